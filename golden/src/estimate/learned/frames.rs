//! Frames: drawn contacts from which the frames of the training are mixed.
//!
//! A contact is kept as three stresses, per unit of its normal load and of its shear along x and y, beside that of the
//! other contacts of its array. Its μ, noise, gains and dead taxels are drawn anew for every frame of the training.
//!
//! | drawn | range |
//! |---|---|
//! | spread of the shear | the training's [`Slip`] |
//! | cover | the scene's, or 16 of them spread evenly over the training's tolerances of thickness and Poisson ratio |
//! | contacts | [`Draws`], all shapes in turn; one, or in windows around contacts one to four, as many as fit |
//! | μ | 0 … 0.85 mu_max, any direction |
//! | load | times 1 … 2, its logarithm evenly |
//! | share of the others' stress that is left | 1 in half of the frames, −0.1 … 0.1 in the other half |
//! | σ of the noise | 0.005 … 2 % of max \|b\|, its logarithm evenly |
//! | gain spread | none in half of the frames, 0.2 … 3 % in the other half |
//! | baseline | none in three of four frames, else [`crate::physics::smooth`], at most 0.1 … 3 % of max \|b\|, its logarithm evenly |
//! | dead taxels | the scene's, and in one frame of eight one to three more |
//! | tension | reads 0 where the scene is unipolar |
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: scene | – | – |
//! | out: readings, μ | window × frames, 2 × frames | MPa, of mu_max |

use super::features::Readings;
use super::options::Training;
use crate::data::generator::draws::{ContactShape, DrawOptions, Draws};
use crate::data::generator::support::Support;
use crate::data::generator::GeneratorError;
use crate::estimate::float::objective::taxels::Taxels;
use crate::physics::smooth::{terms, TERMS};
use crate::random::Random;
use crate::spec::scene::{Medium, Scene};
use crate::spec::sensor::Sensor;
use crate::spec::window::{Place, Window};
use faer::Mat;
use rayon::prelude::*;
use std::f64::consts::TAU;

/// Largest ratio of shear to normal force, in units of mu_max.
pub const RATIO: f64 = 0.85;
/// Range of the noise in units of the peak.
pub const NOISE: [f64; 2] = [5e-5, 2e-2];
/// Range of the gain spread where there is one.
pub const GAINS: [f64; 2] = [2e-3, 3e-2];
/// Share of the frames with a baseline.
const DRIFTED: f64 = 0.25;
/// Range of the largest entry of a baseline in units of the peak.
const BASELINE: [f64; 2] = [1e-3, 3e-2];
/// Share of the frames with more dead taxels than the scene has.
const DEAD: f64 = 0.125;
/// Largest share of the others' stress that a second round leaves.
const LEFT: f64 = 0.1;
/// Range of the Poisson ratios of a tolerance.
const POISSON: [f64; 2] = [0.01, 0.499];
/// Contacts that are kept, each some 1.5 kB.
const KEPT: usize = 1 << 16;
/// Covers over which tolerances are spread.
const COVERS: usize = 16;
/// Normally distributed numbers from which noise and gains are taken: drawing as many anew costs as much as the rest of a step.
const NORMALS: usize = 1 << 18;
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

/// Contacts that are drawn one after the other, and the frames mixed from those that there are.
pub(super) struct Frames {
    scene: Scene,
    window: Window,
    seed: u64,
    /// Those of one, two, … contacts.
    draws: Vec<Draws>,
    /// The window under each of the covers.
    covers: Vec<Taxels>,
    /// Number of the next array.
    next: u64,
    /// Contacts drawn so far.
    drawn: usize,
    items: Vec<Item>,
    /// The smooth terms on each taxel of the window.
    smooth: Vec<[f32; TERMS]>,
    /// Normally distributed; the noise of a frame begins anywhere in it.
    normals: Vec<f32>,
}

