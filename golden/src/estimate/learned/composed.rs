//! Composed: the layers of a network as plain matrices of the stress.
//!
//! Everything before the first ReLU is linear in b/s and the mask. The mask of the whole array is known when the hardware is
//! built: the first layer takes the stress alone, the mask is part of its bias. A window around a contact is masked where it
//! reaches beyond the array: its first layer takes the mask as well.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: network, taxels that are not dead | – | – |
//! | out: weights of each layer and parity | outputs × inputs | – |
//! | out: weights of the mask in the first layer, of a window around a contact | outputs × quads | – |
//! | out: biases of each layer and parity | outputs | – |

use super::first_layer::FirstLayer;
use super::network::Layer;
use super::Learned;
use crate::physics::symmetry::folded::EVEN;
use crate::spec::quads::Quads;
use crate::spec::window::Place;
use faer::Mat;

/// A layer that takes the parities of b/s, s the power of two above max |b|, or those of the layer before.
#[derive(Clone, Debug)]
pub struct ComposedLayer {
    /// Weights of each parity, outputs × inputs.
    pub weights: [Mat<f64>; 4],
    /// Weights of the parities of the mask, outputs × quads; in the first layer for a window around a contact.
    pub mask: Option<[Mat<f64>; 4]>,
    /// Biases of each parity, one per output.
    pub bias: [Vec<f64>; 4],
    /// Largest output of any image on drawn frames.
    pub largest: f64,
}

impl Learned {
    /// The layers for an array with these taxels alive, row-major; those of a window around a contact are the same for all.
    pub fn composed(&self, alive: &[bool]) -> Vec<ComposedLayer> {
        let FirstLayer { stress, mask } = &self.first;
        let mut first = plain(stress);
        if self.signature.window.place == Place::Contact {
            first.mask = Some(mask.each_ref().map(|own| wide(own.as_ref())));
        } else {
            let window = self.signature.window;
            let taxels = window.taxels_of(&self.sensor, window.origin(&self.sensor, [0.0; 2]));
            let masked = |taxel: usize| taxels[taxel].is_none_or(|taxel| !alive[taxel]);
            let masked = Mat::from_fn(taxels.len(), 1, |taxel, _| f32::from(u8::from(masked(taxel))));
            let masked = self.features.in_parities(&masked, &|_| 1.0);
            for (bias, (own, masked)) in first.bias.iter_mut().zip(mask.iter().zip(&masked)) {
                bias.iter_mut().zip((own * masked).col(0).iter()).for_each(|(bias, mask)| *bias += f64::from(*mask));
            }
            let quads = self.quads_of_array();
            first.weights =
                first.weights.map(|own| Mat::from_fn(own.nrows(), quads.len(), |row, quad| own[(row, quads[quad])]));
        }
        std::iter::once(first).chain(self.network.layers[1..].iter().map(plain)).collect()
    }
}

impl Learned {
    /// The quad of the window for each quad of the array: a window that is larger has the array in its middle.
    fn quads_of_array(&self) -> Vec<usize> {
        let window = self.signature.window;
        let [row0, col0] = window.origin(&self.sensor, [0.0; 2]).map(isize::unsigned_abs);
        let own = Quads { rows: self.sensor.rows, cols: self.sensor.cols };
        let of = |quad: usize| {
            let taxel = own.taxel(quad, 0);
            window.quads().locate(row0 + taxel / own.cols, col0 + taxel % own.cols).address
        };
        (0..own.len()).map(of).collect()
    }
}

fn wide(own: faer::MatRef<f32>) -> Mat<f64> {
    Mat::from_fn(own.nrows(), own.ncols(), |row, col| f64::from(own[(row, col)]))
}

/// A layer without a change.
fn plain(layer: &Layer) -> ComposedLayer {
    let bias = |parity: usize| {
        let counts = if parity == EVEN { 1.0 } else { 0.0 };
        layer.bias.iter().map(|bias| counts * f64::from(*bias)).collect()
    };
    ComposedLayer {
        weights: layer.weights.each_ref().map(|own| wide(own.as_ref())),
        mask: None,
        bias: std::array::from_fn(bias),
        largest: f64::from(layer.largest),
    }
}

#[cfg(test)]
mod tests {
    use super::super::features::power_above;
    use super::super::network::{exchanged, Parities};
    use super::super::{Gaussian, Network, OneContact, Training};
    use super::*;
    use crate::spec::scene::Scene;
    use std::ops::ControlFlow::Continue;

    /// The outputs of the layers for the parities of b/s, and of the mask where the first layer takes it.
    fn outputs(layers: &[ComposedLayer], mut inputs: Parities, mask: Option<&Parities>) -> Mat<f32> {
        let product = |own: &Mat<f64>, inputs: &Mat<f32>, row: usize| -> f64 {
            (0..own.ncols()).map(|col| own[(row, col)] * f64::from(inputs[(col, 0)])).sum()
        };
        for (index, layer) in layers.iter().enumerate() {
            inputs = std::array::from_fn(|parity| {
                Mat::from_fn(layer.bias[0].len(), 1, |row, _| {
                    let of_mask =
                        layer.mask.as_ref().zip(mask).map(|(own, mask)| product(&own[parity], &mask[parity], row));
                    let sum = product(&layer.weights[parity], &inputs[parity], row) + of_mask.unwrap_or(0.0);
                    (sum + layer.bias[parity][row]) as f32
                })
            });
            if index + 1 < layers.len() {
                let images = exchanged(inputs).map(|own| Mat::from_fn(own.nrows(), 1, |k, _| own[(k, 0)].max(0.0)));
                inputs = exchanged(images);
            }
        }
        Network::outputs(&inputs)
    }

