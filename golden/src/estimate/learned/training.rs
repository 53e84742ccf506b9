//! Training: weights from frames drawn from the scene's own physics, by Adam.
//!
//! ```text
//! loss = Σ_axis ln σ + (m − μ)²/2σ²                     negative logarithm of the normal density
//! gradient in m: σ^0.6 (m − μ)/σ²        in ln σ: σ^0.6 (1 − (m − μ)²/σ²)
//! ```
//!
//! The factor (Seitzer et al. 2022, β = 0.3) keeps frames whose μ is easy from outweighing the others; with σ itself, frames of little noise
//! are learned less well. The rate falls from its first value
//! to zero as half a cosine, after a rise over the first 2 % of the training. The trained network is the mean over about the last 5 %
//! of the steps so far, which is better than the last one also where the training is interrupted.
//!
//! Contacts are drawn while the steps go on, the first eighth at once, the others in even shares, and the oldest forgotten: of a fixed set
//! the network learns what other contacts do not have. The frames of a step are in
//! [`PARTS`] equal parts, one a thread. After the training σ is scaled so that it covers as many frames of other contacts as a normal
//! distribution does.
//!
//! Equal options give equal weights on one machine, whatever the number of threads, but for a training of stated minutes.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: scene, options | – | – |
//! | out: network, mean loss of the first and of the last steps | – | – |

use super::adam::{Adam, OfLayer};
use super::error::LearnedError;
use super::frames::NOISE;
use super::inputs::Inputs;
use super::network::{
    through_relu, Activation, Layer, Network, Parities, LN_SIGMA, OUTPUTS, OUTPUT_CHANNELS, OUTPUT_ROWS,
};
use super::options::Training;
use super::signature::Signature;
use crate::physics::symmetry::folded::EVEN;
use crate::random::Random;
use crate::spec::scene::Scene;
use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, Par};
use rayon::prelude::*;
use std::f32::consts::PI;
use std::ops::ControlFlow;
use std::time::{Duration, Instant};

/// Power of σ by which the gradients of a frame are multiplied.
const SIGMA_POWER: f32 = 0.6;
/// Share of the training in which the rate rises.
const RISE: f32 = 0.02;
/// Share of the steps at either end over which the loss is averaged.
const ENDS: f64 = 0.05;
/// Reciprocal of the share of the steps so far over which the network is averaged.
const AVERAGED: f32 = 20.0;
/// Share of the contacts that is drawn before the first step.
const AT_FIRST: f64 = 0.125;
/// Parts of a step's frames.
const PARTS: usize = 2;
/// Frames on which the largest output of each layer, σ and the errors are measured.
const MEASURED: usize = 4096;
/// Contacts of the frames on which σ and the errors are measured, none of which is in the training.
const OTHERS: usize = 1024;
/// Added to the seed of the training for them.
const OF_OTHERS: u64 = 3_000_003;
/// Share of a normal distribution within one standard deviation.
const WITHIN: f64 = 0.683;
/// Noise of the errors that are measured during the training.
pub const MEASURED_NOISE: [f64; 2] = [2e-3, 1e-2];
/// Time between two measurements of the errors.
const BETWEEN: Duration = Duration::from_secs(30);
/// Bytes of the block.
const FREED: usize = 16 << 20;
/// Steps between two calls of `progress`, and between contacts drawn.
const EVERY: usize = 20;

/// What a training has done.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stage {
    /// Share of the training.
    pub done: f64,
    /// Steps.
    pub steps: usize,
    /// Mean loss of the last ones.
    pub loss: f64,
    /// Every half minute: median of |m − μ|/|μ| on frames that are not in the training, for each of [`MEASURED_NOISE`].
    pub errors: Option<[f64; 2]>,
}

/// Mean loss of the first and of the last steps.
pub(super) struct Losses {
    /// Number of steps.
    pub steps: usize,
    /// Of the first twentieth.
    pub first: f64,
    /// Of the last twentieth.
    pub last: f64,
}

/// A training under way.
struct Run<'a> {
    training: &'a Training,
    frames: Inputs,
    others: Inputs,
    network: Network,
    /// The mean network.
    mean: Network,
    adam: Adam,
    /// Of each part of the frames.
    randoms: Vec<Random>,
    losses: Vec<f64>,
}

