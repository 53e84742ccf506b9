//! Stage `pass`: matrix-vector products on the MAC lanes.
//!
//! `4·lanes_per_parity` lanes multiply the four parities of one broadcast quad per cycle by coefficients, each lane for
//! one row; rows beyond the lanes follow in groups. All products of a v_ij are added up before they are rounded.
//! ```text
//! v_00:  low = Σ_j Ch (fl·2^a) + (Cl·2^c) fh,  high = Σ_j Ch fh         Cz⁺ = 2^kc Ch + Cl,  f = 2^kf fh + fl
//!        acc = low + 2^limb_align high
//! v_ij:  acc = Σ_j (−Ay')·v_{i,j−1} + (−Ax')·v_{i−1,j}                  A' = A·(4/3)·mu_max
//! ```
//! The product of the two low limbs, below 2^−22 of the largest result, is left out. The smaller low limb is stored
//! shifted left (a, c), so that both mixed products have the same weight. Where neither factor has a low limb, v_00 is
//! the sum of the high limbs.
//!
//! The layers of a network are matrices as well, of other sizes; `relax` multiplies its operands by μ first.

use std::borrow::Cow;

use crate::fixed::words::arith::round_shift;
use crate::fixed::words::formats::Formats;
use crate::fixed::words::network::ONE;
use crate::fixed::words::quantised::{coefficient, Quantised};
use crate::fixed::words::schedule::{Axis, Matrix, Operand, Product};
use crate::spec::quads::Quads;

/// A folded input or v_ij, four parities per quad.
pub type Vector = Vec<[i64; 4]>;

/// The operands of the passes.
#[derive(Clone, Debug, Default)]
pub struct Operands {
    /// High limbs of the folded input.
    pub input_high: Vector,
    /// Low limbs of the folded input, shifted left by `limb_align − input_low_bits`.
    pub input_low: Vector,
    /// Finished v_ij, `data_bits` wide.
    pub vectors: Vec<Vector>,
    /// Images of the network's finished layers, as operands.
    pub layers: Vec<Vector>,
    /// High limbs of the folded window of a contact, and its folded mask.
    pub window: [Vector; 2],
    /// p times the μ of each taxel's contact, for Ax and Ay, after each step of `relax`.
    pub sheared: Vec<[Vector; 2]>,
    /// Position of μ, [x, y], by which the operands of `relax` are multiplied.
    pub position: [i64; 2],
}

impl Operands {
    /// Splits a folded input into limbs.
    pub fn of_input(folded: &[[i64; 4]], formats: &Formats) -> Self {
        let low = formats.input_low_bits;
        let mask = (1 << low) - 1;
        let align = formats.limb_align - low;
        Operands {
            input_high: high_limbs(folded, formats),
            input_low: folded.iter().map(|quad| quad.map(|f| (f & mask) << align)).collect(),
            ..Operands::default()
        }
    }

    /// The quads that a product multiplies.
    fn get(&self, layout: Quads, product: &Product) -> Cow<'_, [[i64; 4]]> {
        let quads = match product.operand {
            Operand::InputHigh => &self.input_high,
            Operand::InputLow => &self.input_low,
            Operand::Vector(index) => &self.vectors[index],
            Operand::Layer(index) => &self.layers[index],
            Operand::Window => &self.window[0],
            Operand::Mask => &self.window[1],
            Operand::Shear(step, axis) => &self.sheared[step][axis as usize],
            Operand::One => return Cow::Owned(vec![[ONE; 4]]),
        };
        let of_axis = |axis: usize| quads.iter().map(|&quad| scaled(quad, self.position[axis])).collect();
        match product.factor {
            Some(Axis::X) => Cow::Owned(of_axis(0)),
            Some(Axis::Y) => Cow::Owned(of_axis(1)),
            None if product.transposed => Cow::Owned(transpose(layout, quads)),
            None => Cow::Borrowed(quads),
        }
    }
}

/// The high limbs of a folded input.
pub fn high_limbs(folded: &[[i64; 4]], formats: &Formats) -> Vector {
    folded.iter().map(|quad| quad.map(|f| f >> formats.input_low_bits)).collect()
}

/// Right shift of an operand times a position.
pub const POSITION_SHIFT: u32 = 9;

/// A word times μ.
pub fn times(word: i64, position: i64) -> i64 {
    round_shift(word * position, POSITION_SHIFT)
}

/// An operand times μ.
pub fn scaled(quad: [i64; 4], position: i64) -> [i64; 4] {
    quad.map(|word| times(word, position))
}

/// Adds up the `products` of one accumulation without a shift: one accumulator per row and parity, in order.
///
/// A transposed product reads its operand with x and y exchanged, and so is its result.
pub fn pass(
    formats: &Formats,
    quantised: &Quantised,
    layout: Quads,
    products: &[Product],
    operands: &Operands,
) -> Vector {
    let rows = products.first().map_or(0, |product| quantised.size(product.matrix, formats.quads)[0]);
    let mut accumulators = vec![[0i64; 4]; rows];
    for product in products {
        let Matrix { kind, flip } = product.matrix;
        let [_, columns] = quantised.size(product.matrix, formats.quads);
        let own = quantised.blocks(product.matrix);
        let source = operands.get(layout, product);
        for (i, row) in accumulators.iter_mut().enumerate() {
            for (target, acc) in row.iter_mut().enumerate() {
                for (j, quad) in source.iter().enumerate() {
                    *acc += coefficient(formats, kind, own.parity[target][i * columns + j]) * quad[target ^ flip];
                }
            }
        }
    }
    accumulators
}

/// The accumulators of a v_ij from those of its limbs, of which the last are the high ones.
pub fn join_limbs(formats: &Formats, limbs: &[Vector]) -> Vector {
    match limbs {
        [low, high] => {
            let join = |(low, high): (&[i64; 4], &[i64; 4])| {
                [0, 1, 2, 3].map(|parity| low[parity] + (high[parity] << formats.limb_align))
            };
            low.iter().zip(high).map(join).collect()
        }
        _ => limbs.concat(),
    }
}

/// A quad vector with x and y exchanged, of a square subarray: quad (r, c) from quad (c, r), lanes 1 and 2 swapped.
pub fn transpose(layout: Quads, quads: &[[i64; 4]]) -> Vector {
    (0..quads.len()).map(|address| swap(quads[layout.transposed(address)])).collect()
}

/// A quad with its two mirrors exchanged.
pub fn swap([a, b, c, d]: [i64; 4]) -> [i64; 4] {
    [a, c, b, d]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_operand_is_scaled_by_the_position() {
        // 384/512 of the word, half up.
        assert_eq!(scaled([512, -512, 3, -2], 384), [384, -384, 2, -1]);
        assert_eq!(scaled([131_071, 1, 0, 0], -384), [-98_303, -1, 0, 0]);
    }
}
