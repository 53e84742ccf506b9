//! Unlike: how surely frames unlike a network's training are flagged, and how seldom those like it.
//!
//! | frame | stress |
//! |---|---|
//! | like the training | contacts as the training draws them: all shapes, one, or with a window around each one to four; gains that differ in every other frame; at a level of noise |
//! | checkerboard, of ±1, of 0 and 1 | of single taxels, with 2 % noise |
//! | taxels permuted, every other row shifted, sign reversed | a frame like the training in another order or of the other sign |
//! | one taxel alone | all others read noise |
//! | taxel stuck, row stuck, row reads 0 | a frame like the training with a taxel or a row at its peak, or the peak's row at 0 |
//! | offset, plane | a frame like the training with 0.3 of its peak added, on all taxels or from −0.3 to 0.3 along the columns |
//! | friction of 2 mu_max | contacts whose shear is twice what the network knows |
//! | cover twice as thick, half as thick | contacts on another cover than the scene states |
//! | noise alone, noise of 5 %, of 10 % | no contact; a frame like the training with more noise than any of it |
//!
//! | | unit |
//! |---|---|
//! | in: scene with a network, estimators | – |
//! | out: per kind, median misfit over its limit | – |
//! | out: share with `misfit`, the noise not stated and stated; share with any flag | fraction |

use super::shapes::Candidate;
use super::statistic::{quantile, Interval};
use super::StudyError;
use crate::steps::steps;
use dermis_golden::data::frame::Frame;
use dermis_golden::data::generator::converter::Converter;
use dermis_golden::data::generator::draws::{ContactShape, DrawOptions, Draws};
use dermis_golden::data::generator::GeneratorError;
use dermis_golden::estimate::float::Golden;
use dermis_golden::estimate::learned::{LearnedError, Signature, GAINS, NOISE, RATIO};
use dermis_golden::estimate::misfit::Misfit;
use dermis_golden::random::Random;
use dermis_golden::result::flags::Flag;
use dermis_golden::spec::scene::{EstimatorKind, Scene};
use dermis_golden::spec::window::Place;
use rayon::prelude::*;
use serde::Serialize;

/// Share of the frames like the training whose misfit is within the limit.
const WITHIN: f64 = 0.998;
/// Noise of a frame like the training before it is changed, over max |b|.
const QUIET: f64 = 2e-3;
/// Noise levels of the frames like the training.
const LEVELS: [f64; 4] = [0.0, 1e-3, 5e-3, 2e-2];
/// Offset and largest value of the plane in units of the peak.
const OFFSET: f64 = 0.3;
/// Multiplier of the seed: neighbouring seeds have no random numbers in common.
const SPREAD: u64 = 0x9e37_79b9_7f4a_7c15;

/// Kind of a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    Like(f64),
    Signs,
    Checkerboard,
    Permuted,
    Shifted,
    Reversed,
    Alone,
    StuckTaxel,
    StuckRow,
    ZeroRow,
    Offset,
    Plane,
    Friction,
    Thickness(f64),
    Noise,
    Loud(f64),
}

/// One line of the table.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct UnlikeRow {
    /// The kind of frame.
    pub frame: String,
    /// Name of the estimator in scenes, or `hardware`.
    pub estimator: String,
    /// Number of frames.
    pub frames: usize,
    /// Median of [`network_misfit`](dermis_golden::result::checks::Checks::network_misfit), the noise not stated; `None` if the network
    /// was evaluated for none.
    pub misfit: Option<f64>,
    /// Share of frames with the flag `misfit`.
    pub flagged: Interval,
    /// The same, had the scene stated the noise.
    pub flagged_if_stated: Interval,
    /// Share of frames with any flag.
    pub any: Interval,
}

/// A frame and its noise.
struct Reading {
    frame: Frame,
    noise_MPa: f64,
}

/// Frames as a network's training draws them.
struct Like<'a> {
    scene: &'a Scene,
    seed: u64,
    /// Largest number of contacts of a frame.
    most: usize,
}

impl Kind {
    fn all() -> Vec<Kind> {
        use Kind::*;
        let changed = [Signs, Checkerboard, Permuted, Shifted, Reversed, Alone, StuckTaxel, StuckRow, ZeroRow];
        let other = [Offset, Plane, Friction, Thickness(2.0), Thickness(0.5), Loud(0.05), Loud(0.1), Noise];
        LEVELS.map(Like).into_iter().chain(changed).chain(other).collect()
    }

    fn name(self) -> String {
        let fixed = match self {
            Kind::Like(level) => return format!("like the training, noise {} %", 100.0 * level),
            Kind::Loud(level) => return format!("noise of {} %", 100.0 * level),
            Kind::Thickness(factor) if factor > 1.0 => "cover twice as thick",
            Kind::Thickness(_) => "cover half as thick",
            Kind::Signs => "checkerboard of ±1",
            Kind::Checkerboard => "checkerboard of 0 and 1",
            Kind::Permuted => "taxels permuted",
            Kind::Shifted => "every other row shifted",
            Kind::Reversed => "sign reversed",
            Kind::Alone => "one taxel alone",
            Kind::StuckTaxel => "taxel stuck",
            Kind::StuckRow => "row stuck",
            Kind::ZeroRow => "row reads 0",
            Kind::Offset => "offset",
            Kind::Plane => "plane",
            Kind::Friction => "friction of 2 mu_max",
            Kind::Noise => "noise alone",
        };
        fixed.to_owned()
    }

