//! Presses: errors and lag of the shear over whole presses, frame by frame and with each kind of mean.
//!
//! ```text
//! press ── frames in their order ─┬─ each alone
//!                                 ├─ sliding mean of 2^4 ─── errors, lag, share of frames in which the template held
//!                                 └─ adaptive mean
//! ```
//! A frame counts from [`SETTLED_S`] on and where the shear is above a quarter of the press's largest. The lag is the one at which the
//! shear of the results is nearest to the true shear so many frames before.
//!
//! | | unit | |
//! |---|---|---|
//! | in: scene, motions, presses of each, levels, means | – | the noise is not stated; the gains differ, the codes are coarse as [`PressStudy`] has it |
//! | out: e_t median and 90 % quantile | fraction | of the resultant |
//! | out: lag | frames | – |
//! | out: bound of a frame and of the longest mean | fraction | median of drawn errors, pressure unknown and support known ([`support_bound`](super::support_bound)) |

use super::statistic::quantile;
use super::support_bound::{Reading, SupportBound};
use super::StudyError;
use crate::steps::steps;
use dermis_golden::data::frame::Frame;
use dermis_golden::data::generator::converter::Converter;
use dermis_golden::data::generator::draws::DrawOptions;
use dermis_golden::data::generator::presses::{Motion, Press};
use dermis_golden::data::generator::support::Kernels;
use dermis_golden::engine::{Engine, State};
use dermis_golden::estimate::float::Golden;
use dermis_golden::fixed::Model;
use dermis_golden::random::Random;
use dermis_golden::result::errors::Errors;
use dermis_golden::result::reconstruct::Reconstruction;
use dermis_golden::spec::scene::{EstimatorKind, MeanKind, Scene};
use rayon::prelude::*;
use serde::Serialize;

/// Time after which frames count: the longest mean has settled.
const SETTLED_S: f64 = 0.1;
/// Share of the press's largest shear above which a frame counts.
const COUNTS: f64 = 0.25;
/// Deviation of the true shear over its size below which there is no lag to find.
const LEAST_CHANGE: f64 = 0.1;
/// Largest lag that is looked for, in frames.
const LONGEST_LAG: usize = 60;
/// Frames of the longest adaptive mean.
const LONGEST_MEAN: f64 = 127.0;
/// Errors drawn from the bound's covariance.
const BOUND_DRAWS: usize = 400;

/// How the frames of a press are averaged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Averaged {
    /// Each frame alone.
    Single,
    /// `mean = "sliding"` with this `average`.
    Sliding(u32),
    /// `mean = "adaptive"`.
    Adaptive,
}

impl Averaged {
    /// The name in tables.
    pub fn name(self) -> String {
        match self {
            Averaged::Single => "single frame".to_string(),
            Averaged::Sliding(average) => format!("sliding {}", 1 << average),
            Averaged::Adaptive => "adaptive".to_string(),
        }
    }

    /// The scene with this mean.
    fn stated(self, scene: &Scene) -> Scene {
        let mut scene = scene.clone();
        (scene.input.mean, scene.input.average) = match self {
            Averaged::Single => (MeanKind::Block, 0),
            Averaged::Sliding(average) => (MeanKind::Sliding, average),
            Averaged::Adaptive => (MeanKind::Adaptive, 0),
        };
        scene
    }
}

/// Which engine reconstructs a press.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PressEngine {
    /// The floating-point model with this estimator.
    Golden(EstimatorKind),
    /// The bit-true model of the scene's hardware; its adaptive mean has no template.
    Fixed,
}

/// Parameters of a study.
#[derive(Clone, Debug)]
pub struct PressStudy {
    /// What the contacts do.
    pub motions: Vec<Motion>,
    /// Number of presses of each motion.
    pub presses: u64,
    /// Noise levels σ over the press's largest |b|.
    pub levels: Vec<f64>,
    /// Engines.
    pub engines: Vec<PressEngine>,
    /// Means.
    pub means: Vec<Averaged>,
    /// Frames, rate, speed, shapes, loads, shears, gains and codes; its motion and noise are not used.
    pub press: Press,
}

