//! Shapes: the errors of estimators on drawn frames of any shape, beside two baselines and the support bound.
//!
//! Every frame is scaled to the same max |b|, so that one noise floor states the noise of all of them. All estimators
//! read the same frames. The baseline `none` takes no shear (e_t = 100 %) and Σ b·area for the normal force.
//!
//! | | unit | |
//! |---|---|---|
//! | in: scene | – | sensor, medium, search, partition |
//! | in: shapes, contacts, sensor's noise and gains, averaged frames | – | [`DrawOptions`] |
//! | out: e_t and e_n, median and 90 % quantile, flagged share, coverage | fraction | [`Summary`], with intervals |
//! | out: e_t and e_n of the bound, median and 90 % quantile | fraction | of errors drawn from [`super::support_bound`] |

use super::outcome::{Outcome, Summary};
use super::statistic::quantile;
use super::support_bound::{Reading, SupportBound};
use super::StudyError;
use crate::steps::steps;
use dermis_golden::data::frame::Frame;
use dermis_golden::data::generator::converter::Converter;
use dermis_golden::data::generator::draws::{ContactShape, DrawOptions, DrawnFrame, Draws};
use dermis_golden::data::generator::support::Kernels;
use dermis_golden::estimate::deviations::Deviations;
use dermis_golden::estimate::float::Golden;
use dermis_golden::fixed::{FixedError, Model};
use dermis_golden::random::Random;
use dermis_golden::result::reconstruct::Reconstruction;
use dermis_golden::spec::scene::{EstimatorKind, ObjectiveKind, Scene};
use rayon::prelude::*;
use serde::Serialize;

/// max |b| of every frame in MPa.
pub(super) const PEAK: f64 = 0.1;
/// Errors drawn from the bound's covariance for each frame.
const BOUND_DRAWS: usize = 8;
/// Multiplier of the seed of a level's noise.
const SPREAD: u64 = 0x9e37_79b9_7f4a_7c15;

/// An estimator of the study.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Candidate {
    /// What the scene names.
    Scene,
    /// An estimator.
    Estimator(EstimatorKind),
    /// The search with an objective.
    Objective(ObjectiveKind),
    /// The scene's hardware: its bit-true model.
    Hardware,
}

/// Parameters of a study over shapes.
#[derive(Clone, Debug, PartialEq)]
pub struct ShapeStudy {
    /// Noise levels σ / max |b| of a single frame, 0 to 1.
    pub levels: Vec<f64>,
    /// Number of frames, 1 to 100 000.
    pub draws: usize,
    /// Shapes, contacts, seed and sensor; each level replaces the sensor's noise.
    pub options: DrawOptions,
    /// Whether the scene states noise and gain spread.
    pub noise_stated: bool,
    /// The estimators.
    pub candidates: Vec<Candidate>,
    /// Whether there is also a row for each shape.
    pub by_shape: bool,
}

impl Default for ShapeStudy {
    fn default() -> Self {
        ShapeStudy {
            levels: vec![0.0, 1e-4, 5e-4, 2e-3, 1e-2],
            draws: 200,
            options: DrawOptions::default(),
            noise_stated: true,
            candidates: vec![Candidate::Scene],
            by_shape: false,
        }
    }
}

/// Median and 90 % quantile of the bound's errors, as fractions.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct BoundSpread {
    /// e_t of the resultant: median, 90 % quantile.
    pub tangential: [f64; 2],
    /// e_n of the resultant: median, 90 % quantile.
    pub normal: [f64; 2],
    /// Frames whose forces can be told apart.
    pub draws: usize,
}

