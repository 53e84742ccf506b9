//! Composed: the layers of a network as plain matrices of the stress.
//!
//! Everything before the first ReLU is linear in b/s and the mask, and the mask is known when the hardware is built: the first
//! layer takes the stress alone, the mask is part of its bias.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: network, taxels that are not dead | – | – |
//! | out: weights of each layer and parity | outputs × inputs | – |
//! | out: biases of each layer and parity | outputs | – |

use super::features::{Features, Readings, AMPLITUDE};
use super::network::{Layer, Parities};
use super::Learned;
use crate::symmetry::folded::EVEN;
use faer::Mat;

/// A layer that takes the parities of b/s, s the power of two above max |b|, or those of the layer before.
#[derive(Clone, Debug)]
pub struct ComposedLayer {
    /// Weights of each parity, outputs × inputs.
    pub weights: [Mat<f64>; 4],
    /// Biases of each parity, one per output.
    pub bias: [Vec<f64>; 4],
    /// Largest output of any image on drawn frames.
    pub largest: f64,
}

impl Learned {
    /// The layers for an array with these taxels alive, row-major.
    pub fn composed(&self, alive: &[bool]) -> Vec<ComposedLayer> {
        let mut layers: Vec<ComposedLayer> = self.network.layers.iter().map(plain).collect();
        let masked = Mat::from_fn(alive.len(), 1, |taxel, _| if alive[taxel] { 0.0 } else { 1.0 });
        let empty = self.features.of(&Readings { b: Mat::zeros(alive.len(), 1), masked });
        if let (Some(own), Some(first)) = (layers.first_mut(), self.network.layers.first()) {
            own.weights = self.features.composed(&first.weights);
            for (parity, bias) in own.bias.iter_mut().enumerate() {
                let of_mask = &first.weights[parity] * &empty[parity];
                bias.iter_mut().zip(of_mask.col(0).iter()).for_each(|(bias, mask)| *bias += f64::from(*mask));
            }
        }
        layers
    }
}

/// A layer without a change.
fn plain(layer: &Layer) -> ComposedLayer {
    let wide = |own: &Mat<f32>| Mat::from_fn(own.nrows(), own.ncols(), |row, col| f64::from(own[(row, col)]));
    let bias = |parity: usize| {
        let counts = if parity == EVEN { 1.0 } else { 0.0 };
        layer.bias.iter().map(|bias| counts * f64::from(*bias)).collect()
    };
    ComposedLayer {
        weights: layer.weights.each_ref().map(wide),
        bias: std::array::from_fn(bias),
        largest: f64::from(layer.largest),
    }
}

impl Features {
    /// The weights of a layer of the inputs as weights of the parities of b/s.
    fn composed(&self, weights: &Parities) -> [Mat<f64>; 4] {
        std::array::from_fn(|parity| {
            let (own, inverse) = (&weights[parity], &self.inverse[parity]);
            let (q, deconvolved) = (inverse.ncols(), inverse.nrows());
            let of_both = own.subcols(0, q) + own.subcols(q, deconvolved) * inverse;
            Mat::from_fn(own.nrows(), q, |row, col| f64::from(AMPLITUDE * of_both[(row, col)]))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::network::exchanged;
    use super::super::OneContact;
    use super::*;
    use crate::scene::Scene;

    /// The composed layers give the μ of the network, also with dead taxels.
    #[test]
    fn composed_layers_are_the_network() {
        let scene = Scene::builtin("sensor-1").unwrap();
        let learned = Learned::of_scene(&scene).unwrap();
        let frame = crate::frame::Frame::shipped(&scene).remove(1);
        for dead in [vec![], vec![37, 5]] {
            let alive: Vec<bool> = (0..100).map(|taxel| !dead.contains(&taxel)).collect();
            let contact = OneContact { b: &frame.stress_MPa, alive: &alive, centre_mm: [0.0; 2] };
            let told = learned.shear(&contact);
            let peak = (0..100).filter(|t| alive[*t]).map(|t| frame.stress_MPa[t].abs()).fold(0.0, f64::max);
            let s = 2f64.powf(peak.log2().floor() + 1.0);
            let quads = learned.signature.window.quads();
            let image = |lane| {
                Mat::from_fn(quads.len(), 1, |quad, _| {
                    let taxel = quads.taxel(quad, lane);
                    if alive[taxel] {
                        (frame.stress_MPa[taxel] / s) as f32
                    } else {
                        0.0
                    }
                })
            };
            let mut inputs = exchanged(&std::array::from_fn(image));
            let layers = learned.composed(&alive);
            for (index, layer) in layers.iter().enumerate() {
                let outputs: Parities = std::array::from_fn(|parity| {
                    Mat::from_fn(layer.bias[0].len(), 1, |row, _| {
                        let own = &layer.weights[parity];
                        let sum: f64 =
                            (0..own.ncols()).map(|col| own[(row, col)] * f64::from(inputs[parity][(col, 0)])).sum();
                        (sum + layer.bias[parity][row]) as f32
                    })
                });
                inputs = outputs;
                if index + 1 < layers.len() {
                    let images =
                        exchanged(&inputs).map(|own| Mat::from_fn(own.nrows(), 1, |k, _| own[(k, 0)].max(0.0)));
                    inputs = exchanged(&images);
                }
            }
            let found = super::super::network::Network::outputs(&inputs);
            for axis in [0, 1] {
                let mu = f64::from(found[(axis, 0)]) * scene.search.mu_max;
                assert!((mu - told.mean[axis]).abs() < 1e-4, "{mu} {told:?}");
            }
        }
    }
}
