//! The matrices of the passes in LSBs, and the operands that a lane multiplies.

use super::coefficients::{Blocks, Flipped};
use super::formats::Formats;
use super::schedule::{Kind, Matrix};

/// Quantised matrices of one subarray shape.
#[derive(Clone, Debug, PartialEq)]
pub struct Quantised {
    /// Cz⁺.
    pub inverse: Blocks,
    /// −Ax·(4/3)·mu_max.
    pub ax: Blocks,
    /// −Ay·(4/3)·mu_max.
    pub ay: Blocks,
}

impl Quantised {
    /// The matrix of which a matrix of `kind` holds the coefficients; both limbs of Cz⁺ hold those of one.
    pub fn of_kind(&self, kind: Kind) -> &Blocks {
        match kind {
            Kind::InverseHigh | Kind::InverseLow => &self.inverse,
            Kind::Ax => &self.ax,
            Kind::Ay => &self.ay,
        }
    }

    /// The blocks of a stored matrix.
    ///
    /// # Panics
    /// If the matrix has no such flip; a schedule lists only flips that exist.
    pub fn blocks(&self, matrix: Matrix) -> &Flipped<i64> {
        let own = self.of_kind(matrix.kind).flips.iter().find(|own| own.flip == matrix.flip);
        own.expect("a flip of the schedule")
    }

    /// The blocks of a stored matrix, to change them; `None` if the matrix has no such flip.
    pub fn blocks_mut(&mut self, matrix: Matrix) -> Option<&mut Flipped<i64>> {
        let blocks = match matrix.kind {
            Kind::InverseHigh | Kind::InverseLow => &mut self.inverse,
            Kind::Ax => &mut self.ax,
            Kind::Ay => &mut self.ay,
        };
        blocks.flips.iter_mut().find(|own| own.flip == matrix.flip)
    }
}

/// The 18-bit operand that a lane multiplies for coefficient `c` of a matrix of `kind`.
pub fn coefficient(formats: &Formats, kind: Kind, c: i64) -> i64 {
    let low = formats.inverse_low_bits;
    match kind {
        Kind::InverseHigh => c >> low,
        Kind::InverseLow => (c & ((1 << low) - 1)) << (formats.limb_align - low),
        Kind::Ax | Kind::Ay => c,
    }
}
