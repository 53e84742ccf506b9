//! Network: layers of products and ReLU that keep the mirror symmetry, from the inputs to μ and its standard deviations.
//!
//! ```text
//! in parities:  y_t = W_t a_t + c (even parity only)        in mirror images:  a = max(0, y)
//! outputs:      μ1 from the parity odd in x, μ2 from that odd in y, ln σ1 and ln σ2 from the even one
//! ```
//!
//! Every channel has one number for each of the four mirror images. A layer that treats mirrored inputs alike is block
//! diagonal in parities, as Cz is: a quarter of the weights and of the products of a layer without the symmetry, and a
//! mirrored frame has the mirrored μ, exactly. ReLU acts on the images; the transform between them is orthonormal and its own
//! inverse.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: inputs of each parity | channels × frames | – |
//! | out: μ1, μ2, ln σ1, ln σ2 | 4 × frames | of mu_max |

use crate::physics::symmetry::folded::{EVEN, ODD_X, ODD_Y};
use crate::physics::symmetry::parity::hadamard;
use crate::random::Random;
use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, Par};

/// Channels of the last layer.
pub(super) const OUTPUT_CHANNELS: usize = 2;
/// Number of outputs.
pub(crate) const OUTPUTS: usize = 4;
/// Parity and channel of each output.
pub const OUTPUT_ROWS: [(usize, usize); OUTPUTS] = [(ODD_X, 0), (ODD_Y, 0), (EVEN, 0), (EVEN, 1)];
/// Range of ln σ, σ in units of mu_max.
pub(crate) const LN_SIGMA: [f32; 2] = [-7.0, 0.5];

/// Channels × frames for each parity, or for each mirror image.
pub(super) type Parities = [Mat<f32>; 4];

/// Mirror images from parities, and back: half their Hadamard transform.
pub(super) fn exchanged(mut of: Parities) -> Parities {
    by_columns(&mut of, exchange);
    of
}

/// The same of one frame.
pub(super) fn exchange(a: &mut [f32], b: &mut [f32], c: &mut [f32], d: &mut [f32]) {
    for (((a, b), c), d) in a.iter_mut().zip(b).zip(c).zip(d) {
        [*a, *b, *c, *d] = halved([*a, *b, *c, *d]);
    }
}

/// Mirror images after ReLU, from parities.
fn rectified(mut of: Parities) -> Parities {
    by_columns(&mut of, rectify);
    of
}

/// The same of one frame.
pub(super) fn rectify(a: &mut [f32], b: &mut [f32], c: &mut [f32], d: &mut [f32]) {
    for (((a, b), c), d) in a.iter_mut().zip(b).zip(c).zip(d) {
        [*a, *b, *c, *d] = halved([*a, *b, *c, *d]).map(|image| image.max(0.0));
    }
}

/// μ and σ in units of mu_max, [x, y], from the outputs of a frame.
pub(super) fn density(outputs: [f32; OUTPUTS]) -> ([f64; 2], [f64; 2]) {
    let [x, y, ln_x, ln_y] = outputs;
    let sigma = |ln: f32| f64::from(ln.clamp(LN_SIGMA[0], LN_SIGMA[1])).exp();
    ([x, y].map(f64::from), [ln_x, ln_y].map(sigma))
}

/// The slope in front of a ReLU, in parities, from that behind it; `images` are its outputs.
pub(super) fn through_relu(mut slopes: Parities, images: &Parities) -> Parities {
    for column in 0..slopes[0].ncols() {
        let [p, q, r, s] = images.each_ref().map(|own| own.col_as_slice(column));
        let [a, b, c, d] = slopes.each_mut().map(|own| own.col_as_slice_mut(column));
        let slopes = a.iter_mut().zip(b).zip(c).zip(d);
        for ((((a, b), c), d), (((p, q), r), s)) in slopes.zip(p.iter().zip(q).zip(r).zip(s)) {
            let behind = halved([*a, *b, *c, *d]);
            let image = [*p, *q, *r, *s];
            [*a, *b, *c, *d] = halved(std::array::from_fn(|k| if image[k] > 0.0 { behind[k] } else { 0.0 }));
        }
    }
    slopes
}

/// The transform of one quad.
pub(super) fn halved(of: [f32; 4]) -> [f32; 4] {
    hadamard(of).map(|sum| 0.5 * sum)
}

/// Does `work` with each column of the four; slices in a row are what the compiler makes vector instructions of.
fn by_columns(of: &mut Parities, work: impl Fn(&mut [f32], &mut [f32], &mut [f32], &mut [f32])) {
    for column in 0..of[0].ncols() {
        let [a, b, c, d] = of.each_mut().map(|own| own.col_as_slice_mut(column));
        work(a, b, c, d);
    }
}