impl Frames {
    /// No contacts yet, of a scene and a training; `seed` is that of the contacts.
    ///
    /// # Errors
    /// As [`Draws::new`].
    pub fn new(scene: &Scene, window: Window, training: &Training, seed: u64) -> Result<Frames, GeneratorError> {
        let most = match window.place {
            Place::Array => 1,
            Place::Contact => 4,
        };
        let draws = (1..=most)
            .map(|contacts| {
                let (ratio, shapes) =
                    ([0.0, RATIO * scene.search.mu_max], ContactShape::NAMES.map(|(_, shape)| shape).to_vec());
                let slip = training.slip;
                Draws::new(scene, DrawOptions { shapes, contacts, ratio, slip, seed, ..Default::default() })
            })
            .collect::<Result<_, _>>()?;
        let mut random = Random::new(seed.wrapping_mul(SPREAD));
        let normals = (0..NORMALS).map(|_| random.normal() as f32).collect();
        let covers = covers(scene, window, training, &mut random);
        let sensor = window.sensor(&scene.sensor);
        let smooth = (0..window.taxels()).map(|taxel| terms(&sensor, taxel).map(|term| term as f32)).collect();
        let scene = scene.clone();
        Ok(Frames { scene, window, seed, draws, covers, next: 0, drawn: 0, items: Vec::new(), smooth, normals })
    }

    /// Draws until at least `count` contacts have been drawn; the last [`KEPT`] of them are mixed.
    ///
    /// # Errors
    /// As [`Draws::contacts`].
    pub fn draw(&mut self, count: usize) -> Result<(), GeneratorError> {
        while self.drawn < count {
            let arrays = (count - self.drawn).min(KEPT).div_ceil(self.draws.len()) as u64;
            let numbers = self.next..self.next + arrays;
            let items: Vec<Vec<Item>> =
                numbers.into_par_iter().map(|number| self.array(number)).collect::<Result<_, _>>()?;
            for item in items.into_iter().flatten() {
                match self.items.get_mut(self.drawn % KEPT) {
                    Some(oldest) => *oldest = item,
                    None => self.items.push(item),
                }
                self.drawn += 1;
            }
            self.next += arrays;
        }
        Ok(())
    }

    /// The contacts of an array, each in its window.
    fn array(&self, number: u64) -> Result<Vec<Item>, GeneratorError> {
        // Where so many do not fit on the array, fewer.
        let most = number as usize % self.draws.len();
        let contacts = (0..most).rev().fold(self.draws[most].contacts(number), |drawn, count| {
            drawn.or_else(|_| self.draws[count].contacts(number))
        })?;
        let supports = contacts.iter().map(Support::new).collect::<Result<Vec<_>, _>>()?;
        let mut random = Random::new((self.seed ^ number << 24).wrapping_mul(SPREAD));
        let cover = (random.between(0.0, self.covers.len() as f64) as usize).min(self.covers.len() - 1);
        let (scene, window, cover) = (&self.scene, self.window, &self.covers[cover]);
        Ok((0..supports.len()).map(|own| item(scene, window, cover, &supports, own, &mut random)).collect())
    }

    /// Mixes `frames` frames of the contacts drawn so far: their readings, and μ in units of mu_max. `noise` is the range of
    /// the noise in units of the peak.
    pub fn mix(&self, frames: usize, noise: [f64; 2], random: &mut Random) -> (Readings, Mat<f32>) {
        let n = self.window.taxels();
        let mut readings = Readings { b: Mat::zeros(n, frames), masked: Mat::zeros(n, frames) };
        let mut truth = Mat::zeros(2, frames);
        for frame in 0..frames {
            let at = (random.between(0.0, self.items.len() as f64) as usize).min(self.items.len() - 1);
            let (size, towards) = (random.between(0.0, RATIO), random.between(0.0, TAU));
            let mu = [size * towards.cos(), size * towards.sin()];
            let into = [readings.b.col_as_slice_mut(frame), readings.masked.col_as_slice_mut(frame)];
            self.frame(&self.items[at], mu, noise, into, random);
            for axis in [0, 1] {
                truth[(axis, frame)] = mu[axis] as f32;
            }
        }
        (readings, truth)
    }

