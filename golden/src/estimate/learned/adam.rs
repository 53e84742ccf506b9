//! Adam: a step against the slope of the loss, by the means of the slopes so far (Kingma and Ba 2015).
//!
//! ```text
//! m ← m + 0.1 (g − m)        v ← v + 0.001 (g² − v)        w ← w − rate · m̂/(√v̂ + 10⁻⁸)
//! ```
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: network, slope in every number | – | – |
//! | out: network | – | – |

use super::network::{Layer, Network, Parities};
use faer::Mat;

/// Decay of the means of the slope and of its square.
const DECAY: [f32; 2] = [0.9, 0.999];
/// Added to the root of the mean square.
const LEAST: f32 = 1e-8;

/// A number for each weight and bias of a layer.
pub(super) struct OfLayer {
    /// Of each parity.
    pub weights: Parities,
    /// Of the even parity.
    pub bias: Vec<f32>,
}

/// The means, and the number of steps done.
pub(super) struct Adam {
    slopes: Vec<OfLayer>,
    squares: Vec<OfLayer>,
    steps: i32,
}

impl OfLayer {
    fn zero(layer: &Layer) -> OfLayer {
        let weights = layer.weights.each_ref().map(|own| Mat::zeros(own.nrows(), own.ncols()));
        OfLayer { weights, bias: vec![0.0; layer.bias.len()] }
    }

    /// Adds those of another part of the frames.
    pub fn add(&mut self, other: &OfLayer) {
        self.weights.iter_mut().zip(&other.weights).for_each(|(own, other)| *own += other);
        self.bias.iter_mut().zip(&other.bias).for_each(|(own, other)| *own += other);
    }
}

impl Adam {
    /// Before the first step.
    pub fn new(network: &Network) -> Adam {
        let zeros = || network.layers.iter().map(OfLayer::zero).collect();
        Adam { slopes: zeros(), squares: zeros(), steps: 0 }
    }

    /// One step of all layers.
    pub fn step(&mut self, network: &mut Network, slopes: &[OfLayer], rate: f32) {
        self.steps = self.steps.saturating_add(1);
        let scale = rate * (1.0 - DECAY[1].powi(self.steps)).sqrt() / (1.0 - DECAY[0].powi(self.steps));
        let layers = network.layers.iter_mut().zip(slopes).zip(&mut self.slopes).zip(&mut self.squares);
        for (((layer, slope), mean), square) in layers {
            for (parity, weights) in layer.weights.iter_mut().enumerate() {
                let (slope, mean, square) =
                    (&slope.weights[parity], &mut mean.weights[parity], &mut square.weights[parity]);
                for column in 0..weights.ncols() {
                    let [weights, mean, square] =
                        [&mut *weights, &mut *mean, &mut *square].map(|own| own.col_as_slice_mut(column));
                    move_by(weights, slope.col_as_slice(column), mean, square, scale);
                }
            }
            move_by(&mut layer.bias, &slope.bias, &mut mean.bias, &mut square.bias, scale);
        }
    }
}

fn move_by(values: &mut [f32], slopes: &[f32], means: &mut [f32], squares: &mut [f32], scale: f32) {
    for (((value, slope), mean), square) in values.iter_mut().zip(slopes).zip(means).zip(squares) {
        *mean += (1.0 - DECAY[0]) * (slope - *mean);
        *square += (1.0 - DECAY[1]) * (slope * slope - *square);
        *value -= scale * *mean / (square.sqrt() + LEAST);
    }
}
