//! Stage `pass`: matrix-vector products on the MAC lanes.
//!
//! `4·lanes_per_parity` lanes multiply the four parities of one broadcast quad per cycle with the coefficients of one row each;
//! rows beyond the lanes follow in groups. All products of a v_ij stay in the accumulator.
//! ```text
//! v_00:  acc = Σ_j 2^limb_align Ch fh + Ch (fl·2^a) + (Cl·2^c) fh       Cz⁺ = 2^kc Ch + Cl,  f = 2^kf fh + fl
//! v_ij:  acc = Σ_j (−Ay')·v_{i,j−1} + (−Ax')·v_{i−1,j}                  A' = A·(4/3)·mu_max
//! ```
//! The product of the two low limbs is dropped: below 2^−22 of the largest result. The smaller low limb is stored shifted (a, c), so that
//! both mixed products have one weight.

use super::coefficients::Blocks;
use super::formats::{Formats, Quantised};
use super::schedule::{Matrix, Operand, Product};

/// A folded input or v_ij as operands: parities per quad.
pub type Vector = Vec<[i64; 4]>;

/// The vectors that passes read.
#[derive(Clone, Debug, Default)]
pub struct Operands {
    /// High limbs of the folded input.
    pub input_high: Vector,
    /// Low limbs of the folded input, aligned.
    pub input_low: Vector,
    /// Finished v_ij, `data_bits` wide.
    pub vectors: Vec<Vector>,
}

impl Operands {
    /// Splits a folded input into limbs.
    pub fn of_input(folded: &[[i64; 4]], formats: &Formats) -> Self {
        let low = formats.input_low_bits;
        let mask = (1 << low) - 1;
        let align = formats.limb_align - low;
        Operands {
            input_high: folded.iter().map(|quad| quad.map(|f| f >> low)).collect(),
            input_low: folded.iter().map(|quad| quad.map(|f| (f & mask) << align)).collect(),
            vectors: Vec::new(),
        }
    }

    fn get(&self, operand: Operand) -> &Vector {
        match operand {
            Operand::InputHigh => &self.input_high,
            Operand::InputLow => &self.input_low,
            Operand::Vector(index) => &self.vectors[index],
        }
    }
}

/// The coefficient of `matrix` that a lane of parity `target` multiplies for row `i`, column `j`: an 18-bit operand.
pub fn coefficient(formats: &Formats, quantised: &Quantised, matrix: Matrix, target: usize, i: usize, j: usize) -> i64 {
    let at = |blocks: &Blocks| blocks.parity[target][i * formats.quads + j];
    let low = formats.inverse_low_bits;
    match matrix {
        Matrix::InverseHigh => at(&quantised.inverse) >> low,
        Matrix::InverseLow => (at(&quantised.inverse) & ((1 << low) - 1)) << (formats.limb_align - low),
        Matrix::Ax => at(&quantised.ax),
        Matrix::Ay => at(&quantised.ay),
    }
}

/// Source parity = target parity XOR this.
pub fn flip(quantised: &Quantised, matrix: Matrix) -> usize {
    match matrix {
        Matrix::InverseHigh | Matrix::InverseLow => quantised.inverse.flip,
        Matrix::Ax => quantised.ax.flip,
        Matrix::Ay => quantised.ay.flip,
    }
}

/// Accumulates all `products` of one v_ij: accumulators per quad and parity, in row order.
pub fn pass(formats: &Formats, quantised: &Quantised, products: &[Product], operands: &Operands) -> Vector {
    let quads = formats.quads;
    let mut accumulators = vec![[0i64; 4]; quads];
    for product in products {
        let source = operands.get(product.operand);
        let align = if product.align { formats.limb_align } else { 0 };
        let flip = flip(quantised, product.matrix);
        for (i, row) in accumulators.iter_mut().enumerate() {
            for (target, acc) in row.iter_mut().enumerate() {
                for (j, quad) in source.iter().enumerate() {
                    let c = coefficient(formats, quantised, product.matrix, target, i, j);
                    *acc += (c * quad[target ^ flip]) << align;
                }
            }
        }
    }
    accumulators
}

/// The coefficient memory: one word per (matrix, group, column), each holding one coefficient per lane, lane
/// `parity·lanes_per_parity + k` for row `group·lanes_per_parity + k`; rows past the last are zero.
pub fn memory(formats: &Formats, quantised: &Quantised, matrices: &[Matrix]) -> Vec<Vec<i64>> {
    let lanes = formats.lanes_per_parity;
    let word = |matrix, group: usize, j| {
        (0..4)
            .flat_map(|parity| (0..lanes).map(move |k| (parity, group * lanes + k)))
            .map(
                |(parity, i)| {
                    if i < formats.quads {
                        coefficient(formats, quantised, matrix, parity, i, j)
                    } else {
                        0
                    }
                },
            )
            .collect()
    };
    matrices
        .iter()
        .flat_map(|&matrix| (0..formats.groups).map(move |group| (matrix, group)))
        .flat_map(|(matrix, group)| (0..formats.quads).map(move |j| (matrix, group, j)))
        .map(|(matrix, group, j)| word(matrix, group, j))
        .collect()
}