    /// One frame of a contact with μ in units of mu_max: its readings and its mask.
    fn frame(&self, item: &Item, mu: [f64; 2], noise: [f64; 2], into: [&mut [f32]; 2], random: &mut Random) {
        let ([b, masked], n) = (into, self.window.taxels());
        let [x, y] = mu.map(|mu| (mu * self.scene.search.mu_max) as f32);
        let left = if random.coin() { 1.0 } else { random.between(-LEFT, LEFT) as f32 };
        let load = random.between(0.0, 1.0).exp2() as f32;
        let [of_x, of_y, of_z] = &item.axes;
        for (((b, of_x), of_y), of_z) in b.iter_mut().zip(of_x).zip(of_y).zip(of_z) {
            *b = load * (of_z + x * of_x + y * of_y);
        }
        b.iter_mut().zip(&item.others).for_each(|(b, other)| *b += load * left * other);
        let peak = b.iter().fold(0.0f32, |peak, b| b.abs().max(peak));
        let log = |[low, high]: [f64; 2], random: &mut Random| random.between(low.ln(), high.ln()).exp() as f32;
        let sigma = peak * log(noise, random);
        let gains = if random.coin() { log(GAINS, random) } else { 0.0 };
        let [first, second] = [(); 2].map(|()| self.normals(n, random));
        for ((b, gain), noise) in b.iter_mut().zip(first).zip(second) {
            *b = (1.0 + gains * gain) * *b + sigma * noise;
        }
        if random.between(0.0, 1.0) < DRIFTED {
            self.add_baseline(b, peak * log(BASELINE, random), random);
        }
        masked.iter_mut().zip(&item.masked).for_each(|(own, masked)| *own = f32::from(u8::from(*masked)));
        if random.between(0.0, 1.0) < DEAD {
            for _ in 0..=(random.between(0.0, 3.0) as usize) {
                masked[(random.between(0.0, n as f64) as usize).min(n - 1)] = 1.0;
            }
        }
        let least = if self.scene.input.unipolar { 0.0 } else { f32::NEG_INFINITY };
        b.iter_mut().zip(masked.iter()).for_each(|(b, masked)| *b = if *masked > 0.0 { 0.0 } else { b.max(least) });
    }

    /// Adds smooth terms of random sizes, the largest entry of whose sum is `largest`.
    fn add_baseline(&self, b: &mut [f32], largest: f32, random: &mut Random) {
        let sizes: [f32; TERMS] = std::array::from_fn(|_| random.normal() as f32);
        let at = |terms: &[f32; TERMS]| -> f32 { terms.iter().zip(sizes).map(|(term, size)| term * size).sum() };
        let most = self.smooth.iter().map(|terms| at(terms).abs()).fold(f32::MIN_POSITIVE, f32::max);
        b.iter_mut().zip(&self.smooth).for_each(|(b, terms)| *b += largest / most * at(terms));
    }

    /// `count` of the normally distributed numbers, from anywhere.
    fn normals(&self, count: usize, random: &mut Random) -> &[f32] {
        let first = random.between(0.0, (self.normals.len() - count) as f64) as usize;
        &self.normals[first..first + count]
    }
}

/// The window under covers as they may be: as stated, or spread evenly over the tolerances.
fn covers(scene: &Scene, window: Window, training: &Training, random: &mut Random) -> Vec<Taxels> {
    let (sensor, medium) = (window.sensor(&scene.sensor), scene.medium);
    let Training { poisson_tolerance, thickness_tolerance, .. } = *training;
    if poisson_tolerance == 0.0 && thickness_tolerance == 0.0 {
        return vec![Taxels::new(&sensor, medium)];
    }
    let cover = |index: usize| {
        // The values of one are in even steps, those of the other at random.
        let even = (index as f64 + 0.5) / COVERS as f64 * 2.0 - 1.0;
        let thickness_mm = sensor.thickness_mm * (1.0 + thickness_tolerance * random.between(-1.0, 1.0));
        let medium = match medium {
            Medium::HalfSpace => medium,
            Medium::BondedLayer { poisson } => {
                let poisson = poisson + poisson_tolerance * even;
                Medium::BondedLayer { poisson: poisson.clamp(POISSON[0], POISSON[1]) }
            }
        };
        Taxels::new(&Sensor { thickness_mm, ..sensor.clone() }, medium)
    };
    (0..COVERS).map(cover).collect()
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