    /// Changes the stress of a frame like the training.
    fn change(self, frame: &mut Frame, random: &mut Random) {
        let (cols, rows, n) = (frame.sensor.cols, frame.sensor.rows, frame.stress_MPa.len());
        let peak = frame.peak_MPa();
        let before = frame.stress_MPa.clone();
        let b = &mut frame.stress_MPa;
        let any = |random: &mut Random, count: usize| (random.between(0.0, count as f64) as usize).min(count - 1);
        let is_dark = |t: usize| (t / cols + t % cols) % 2 == 1;
        match self {
            Kind::Like(_) | Kind::Friction | Kind::Thickness(_) => (),
            Kind::Signs | Kind::Checkerboard => {
                let dark = if self == Kind::Signs { -1.0 } else { 0.0 };
                (0..n).for_each(|t| b[t] = if is_dark(t) { dark } else { 1.0 } + NOISE[1] * random.normal());
            }
            Kind::Permuted => (1..n).rev().for_each(|t| b.swap(t, any(random, t + 1))),
            Kind::Shifted => {
                let from = |t: usize| t / cols * cols + (t % cols + 2 * (t / cols % 2)) % cols;
                (0..n).for_each(|t| b[t] = before[from(t)]);
            }
            Kind::Reversed => b.iter_mut().for_each(|b| *b = -*b),
            Kind::Alone => {
                b.iter_mut().for_each(|b| *b = QUIET * peak * random.normal());
                b[any(random, n)] = peak;
            }
            Kind::StuckTaxel => b[any(random, n)] = peak,
            Kind::StuckRow => {
                let row = any(random, rows);
                b[row * cols..(row + 1) * cols].fill(peak);
            }
            Kind::ZeroRow => {
                let row = before.iter().position(|b| b.abs() == peak).unwrap_or(0) / cols;
                b[row * cols..(row + 1) * cols].fill(0.0);
            }
            Kind::Offset => b.iter_mut().for_each(|b| *b += OFFSET * peak),
            Kind::Plane => {
                let along = |t: usize| 2.0 * (t / cols) as f64 / (rows.max(2) - 1) as f64 - 1.0;
                (0..n).for_each(|t| b[t] += OFFSET * peak * along(t));
            }
            Kind::Noise => b.iter_mut().for_each(|b| *b = peak * random.normal()),
            Kind::Loud(level) => b.iter_mut().for_each(|b| *b += level * peak * random.normal()),
        }
    }
}

impl Like<'_> {
    fn new(scene: &Scene, seed: u64) -> Like<'_> {
        let most = match Signature::of(scene).window.place {
            Place::Array => 1,
            Place::Contact => 4,
        };
        Like { scene, seed, most }
    }

    /// A frame of contacts on the array of `scene`, with friction of `ratio` times mu_max, as read with this noise.
    fn read(&self, scene: &Scene, number: u64, ratio: [f64; 2], noise: f64) -> Result<Reading, GeneratorError> {
        let wanted = 1 + (number % self.most as u64) as usize;
        let draw = |contacts: usize| {
            let shapes = ContactShape::NAMES.map(|(_, shape)| shape).to_vec();
            let ratio = ratio.map(|ratio| ratio * scene.search.mu_max);
            Draws::new(scene, DrawOptions { shapes, contacts, ratio, seed: self.seed, ..Default::default() })?
                .frame(number)
        };
        // Where so many do not fit on the array, fewer.
        let drawn = (1..wanted).rev().fold(draw(wanted), |drawn, contacts| drawn.or_else(|_| draw(contacts)))?;
        let mut random = self.random(number);
        let gain_spread = if random.coin() { logarithmic(GAINS, &mut random) } else { 0.0 };
        let seed = self.seed.wrapping_mul(SPREAD) ^ number;
        let unipolar = self.scene.input.unipolar;
        let read = drawn.read(&Converter { noise, gain_spread, unipolar, seed, ..Default::default() })?;
        // Stress alone, of the sensor that is stated.
        let frame = Frame::from_stress(&read.id, &self.scene.sensor, read.stress_MPa);
        let frame = frame.map_err(|_| GeneratorError::NotFinite { index: 0 })?;
        Ok(Reading { frame, noise_MPa: noise * drawn.peak_MPa() })
    }

    fn random(&self, number: u64) -> Random {
        Random::new(self.seed.wrapping_add(number << 20).wrapping_mul(SPREAD))
    }

    /// A frame with any noise of the training.
    fn any_noise(&self, number: u64) -> Result<Reading, GeneratorError> {
        let noise = logarithmic(NOISE, &mut self.random(number ^ 1 << 40));
        self.read(self.scene, number, [0.0, RATIO], noise)
    }

    fn of(&self, kind: Kind, number: u64) -> Result<Reading, GeneratorError> {
        let (scene, trained) = (self.scene, [0.0, RATIO]);
        let mut reading = match kind {
            Kind::Like(level) => self.read(scene, number, trained, level),
            Kind::Friction => self.read(scene, number, [2.0; 2], QUIET),
            Kind::Thickness(factor) => {
                let mut other = scene.clone();
                other.sensor.thickness_mm *= factor;
                self.read(&other, number, trained, QUIET)
            }
            _ => self.read(scene, number, trained, QUIET),
        }?;
        kind.change(&mut reading.frame, &mut self.random(number ^ 1 << 41));
        if scene.input.unipolar {
            reading.frame.stress_MPa.iter_mut().for_each(|b| *b = b.max(0.0));
        }
        Ok(reading)
    }
}