/// One layer.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Layer {
    /// For each parity, outputs × inputs.
    pub weights: Parities,
    /// Of the even parity, one for each output.
    pub bias: Vec<f32>,
    /// Largest output of any image on the frames of [`Network::measure`]; it sets the scale of fixed-point words.
    pub largest: f32,
}

/// The layers in order.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Network {
    /// At least one.
    pub layers: Vec<Layer>,
}

/// What a layer passes on.
pub(super) struct Activation {
    /// Channels × frames of each mirror image, after ReLU; `None` for the inputs and the outputs.
    pub images: Option<Parities>,
    /// The same in parities.
    pub parities: Parities,
}

impl Layer {
    /// The outputs before ReLU.
    pub fn apply(&self, inputs: &Parities) -> Parities {
        std::array::from_fn(|parity| {
            let mut outputs = Mat::zeros(self.bias.len(), inputs[parity].ncols());
            matmul(&mut outputs, Accum::Replace, &self.weights[parity], &inputs[parity], 1.0, Par::Seq);
            for column in 0..if parity == EVEN { outputs.ncols() } else { 0 } {
                let outputs = outputs.col_as_slice_mut(column);
                outputs.iter_mut().zip(&self.bias).for_each(|(output, bias)| *output += bias);
            }
            outputs
        })
    }
}

impl Network {
    /// A network with random weights of variance 2/inputs; `widths` are the channels of the inputs and of every layer.
    pub fn random(widths: &[usize], random: &mut Random) -> Network {
        let layer = |pair: &[usize]| {
            let spread = (2.0 / pair[0] as f64).sqrt();
            let mut weights = |_| Mat::from_fn(pair[1], pair[0], |_, _| (spread * random.normal()) as f32);
            Layer { weights: std::array::from_fn(&mut weights), bias: vec![0.0; pair[1]], largest: 0.0 }
        };
        Network { layers: widths.windows(2).map(layer).collect() }
    }

    /// The network whose first layer takes the inputs without the last ones, which are `stated` for every frame: their products are
    /// part of its bias.
    pub fn with_stated(mut self, stated: &[f32]) -> Network {
        if let Some(first) = self.layers.first_mut() {
            let left = first.weights[EVEN].ncols() - stated.len();
            for (row, bias) in first.bias.iter_mut().enumerate() {
                *bias += stated
                    .iter()
                    .enumerate()
                    .map(|(own, value)| first.weights[EVEN][(row, left + own)] * value)
                    .sum::<f32>();
            }
            first.weights.iter_mut().for_each(|weights| *weights = weights.subcols(0, left).to_owned());
        }
        self
    }

    /// What every layer passes on, the inputs first and the outputs last.
    pub fn activations(&self, inputs: Parities) -> Vec<Activation> {
        let mut all = vec![Activation { images: None, parities: inputs }];
        for (k, layer) in self.layers.iter().enumerate() {
            let next = layer.apply(&all[k].parities);
            all.push(match k + 1 < self.layers.len() {
                true => {
                    let images = rectified(next);
                    Activation { parities: exchanged(images.clone()), images: Some(images) }
                }
                false => Activation { images: None, parities: next },
            });
        }
        all
    }

    /// Moves every weight and bias towards those of `other` by this share of the way.
    pub fn approach(&mut self, other: &Network, share: f32) {
        let towards = |values: &mut [f32], other: &[f32]| {
            values.iter_mut().zip(other).for_each(|(value, other)| *value += share * (other - *value));
        };
        for (layer, other) in self.layers.iter_mut().zip(&other.layers) {
            towards(&mut layer.bias, &other.bias);
            for (weights, other) in layer.weights.iter_mut().zip(&other.weights) {
                (0..weights.ncols())
                    .for_each(|column| towards(weights.col_as_slice_mut(column), other.col_as_slice(column)));
            }
        }
    }

    /// Sets the largest output of each layer from frames with these inputs.
    pub fn measure(&mut self, inputs: Parities) {
        let all = self.activations(inputs);
        for (layer, activation) in self.layers.iter_mut().zip(&all[1..]) {
            let outputs = activation.images.as_ref().unwrap_or(&activation.parities);
            layer.largest = outputs.iter().map(|outputs| outputs.norm_max()).fold(0.0, f32::max);
        }
    }

    /// The outputs of each frame, from the last layer's parities.
    pub fn outputs(last: &Parities) -> Mat<f32> {
        Mat::from_fn(OUTPUTS, last[0].ncols(), |output, frame| {
            let (parity, channel) = OUTPUT_ROWS[output];
            last[parity][(channel, frame)]
        })
    }

    /// μ and σ of each frame in units of mu_max, [x, y].
    pub fn shear(&self, inputs: Parities) -> Vec<([f64; 2], [f64; 2])> {
        self.shear_behind(self.layers[0].apply(&inputs))
    }