impl Default for PressStudy {
    fn default() -> Self {
        let converter = Converter { gain_spread: 0.01, bits: Some(10), ..Converter::default() };
        let draw = DrawOptions { ratio: [0.3, 0.5], converter, ..DrawOptions::default() };
        PressStudy {
            motions: Motion::LASTING.to_vec(),
            presses: 3,
            levels: vec![0.01],
            engines: vec![PressEngine::Golden(EstimatorKind::Network)],
            means: vec![Averaged::Single, Averaged::Sliding(4), Averaged::Adaptive],
            press: Press { draw, ..Press::new(Motion::Hold) },
        }
    }
}

/// One line of the table.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct PressRow {
    /// Noise level over the press's largest |b|.
    pub noise: f64,
    /// The estimator, or `hardware`.
    pub estimator: String,
    /// How frames are averaged.
    pub mean: String,
    /// The motion; `all` for all together.
    pub motion: &'static str,
    /// Number of frames that count.
    pub frames: usize,
    /// Median and 90 % quantile of e_t, fractions.
    pub tangential: [f64; 2],
    /// Median of the lags of the presses in frames; `None` where the shear does not change.
    pub lag_frames: Option<f64>,
    /// Share of the frames in which the template held; `None` without one.
    pub held: Option<f64>,
    /// Share of the components of the shear within one standard deviation; `None` without standard deviations.
    pub within_1: Option<f64>,
    /// Median e_t that the bound allows for a frame alone, and for the mean of 127 frames of the same press; `None` for all together.
    pub bound: Option<[f64; 2]>,
}

/// What an engine has made of a press.
struct Followed {
    errors: Vec<f64>,
    lag_frames: Option<f64>,
    held: Vec<bool>,
    within: Vec<bool>,
}

/// Runs a study; `progress` is called after every press with the number done and of all. Rows by level, engine, mean and motion,
/// several motions together last.
///
/// ```
/// use dermis_golden::{data::generator::presses::{Motion, Press}, spec::scene::Scene};
/// use dermis_study::noise::{press_study, Averaged, PressStudy};
///
/// let all = PressStudy::default();
/// let press = Press { frames: 240, ..all.press };
/// let means = vec![Averaged::Single, Averaged::Adaptive];
/// let small = PressStudy { motions: vec![Motion::Hold], presses: 1, means, press, ..all };
/// let rows = press_study(&Scene::builtin("sensor-1-noisy")?, &small, &|_, _| ())?;
/// // A contact that holds has a third of the error of a single frame.
/// assert!(rows[1].motion == "hold" && rows[1].tangential[0] < 0.33 * rows[0].tangential[0]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`StudyError`]: a scene that an engine refuses, presses that cannot be drawn, a parameter out of range.
pub fn press_study(
    scene: &Scene,
    study: &PressStudy,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<Vec<PressRow>, StudyError> {
    super::study::check_parameters(study.presses as usize, 1, &study.levels)?;
    let total =
        study.levels.len() * study.engines.len() * study.means.len() * study.motions.len() * study.presses as usize;
    let step = steps(progress, total);
    let mut rows = Vec::new();
    for &noise in &study.levels {
        let drawn = draw(scene, study, noise)?;
        let bounds = study.motions.iter().map(|motion| {
            let presses: Vec<&Drawn> = drawn.iter().filter(|press| press.motion == *motion).collect();
            bound(scene, &presses, study.press.draw.converter.gain_spread)
        });
        let bounds = bounds.collect::<Result<Vec<_>, _>>()?;
        for (&kind, &mean) in study.engines.iter().flat_map(|kind| study.means.iter().map(move |mean| (kind, mean))) {
            let mut stated = mean.stated(scene);
            stated.input.template &= kind != PressEngine::Fixed;
            let engine: Box<dyn Engine + Send + Sync> = match kind {
                PressEngine::Golden(estimator) => Box::new(Golden::with(&stated, estimator)?),
                PressEngine::Fixed => Box::new(Model::for_frames(&stated, &largest(&drawn))?),
            };
            let follow = |press: &Drawn| -> Result<Followed, StudyError> {
                let followed = follow(&*engine, press, study.press.rate_Hz)?;
                step();
                Ok(followed)
            };
            let all = drawn.par_iter().map(follow).collect::<Result<Vec<Followed>, _>>()?;
            let estimator = match kind {
                PressEngine::Golden(estimator) => estimator.name().to_string(),
                PressEngine::Fixed => "hardware".to_string(),
            };
            let row = |motion: &'static str, followed: &[&Followed], bound| {
                let named = PressRow {
                    noise,
                    estimator: estimator.clone(),
                    mean: mean.name(),
                    motion,
                    bound,
                    ..Default::default()
                };
                named.with_figures(followed)
            };
            for (motion, bound) in std::iter::zip(&study.motions, &bounds) {
                let of_motion = drawn.iter().zip(&all).filter(|(drawn, _)| drawn.motion == *motion);
                rows.push(row(motion.name(), &of_motion.map(|(_, followed)| followed).collect::<Vec<_>>(), *bound));
            }
            if study.motions.len() > 1 {
                rows.push(row("all", &all.iter().collect::<Vec<_>>(), None));
            }
        }
    }
    Ok(rows)
}