/// One line of the table.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ShapeRow {
    /// Noise level σ / max |b| of a single frame.
    pub noise: f64,
    /// Number of frames averaged into a reading.
    pub frames: usize,
    /// Standard deviation of the gains.
    pub gain_spread: f64,
    /// Whether tension reads as zero.
    pub unipolar: bool,
    /// Whether the scene states noise and gain spread.
    #[serde(rename = "told")]
    pub noise_stated: bool,
    /// Number of contacts of a frame.
    pub contacts: usize,
    /// The shape, or `all`.
    pub shape: &'static str,
    /// Name of the estimator in scenes, with that of the objective for the search; `none` for the baseline.
    pub estimator: String,
    /// Its errors.
    #[serde(flatten)]
    pub summary: Summary,
    /// The bound of the same frames.
    pub bound: BoundSpread,
}

impl Candidate {
    /// Name of the estimator in scenes; for the search with that of the objective.
    pub fn name(self, scene: &Scene) -> String {
        if self == Candidate::Hardware {
            return "hardware".to_owned();
        }
        let stated = self.stated(scene);
        match stated.model_estimator() {
            EstimatorKind::Search => format!("search {}", stated.search.objective.name()),
            other => other.name().to_owned(),
        }
    }

    /// The scene with this estimator.
    pub fn stated(self, scene: &Scene) -> Scene {
        let mut scene = scene.clone();
        match self {
            Candidate::Scene | Candidate::Hardware => {}
            Candidate::Estimator(kind) => scene.search.estimator = Some(kind),
            Candidate::Objective(kind) => {
                scene.search.estimator = Some(EstimatorKind::Search);
                scene.search.objective = kind;
            }
        }
        scene
    }

    /// What reconstructs averaged frames of stress of the scene `stated`, [`Candidate::stated`].
    ///
    /// The bit-true model reads each frame as codes of its own full scale unless the scene states one. Stated noise is used
    /// for the standard deviations alone: the noise floor is a word of the hardware, which needs a full scale.
    ///
    /// # Errors
    /// A scene that the model refuses.
    pub(super) fn run(self, stated: &Scene) -> Result<Box<Run>, StudyError> {
        if self != Candidate::Hardware {
            let golden = Golden::new(stated)?;
            return Ok(Box::new(move |frame| Ok(golden.run(frame)?)));
        }
        let mut scene = stated.clone().with_chosen_hardware();
        let noise_MPa = scene.search.noise_floor_MPa() * scene.input.noise_share();
        scene.search.noise_floor_MPa = Some(0.0);
        let model = Model::new(&scene)?;
        let deviations = Deviations::of_scene(&model.scene, model.estimator()).map_err(FixedError::from)?;
        Ok(Box::new(move |frame| {
            let mut result = model.reconstruct(frame)?;
            deviations.iter().for_each(|table| table.add(&mut result, &scene, frame, noise_MPa));
            Ok(result)
        }))
    }
}

/// Reconstructs a frame of stress.
pub(super) type Run = dyn Fn(&Frame) -> Result<Reconstruction, StudyError> + Send + Sync;

impl ShapeStudy {
    /// # Errors
    /// [`StudyError::Parameter`] for a parameter out of range.
    pub(super) fn check(&self) -> Result<(), StudyError> {
        super::study::check_parameters(self.draws, self.options.converter.frames, &self.levels)
    }

    /// The sensor at a noise level.
    pub(super) fn converter(&self, level: usize) -> Converter {
        let seed = self.options.seed.wrapping_add(level as u64 + 1).wrapping_mul(SPREAD);
        Converter { noise: self.levels[level], seed, ..self.options.converter.clone() }
    }

    /// The frames without noise, drawn in parallel.
    pub(super) fn frames(&self, scene: &Scene) -> Result<Vec<DrawnFrame>, StudyError> {
        let options = DrawOptions { peak_MPa: Some(PEAK), converter: Converter::default(), ..self.options.clone() };
        let draws = Draws::new(scene, options)?;
        let drawn: Result<Vec<_>, _> = (0..self.draws as u64).into_par_iter().map(|k| draws.frame(k)).collect();
        Ok(drawn?)
    }
}

