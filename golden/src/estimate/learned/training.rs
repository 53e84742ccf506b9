//! Training: weights from frames drawn from the scene's own physics, by Adam.
//!
//! ```text
//! loss = Σ_axis ln σ + (m − μ)²/2σ²                     negative logarithm of the normal density
//! gradient in m: σ (m − μ)/σ²        in ln σ: σ (1 − (m − μ)²/σ²)
//! ```
//!
//! The factor σ (Seitzer et al. 2022, β = ½) keeps frames whose μ is easy from outweighing the others. The rate falls from its first value
//! to zero as half a cosine, after a rise over the first 2 % of the steps (Adam: Kingma and Ba 2015).
//!
//! Equal options give equal weights on one machine.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: scene, options | – | – |
//! | out: network, mean loss of the first and of the last steps | – | – |

use super::error::LearnedError;
use super::features::Features;
use super::frames::Frames;
use super::network::{exchanged, Activation, Layer, Network, Parities, LN_SIGMA, OUTPUTS, OUTPUT_CHANNELS, PLACES};
use crate::data::generator::slip::Slip;
use crate::physics::symmetry::folded::EVEN;
use crate::random::Random;
use crate::spec::scene::Scene;
use crate::spec::window::Window;
use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, Par};
use std::f32::consts::PI;

/// Decay of Adam's means of the gradient and of its square.
const DECAY: [f32; 2] = [0.9, 0.999];
/// Added to the root of the mean square.
const LEAST: f32 = 1e-8;
/// Share of the steps in which the rate rises.
const RISE: f32 = 0.02;
/// Share of the steps at either end over which the loss is averaged.
const ENDS: f64 = 0.05;
/// Frames on which the largest output of each layer is measured after the training.
const MEASURED: usize = 4096;
/// Steps between two calls of `progress`.
const EVERY: usize = 20;

/// Size of a training.
#[derive(Clone, Debug, PartialEq)]
pub struct Training {
    /// Steps of Adam, 1 to 10 million.
    pub steps: usize,
    /// Frames of a step, 1 to 65 536.
    pub batch: usize,
    /// Frames of contacts that are drawn, 1 to 10 million.
    pub contacts: usize,
    /// Widths of the hidden layers, each 1 to 4096.
    pub hidden: Vec<usize>,
    /// Largest rate of a step.
    pub rate: f64,
    /// How the shear is spread over the contacts.
    pub slip: Slip,
    /// Seed of weights and frames.
    pub seed: u64,
}

impl Default for Training {
    fn default() -> Self {
        let (hidden, slip) = (vec![150, 75, 25], Slip::Mixed);
        Training { steps: 60_000, batch: 384, contacts: 60_000, hidden, rate: 2e-3, slip, seed: 1 }
    }
}

/// What a training does at present.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Stage {
    /// Contacts drawn.
    Contacts(usize),
    /// Steps done, with the mean loss of the last ones.
    Steps(usize, f64),
}

/// Mean loss of the first and of the last steps.
pub(super) struct Losses {
    /// Of the first twentieth.
    pub first: f64,
    /// Of the last twentieth.
    pub last: f64,
}

/// First and second moment of the gradient of one layer.
struct Moments {
    /// Of each parity's weights.
    weights: [[Vec<f32>; 2]; 4],
    bias: [Vec<f32>; 2],
}

/// Trains a network for a scene.
pub(super) fn train(
    scene: &Scene,
    window: Window,
    training: &Training,
    progress: &(dyn Fn(Stage) + Sync),
) -> Result<(Network, Losses), LearnedError> {
    check(training)?;
    let drawn = std::sync::atomic::AtomicUsize::new(0);
    let one = || {
        let count = drawn.fetch_add(1, std::sync::atomic::Ordering::Relaxed) + 1;
        progress(Stage::Contacts(count));
    };
    let frames = Frames::new(scene, window, training.slip, training.contacts, training.seed, &one)?;
    let features = Features::new(&window, &scene.sensor, scene.medium)?;
    let mut random = Random::new(training.seed);
    let widths: Vec<usize> = std::iter::once(Features::channels(&window))
        .chain(training.hidden.iter().copied())
        .chain(std::iter::once(OUTPUT_CHANNELS))
        .collect();
    let mut network = Network::random(&widths, &mut random);
    // The first estimate is μ = 0 with σ = mu_max.
    if let Some(last) = network.layers.last_mut() {
        last.weights.iter_mut().for_each(|weights| *weights *= faer::Scale(0.1f32));
    }
    let mut moments: Vec<Moments> = network.layers.iter().map(Moments::zero).collect();
    let ends = ((training.steps as f64 * ENDS) as usize).max(1);
    let (mut losses, mut recent) = (Losses { first: 0.0, last: 0.0 }, 0.0);
    for step in 0..training.steps {
        let (readings, truth) = frames.mix(training.batch, &mut random);
        let activations = network.activations(features.of(&readings));
        let (loss, slope) = slope(&Network::outputs(&activations[activations.len() - 1].parities), &truth);
        descend(&mut network, &mut moments, &activations, &slope, rate(training, step), step);
        if step < ends {
            losses.first += loss / ends as f64;
        }
        if step + ends >= training.steps {
            losses.last += loss / ends as f64;
        }
        recent += loss / EVERY as f64;
        if (step + 1) % EVERY == 0 {
            progress(Stage::Steps(step + 1, recent));
            recent = 0.0;
        }
    }
    let (readings, _) = frames.mix(MEASURED, &mut random);
    network.measure(features.of(&readings));
    let finite = |layer: &Layer| layer.bias.iter().all(|bias| bias.is_finite());
    match losses.last.is_finite() && network.layers.iter().all(finite) {
        true => Ok((network, losses)),
        false => Err(LearnedError::Diverged { rate: training.rate }),
    }
}