/// A drawn press.
struct Drawn {
    motion: Motion,
    frames: Vec<Frame>,
    /// σ in MPa.
    noise_MPa: f64,
}

fn draw(scene: &Scene, study: &PressStudy, noise: f64) -> Result<Vec<Drawn>, StudyError> {
    let all = study.motions.iter().flat_map(|motion| (0..study.presses).map(move |number| (*motion, number)));
    let one = |(motion, number)| {
        let press = Press { motion, ..study.press.clone() };
        let exact = press.exact(scene, number)?;
        let peak_MPa = exact.iter().map(Frame::peak_MPa).fold(0.0, f64::max);
        let press = press.with_noise(noise);
        Ok(Drawn { motion, frames: press.read(exact, number)?, noise_MPa: noise * peak_MPa })
    };
    all.collect::<Vec<_>>().into_par_iter().map(one).collect()
}

/// The frame of each press with the largest reading.
fn largest(drawn: &[Drawn]) -> Vec<Frame> {
    let most = |own: &Drawn| own.frames.iter().max_by(|a, b| a.peak_MPa().total_cmp(&b.peak_MPa())).cloned();
    drawn.iter().filter_map(most).collect()
}

/// Reconstructs a press frame by frame.
fn follow(engine: &dyn Engine, drawn: &Drawn, rate_Hz: f64) -> Result<Followed, StudyError> {
    let mut state = State::default();
    let next = |frame: &Frame| engine.reconstruct_after(&mut state, std::slice::from_ref(frame));
    let results = drawn.frames.iter().map(next).collect::<Result<Vec<Reconstruction>, _>>()?;
    let truth: Vec<[f64; 3]> = drawn.frames.iter().map(|frame| frame.resultant_N.unwrap_or_default()).collect();
    let size = |[x, y, _]: [f64; 3]| x.hypot(y);
    let least = COUNTS * truth.iter().map(|own| size(*own)).fold(0.0, f64::max);
    let settled = (SETTLED_S * rate_Hz) as usize;
    let counts: Vec<usize> = (settled..truth.len()).filter(|k| size(truth[*k]) > least).collect();
    let errors = counts.iter().filter_map(|&k| Errors::new(truth[k], results[k].resultant_N).tangential).collect();
    let held = counts.iter().filter_map(|&k| results[k].extra.template.map(|template| template.held)).collect();
    let within = |&k: &usize| -> Vec<bool> {
        let sigma = match results[k].sigma_N() {
            Some([x, y, _]) => Some([x, y]),
            None => results[k].subarrays.first().and_then(|own| own.shear_sigma_N),
        };
        let off = |axis: usize| (results[k].resultant_N[axis] - truth[k][axis]).abs();
        sigma.map_or(Vec::new(), |sigma| (0..2).map(|axis| off(axis) <= sigma[axis]).collect())
    };
    let shears = |of: &dyn Fn(usize) -> [f64; 3]| (0..truth.len()).map(|k| [of(k)[0], of(k)[1]]).collect::<Vec<_>>();
    let lag_frames = lag(&shears(&|k| results[k].resultant_N), &shears(&|k| truth[k]), settled);
    Ok(Followed { errors, lag_frames, held, within: counts.iter().flat_map(within).collect() })
}

