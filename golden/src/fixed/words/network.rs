//! The network that gives μ, in the words of the passes: its layers are further matrices of the same lanes.
//!
//! ```text
//! y = (Σ_j W x_j + c·ONE) / 2^shift        images H y → ReLU → operands of the next layer H max(0, H y)
//! ```
//! A layer has the mirror symmetry, so that it has four blocks like every matrix here. Scales are part of the weights:
//! all hidden layers have the same shift, the last one [`LAST_SHIFT`] more, as its outputs are short. H is the butterfly of
//! `fold`, unnormalised.
//!
//! | word | bits | LSB |
//! |---|---|---|
//! | operand of the first layer: high limb of the folded input, or of the folded window of a contact | 18 | 2^−(`input_bits` − `input_low_bits`) |
//! | the same, for a contact: folded mask, of [`MASKED`] on taxels beyond the array and dead ones | 17 | 1 / [`MASKED`] |
//! | weight, bias | 18 | of the layer |
//! | image of a hidden neuron | `image_bits`, no sign | largest image on drawn frames over 2^`image_bits`, with [`MARGIN`] |
//! | operand of a later layer | `data_bits` | the same / 2 |
//! | output: μ | [`POSITION_BITS`] | mu_max / 384 |
//! | output: ln σ, σ in units of mu_max | [`OUTPUT_BITS`] | 1/384 |

use super::coefficients::Flipped;
use super::formats::{Formats, MULTIPLIER_BITS, MU_STEPS};
use crate::estimate::learned::ComposedLayer;
use faer::Mat;

/// The operand of the biases.
pub const ONE: i64 = 1 << (MULTIPLIER_BITS - 2);
/// The word of a masked taxel in the window of a contact; that of the others is 0. A folded mask is at most [`ONE`].
pub const MASKED: i64 = ONE / 4;
/// Width of an output, signed.
pub const OUTPUT_BITS: u32 = 13;
/// Width of the position of μ, signed.
pub const POSITION_BITS: u32 = 10;
/// Right shift from an accumulator of the last layer beyond that of the others.
pub const LAST_SHIFT: u32 = 5;
/// Largest image of a frame over the largest of the frames on which the network was measured, without saturation.
pub const MARGIN: f64 = 1.25;

/// A layer in LSBs.
#[derive(Clone, Debug, PartialEq)]
pub struct WordLayer {
    /// Number of rows of a block.
    pub outputs: usize,
    /// Number of columns of a block.
    pub inputs: usize,
    /// Weights of each parity, outputs × inputs, row-major.
    pub weights: Flipped<i64>,
    /// Weights of the mask of a contact's window, outputs × quads, row-major; in the first layer, where there is one.
    pub mask: Option<Flipped<i64>>,
    /// Biases of each parity, one column.
    pub bias: Flipped<i64>,
}

/// The layers of a network and their common shift.
#[derive(Clone, Debug, PartialEq)]
pub struct WordNetwork {
    /// The layers in order.
    pub layers: Vec<WordLayer>,
    /// Right shift from an accumulator of a hidden layer to an output.
    pub shift: u32,
}

impl WordNetwork {
    /// The largest shift, and with it the finest weights, with which all weights fit an operand and all accumulators
    /// `lane_bits`; `None` if there is none.
    pub fn new(formats: &Formats, layers: &[ComposedLayer]) -> Option<WordNetwork> {
        let all = (1..formats.lane_bits).rev().map(|shift| WordNetwork::of_shift(formats, layers, shift));
        all.into_iter().find(|network| network.fits(formats))
    }

    fn of_shift(formats: &Formats, layers: &[ComposedLayer], shift: u32) -> WordNetwork {
        let last = layers.len() - 1;
        // LSBs of an operand per unit of an input, in parities.
        let mut inputs_per_unit = 2f64.powi((formats.input_bits - formats.input_low_bits) as i32);
        let words = |(index, layer): (usize, &ComposedLayer)| {
            let largest = f64::from(1u32 << formats.image_bits()) / MARGIN;
            // The images are twice the orthonormal ones.
            let outputs_per_unit = if index == last { MU_STEPS as f64 } else { largest / (2.0 * layer.largest) };
            let own_shift = if index == last { shift + LAST_SHIFT } else { shift };
            let scale = outputs_per_unit * 2f64.powi(own_shift as i32);
            let word = |value: f64, per_unit: f64| (value * scale / per_unit).round() as i64;
            let (outputs, inputs) = (layer.bias[0].len(), layer.weights[0].ncols());
            let block = |matrix: &Mat<f64>, per_unit: f64| -> Vec<i64> {
                let cols = matrix.ncols();
                (0..outputs * cols).map(|k| word(matrix[(k / cols, k % cols)], per_unit)).collect()
            };
            let weights = |parity: usize| block(&layer.weights[parity], inputs_per_unit);
            // The transform is twice the orthonormal one.
            let mask = |masks: &[Mat<f64>; 4]| Flipped {
                flip: 0,
                parity: std::array::from_fn(|parity| block(&masks[parity], 2.0 * MASKED as f64)),
            };
            let bias = |parity: usize| layer.bias[parity].iter().map(|&bias| word(bias, ONE as f64)).collect();
            let layer = WordLayer {
                outputs,
                inputs,
                weights: Flipped { flip: 0, parity: std::array::from_fn(weights) },
                mask: layer.mask.as_ref().map(mask),
                bias: Flipped { flip: 0, parity: std::array::from_fn(bias) },
            };
            // Half the transform of images that are twice as large.
            inputs_per_unit = 4.0 * outputs_per_unit;
            layer
        };
        WordNetwork { layers: layers.iter().enumerate().map(words).collect(), shift }
    }

    /// Whether every word has its width, whatever the operands.
    fn fits(&self, formats: &Formats) -> bool {
        let limit = 1i64 << (MULTIPLIER_BITS - 1);
        let coefficients = |layer: &WordLayer| {
            let mask = layer.mask.iter().flat_map(|mask| &mask.parity);
            layer.weights.parity.iter().chain(&layer.bias.parity).chain(mask).flatten().all(|word| word.abs() < limit)
        };
        let sums = |layer: &WordLayer| {
            let row = |parity: usize, row: usize| -> i64 {
                let of = |own: &Flipped<i64>, largest: i64| -> i64 {
                    let cols = own.parity[parity].len() / layer.outputs;
                    own.parity[parity][row * cols..][..cols].iter().map(|word| word.abs() * largest).sum()
                };
                let mask = layer.mask.as_ref().map_or(0, |mask| of(mask, ONE));
                of(&layer.weights, limit) + mask + of(&layer.bias, ONE)
            };
            (0..4).all(|parity| (0..layer.outputs).all(|i| row(parity, i) < 1 << (formats.lane_bits - 1)))
        };
        self.layers.iter().all(|layer| coefficients(layer) && sums(layer))
    }
}