/// Between two numbers, the logarithm evenly.
fn logarithmic([low, high]: [f64; 2], random: &mut Random) -> f64 {
    random.between(low.ln(), high.ln()).exp()
}

/// The limit of [`Misfit`] for the network that `scene` names: 99.8 % of `frames` frames as its training draws them are
/// within it, their noise stated. `None` if the network was evaluated for none. The frames depend on `seed`.
///
/// # Errors
/// [`StudyError`]: a scene without such a network, or on which no contacts fit.
pub fn misfit_limit(
    scene: &Scene,
    frames: usize,
    seed: u64,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<Option<f64>, StudyError> {
    // The network alone is faster than the most probable forces at the same μ; not every scene has it.
    let golden =
        Golden::with(scene, EstimatorKind::Network).or_else(|_| Golden::with(scene, EstimatorKind::EvidenceNetwork))?;
    let (misfit, like) = (Misfit::new(scene, 1.0), Like::new(scene, seed));
    let step = steps(progress, frames);
    let one = |number: u64| -> Result<Option<f64>, StudyError> {
        let Reading { frame, noise_MPa } = like.any_noise(number)?;
        let own = misfit.of(&golden.run(&frame)?, &frame, noise_MPa);
        step();
        Ok(own)
    };
    let all: Vec<Option<f64>> = (0..frames as u64).into_par_iter().map(one).collect::<Result<_, _>>()?;
    let mut all: Vec<f64> = all.into_iter().flatten().collect();
    all.sort_by(f64::total_cmp);
    Ok(Some(quantile(&all, WITHIN)).filter(|limit| *limit > 0.0))
}

/// Draws `draws` frames of every kind, and counts those that `estimators` flag; `progress` is called after every frame with
/// the number of frames done and of all.
///
/// # Errors
/// [`StudyError`]: a scene that is refused, or whose network has no limit, contacts that do not fit, or no frames.
pub fn unlike_study(
    scene: &Scene,
    draws: usize,
    seed: u64,
    estimators: &[Candidate],
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<Vec<UnlikeRow>, StudyError> {
    super::study::check_parameters(draws, 1, &[])?;
    // No noise is stated, and the hardware takes no noise floor without a full scale.
    let mut scene = scene.clone();
    scene.search.noise_floor_MPa = Some(0.0);
    let Some(misfit) = Misfit::of_scene(&scene, scene.model_estimator()).map_err(golden)? else {
        let value = scene.search.network.as_ref().map_or("none".to_owned(), |path| path.display().to_string());
        let allowed =
            "a network with a limit of the misfit (dermis train --limit-of adds it), and search.estimator = network or evidence+network";
        return Err(StudyError::Parameter { field: "search.network", value, allowed });
    };
    let kinds = Kind::all();
    let like = Like::new(&scene, seed);
    let step = steps(progress, kinds.len() * estimators.len() * draws);
    let mut rows = Vec::new();
    for &candidate in estimators {
        let named = candidate.stated(&scene);
        let run = candidate.run(&named)?;
        for &kind in &kinds {
            let one = |number: u64| -> Result<(Option<f64>, [bool; 3]), StudyError> {
                let Reading { frame, noise_MPa } = like.of(kind, number)?;
                let result = run(&frame)?;
                let stated = misfit.of(&result, &frame, noise_MPa).is_some_and(|misfit| misfit > 1.0);
                step();
                let flagged = result.flags.contains(&Flag::Misfit);
                Ok((result.checks.network_misfit, [flagged, stated, !result.flags.is_empty()]))
            };
            let all: Vec<_> = (0..draws as u64).into_par_iter().map(one).collect::<Result<_, _>>()?;
            let mut figures: Vec<f64> = all.iter().filter_map(|(misfit, _)| *misfit).collect();
            figures.sort_by(f64::total_cmp);
            let share =
                |k: usize| Interval::share(&all.iter().map(|(_, flagged)| vec![flagged[k]]).collect::<Vec<_>>());
            rows.push(UnlikeRow {
                frame: kind.name(),
                estimator: candidate.name(&scene),
                frames: draws,
                misfit: (!figures.is_empty()).then(|| quantile(&figures, 0.5)),
                flagged: share(0),
                flagged_if_stated: share(1),
                any: share(2),
            });
        }
    }
    Ok(rows)
}

fn golden(error: LearnedError) -> StudyError {
    StudyError::Golden(error.into())
}