/// The number of frames by which `found` is behind `truth` from frame `from` on: their cross-correlation less half the power of
/// the delayed truth is largest, that is, their squared difference is least. `None` where the truth hardly changes.
fn lag(found: &[[f64; 2]], truth: &[[f64; 2]], from: usize) -> Option<f64> {
    let begin = from.max(LONGEST_LAG);
    let count = truth.len().checked_sub(begin).filter(|count| *count > 1)? as f64;
    let mean = [0, 1].map(|axis| truth[begin..].iter().map(|force| force[axis]).sum::<f64>() / count);
    let away = |force: &[f64; 2], from: &[f64; 2]| (force[0] - from[0]).powi(2) + (force[1] - from[1]).powi(2);
    let sum = |from: &[f64; 2]| truth[begin..].iter().map(|force| away(force, from)).sum::<f64>();
    let changes = sum(&mean) > LEAST_CHANGE.powi(2) * sum(&[0.0; 2]);
    let apart = |shift: usize| (begin..truth.len()).map(|k| away(&found[k], &truth[k - shift])).sum::<f64>();
    let all: Vec<f64> = (0..=LONGEST_LAG).map(apart).collect();
    let least = (0..all.len()).min_by(|a, b| all[*a].total_cmp(&all[*b]));
    least.filter(|_| changes).map(|lag| lag as f64)
}

/// Median e_t that the bound allows for a frame alone and for the mean of 127 frames, of the middle frames of some presses.
fn bound(scene: &Scene, drawn: &[&Drawn], gain_spread: f64) -> Result<Option<[f64; 2]>, StudyError> {
    let kernels = Kernels::new(&scene.sensor, scene.medium);
    let mut errors = [Vec::new(), Vec::new()];
    let mut random = Random::new(1);
    for press in drawn {
        let middle = &press.frames[press.frames.len() / 2];
        let truth = middle.resultant_N.unwrap_or_default();
        let bound =
            SupportBound::new(&kernels, scene.sensor.thickness_mm, &middle.contacts, middle.stress_MPa.clone())?;
        for (errors, frames) in errors.iter_mut().zip([1.0, LONGEST_MEAN]) {
            let noise_MPa = press.noise_MPa / f64::sqrt(frames);
            let reading = Reading { noise_MPa, gain_spread, unipolar: scene.input.unipolar };
            let Some(covariance) = bound.covariance(reading) else { return Ok(None) };
            let shear = nalgebra::Matrix2::from_fn(|i, k| covariance[(i, k)]);
            let Some(root) = shear.cholesky() else { return Ok(None) };
            errors.extend((0..BOUND_DRAWS).map(|_| {
                (root.l() * nalgebra::Vector2::new(random.normal(), random.normal())).norm() / truth[0].hypot(truth[1])
            }));
        }
    }
    Ok(Some(errors.map(|mut errors| {
        errors.sort_by(f64::total_cmp);
        quantile(&errors, 0.5)
    })))
}

impl PressRow {
    /// The row with the figures of some presses.
    fn with_figures(self, presses: &[&Followed]) -> PressRow {
        let sorted = |values: &mut dyn Iterator<Item = f64>| {
            let mut values: Vec<f64> = values.collect();
            values.sort_by(f64::total_cmp);
            values
        };
        let share = |of: &dyn Fn(&Followed) -> &Vec<bool>| {
            let count = presses.iter().map(|press| of(press).len()).sum::<usize>();
            let trues = presses.iter().flat_map(|press| of(press)).filter(|is_true| **is_true).count();
            (count > 0).then(|| trues as f64 / count as f64)
        };
        let errors = sorted(&mut presses.iter().flat_map(|press| press.errors.iter().copied()));
        let lags = sorted(&mut presses.iter().filter_map(|press| press.lag_frames));
        PressRow {
            frames: errors.len(),
            tangential: [0.5, 0.9].map(|share| quantile(&errors, share)),
            lag_frames: (!lags.is_empty()).then(|| quantile(&lags, 0.5)),
            held: share(&|press| &press.held),
            within_1: share(&|press| &press.within),
            ..self
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A signal and the same so many frames later.
    #[test]
    fn a_lag_is_found_and_none_without_a_change() {
        let at = |k: usize| [(0.05 * k as f64).sin(), (0.02 * k as f64).cos()];
        let truth: Vec<[f64; 2]> = (100..500).map(at).collect();
        for behind in [0, 3, 17] {
            let found: Vec<[f64; 2]> = (100..500).map(|k| at(k - behind)).collect();
            assert_eq!(lag(&found, &truth, 80), Some(behind as f64));
        }
        assert_eq!(lag(&truth, &vec![[1.0; 2]; 400], 80), None);
    }
}
