//! The order of the matrix passes: which product feeds which v_ij.
//!
//! v_00 = Cz⁺ b comes first, in limbs; then v_ij = −(Ax v_{i−1,j} + Ay v_{i,j−1}) by rising degree, so that every operand
//! is as old as it can be when it is needed. One accumulator per result: it takes all products of a v_ij
//! before it is rounded once. A matrix without the mirror symmetry takes a product for each of its parity flips in the
//! place of one. Hardware and bit-true model read the same list.

use serde::Serialize;

use super::coefficients::{FLIP_X, FLIP_Y};
use super::formats::Formats;

/// (i, j) of the v_ij up to degree 3, in order of computation.
pub const EXPONENTS: [(u32, u32); 10] =
    [(0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2), (3, 0), (2, 1), (1, 2), (0, 3)];

/// Number of v_ij for a polynomial of `degree`.
pub fn vectors(degree: usize) -> usize {
    (degree + 1) * (degree + 2) / 2
}

/// What a matrix in the coefficient memory is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// High limb of Cz⁺.
    InverseHigh,
    /// Low limb of Cz⁺.
    InverseLow,
    /// −Ax·(4/3)·mu_max.
    Ax,
    /// −Ay·(4/3)·mu_max.
    Ay,
}

/// A matrix in the coefficient memory: the blocks that flip the parity in one way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Matrix {
    /// What it is.
    pub kind: Kind,
    /// Source parity = target parity XOR `flip`.
    pub flip: usize,
}

/// The parity flips of each matrix, the one of its mirror symmetry first: others are there only where the symmetry
/// is broken.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Flips {
    /// Of Cz⁺.
    pub inverse: Vec<usize>,
    /// Of Ax.
    pub ax: Vec<usize>,
    /// Of Ay.
    pub ay: Vec<usize>,
}

impl Flips {
    /// Those of an array of which every taxel is read.
    pub fn symmetric() -> Flips {
        Flips { inverse: vec![0], ax: vec![FLIP_X], ay: vec![FLIP_Y] }
    }

    /// Whether the mirror symmetry holds.
    pub fn are_symmetric(&self) -> bool {
        *self == Flips::symmetric()
    }
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
    let limbs = (formats.input_low_bits > 0, formats.inverse_low_bits > 0);
    products(formats.degree, limbs, formats.shared_a, &formats.flips)
}

/// The same from its ingredients: the degree, whether input and Cz⁺ have a low limb, whether Ax serves for Ay, the
/// matrices' flips.
pub fn products(degree: usize, limbs: (bool, bool), shared_a: bool, flips: &Flips) -> Vec<Vec<Product>> {
    let of = |kind, flips: &[usize], operand, align, transposed| -> Vec<Product> {
        let product = |&flip| Product { matrix: Matrix { kind, flip }, operand, align, transposed };
        flips.iter().map(product).collect()
    };
    let mut first = of(Kind::InverseHigh, &flips.inverse, Operand::InputHigh, true, false);
    if limbs.0 {
        first.extend(of(Kind::InverseHigh, &flips.inverse, Operand::InputLow, false, false));
    }
    if limbs.1 {
        first.extend(of(Kind::InverseLow, &flips.inverse, Operand::InputHigh, false, false));
    }
    let index = |i, j| EXPONENTS.iter().position(|&e| e == (i, j));
    let mut all = vec![first];
    for &(i, j) in EXPONENTS[..vectors(degree)].iter().skip(1) {
        let mut products = Vec::new();
        if let Some(source) = j.checked_sub(1).and_then(|below| index(i, below)) {
            let (kind, flips) = if shared_a { (Kind::Ax, &flips.ax) } else { (Kind::Ay, &flips.ay) };
            products.extend(of(kind, flips, Operand::Vector(source), false, shared_a));
        }
        if let Some(source) = i.checked_sub(1).and_then(|left| index(left, j)) {
            products.extend(of(Kind::Ax, &flips.ax, Operand::Vector(source), false, false));
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