/// Trains a network for a scene until it is done or `progress` breaks; then the best network so far is the result.
pub(super) fn train(
    scene: &Scene,
    signature: &Signature,
    training: &Training,
    progress: &mut dyn FnMut(&Stage) -> ControlFlow<()>,
) -> Result<(Network, Losses), LearnedError> {
    training.check(scene.medium, signature.window)?;
    // Until so large a block has been freed once, glibc returns the memory of every step to the system: a fifth of the time.
    drop(std::hint::black_box(Vec::<u8>::with_capacity(FREED)));
    let mut run = Run::new(scene, signature, training)?;
    let (clock, mut measured) = (Instant::now(), Instant::now());
    let mut best: Option<(f64, Network)> = None;
    while let Some(done) = training.done(run.losses.len(), clock.elapsed()) {
        if run.losses.len() % EVERY == 0 {
            let drawn = training.contacts as f64 * (AT_FIRST + (1.0 - AT_FIRST) * done);
            run.frames.draw((drawn as usize).max(1))?;
        }
        run.step(training.rate_at(done));
        if run.losses.len() % EVERY != 0 {
            continue;
        }
        let errors = (measured.elapsed() >= BETWEEN).then(|| {
            measured = Instant::now();
            run.errors()
        });
        if let Some(own) = errors.map(|errors| errors.iter().sum::<f64>())
            && best.as_ref().is_none_or(|(least, _)| own < *least)
        {
            best = Some((own, run.mean.clone()));
        }
        let loss = mean(&run.losses[run.losses.len() - EVERY..]);
        if progress(&Stage { done, steps: run.losses.len(), loss, errors }).is_break() {
            if let Some((least, network)) = best
                && least < run.errors().iter().sum::<f64>()
            {
                run.mean = network;
            }
            break;
        }
    }
    run.finish()
}

impl Training {
    /// Share of the training that is done after so many steps and so much time; `None` at its end.
    fn done(&self, steps: usize, time: Duration) -> Option<f64> {
        let done = match self.minutes {
            Some(minutes) => time.as_secs_f64() / (60.0 * minutes),
            None => steps as f64 / self.steps as f64,
        };
        // One step at least.
        (done < 1.0 || steps == 0).then_some(done.min(1.0))
    }

    /// The rate at a share of the training.
    fn rate_at(&self, done: f64) -> f32 {
        let done = done as f32 + 0.5 / self.steps as f32;
        self.rate as f32 * (done / RISE).min(1.0) * 0.5 * (1.0 + (PI * done.min(1.0)).cos())
    }
}

