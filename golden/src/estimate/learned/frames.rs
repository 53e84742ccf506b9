//! Frames: drawn contacts from which the frames of the training are mixed.
//!
//! A contact is kept as three stresses, per unit of its normal load and of its shear along x and y, beside that of the
//! other contacts of its array. Its μ, noise, gains and dead taxels are drawn anew for every frame of the training.
//!
//! | drawn | range |
//! |---|---|
//! | spread of the shear | the training's [`Slip`] |
//! | contacts | [`Draws`], all shapes in turn; one, or in windows around contacts one to four, as many as fit |
//! | μ | 0 … 0.85 mu_max, any direction |
//! | load | times 1 … 2, its logarithm evenly |
//! | share of the others' stress that is left | 1 in half of the frames, −0.1 … 0.1 in the other half |
//! | σ of the noise | 0.005 … 2 % of max \|b\|, its logarithm evenly |
//! | gain spread | none in half of the frames, 0.2 … 3 % in the other half |
//! | dead taxels | the scene's, and in one frame of eight one to three more |
//! | tension | reads 0 where the scene is unipolar |
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: scene | – | – |
//! | out: readings, μ | window × frames, 2 × frames | MPa, of mu_max |

use super::features::Readings;
use crate::data::generator::draws::{DrawOptions, Draws, Shape};
use crate::data::generator::slip::Slip;
use crate::data::generator::support::Support;
use crate::data::generator::GeneratorError;
use crate::estimate::float::objective::taxels::Taxels;
use crate::random::Random;
use crate::spec::scene::Scene;
use crate::spec::window::{Place, Window};
use faer::Mat;
use rayon::prelude::*;
use std::f64::consts::TAU;

/// Largest ratio of shear to normal force, in units of mu_max.
pub(crate) const RATIO: f64 = 0.85;
/// Range of the noise in units of the peak.
pub(crate) const NOISE: [f64; 2] = [5e-5, 2e-2];
/// Range of the gain spread where there is one.
pub(crate) const GAINS: [f64; 2] = [2e-3, 3e-2];
/// Share of the frames with more dead taxels than the scene has.
const DEAD: f64 = 0.125;
/// Largest share of the others' stress that a second round leaves.
const LEFT: f64 = 0.1;
/// Multiplier of the seed: neighbouring seeds have no random numbers in common.
const SPREAD: u64 = 0x9e37_79b9_7f4a_7c15;

/// One contact in its window.
struct Item {
    /// Stress per unit of μ1 and μ2, and without shear: [x, y, z], each of the window's size.
    axes: [Vec<f32>; 3],
    /// Stress of the other contacts; empty if there are none.
    others: Vec<f32>,
    /// Whether the taxel is dead or beyond the array.
    masked: Vec<bool>,
}

/// Drawn contacts.
pub(super) struct Frames {
    window: Window,
    unipolar: bool,
    mu_max: f64,
    items: Vec<Item>,
}

impl Frames {
    /// Draws at least `count` contacts of a scene; `progress` is called with every contact made.
    ///
    /// # Errors
    /// As [`Draws::contacts`].
    pub fn new(
        scene: &Scene,
        window: Window,
        slip: Slip,
        count: usize,
        seed: u64,
        progress: &(dyn Fn() + Sync),
    ) -> Result<Frames, GeneratorError> {
        let shapes = Shape::NAMES.map(|(_, shape)| shape).to_vec();
        let most = match window.place {
            Place::Array => 1,
            Place::Contact => 4,
        };
        let draws = (1..=most)
            .map(|contacts| {
                let ratio = [0.0, RATIO * scene.search.mu_max];
                let shapes = shapes.clone();
                Draws::new(scene, DrawOptions { shapes, contacts, ratio, slip, seed, ..Default::default() })
            })
            .collect::<Result<Vec<_>, _>>()?;
        let array = Taxels::new(&window.sensor(&scene.sensor), scene.medium);
        let frame = |number: usize| -> Result<Vec<Item>, GeneratorError> {
            // Where so many do not fit on the array, fewer.
            let (most, number) = (number % draws.len(), number as u64);
            let fewer = (0..most).rev();
            let contacts = fewer
                .fold(draws[most].contacts(number), |drawn, count| drawn.or_else(|_| draws[count].contacts(number)))?;
            let supports = contacts.iter().map(Support::new).collect::<Result<Vec<_>, _>>()?;
            let mut random = Random::new((seed ^ number << 24).wrapping_mul(SPREAD));
            let own = (0..supports.len()).map(|own| item(scene, window, &array, &supports, own, &mut random));
            progress();
            Ok(own.collect())
        };
        let items: Vec<Vec<Item>> = (0..count).into_par_iter().map(frame).collect::<Result<_, _>>()?;
        let items = items.into_iter().flatten().collect();
        Ok(Frames { window, unipolar: scene.input.unipolar, mu_max: scene.search.mu_max, items })
    }

