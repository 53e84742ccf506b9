//! The order of the matrix passes: which product feeds which v_ij.
//!
//! v_00 = Cz⁺ b comes first, in limbs; then v_ij = −(Ax v_{i−1,j} + Ay v_{i,j−1}) by rising degree, so that every operand
//! is as old as it can be when it is needed. One accumulator per result: it takes all products of a v_ij
//! before it is rounded once. Hardware and bit-true model read the same list.

use super::formats::Formats;

/// (i, j) of the v_ij up to degree 3, in order of computation.
pub const EXPONENTS: [(u32, u32); 10] =
    [(0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2), (3, 0), (2, 1), (1, 2), (0, 3)];

/// Number of v_ij for a polynomial of `degree`.
pub fn vectors(degree: usize) -> usize {
    (degree + 1) * (degree + 2) / 2
}

/// A matrix in the coefficient memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Matrix {
    /// High limb of Cz⁺.
    InverseHigh,
    /// Low limb of Cz⁺.
    InverseLow,
    /// −Ax·(4/3)·mu_max.
    Ax,
    /// −Ay·(4/3)·mu_max.
    Ay,
}

/// A vector that a pass multiplies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Operand {
    /// High limb of the folded input.
    InputHigh,
    /// Low limb of the folded input.
    InputLow,
    /// v_ij, by its index in [`EXPONENTS`].
    Vector(usize),
}

/// One matrix-vector product.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Product {
    /// What to multiply with.
    pub matrix: Matrix,
    /// What to multiply.
    pub operand: Operand,
    /// Whether the product of two high limbs is aligned by `formats.limb_align` bits to the left.
    pub align: bool,
}

/// The products of every v_ij, in order of [`EXPONENTS`].
pub fn schedule(formats: &Formats) -> Vec<Vec<Product>> {
    let product = |matrix, operand, align| Product { matrix, operand, align };
    let mut first = vec![product(Matrix::InverseHigh, Operand::InputHigh, true)];
    if formats.input_low_bits > 0 {
        first.push(product(Matrix::InverseHigh, Operand::InputLow, false));
    }
    if formats.inverse_low_bits > 0 {
        first.push(product(Matrix::InverseLow, Operand::InputHigh, false));
    }
    let index = |i, j| EXPONENTS.iter().position(|&e| e == (i, j));
    let mut all = vec![first];
    for &(i, j) in EXPONENTS[..vectors(formats.degree)].iter().skip(1) {
        let mut products = Vec::new();
        if let Some(source) = j.checked_sub(1).and_then(|below| index(i, below)) {
            products.push(product(Matrix::Ay, Operand::Vector(source), false));
        }
        if let Some(source) = i.checked_sub(1).and_then(|left| index(left, j)) {
            products.push(product(Matrix::Ax, Operand::Vector(source), false));
        }
        // The older operand first: its pass hides the latency of the younger one.
        products.sort_by_key(Product::operand_index);
        all.push(products);
    }
    all
}

impl Product {
    /// Index of the operand's v_ij; 0 for the limbs of the input.
    pub fn operand_index(&self) -> usize {
        match self.operand {
            Operand::Vector(index) => index,
            Operand::InputHigh | Operand::InputLow => 0,
        }
    }
}