impl<'a> Run<'a> {
    fn new(scene: &Scene, signature: &Signature, training: &'a Training) -> Result<Run<'a>, LearnedError> {
        let mut random = Random::new(training.seed);
        let frames = Inputs::new(scene, signature, training, training.seed)?;
        let widths: Vec<usize> = std::iter::once(frames.channels())
            .chain(training.hidden.iter().copied())
            .chain(std::iter::once(OUTPUT_CHANNELS))
            .collect();
        let mut network = Network::random(&widths, &mut random);
        // The first estimate is μ = 0 with σ = mu_max.
        if let Some(last) = network.layers.last_mut() {
            last.weights.iter_mut().for_each(|weights| *weights *= faer::Scale(0.1f32));
        }
        let mut others = Inputs::new(scene, signature, training, training.seed.wrapping_add(OF_OTHERS))?;
        others.draw(OTHERS.min(training.contacts))?;
        Ok(Run {
            training,
            frames,
            others,
            mean: network.clone(),
            adam: Adam::new(&network),
            network,
            randoms: (0..PARTS as u64).map(|part| Random::new(!training.seed.wrapping_sub(part))).collect(),
            losses: Vec::new(),
        })
    }

    /// One step.
    fn step(&mut self, rate: f32) {
        let (batch, network, frames) = (self.training.batch, &self.network, &self.frames);
        let part = |(part, random): (usize, &mut Random)| {
            let count = batch * (part + 1) / PARTS - batch * part / PARTS;
            let (inputs, truth) = frames.mix(count, NOISE, random);
            let activations = network.activations(inputs);
            let outputs = Network::outputs(&activations[activations.len() - 1].parities);
            let (loss, slope) = slope(&outputs, &truth, batch);
            (loss, slopes(network, &activations, &slope))
        };
        let parts: Vec<(f64, Vec<OfLayer>)> = self.randoms.par_iter_mut().enumerate().map(part).collect();
        let mut loss = 0.0;
        // In the order of the parts: the sum is the same whichever thread is first.
        let sum = parts.into_iter().map(|(own, slopes)| {
            loss += own;
            slopes
        });
        let sum = sum.reduce(|mut sum, own| {
            sum.iter_mut().zip(&own).for_each(|(sum, own)| sum.add(own));
            sum
        });
        self.adam.step(&mut self.network, &sum.unwrap_or_default(), rate);
        self.losses.push(loss);
        let steps = self.losses.len() as f32;
        self.mean.approach(&self.network, AVERAGED / (AVERAGED + steps - 1.0));
    }

    /// Median of |m − μ|/|μ| of the mean network on frames of other contacts, for each of [`MEASURED_NOISE`].
    fn errors(&self) -> [f64; 2] {
        MEASURED_NOISE.map(|noise| {
            let (inputs, truth) = self.others.mix(MEASURED / 4, [noise; 2], &mut Random::new(self.training.seed));
            let found = self.mean.shear(inputs);
            let error = |(frame, (mean, _)): (usize, &([f64; 2], [f64; 2]))| {
                let [x, y] = [0, 1].map(|axis| f64::from(truth[(axis, frame)]));
                (mean[0] - x).hypot(mean[1] - y) / x.hypot(y)
            };
            share_below(found.iter().enumerate().map(error).collect(), 0.5)
        })
    }

    /// The mean network with its σ and its largest outputs.
    fn finish(mut self) -> Result<(Network, Losses), LearnedError> {
        let random = &mut Random::new(!self.training.seed);
        let (inputs, truth) = self.others.mix(MEASURED, NOISE, random);
        let found = self.mean.shear(inputs);
        for axis in [0, 1] {
            let z = |(frame, (mean, sigma)): (usize, &([f64; 2], [f64; 2]))| {
                (mean[axis] - f64::from(truth[(axis, frame)])).abs() / sigma[axis]
            };
            let (_, channel) = OUTPUT_ROWS[2 + axis];
            let within = share_below(found.iter().enumerate().map(z).collect(), WITHIN);
            if let Some(last) = self.mean.layers.last_mut().filter(|_| within > 0.0) {
                last.bias[channel] += within.ln() as f32;
            }
        }
        // Of a short training too: what an output exceeds later is cut off in the hardware.
        self.frames.draw(self.training.contacts)?;
        let (inputs, _) = self.frames.mix(MEASURED, NOISE, random);
        self.mean.measure(inputs);
        let steps = self.losses.len();
        let ends = ((steps as f64 * ENDS) as usize).clamp(1, steps.max(1));
        let losses = Losses { steps, first: mean(&self.losses[..ends]), last: mean(&self.losses[steps - ends..]) };
        let finite = |layer: &Layer| layer.bias.iter().all(|bias| bias.is_finite());
        match losses.last.is_finite() && self.mean.layers.iter().all(finite) {
            true => Ok((self.mean, losses)),
            false => Err(LearnedError::Diverged { rate: self.training.rate }),
        }
    }
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// The value below which a share of the values is.
fn share_below(mut values: Vec<f64>, share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get((values.len() as f64 * share) as usize).copied().unwrap_or(0.0)
}

/// Loss of a part of a step's `batch` frames, and its slope in the outputs, both over the number of all of them.
fn slope(outputs: &Mat<f32>, truth: &Mat<f32>, batch: usize) -> (f64, Mat<f32>) {
    let (frames, share) = (outputs.ncols(), 1.0 / batch as f32);
    let mut slope = Mat::zeros(OUTPUTS, frames);
    let mut loss = 0.0f64;
    for frame in 0..frames {
        for axis in [0, 1] {
            let raw = outputs[(2 + axis, frame)];
            let ln = raw.clamp(LN_SIGMA[0], LN_SIGMA[1]);
            let sigma = ln.exp();
            let off = (outputs[(axis, frame)] - truth[(axis, frame)]) / sigma;
            loss += f64::from(ln + 0.5 * off * off);
            let factor = share * sigma.powf(SIGMA_POWER);
            slope[(axis, frame)] = factor * off / sigma;
            let pull = 1.0 - off * off;
            // Beyond its range ln σ is only moved back.
            let stuck = (raw > LN_SIGMA[1] && pull < 0.0) || (raw < LN_SIGMA[0] && pull > 0.0);
            slope[(2 + axis, frame)] = if stuck { 0.0 } else { factor * pull };
        }
    }
    (loss / batch as f64, slope)
}

/// The slope of the loss in every number of the network, from that in the outputs.
fn slopes(network: &Network, activations: &[Activation], slope: &Mat<f32>) -> Vec<OfLayer> {
    let mut slopes: Parities = std::array::from_fn(|_| Mat::zeros(OUTPUT_CHANNELS, slope.ncols()));
    for (output, (parity, channel)) in OUTPUT_ROWS.into_iter().enumerate() {
        slopes[parity].row_mut(channel).copy_from(slope.row(output));
    }
    let mut all = Vec::new();
    for (layer, inputs) in network.layers.iter().zip(activations).rev() {
        let weights = std::array::from_fn(|parity| {
            let mut own = Mat::<f32>::zeros(layer.weights[parity].nrows(), layer.weights[parity].ncols());
            matmul(&mut own, Accum::Replace, &slopes[parity], inputs.parities[parity].transpose(), 1.0, Par::Seq);
            own
        });
        let bias = slopes[EVEN].row_iter().map(|row| row.iter().sum()).collect();
        all.push(OfLayer { weights, bias });
        if let Some(images) = &inputs.images {
            let before = std::array::from_fn(|parity| {
                let mut before = Mat::zeros(layer.weights[parity].ncols(), slope.ncols());
                matmul(&mut before, Accum::Replace, layer.weights[parity].transpose(), &slopes[parity], 1.0, Par::Seq);
                before
            });
            slopes = through_relu(before, images);
        }
    }
    all.reverse();
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The slope that is propagated back is that of the loss, by differences, times the power of σ.
    #[test]
    fn slopes_by_differences() {
        let truth = Mat::from_fn(2, 1, |axis, _| [0.3f32, -0.2][axis]);
        let outputs = |k: usize, step: f32| {
            Mat::from_fn(OUTPUTS, 1, |i, _| [0.1f32, 0.05, -1.0, -2.0][i] + if i == k { step } else { 0.0 })
        };
        let (_, got) = slope(&outputs(0, 0.0), &truth, 1);
        for k in 0..OUTPUTS {
            let difference = (slope(&outputs(k, 1e-3), &truth, 1).0 - slope(&outputs(k, -1e-3), &truth, 1).0) / 2e-3;
            let sigma = f64::from([-1.0f32, -2.0][k % 2].exp());
            let wanted = sigma.powf(f64::from(SIGMA_POWER)) * difference;
            assert!(
                (f64::from(got[(k, 0)]) - wanted).abs() < 1e-3 * wanted.abs().max(0.1),
                "{k}: {} {wanted}",
                got[(k, 0)]
            );
        }
    }

    /// The slope in every weight is that of the loss, by differences.
    #[test]
    fn slopes_of_all_layers_by_differences() {
        let mut random = Random::new(5);
        let network = Network::random(&[3, 4, 3, OUTPUT_CHANNELS], &mut random);
        let inputs: Parities = std::array::from_fn(|_| Mat::from_fn(3, 2, |_, _| random.normal() as f32));
        // The sum of the outputs is the loss here: its slope in every output is 1.
        let loss = |network: &Network| {
            let all = network.activations(inputs.clone());
            let outputs = Network::outputs(&all[all.len() - 1].parities);
            outputs.col_iter().flat_map(|column| column.iter().copied().collect::<Vec<_>>()).sum::<f32>()
        };
        // The first step of Adam moves every number by the rate, against the sign of its slope.
        let mut moved = network.clone();
        let slope = Mat::from_fn(OUTPUTS, 2, |_, _| 1.0f32);
        let all = slopes(&network, &network.activations(inputs.clone()), &slope);
        Adam::new(&network).step(&mut moved, &all, 1e-3);
        let mut compared = 0;
        for (k, slopes) in all.iter().enumerate() {
            for parity in 0..4 {
                let weights = &network.layers[k].weights[parity];
                let (rows, cols) = (weights.nrows(), weights.ncols());
                for (row, col) in (0..rows).flat_map(|row| (0..cols).map(move |col| (row, col))) {
                    let at = |step: f32| {
                        let mut other = network.clone();
                        other.layers[k].weights[parity][(row, col)] += step;
                        loss(&other)
                    };
                    let wanted = (at(1e-2) - at(-1e-2)) / 2e-2;
                    let step = |network: &Network| network.layers[k].weights[parity][(row, col)];
                    let own = slopes.weights[parity][(row, col)];
                    assert!((own - wanted).abs() < 0.02 * wanted.abs().max(0.1), "{k} {parity}: {own} {wanted}");
                    if wanted.abs() > 0.1 {
                        assert_eq!((step(&moved) - step(&network)).signum(), -wanted.signum());
                        compared += 1;
                    }
                }
            }
        }
        assert!(compared > 40, "{compared}");
    }

    /// Adam reaches the least squares of a map with the mirror symmetry.
    #[test]
    fn a_linear_map_is_learned() {
        let mut random = Random::new(3);
        let mut network = Network::random(&[3, 16, OUTPUT_CHANNELS], &mut random);
        let mut adam = Adam::new(&network);
        let training = Training { steps: 800, rate: 1e-2, ..Default::default() };
        let (mut first, mut last) = (0.0, 0.0);
        for step in 0..training.steps {
            let inputs: Parities = std::array::from_fn(|_| Mat::from_fn(3, 64, |_, _| random.normal() as f32));
            let truth = Mat::from_fn(2, 64, |axis, k| {
                let odd = &inputs[OUTPUT_ROWS[axis].0];
                0.5 * odd[(axis, k)] - 0.25 * odd[(2, k)]
            });
            let activations = network.activations(inputs);
            let (loss, slope) = slope(&Network::outputs(&activations[2].parities), &truth, 64);
            let all = slopes(&network, &activations, &slope);
            adam.step(&mut network, &all, training.rate_at(step as f64 / training.steps as f64));
            if step == 0 {
                first = loss;
            }
            last = loss;
        }
        assert!(last < first - 3.0, "{first} {last}");
    }
}