fn check(training: &Training) -> Result<(), LearnedError> {
    let fail = |field, value, allowed| Err(LearnedError::Option { field, value, allowed });
    let Training { steps, batch, contacts, hidden, rate, .. } = training;
    if !(1..=10_000_000).contains(steps) {
        return fail("steps", *steps as f64, "a whole number from 1 to 10 million");
    }
    if !(1..=65_536).contains(batch) {
        return fail("batch", *batch as f64, "a whole number from 1 to 65 536");
    }
    if !(1..=10_000_000).contains(contacts) {
        return fail("contacts", *contacts as f64, "a whole number from 1 to 10 million");
    }
    if let Some(width) = hidden.iter().find(|width| !(1..=4096).contains(*width)) {
        return fail("hidden", *width as f64, "whole numbers from 1 to 4096");
    }
    if !(*rate > 0.0 && *rate <= 1.0) {
        return fail("rate", *rate, "a number above 0, at most 1");
    }
    Ok(())
}

/// The rate of a step.
fn rate(training: &Training, step: usize) -> f32 {
    let done = (step as f32 + 0.5) / training.steps as f32;
    training.rate as f32 * (done / RISE).min(1.0) * 0.5 * (1.0 + (PI * done).cos())
}

/// Mean loss of the frames, and its slope in the outputs.
fn slope(outputs: &Mat<f32>, truth: &Mat<f32>) -> (f64, Mat<f32>) {
    let frames = outputs.ncols();
    let share = 1.0 / frames as f32;
    let mut slope = Mat::zeros(OUTPUTS, frames);
    let mut loss = 0.0f64;
    for frame in 0..frames {
        for axis in [0, 1] {
            let raw = outputs[(2 + axis, frame)];
            let ln = raw.clamp(LN_SIGMA[0], LN_SIGMA[1]);
            let sigma = ln.exp();
            let off = (outputs[(axis, frame)] - truth[(axis, frame)]) / sigma;
            loss += f64::from(ln + 0.5 * off * off);
            slope[(axis, frame)] = share * off;
            let pull = 1.0 - off * off;
            // Beyond its range ln σ is only moved back.
            let stuck = (raw > LN_SIGMA[1] && pull < 0.0) || (raw < LN_SIGMA[0] && pull > 0.0);
            slope[(2 + axis, frame)] = if stuck { 0.0 } else { share * sigma * pull };
        }
    }
    (loss / frames as f64, slope)
}

/// One step of Adam on all layers, from the slope in the outputs back.
fn descend(
    network: &mut Network,
    moments: &mut [Moments],
    activations: &[Activation],
    slope: &Mat<f32>,
    rate: f32,
    step: usize,
) {
    let power = step as i32 + 1;
    let scale = rate * (1.0 - DECAY[1].powi(power)).sqrt() / (1.0 - DECAY[0].powi(power));
    let mut slopes: Parities = std::array::from_fn(|_| Mat::zeros(OUTPUT_CHANNELS, slope.ncols()));
    for (output, (parity, channel)) in PLACES.into_iter().enumerate() {
        slopes[parity].row_mut(channel).copy_from(slope.row(output));
    }
    for k in (0..network.layers.len()).rev() {
        let (layer, inputs) = (&mut network.layers[k], &activations[k]);
        let before = inputs.images.as_ref().map(|images| {
            let slopes = std::array::from_fn(|parity| layer.weights[parity].transpose() * &slopes[parity]);
            through_relu(&slopes, images)
        });
        for (parity, weights) in layer.weights.iter_mut().enumerate() {
            let mut gradient = Mat::<f32>::zeros(weights.nrows(), weights.ncols());
            let inputs = inputs.parities[parity].transpose();
            matmul(&mut gradient, Accum::Replace, &slopes[parity], inputs, 1.0, Par::Seq);
            let [first, second] = &mut moments[k].weights[parity];
            let rows = weights.nrows();
            for (col, (weights, gradient)) in weights.col_iter_mut().zip(gradient.col_iter()).enumerate() {
                let range = col * rows..(col + 1) * rows;
                move_by(weights.iter_mut(), gradient.iter(), &mut first[range.clone()], &mut second[range], scale);
            }
        }
        let bias: Vec<f32> = slopes[EVEN].row_iter().map(|row| row.iter().sum()).collect();
        let [first, second] = &mut moments[k].bias;
        move_by(layer.bias.iter_mut(), bias.iter(), first, second, scale);
        match before {
            Some(before) => slopes = before,
            None => break,
        }
    }
}