    /// The same where the first layer gives this, before its ReLU.
    pub fn shear_behind(&self, first: Parities) -> Vec<([f64; 2], [f64; 2])> {
        let last = self.layers[1..].iter().fold(first, |before, layer| layer.apply(&exchanged(rectified(before))));
        let last = Network::outputs(&last);
        (0..last.ncols()).map(|frame| density(std::array::from_fn(|k| last[(k, frame)]))).collect()
    }

    /// Channels of the inputs and of every layer.
    pub fn widths(&self) -> Vec<usize> {
        let first = self.layers.first().map(|layer| layer.weights[EVEN].ncols());
        first.into_iter().chain(self.layers.iter().map(|layer| layer.bias.len())).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Inputs of one frame from their mirror images.
    fn frame(images: [&[f32]; 4]) -> Parities {
        exchanged(images.map(|image| Mat::from_fn(image.len(), 1, |row, _| image[row])))
    }

    #[test]
    fn two_layers_by_hand() {
        let all = |weights: Mat<f32>| [weights.clone(), weights.clone(), weights.clone(), weights];
        let mat = |rows: [[f32; 2]; 2]| Mat::from_fn(2, 2, |i, j| rows[i][j]);
        // Equal weights of all parities act on every image alone. The bias of an image is half of that of the parity.
        let hidden = Layer { weights: all(mat([[1.0, -1.0], [2.0, 0.5]])), bias: vec![0.0, -2.0], largest: 0.0 };
        let last = Layer { weights: all(mat([[1.0, 0.0], [0.0, 1.0]])), bias: vec![0.0, 1.0], largest: 0.0 };
        let network = Network { layers: vec![hidden, last] };
        assert_eq!(network.widths(), [2, 2, 2]);
        let mut measured = network.clone();
        // Images after ReLU: (2, 5.5), (0, 2), (0, 0), (0, 0).
        let images: [&[f32]; 4] = [&[3.0, 1.0], &[1.0, 2.0], &[0.0, 0.0], &[-1.0, 0.0]];
        let found = network.shear(frame(images));
        // Halved sums with the signs of the parities; ln σ = 1 and 4.75, the latter out of range.
        assert_eq!(found[0].0, [1.0, 1.0]);
        assert_eq!(found[0].1, [f64::from(LN_SIGMA[1]).exp(); 2]);
        measured.measure(frame(images));
        assert_eq!([0, 1].map(|k| measured.layers[k].largest), [5.5, 4.75]);
        let swapped = network.shear(frame([images[1], images[0], images[3], images[2]]));
        assert_eq!(swapped[0].0, [-1.0, 1.0]);
    }

    /// Inputs that are the same for every frame are as good as a bias.
    #[test]
    fn stated_inputs_are_part_of_the_bias() {
        let network = Network::random(&[7, 6, OUTPUT_CHANNELS], &mut Random::new(4));
        let mut random = Random::new(9);
        let own: Parities = std::array::from_fn(|_| Mat::from_fn(5, 1, |_, _| random.normal() as f32));
        let stated = [0.5f32, -0.75];
        let all: Parities = std::array::from_fn(|parity| {
            let of = |row: usize| if parity == EVEN { stated[row - 5] } else { 0.0 };
            Mat::from_fn(7, 1, |row, _| if row < 5 { own[parity][(row, 0)] } else { of(row) })
        });
        let (whole, folded) = (network.shear(all)[0], network.clone().with_stated(&stated).shear(own.clone())[0]);
        let differ = |a: ([f64; 2], [f64; 2]), b: ([f64; 2], [f64; 2])| {
            (0..2).map(|k| (a.0[k] - b.0[k]).abs() + (a.1[k] - b.1[k]).abs()).sum::<f64>()
        };
        assert!(differ(whole, folded) < 1e-5, "{whole:?} {folded:?}");
        assert!(differ(whole, network.with_stated(&[0.5, 0.75]).shear(own)[0]) > 1e-2);
    }

    #[test]
    fn a_mirrored_frame_has_the_mirrored_shear() {
        let network = Network::random(&[5, 7, 6, OUTPUT_CHANNELS], &mut Random::new(3));
        let mut random = Random::new(8);
        let images: [Vec<f32>; 4] = std::array::from_fn(|_| (0..5).map(|_| random.normal() as f32).collect());
        let of = |across: usize| network.shear(frame(std::array::from_fn(|lane| &images[lane ^ across][..])))[0];
        let straight = of(0);
        assert!(straight.0.iter().all(|mu| mu.abs() > 1e-3));
        for across in 1..4 {
            let mirrored = of(across);
            for axis in [0, 1] {
                let sign = if across >> axis & 1 == 1 { -1.0 } else { 1.0 };
                assert!((mirrored.0[axis] - sign * straight.0[axis]).abs() < 1e-5, "{across} {axis}");
                assert!((mirrored.1[axis] - straight.1[axis]).abs() < 1e-5, "{across} {axis}");
            }
        }
    }
}
