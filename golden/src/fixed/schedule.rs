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
    /// The operand is transposed, and so is the result: x and y exchanged.
    pub transposed: bool,
}

/// The products of every v_ij, in order of [`EXPONENTS`].
pub fn schedule(formats: &Formats) -> Vec<Vec<Product>> {
    products(formats.degree, (formats.input_low_bits > 0, formats.inverse_low_bits > 0), formats.shared_a)
}

/// The same from its ingredients: the degree, whether input and Cz⁺ have a low limb, whether Ax serves for Ay.
pub fn products(degree: usize, limbs: (bool, bool), shared_a: bool) -> Vec<Vec<Product>> {
    let product = |matrix, operand| Product { matrix, operand, align: false, transposed: false };
    let mut first = vec![Product { align: true, ..product(Matrix::InverseHigh, Operand::InputHigh) }];
    if limbs.0 {
        first.push(product(Matrix::InverseHigh, Operand::InputLow));
    }
    if limbs.1 {
        first.push(product(Matrix::InverseLow, Operand::InputHigh));
    }
    let index = |i, j| EXPONENTS.iter().position(|&e| e == (i, j));
    let mut all = vec![first];
    for &(i, j) in EXPONENTS[..vectors(degree)].iter().skip(1) {
        let mut products = Vec::new();
        if let Some(source) = j.checked_sub(1).and_then(|below| index(i, below)) {
            let matrix = if shared_a { Matrix::Ax } else { Matrix::Ay };
            products.push(Product { transposed: shared_a, ..product(matrix, Operand::Vector(source)) });
        }
        if let Some(source) = i.checked_sub(1).and_then(|left| index(left, j)) {
            products.push(product(Matrix::Ax, Operand::Vector(source)));
        }
        // The older operand first: its pass hides the latency of the younger one.
        products.sort_by_key(Product::operand_index);
        all.push(products);
    }
    all
}

/// Whether the v_ij of these products comes out with x and y exchanged.
pub fn is_transposed(products: &[Product]) -> bool {
    products.iter().any(|product| product.transposed)
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
