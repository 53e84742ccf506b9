//! The study: random contacts, noise, estimates and the spread of their errors.

use super::bound::Bound;
use super::contact::{ContactStress, HertzContact};
use super::statistic::quantile;
use dermis_golden::data::frame::{Frame, FrameError};
use dermis_golden::data::generator::GeneratorError;
use dermis_golden::engine::EngineError;
use dermis_golden::estimate::blind_gains::BlindError;
use dermis_golden::estimate::float::{Golden, GoldenError};
use dermis_golden::fixed::FixedError;
use dermis_golden::random::Random;
use dermis_golden::spec::scene::{EstimatorKind, ObjectiveKind, Scene};
use nalgebra::Vector2;
use serde::Serialize;
use thiserror::Error;

/// Frames averaged in the second half of the table, unless stated.
pub const AVERAGED: usize = 64;

/// Parameters of a study.
#[derive(Clone, Debug, PartialEq)]
pub struct Study {
    /// Noise levels σ / max|b|, 0 to 1.
    pub levels: Vec<f64>,
    /// Number of contacts, 1 to 100 000.
    pub draws: usize,
    /// Seed of contacts and noise.
    pub seed: u64,
    /// Objectives to compare.
    pub objectives: Vec<ObjectiveKind>,
    /// Number of frames averaged in the second half of the table, 1 to 100 000; 1 leaves out that half.
    pub frames: usize,
}

impl Default for Study {
    fn default() -> Self {
        let objectives = ObjectiveKind::NAMES.iter().map(|(_, kind)| *kind).collect();
        Study { levels: vec![0.0, 1e-4, 5e-4, 2e-3, 1e-2], draws: 200, seed: 1, objectives, frames: AVERAGED }
    }
}

/// Number of frames averaged.
pub type Averaging = usize;

/// Statistics of errors, as fractions.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Spread {
    /// Median.
    pub median: f64,
    /// 90 % quantile.
    pub ninety: f64,
    /// Root mean square.
    pub rms: f64,
}

/// One line of the table.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct NoiseRow {
    /// Noise level σ / max|b| of a single frame.
    pub noise: f64,
    /// Number of frames averaged.
    pub frames: Averaging,
    /// Name of the objective in scenes.
    pub objective: &'static str,
    /// e_t of the reconstruction.
    pub found: Spread,
    /// e_t of the 6-parameter bound.
    pub bound_6: Spread,
    /// e_t of the 9-parameter bound.
    pub bound_9: Spread,
    /// Median e_t over the 6-parameter bound's median; `None` without noise.
    pub ratio_6: Option<f64>,
    /// Median e_t over the 9-parameter bound's median; `None` without noise.
    pub ratio_9: Option<f64>,
}