    /// μ by the features and the network behind them, without a composed layer; [`Learned::shear`] gives the same.
    fn by_features(learned: &Learned, contact: &OneContact) -> Gaussian {
        let features = learned.features.of(&learned.readings(contact));
        let (output, own) = (learned.in_scene(learned.network.shear(features)[0]), learned.shear(contact));
        for axis in [0, 1] {
            assert!((own.mean[axis] - output.mean[axis]).abs() < 1e-4, "{own:?} {output:?}");
            assert!((own.sigma[axis] - output.sigma[axis]).abs() < 1e-4, "{own:?} {output:?}");
        }
        output
    }

    /// Around a contact the first layer takes the mask; the window has middle lines.
    #[test]
    fn composed_layers_take_the_mask_of_a_window() {
        let mut scene = Scene::builtin("sensor-3").unwrap();
        scene.search.estimator = Some(crate::spec::scene::EstimatorKind::EvidenceNetwork);
        let training = Training { steps: 30, batch: 16, contacts: 60, hidden: vec![16, 8], ..Training::default() };
        let learned = Learned::train(&scene, &training, &mut |_| Continue(())).unwrap().learned;
        let mut random = crate::random::Random::new(6);
        let b: Vec<f64> = (0..400).map(|_| random.normal()).collect();
        let alive: Vec<bool> = (0..400).map(|taxel| taxel % 7 != 3).collect();
        let window = learned.signature.window;
        for [row, col] in [[9, 9], [1, 17]] {
            let centre_mm = scene.sensor.position_mm(row, col);
            let output = by_features(&learned, &OneContact { b: &b, alive: &alive, centre_mm });
            let taxels = window.taxels_of(&scene.sensor, window.origin(&scene.sensor, centre_mm));
            let taxels: Vec<Option<usize>> = taxels.into_iter().map(|t| t.filter(|t| alive[*t])).collect();
            let peak = taxels.iter().flatten().map(|t| b[*t].abs()).fold(0.0, f64::max);
            let s = f64::from(power_above(peak as f32));
            let quads = window.quads();
            let parities = |of: &dyn Fn(Option<usize>) -> f64| {
                let image = |lane| Mat::from_fn(quads.len(), 1, |quad, _| of(taxels[quads.taxel(quad, lane)]) as f32);
                exchanged(std::array::from_fn(image))
            };
            let (stress, mask) =
                (parities(&|t| t.map_or(0.0, |t| b[t] / s)), parities(&|t| if t.is_none() { 1.0 } else { 0.0 }));
            let found = outputs(&learned.composed(&alive), stress, Some(&mask));
            for axis in [0, 1] {
                let [mu, ln] = [0, 2].map(|first| f64::from(found[(first + axis, 0)]));
                assert!((mu * scene.search.mu_max - output.mean[axis]).abs() < 1e-4, "{mu} {output:?}");
                assert!((ln.exp() * scene.search.mu_max - output.sigma[axis]).abs() < 1e-4, "{ln} {output:?}");
            }
        }
    }

    /// The layers for the array of `scene`, which the network reads as a whole, give its μ and σ for stress `b`, also with dead taxels.
    fn composed_layers_are(learned: &Learned, scene: &Scene, b: &[f64]) {
        for dead in [vec![], vec![37, 5]] {
            let alive: Vec<bool> = (0..b.len()).map(|taxel| !dead.contains(&taxel)).collect();
            let output = by_features(learned, &OneContact { b, alive: &alive, centre_mm: [0.0; 2] });
            let peak = (0..b.len()).filter(|t| alive[*t]).map(|t| b[t].abs()).fold(0.0, f64::max);
            let s = f64::from(power_above(peak as f32));
            let quads = Quads { rows: scene.sensor.rows, cols: scene.sensor.cols };
            let read = |taxel: usize| if alive[taxel] { (b[taxel] / s) as f32 } else { 0.0 };
            let image = |lane| Mat::from_fn(quads.len(), 1, |quad, _| read(quads.taxel(quad, lane)));
            let found = outputs(&learned.composed(&alive), exchanged(std::array::from_fn(image)), None);
            for axis in [0, 1] {
                let [mu, ln] = [0, 2].map(|first| f64::from(found[(first + axis, 0)]));
                assert!((mu * scene.search.mu_max - output.mean[axis]).abs() < 1e-4, "{mu} {output:?}");
                assert!((ln.exp() * scene.search.mu_max - output.sigma[axis]).abs() < 1e-4, "{ln} {output:?}");
            }
        }
    }

    #[test]
    fn composed_layers_are_the_network() {
        let scene = Scene::builtin("sensor-1").unwrap();
        let learned = Learned::of_scene(&scene, crate::spec::scene::EstimatorKind::Network).unwrap();
        let frame = crate::data::frame::Frame::shipped(&scene).remove(1);
        composed_layers_are(&learned, &scene, &frame.stress_MPa);
    }

    /// Of an array that is smaller than the window they take its own quads.
    #[test]
    fn composed_layers_leave_out_what_lies_beyond_a_smaller_array() {
        let mut scene = Scene::builtin("sensor-1-bonded").unwrap();
        let range =
            Training { pitch_over_thickness: Some([0.5, 2.0]), least_side: Some(6), ..Training::trial(&[6, 4]) };
        let bytes = Learned::train(&scene, &range, &mut |_| Continue(())).unwrap().bytes;
        (scene.sensor.rows, scene.sensor.cols, scene.search.network) = (6, 8, None);
        let learned = Learned::from_bytes(&scene, crate::spec::scene::EstimatorKind::Network, &bytes, "n").unwrap();
        let b: Vec<f64> = (0..48).map(|taxel| f64::from(taxel * taxel % 11) - 2.0).collect();
        composed_layers_are(&learned, &scene, &b);
    }
}