/// The slope in front of a ReLU, in parities, from that behind it; `images` are its outputs.
fn through_relu(slopes: &Parities, images: &Parities) -> Parities {
    let mut slopes = exchanged(slopes);
    for (slopes, images) in slopes.iter_mut().zip(images) {
        for (slopes, images) in slopes.col_iter_mut().zip(images.col_iter()) {
            slopes.iter_mut().zip(images.iter()).filter(|(_, a)| **a <= 0.0).for_each(|(slope, _)| *slope = 0.0);
        }
    }
    exchanged(&slopes)
}

fn move_by<'a>(
    values: impl Iterator<Item = &'a mut f32>,
    gradient: impl Iterator<Item = &'a f32>,
    first: &mut [f32],
    second: &mut [f32],
    scale: f32,
) {
    for (((value, gradient), m), v) in values.zip(gradient).zip(first).zip(second) {
        *m += (1.0 - DECAY[0]) * (gradient - *m);
        *v += (1.0 - DECAY[1]) * (gradient * gradient - *v);
        *value -= scale * *m / (v.sqrt() + LEAST);
    }
}

impl Moments {
    fn zero(layer: &Layer) -> Moments {
        let zeros = |count: usize| [vec![0.0; count], vec![0.0; count]];
        let of = |weights: &Mat<f32>| zeros(weights.nrows() * weights.ncols());
        Moments { weights: layer.weights.each_ref().map(of), bias: zeros(layer.bias.len()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The slope that is propagated back is that of the loss, by differences, times σ.
    #[test]
    fn slopes_by_differences() {
        let truth = Mat::from_fn(2, 1, |axis, _| [0.3f32, -0.2][axis]);
        let outputs = |k: usize, step: f32| {
            Mat::from_fn(OUTPUTS, 1, |i, _| [0.1f32, 0.05, -1.0, -2.0][i] + if i == k { step } else { 0.0 })
        };
        let (_, got) = slope(&outputs(0, 0.0), &truth);
        for k in 0..OUTPUTS {
            let difference = (slope(&outputs(k, 1e-3), &truth).0 - slope(&outputs(k, -1e-3), &truth).0) / 2e-3;
            let sigma = f64::from([-1.0f32, -2.0][k % 2].exp());
            let wanted = sigma * difference;
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
        let mut moments: Vec<Moments> = network.layers.iter().map(Moments::zero).collect();
        let slope = Mat::from_fn(OUTPUTS, 2, |_, _| 1.0f32);
        descend(&mut moved, &mut moments, &network.activations(inputs.clone()), &slope, 1e-3, 0);
        let mut compared = 0;
        for (k, moments) in moments.iter().enumerate() {
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
                    let own = moments.weights[parity][0][col * rows + row] / (1.0 - DECAY[0]);
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
        let mut moments: Vec<Moments> = network.layers.iter().map(Moments::zero).collect();
        let training = Training { steps: 800, rate: 1e-2, ..Default::default() };
        let (mut first, mut last) = (0.0, 0.0);
        for step in 0..training.steps {
            let inputs: Parities = std::array::from_fn(|_| Mat::from_fn(3, 64, |_, _| random.normal() as f32));
            let truth = Mat::from_fn(2, 64, |axis, k| {
                let odd = &inputs[PLACES[axis].0];
                0.5 * odd[(axis, k)] - 0.25 * odd[(2, k)]
            });
            let activations = network.activations(inputs);
            let (loss, slope) = slope(&Network::outputs(&activations[2].parities), &truth);
            descend(&mut network, &mut moments, &activations, &slope, rate(&training, step), step);
            if step == 0 {
                first = loss;
            }
            last = loss;
        }
        assert!(last < first - 3.0, "{first} {last}");
    }

    #[test]
    fn options_out_of_range() {
        let scene = Scene::builtin("sensor-1").unwrap();
        let refused = |training: Training| match train(&scene, Window::of(&scene.sensor), &training, &|_| ()) {
            Err(LearnedError::Option { field, .. }) => field,
            _ => "none",
        };
        assert_eq!(refused(Training { steps: 0, ..Default::default() }), "steps");
        assert_eq!(refused(Training { batch: 0, ..Default::default() }), "batch");
        assert_eq!(refused(Training { contacts: 0, ..Default::default() }), "contacts");
        assert_eq!(refused(Training { hidden: vec![0], ..Default::default() }), "hidden");
        assert_eq!(refused(Training { rate: f64::NAN, ..Default::default() }), "rate");
    }
}