/// A study cannot be run.
#[derive(Debug, Error)]
pub enum StudyError {
    /// The scene cannot be reconstructed.
    #[error(transparent)]
    Golden(#[from] GoldenError),
    /// The scene has no bit-true model, or a frame no result in it.
    #[error(transparent)]
    Fixed(#[from] FixedError),
    /// An engine refuses a frame.
    #[error(transparent)]
    Engine(#[from] EngineError),
    /// A frame is not finite.
    #[error(transparent)]
    Frame(#[from] FrameError),
    /// Contacts cannot be drawn.
    #[error(transparent)]
    Generator(#[from] GeneratorError),
    /// Presses give no gains.
    #[error(transparent)]
    Blind(#[from] BlindError),
    /// A parameter of the study is out of range.
    #[error("{field} = {value} is not allowed; it must be {allowed}")]
    Parameter {
        /// Name of the parameter.
        field: &'static str,
        /// Its value.
        value: String,
        /// The allowed values, in words.
        allowed: &'static str,
    },
    /// Of the frames of a table of standard deviations none has a contact of some size at some noise.
    #[error("at a noise of {noise} of the peak, {draws} frames have no errors of a class of sizes; draw more of them")]
    Unmeasured {
        /// The level.
        noise: f64,
        /// Number of frames.
        draws: usize,
    },
}

impl Spread {
    fn of(mut values: Vec<f64>) -> Spread {
        values.sort_by(f64::total_cmp);
        let at = |share: f64| quantile(&values, share);
        let square: f64 = values.iter().map(|v| v * v).sum();
        Spread { median: at(0.5), ninety: at(0.9), rms: (square / values.len().max(1) as f64).sqrt() }
    }
}

/// A random contact, its stress and its bound.
struct DrawnContact {
    contact: HertzContact,
    stress_MPa: Vec<f64>,
    peak_MPa: f64,
    bound: Bound,
}

/// Largest number of contacts and of frames.
const MAX_COUNT: usize = 100_000;
/// Errors drawn from the bound's covariance for each contact.
const BOUND_DRAWS: usize = 32;

/// Runs a study; `progress` is called after every row with the number of rows done and of all rows.
///
/// ```
/// use dermis_golden::spec::scene::{ObjectiveKind, Scene};
/// use dermis_study::noise::{study, Study};
///
/// let small = Study { levels: vec![0.0, 1e-3], draws: 12, seed: 1, objectives: vec![ObjectiveKind::Patch], frames: 1 };
/// let rows = study(&Scene::builtin("sensor-1")?, &small, &mut |_, _| ())?;
/// // Without noise the shear is found almost exactly; with noise the error is about that of the bound.
/// assert!(rows[0].found.median < 1e-3 && rows[0].ratio_6.is_none());
/// assert!((0.5..2.0).contains(&rows[1].ratio_6.ok_or("no bound")?));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`StudyError`]: a scene that the golden model cannot reconstruct, or a parameter out of range.
pub fn study(
    scene: &Scene,
    study: &Study,
    progress: &mut dyn FnMut(usize, usize),
) -> Result<Vec<NoiseRow>, StudyError> {
    check_parameters(study.draws, study.frames, &study.levels)?;
    let draws = draws(scene, study);
    let averagings: Vec<Averaging> = if study.frames == 1 { vec![1] } else { vec![1, study.frames] };
    let total = averagings.len() * study.levels.len() * study.objectives.len();
    let mut rows = Vec::with_capacity(total);
    let mut engines = Vec::new();
    for &kind in &study.objectives {
        let mut scene = scene.clone();
        scene.search.objective = kind;
        engines.push((kind, Golden::with(&scene, EstimatorKind::Search)?));
    }
    for &frames in &averagings {
        for (level, &noise) in study.levels.iter().enumerate() {
            let single = (level * 2 + usize::from(frames > 1)) as u64;
            // Every objective gets the same noise.
            let noisy = noisy(&draws, noise, frames, study.seed.wrapping_add(0x1000 + single));
            let share = noise / (frames as f64).sqrt();
            let bounds = [|bound: &Bound| bound.six, |bound: &Bound| bound.nine];
            let [bound_6, bound_9] = bounds.map(|block| Spread::of(bound_errors(&draws, share, block)));
            for (kind, engine) in &engines {
                let mut errors = Vec::with_capacity(draws.len());
                for (draw, stress) in draws.iter().zip(&noisy) {
                    errors.push(error(engine, scene, draw, stress, share * draw.peak_MPa)?);
                }
                let found = Spread::of(errors);
                let ratio = |bound: Spread| (bound.median > 0.0).then(|| found.median / bound.median);
                rows.push(NoiseRow {
                    noise,
                    frames,
                    objective: kind.name(),
                    found,
                    bound_6,
                    bound_9,
                    ratio_6: ratio(bound_6),
                    ratio_9: ratio(bound_9),
                });
                progress(rows.len(), total);
            }
        }
    }
    Ok(rows)
}

/// Checks what both studies take.
pub(super) fn check_parameters(draws: usize, frames: usize, levels: &[f64]) -> Result<(), StudyError> {
    let wrong = |field, value: String, allowed| Err(StudyError::Parameter { field, value, allowed });
    if !(1..=MAX_COUNT).contains(&draws) {
        return wrong("draws", draws.to_string(), "from 1 to 100000");
    }
    if !(1..=MAX_COUNT).contains(&frames) {
        return wrong("frames", frames.to_string(), "from 1 to 100000");
    }
    match levels.iter().find(|level| !(0.0..=1.0).contains(*level)) {
        Some(level) => wrong("noise", level.to_string(), "a fraction of max |b| from 0 to 1"),
        None => Ok(()),
    }
}

/// The contacts; one whose unknowns cannot be distinguished is drawn again.
fn draws(scene: &Scene, study: &Study) -> Vec<DrawnContact> {
    let truth = ContactStress::new(&scene.sensor, scene.medium);
    let mut random = Random::new(study.seed);
    let mut draws = Vec::with_capacity(study.draws);
    // Bounded, for arrays on which no contact can be resolved.
    for _ in 0..4 * study.draws {
        let contact = HertzContact::draw(&scene.sensor, &mut random);
        let Some(bound) = Bound::new(&truth, &contact) else { continue };
        let stress_MPa = truth.stress_MPa(&contact);
        let peak_MPa = stress_MPa.iter().fold(0.0f64, |peak, b| b.abs().max(peak));
        draws.push(DrawnContact { contact, stress_MPa, peak_MPa, bound });
        if draws.len() == study.draws {
            break;
        }
    }
    draws
}

/// The stress of each contact with noise, averaged over `frames` frames.
fn noisy(draws: &[DrawnContact], noise: f64, frames: usize, seed: u64) -> Vec<Vec<f64>> {
    let mut random = Random::new(seed.wrapping_mul(0x9e37_79b9));
    let mut one = |draw: &DrawnContact| -> Vec<f64> {
        let sigma = noise * draw.peak_MPa;
        let mut mean = || (0..frames).map(|_| random.normal()).sum::<f64>() / frames as f64;
        draw.stress_MPa.iter().map(|b| if sigma > 0.0 { b + sigma * mean() } else { *b }).collect()
    };
    draws.iter().map(&mut one).collect()
}

/// e_t of errors drawn from the bound's covariance; `share` is σ / max|b|.
fn bound_errors(draws: &[DrawnContact], share: f64, block: impl Fn(&Bound) -> nalgebra::Matrix2<f64>) -> Vec<f64> {
    let mut random = Random::new(0xb0_0d);
    let mut errors = Vec::with_capacity(draws.len() * BOUND_DRAWS);
    for draw in draws {
        let sigma = share * draw.peak_MPa;
        let root = block(&draw.bound).cholesky().map_or_else(nalgebra::Matrix2::zeros, |root| root.l());
        let shear = draw.contact.mu[0].hypot(draw.contact.mu[1]);
        for _ in 0..BOUND_DRAWS {
            let error = root * Vector2::new(random.normal(), random.normal());
            errors.push(sigma * error.norm() / shear);
        }
    }
    errors
}

/// e_t of one reconstruction.
fn error(
    engine: &Golden,
    scene: &Scene,
    draw: &DrawnContact,
    stress: &[f64],
    noise_MPa: f64,
) -> Result<f64, StudyError> {
    let mut frame = Frame::from_stress("draw", &scene.sensor, stress.to_vec())?;
    frame.resultant_N = Some(draw.contact.force_N());
    let result = engine.run_with_noise(&frame, noise_MPa)?;
    let [x, y, _] = result.resultant_N;
    let [tx, ty] = draw.contact.mu;
    Ok((x - tx).hypot(y - ty) / tx.hypot(ty))
}
