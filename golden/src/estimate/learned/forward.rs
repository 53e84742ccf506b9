//! Forward: the network behind its features, for one frame.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: parities of b/s, s the power of two above max \|b\| | quads | – |
//! | in: parities of the mask | quads | – |
//! | out: μ and its standard deviations | 2, 2 | of mu_max |

use super::first_layer::FirstLayer;
use super::network::{density, exchange, rectify, Layer, OUTPUT_ROWS};
use crate::physics::panels::Panels;
use crate::physics::symmetry::folded::EVEN;
use faer::Mat;

/// A matrix of each parity.
type Weights = [Panels<f32>; 4];

/// The layers of a network for one frame at a time.
pub(super) struct Forward {
    /// Weights and biases.
    layers: Vec<(Weights, Vec<f32>)>,
    /// Weights of the mask in the first layer.
    mask: Weights,
}

fn panels(weights: &[Mat<f32>; 4]) -> Weights {
    weights.each_ref().map(|own| Panels::new(own.as_ref()))
}

fn product(weights: &Panels<f32>, input: &[f32], outputs: usize) -> Vec<f32> {
    let mut output = vec![0.0; outputs];
    weights.accumulate(input, 1.0, &mut output);
    output
}

impl Forward {
    /// That of a network with this first layer behind its features, and these after it.
    pub fn new(first: &FirstLayer, others: &[Layer]) -> Forward {
        let layers = std::iter::once(&first.stress).chain(others);
        let layers = layers.map(|layer| (panels(&layer.weights), layer.bias.clone())).collect();
        Forward { layers, mask: panels(&first.mask) }
    }

    /// μ and σ in units of mu_max, [x, y]; without `mask` no taxel is masked.
    pub fn shear(&self, stress: [&[f32]; 4], mask: Option<[&[f32]; 4]>) -> ([f64; 2], [f64; 2]) {
        let mut values = stress.map(<[f32]>::to_vec);
        for (index, (weights, bias)) in self.layers.iter().enumerate() {
            if index > 0 {
                let [a, b, c, d] = &mut values;
                exchange(a, b, c, d);
            }
            values = std::array::from_fn(|parity| product(&weights[parity], &values[parity], bias.len()));
            values[EVEN].iter_mut().zip(bias).for_each(|(value, bias)| *value += bias);
            if let (0, Some(mask)) = (index, mask) {
                for (values, (own, mask)) in values.iter_mut().zip(self.mask.iter().zip(mask)) {
                    let of_mask = product(own, mask, bias.len());
                    values.iter_mut().zip(of_mask).for_each(|(value, own)| *value += own);
                }
            }
            if index + 1 < self.layers.len() {
                let [a, b, c, d] = &mut values;
                rectify(a, b, c, d);
            }
        }
        density(OUTPUT_ROWS.map(|(parity, channel)| values[parity][channel]))
    }
}

#[cfg(test)]
mod tests {
    use super::super::network::{Network, Parities};
    use super::*;
    use crate::random::Random;

    /// Of one frame the same as of many but for rounding, with and without a mask.
    #[test]
    fn a_frame_alone_is_the_same() {
        const QUADS: usize = 25;
        let mut random = Random::new(6);
        let network = Network::random(&[QUADS, 40, 33, 2], &mut random);
        let of_mask = Network::random(&[QUADS, 40], &mut random).layers.remove(0).weights;
        let first = FirstLayer { stress: network.layers[0].clone(), mask: of_mask };
        let forward = Forward::new(&first, &network.layers[1..]);
        let mut drawn =
            || -> Parities { std::array::from_fn(|_| Mat::from_fn(QUADS, 1, |_, _| random.normal() as f32)) };
        for _ in 0..5 {
            let (stress, mask) = (drawn(), drawn());
            let slices = |of: &Parities| -> [Vec<f32>; 4] { of.each_ref().map(|own| own.col_as_slice(0).to_vec()) };
            let (own, own_mask) = (slices(&stress), slices(&mask));
            let [own, own_mask] = [&own, &own_mask].map(|own| own.each_ref().map(Vec::as_slice));
            let mut outputs = first.stress.apply(&stress);
            let same = |(mu, sigma): ([f64; 2], [f64; 2]), wanted: ([f64; 2], [f64; 2])| {
                let apart = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).abs().max((a[1] - b[1]).abs());
                apart(mu, wanted.0) < 1e-5 && apart(sigma, wanted.1) < 1e-5
            };
            let plain = forward.shear(own, None);
            assert!(same(plain, network.shear_behind(outputs.clone())[0]), "{plain:?}");
            for (outputs, (weights, mask)) in outputs.iter_mut().zip(first.mask.iter().zip(&mask)) {
                *outputs += weights * mask;
            }
            let masked = forward.shear(own, Some(own_mask));
            assert!(same(masked, network.shear_behind(outputs)[0]) && !same(masked, plain), "{masked:?}");
        }
    }
}