/// Standard deviation in MPa of what noise, tare and drift add to a reading, per MPa of max |b|.
fn deviation(converter: &Converter) -> f64 {
    let Converter { noise, drift, frames, tare_frames, .. } = *converter;
    let tare = if tare_frames > 0 { 1.0 / tare_frames as f64 } else { 0.0 };
    (noise * (1.0 / frames as f64 + tare).sqrt()).hypot(drift)
}

/// The scene as the study states it: unipolar as the sensor, noise and gains with `noise_stated`.
pub(super) fn stated(scene: &Scene, converter: &Converter, noise_stated: bool) -> Scene {
    let mut scene = scene.clone();
    scene.input.unipolar = converter.unipolar;
    if noise_stated {
        scene.search.noise_floor_MPa = Some(deviation(converter) * PEAK / scene.input.noise_share());
        scene.input.gain_spread = converter.gain_spread;
    }
    scene
}

/// The readings of each frame at a level, as frames of stress alone of the stated sensor.
pub(super) fn readings(drawn: &[DrawnFrame], converter: &Converter, stated: &Scene) -> Result<Vec<Frame>, StudyError> {
    let read = |(number, drawn): (usize, &DrawnFrame)| {
        let seed = converter.seed ^ (number as u64) << 20;
        let stress_MPa = drawn.read(&Converter { seed, ..converter.clone() })?.stress_MPa;
        Ok(Frame::from_stress(&drawn.frame.id, &stated.sensor, stress_MPa)?)
    };
    drawn.par_iter().enumerate().map(|(number, drawn)| read((number, drawn))).collect()
}

/// Reconstructs every reading by a candidate for the scene `stated`, [`Candidate::stated`]; `step` is called after each.
pub(super) fn outcomes(
    candidate: Candidate,
    stated: &Scene,
    drawn: &[DrawnFrame],
    readings: &[Frame],
    step: &(dyn Fn() + Sync),
) -> Result<Vec<Outcome>, StudyError> {
    let run = candidate.run(stated)?;
    let one = |(drawn, reading): (&DrawnFrame, &Frame)| {
        let outcome = Outcome::new(drawn, &run(reading)?);
        step();
        Ok(outcome)
    };
    drawn.par_iter().zip(readings).map(one).collect()
}

