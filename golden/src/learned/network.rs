//! Network: layers of products and ReLU, from the inputs to μ and its standard deviations.
//!
//! ```text
//! a₀ = inputs        a_k = max(0, W_k a_{k−1} + c_k)        outputs = W_last a + c_last
//! ```
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: inputs | width × frames | – |
//! | out: μ1, μ2, ln σ1, ln σ2 | 4 × frames | of mu_max |

use crate::random::Random;
use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, Par};

/// Number of outputs.
pub(super) const OUTPUTS: usize = 4;
/// Range of ln σ, σ in units of mu_max.
pub(super) const LN_SIGMA: [f32; 2] = [-7.0, 0.5];

/// One layer.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Layer {
    /// Outputs × inputs.
    pub weights: Mat<f32>,
    /// One for each output.
    pub bias: Vec<f32>,
}

/// The layers in order.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Network {
    /// At least one.
    pub layers: Vec<Layer>,
}

impl Layer {
    fn apply(&self, inputs: &Mat<f32>) -> Mat<f32> {
        let mut outputs = Mat::from_fn(self.bias.len(), inputs.ncols(), |row, _| self.bias[row]);
        matmul(&mut outputs, Accum::Add, &self.weights, inputs, 1.0, Par::Seq);
        outputs
    }
}

impl Network {
    /// A network with random weights of variance 2/inputs; `widths` are those of the inputs and of every layer.
    pub fn random(widths: &[usize], random: &mut Random) -> Network {
        let layer = |pair: &[usize]| {
            let spread = (2.0 / pair[0] as f64).sqrt();
            let weights = Mat::from_fn(pair[1], pair[0], |_, _| (spread * random.normal()) as f32);
            Layer { weights, bias: vec![0.0; pair[1]] }
        };
        Network { layers: widths.windows(2).map(layer).collect() }
    }

    /// The activations of every layer, the inputs first and the outputs last.
    pub fn activations(&self, inputs: Mat<f32>) -> Vec<Mat<f32>> {
        let mut all = vec![inputs];
        for (k, layer) in self.layers.iter().enumerate() {
            let mut next = layer.apply(&all[k]);
            if k + 1 < self.layers.len() {
                for column in next.col_iter_mut() {
                    column.iter_mut().for_each(|a| *a = a.max(0.0));
                }
            }
            all.push(next);
        }
        all
    }

    /// μ and σ of each frame in units of mu_max, [x, y].
    pub fn outputs(&self, inputs: Mat<f32>) -> Vec<([f64; 2], [f64; 2])> {
        let all = self.activations(inputs);
        let last = &all[all.len() - 1];
        let sigma = |ln: f32| f64::from(ln.clamp(LN_SIGMA[0], LN_SIGMA[1])).exp();
        let of = |frame: usize| {
            let at = |k: usize| last[(k, frame)];
            ([f64::from(at(0)), f64::from(at(1))], [sigma(at(2)), sigma(at(3))])
        };
        (0..last.ncols()).map(of).collect()
    }

    /// Widths of the inputs and of every layer.
    pub fn widths(&self) -> Vec<usize> {
        let first = self.layers.first().map(|layer| layer.weights.ncols());
        first.into_iter().chain(self.layers.iter().map(|layer| layer.bias.len())).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_layers_by_hand() {
        let layer = |rows: &[[f32; 2]], bias: &[f32]| Layer {
            weights: Mat::from_fn(rows.len(), 2, |i, j| rows[i][j]),
            bias: bias.to_vec(),
        };
        let hidden = layer(&[[1.0, -1.0], [2.0, 0.5]], &[0.0, -1.0]);
        let last = layer(&[[1.0, 0.0], [0.0, 1.0], [-100.0, 0.0], [0.0, 0.0]], &[0.0, 0.5, 0.0, 0.0]);
        let network = Network { layers: vec![hidden, last] };
        assert_eq!(network.widths(), [2, 2, 4]);
        // Hidden: max(0, 3 − 1) = 2 and max(0, 6 + 0.5 − 1) = 5.5; then max(0, 1 − 2) = 0 and 2.
        let found = network.outputs(Mat::from_fn(2, 2, |i, j| [[3.0, 1.0], [1.0, 2.0]][j][i]));
        assert_eq!(found[0], ([2.0, 6.0], [f64::from(LN_SIGMA[0]).exp(), 1.0]));
        assert_eq!(found[1], ([0.0, 2.5], [1.0, 1.0]));
    }
}
