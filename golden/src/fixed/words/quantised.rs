//! The matrices of the passes in LSBs, and the operands that a lane multiplies.

use super::coefficients::{Blocks, Flipped};
use super::formats::Formats;
use super::network::WordNetwork;
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
    /// The network that gives μ, if there is one.
    pub network: Option<WordNetwork>,
}

impl Quantised {
    /// The blocks of what `kind` names, flip by flip; both limbs of Cz⁺ have those of one.
    pub fn flips(&self, kind: Kind) -> &[Flipped<i64>] {
        let layer = |layer: usize| self.network.as_ref().and_then(|network| network.layers.get(layer));
        match kind {
            Kind::InverseHigh | Kind::InverseLow => &self.inverse.flips,
            Kind::Ax => &self.ax.flips,
            Kind::Ay => &self.ay.flips,
            Kind::Layer(index) => layer(index).map_or(&[], |layer| std::slice::from_ref(&layer.weights)),
            Kind::Mask => layer(0).and_then(|layer| layer.mask.as_ref()).map_or(&[], std::slice::from_ref),
            Kind::Bias(index) => layer(index).map_or(&[], |layer| std::slice::from_ref(&layer.bias)),
        }
    }

    /// The blocks of a stored matrix.
    ///
    /// # Panics
    /// If there is no such matrix; a schedule lists only those that exist.
    pub fn blocks(&self, matrix: Matrix) -> &Flipped<i64> {
        let own = self.flips(matrix.kind).iter().find(|own| own.flip == matrix.flip);
        own.expect("a matrix of the schedule")
    }

    /// The blocks of a stored matrix of the passes, to change them; `None` if there is no such flip, and for a network.
    pub fn blocks_mut(&mut self, matrix: Matrix) -> Option<&mut Flipped<i64>> {
        let blocks = match matrix.kind {
            Kind::InverseHigh | Kind::InverseLow => &mut self.inverse,
            Kind::Ax => &mut self.ax,
            Kind::Ay => &mut self.ay,
            Kind::Layer(_) | Kind::Mask | Kind::Bias(_) => return None,
        };
        blocks.flips.iter_mut().find(|own| own.flip == matrix.flip)
    }

    /// Rows and columns of the blocks of a stored matrix, for a subarray of `quads` quads.
    pub fn size(&self, matrix: Matrix, quads: usize) -> [usize; 2] {
        let own = |layer: usize| self.network.as_ref().map(|network| &network.layers[layer]);
        let size = match matrix.kind {
            Kind::InverseHigh | Kind::InverseLow | Kind::Ax | Kind::Ay => Some([quads; 2]),
            Kind::Layer(layer) => own(layer).map(|layer| [layer.outputs, layer.inputs]),
            Kind::Mask => own(0).map(|layer| [layer.outputs, layer.inputs]),
            Kind::Bias(layer) => own(layer).map(|layer| [layer.outputs, 1]),
        };
        size.unwrap_or_default()
    }
}

/// The 18-bit operand that a lane multiplies for coefficient `c` of a matrix of `kind`.
pub fn coefficient(formats: &Formats, kind: Kind, c: i64) -> i64 {
    let low = formats.inverse_low_bits;
    match kind {
        Kind::InverseHigh => c >> low,
        Kind::InverseLow => (c & ((1 << low) - 1)) << (formats.limb_align - low),
        Kind::Ax | Kind::Ay | Kind::Layer(_) | Kind::Mask | Kind::Bias(_) => c,
    }
}

/// Coefficient `c` of a matrix of `kind` with the limb that `operand`, an 18-bit word of a lane, holds of it.
pub fn with_operand(formats: &Formats, kind: Kind, c: i64, operand: i64) -> i64 {
    let low = formats.inverse_low_bits;
    let mask = (1 << low) - 1;
    match kind {
        Kind::InverseHigh => operand << low | c & mask,
        Kind::InverseLow => c & !mask | operand >> (formats.limb_align - low) & mask,
        Kind::Ax | Kind::Ay | Kind::Layer(_) | Kind::Mask | Kind::Bias(_) => operand,
    }
}