/// Runs a study; `progress` is called after every frame with the number of frames done and of all.
///
/// ```
/// use dermis_golden::spec::scene::{ObjectiveKind, Scene};
/// use dermis_study::noise::{shape_study, Candidate, ShapeStudy};
///
/// let candidates = vec![Candidate::Objective(ObjectiveKind::Sparse)];
/// let small = ShapeStudy { levels: vec![0.0], draws: 10, candidates, ..Default::default() };
/// let rows = shape_study(&Scene::builtin("sensor-1")?, &small, &|_, _| ())?;
/// // Without noise the shear is found for any shape; the baseline has none.
/// assert_eq!((rows[0].estimator.as_str(), rows[1].estimator.as_str()), ("none", "search sparse"));
/// assert!(rows[0].summary.tangential.median.value == 1.0 && rows[1].summary.tangential.median.value < 0.1);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`StudyError`]: a scene that the golden model cannot reconstruct, contacts that do not fit, or a parameter out of
/// range.
pub fn shape_study(
    scene: &Scene,
    study: &ShapeStudy,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<Vec<ShapeRow>, StudyError> {
    study.check()?;
    let drawn = study.frames(scene)?;
    let bounds = bounds(scene, &drawn)?;
    let total = study.levels.len() * study.candidates.len() * drawn.len();
    let step = steps(progress, total);
    let mut rows = Vec::new();
    for (level, &noise) in study.levels.iter().enumerate() {
        let converter = study.converter(level);
        let stated = stated(scene, &converter, study.noise_stated);
        let readings = readings(&drawn, &converter, &stated)?;
        let reading = Reading {
            noise_MPa: deviation(&converter) * PEAK,
            gain_spread: converter.gain_spread,
            unipolar: converter.unipolar,
        };
        let bound_errors: Vec<Vec<[f64; 2]>> = drawn
            .par_iter()
            .zip(&bounds)
            .enumerate()
            .map(|(number, (drawn, bound))| bound_errors(drawn, bound, reading, number as u64))
            .collect();
        let baseline = drawn.iter().zip(&readings).map(|(d, b)| Outcome::baseline(d, &stated.sensor, &b.stress_MPa));
        let mut all = vec![("none".to_owned(), baseline.collect::<Vec<_>>())];
        for &candidate in &study.candidates {
            let named = candidate.stated(&stated);
            let outcomes = outcomes(candidate, &named, &drawn, &readings, &step)?;
            all.push((candidate.name(&stated), outcomes));
        }
        for (estimator, outcomes) in &all {
            for shape in groups(study) {
                let own: Vec<usize> =
                    (0..drawn.len()).filter(|&k| shape.is_none_or(|shape| outcomes[k].shape == shape)).collect();
                rows.push(ShapeRow {
                    noise,
                    frames: converter.frames,
                    gain_spread: converter.gain_spread,
                    unipolar: converter.unipolar,
                    noise_stated: study.noise_stated,
                    contacts: study.options.contacts,
                    shape: shape.map_or("all", ContactShape::name),
                    estimator: estimator.clone(),
                    summary: Summary::of(&own.iter().map(|&k| &outcomes[k]).collect::<Vec<_>>()),
                    bound: BoundSpread::of(&own.iter().map(|&k| bound_errors[k].as_slice()).collect::<Vec<_>>()),
                });
            }
        }
    }
    Ok(rows)
}

/// All shapes together, then each of them if wanted.
fn groups(study: &ShapeStudy) -> Vec<Option<ContactShape>> {
    let own = study.options.shapes.iter().copied().map(Some).filter(|_| study.by_shape);
    std::iter::once(None).chain(own).collect()
}

fn bounds(scene: &Scene, drawn: &[DrawnFrame]) -> Result<Vec<SupportBound>, StudyError> {
    let kernels = Kernels::new(&scene.sensor, scene.medium);
    let one = |drawn: &DrawnFrame| {
        SupportBound::new(&kernels, scene.sensor.thickness_mm, &drawn.frame.contacts, drawn.exact_MPa.clone())
    };
    Ok(drawn.par_iter().map(one).collect::<Result<_, _>>()?)
}

/// e_t and e_n of errors of the resultant that are drawn from the bound's covariance; none if the forces cannot be told
/// apart.
fn bound_errors(drawn: &DrawnFrame, bound: &SupportBound, reading: Reading, number: u64) -> Vec<[f64; 2]> {
    let Some(covariance) = bound.covariance(reading) else { return Vec::new() };
    // The sum over contacts.
    let contacts = drawn.truth.len();
    let block = |i: usize, k: usize| {
        (0..contacts).flat_map(|a| (0..contacts).map(move |b| (3 * a + i, 3 * b + k))).map(|at| covariance[at]).sum()
    };
    let total = nalgebra::Matrix3::from_fn(block);
    let root = total.cholesky().map_or_else(nalgebra::Matrix3::zeros, |root| root.l());
    let [x, y, normal] = drawn.total_N;
    let mut random = Random::new(number.wrapping_add(1).wrapping_mul(SPREAD));
    let mut error = || {
        let off = root * nalgebra::Vector3::from_fn(|_, _| random.normal());
        [off.xy().norm() / x.hypot(y), off.z.abs() / normal]
    };
    (0..BOUND_DRAWS).map(|_| error()).collect()
}

impl BoundSpread {
    fn of(frames: &[&[[f64; 2]]]) -> BoundSpread {
        let spread = |axis: usize| {
            let mut values: Vec<f64> = frames.iter().flat_map(|errors| errors.iter().map(|e| e[axis])).collect();
            values.sort_by(f64::total_cmp);
            [0.5, 0.9].map(|share| quantile(&values, share))
        };
        let draws = frames.iter().filter(|errors| !errors.is_empty()).count();
        BoundSpread { tangential: spread(0), normal: spread(1), draws }
    }
}
