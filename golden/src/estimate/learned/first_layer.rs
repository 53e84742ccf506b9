//! First layer: that of a network behind its features, as products with the stress and the mask.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: weights of the inputs, of each parity | outputs × 4Q | – |
//! | out: weights of b/s, s the power of two above max \|b\| | outputs × Q | – |
//! | out: weights of the mask | outputs × Q | – |

use super::features::{Features, AMPLITUDE};
use super::network::{Layer, Parities};
use faer::Mat;

/// The first layer of a network as products with the parities of b/s and of the mask: everything before its ReLU is linear in both.
pub(super) struct FirstLayer {
    /// Weights of b/s, outputs × quads, and biases.
    pub stress: Layer,
    /// Weights of the mask, outputs × quads.
    pub mask: Parities,
}

impl FirstLayer {
    /// That of a network with these features.
    pub fn new(features: &Features, layer: &Layer) -> FirstLayer {
        let stress = Layer { weights: features.composed(&layer.weights), ..layer.clone() };
        FirstLayer { stress, mask: features.of_mask(&layer.weights) }
    }
}

impl Features {
    /// The weights of the mask in a layer of the inputs.
    fn of_mask(&self, weights: &Parities) -> Parities {
        let (first, count) = (self.inverse[0].ncols() + self.inverse[0].nrows(), self.inverse[0].ncols());
        weights.each_ref().map(|own| own.subcols(first, count).to_owned())
    }

    /// The weights of a layer of the inputs as weights of the parities of b/s.
    fn composed(&self, weights: &Parities) -> Parities {
        std::array::from_fn(|parity| {
            let (own, inverse) = (&weights[parity], &self.inverse[parity]);
            let (q, deconvolved) = (inverse.ncols(), inverse.nrows());
            let of_both = own.subcols(0, q) + own.subcols(q, deconvolved) * inverse;
            Mat::from_fn(own.nrows(), q, |row, col| AMPLITUDE * of_both[(row, col)])
        })
    }
}