    /// Mixes `frames` frames: their readings, and μ in units of mu_max.
    pub fn mix(&self, frames: usize, random: &mut Random) -> (Readings, Mat<f32>) {
        let n = self.window.taxels();
        let mut readings = Readings { b: Mat::zeros(n, frames), masked: Mat::zeros(n, frames) };
        let mut truth = Mat::zeros(2, frames);
        for frame in 0..frames {
            let at = (random.between(0.0, self.items.len() as f64) as usize).min(self.items.len() - 1);
            let (size, towards) = (random.between(0.0, RATIO), random.between(0.0, TAU));
            let mu = [size * towards.cos(), size * towards.sin()];
            self.frame(&self.items[at], mu, frame, &mut readings, random);
            for axis in [0, 1] {
                truth[(axis, frame)] = mu[axis] as f32;
            }
        }
        (readings, truth)
    }

    /// One frame of a contact with μ in units of mu_max.
    fn frame(&self, item: &Item, mu: [f64; 2], at: usize, into: &mut Readings, random: &mut Random) {
        let n = self.window.taxels();
        let [x, y] = mu.map(|mu| (mu * self.mu_max) as f32);
        let left = if random.coin() { 1.0 } else { random.between(-LEFT, LEFT) as f32 };
        let other = |t: usize| item.others.get(t).map_or(0.0, |other| left * other);
        let load = random.between(0.0, 1.0).exp2() as f32;
        let exact: Vec<f32> =
            (0..n).map(|t| load * (item.axes[2][t] + x * item.axes[0][t] + y * item.axes[1][t] + other(t))).collect();
        let own_peak = exact.iter().fold(0.0f32, |peak, b| b.abs().max(peak));
        let log = |[low, high]: [f64; 2], random: &mut Random| random.between(low.ln(), high.ln()).exp() as f32;
        let sigma = own_peak * log(NOISE, random);
        let gains = if random.coin() { log(GAINS, random) } else { 0.0 };
        let mut masked = item.masked.clone();
        if random.between(0.0, 1.0) < DEAD {
            for _ in 0..=(random.between(0.0, 3.0) as usize) {
                masked[(random.between(0.0, n as f64) as usize).min(n - 1)] = true;
            }
        }
        for t in 0..n {
            if masked[t] {
                into.masked[(t, at)] = 1.0;
                continue;
            }
            let gain = if gains > 0.0 { 1.0 + gains * random.normal() as f32 } else { 1.0 };
            let b = gain * exact[t] + sigma * random.normal() as f32;
            into.b[(t, at)] = if self.unipolar { b.max(0.0) } else { b };
        }
    }
}

/// Contact `own` of an array in its window.
fn item(scene: &Scene, window: Window, array: &Taxels, supports: &[Support], own: usize, random: &mut Random) -> Item {
    let sensor = &scene.sensor;
    let centre = centre_mm(&supports[own]);
    // Where the estimate of the centre is not exact, the window is the next one.
    let jitter = |pitch: f64, random: &mut Random| random.between(-0.5, 0.5) * pitch;
    let near = [centre[0] + jitter(sensor.pitch_x_mm, random), centre[1] + jitter(sensor.pitch_y_mm, random)];
    let origin = window.origin(sensor, near);
    let middle = window.middle_mm(sensor, origin);
    let taxels = window.taxels_of(sensor, origin);
    let dead = |taxel: usize| scene.input.is_dead([taxel / sensor.cols, taxel % sensor.cols]);
    let masked: Vec<bool> = taxels.iter().map(|taxel| taxel.is_none_or(dead)).collect();
    // Per N along x, y and z.
    let stress = |support: &Support| {
        let mut axes = [(); 3].map(|()| vec![0.0; masked.len()]);
        let mut of_load = [(); 3].map(|()| vec![0.0; masked.len()]);
        for (([x, y], share), of_shear) in support.at_mm.iter().zip(&support.share).zip(&support.shear_share) {
            let at = [x - middle[0], y - middle[1]];
            array.add_unit_forces(at, *of_shear, &mut axes);
            if share != of_shear {
                array.add_unit_forces(at, share - of_shear, &mut of_load);
            }
        }
        axes[2].iter_mut().zip(&of_load[2]).for_each(|(sum, rest)| *sum += rest);
        axes
    };
    let read = |t: usize, b: f64| if masked[t] { 0.0 } else { b as f32 };
    let normal = supports[own].force_N[2];
    let scaled = |axis: Vec<f64>| axis.iter().enumerate().map(|(t, b)| read(t, normal * b)).collect();
    let axes = stress(&supports[own]).map(scaled);
    let mut others = Vec::new();
    for (_, support) in supports.iter().enumerate().filter(|(k, _)| *k != own) {
        let ([x, y, z], [fx, fy, fz]) = (stress(support), support.force_N);
        others.resize(masked.len(), 0.0);
        others.iter_mut().enumerate().for_each(|(t, sum)| *sum += read(t, fx * x[t] + fy * y[t] + fz * z[t]));
    }
    Item { axes, others, masked }
}

/// Centre of pressure of a support.
fn centre_mm(support: &Support) -> [f64; 2] {
    let moment = |axis: usize| support.at_mm.iter().zip(&support.share).map(|(at, share)| at[axis] * share).sum();
    [moment(0), moment(1)]
}
