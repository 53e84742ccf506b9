//! Deviations: measures the table of [`dermis_golden::estimate::deviations`] on drawn frames.
//!
//! Frames of every shape, one contact each, its shear up to 0.83 mu_max in any direction, are read at each level of noise and
//! reconstructed by the bit-true model, whether a board holds it or not, or by the golden one where the hardware does not
//! implement the scene. The classes of sizes have equal numbers of frames.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: scene, number of frames, seed | – | – |
//! | out: 68.3 % quantiles of the errors of μ and normal force | levels × classes × 3 | –, fraction |

use super::shapes::{readings, ShapeStudy, PEAK};
use super::statistic::quantile;
use super::StudyError;
use crate::steps::steps;
use dermis_golden::data::frame::Frame;
use dermis_golden::data::generator::draws::{ContactShape, DrawOptions, DrawnFrame};
use dermis_golden::engine::Engine;
use dermis_golden::estimate::deviations::{Deviations, Load, Subject, MOST_PUSH};
use dermis_golden::estimate::float::Golden;
use dermis_golden::fixed::words::formats::LOG_FRACTION;
use dermis_golden::fixed::Model;
use dermis_golden::result::checks::COUNTS_FROM;
use dermis_golden::result::flags::SPARSE_NOISE_LIMIT;
use dermis_golden::result::reconstruct::Reconstruction;
use dermis_golden::spec::scene::{EstimatorKind, ForceOutput, InputSpec, Scene, ThresholdSpec};
use rayon::prelude::*;
use std::slice::from_ref;

#[cfg(test)]
mod tests;

/// Share of errors within one standard deviation of a normal distribution.
const WITHIN_ONE: f64 = 0.6827;
/// Steps of a score in a bit.
const SCORE_UNIT: f64 = (1u32 << LOG_FRACTION) as f64;
/// Classes of sizes.
const CLASSES: usize = 4;
/// Levels of noise per decade.
const PER_DECADE: i32 = 3;
/// First and last decade: about the LSB of a code of 20 bits, and more than any array has.
const DECADES: [i32; 2] = [-6, -1];
/// Shear over normal force of the frames, in units of mu_max.
const RATIO: [f64; 2] = [0.25, 0.83];

/// A searched subarray of a frame: what it is looked up by, and the errors of μ, [x, y], and of the normal force over the
/// force.
struct Error {
    /// Maximum of the objective.
    score: f64,
    /// Share of the array's normal forces that is below zero.
    negative: f64,
    noise: f64,
    size: f64,
    off: [f64; 3],
}

/// Measures the table of a scene on `draws` frames per level; `progress` is called after every frame with the number of frames
/// done and of all.
///
/// ```
/// use dermis_golden::spec::scene::Scene;
/// use dermis_study::noise::measure_deviations;
///
/// let table = measure_deviations(&Scene::builtin("eight-by-eight")?, 100, 1, &|_, _| ())?;
/// // The more noise, the less is known of the shear.
/// assert!(table.at(1e-3, 10.0)[0] > table.at(1e-5, 10.0)[0]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`StudyError`]: a scene that is not searched with the objective `sparse`, that no model reconstructs, contacts that do not
/// fit, or too few draws.
pub fn measure_deviations(
    scene: &Scene,
    draws: usize,
    seed: u64,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<Deviations, StudyError> {
    let per_decade = f64::from(PER_DECADE);
    let steps = PER_DECADE * DECADES[0]..=PER_DECADE * DECADES[1];
    let levels: Vec<f64> = steps.map(|step| digits(10f64.powf(f64::from(step) / per_decade))).collect();
    let scene = bare(scene);
    let subject = subject(&scene)?;
    let errors = by_level(errors(&scene, &levels, draws, seed, progress)?, &levels);
    let sizes = edges(&errors);
    let mut sigma = Vec::with_capacity(levels.len());
    for (level, own) in levels.iter().zip(&errors) {
        let class = |class: usize| within(own, &sizes, class).ok_or(StudyError::Unmeasured { noise: *level, draws });
        sigma.push((0..=sizes.len()).map(class).collect::<Result<Vec<_>, _>>()?);
    }
    let quiet = || errors.iter().flatten().filter(|error| error.noise <= SPARSE_NOISE_LIMIT);
    // As the hardware's word has it.
    let least_score = quiet().map(|error| (SCORE_UNIT * error.score).floor() / SCORE_UNIT).reduce(f64::min);
    let push = quiet().map(|error| (1.0 - error.negative) / error.negative).reduce(f64::min);
    let least_push = push.map(|push| push.min(f64::from(MOST_PUSH)) as u32).filter(|push| *push > 0);
    Ok(Deviations::new(subject, [draws as u64, seed], levels, sizes, sigma, (least_score, least_push)))
}

/// How often errors of frames are within the deviations of a table: per level, of μ along x and y, and of the normal force.
///
/// # Errors
/// As [`measure_deviations`].
pub fn deviations_coverage(
    scene: &Scene,
    table: &Deviations,
    levels: &[f64],
    [draws, seed]: [u64; 2],
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<Vec<[f64; 3]>, StudyError> {
    let scene = bare(scene);
    let errors = errors(&scene, levels, draws as usize, seed, progress)?;
    let share = |own: &Vec<Error>| {
        [0, 1, 2].map(|axis| {
            let within = own.iter().filter(|error| error.off[axis] <= table.at(error.noise, error.size)[axis]).count();
            within as f64 / own.len().max(1) as f64
        })
    };
    Ok(errors.iter().map(share).collect())
}

fn subject(scene: &Scene) -> Result<Subject, StudyError> {
    Subject::of(scene, EstimatorKind::Search).ok_or_else(|| StudyError::Parameter {
        field: "scene",
        value: scene.name.clone(),
        allowed: "one that is searched: objective sparse, form oblique, mu_max above 0, no contacts, not unipolar",
    })
}

/// To four digits: more are not known.
fn digits(value: f64) -> f64 {
    format!("{value:.3e}").parse().unwrap_or(value)
}

/// The errors by the level that is nearest to the noise of their subarray: one that a contact only touches has a smaller peak
/// than the frame.
fn by_level(errors: Vec<Vec<Error>>, levels: &[f64]) -> Vec<Vec<Error>> {
    let mut all: Vec<Vec<Error>> = levels.iter().map(|_| Vec::new()).collect();
    for error in errors.into_iter().flatten() {
        let off = |(level, _): &(&f64, _)| (error.noise / **level).ln().abs();
        let nearest = levels.iter().zip(&mut all).min_by(|a, b| off(a).total_cmp(&off(b)));
        if let Some((_, own)) = nearest {
            own.push(error);
        }
    }
    all
}

/// The errors of frames at each level.
fn errors(
    scene: &Scene,
    levels: &[f64],
    draws: usize,
    seed: u64,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<Vec<Vec<Error>>, StudyError> {
    let shapes = ContactShape::NAMES.map(|(_, shape)| shape).to_vec();
    let ratio = RATIO.map(|share| share * scene.search.mu_max);
    let options = DrawOptions { shapes, ratio, seed, ..Default::default() };
    let study = ShapeStudy { levels: levels.to_vec(), draws, options, ..Default::default() };
    study.check()?;
    let engine = engine(scene)?;
    let drawn = study.frames(scene)?;
    let step = steps(progress, levels.len() * draws);
    let at = |level: usize| {
        let readings = readings(&drawn, &study.converter(level), scene)?;
        let of = |(drawn, reading): (&DrawnFrame, &Frame)| {
            let reading = reading.clone().mask_dead(&scene.input.dead);
            let own = errors_of(scene, drawn, &reading, &engine.reconstruct(from_ref(&reading))?, levels[level] * PEAK);
            step();
            Ok(own)
        };
        let own: Result<Vec<Vec<Error>>, StudyError> = drawn.par_iter().zip(&readings).map(of).collect();
        Ok(own?.into_iter().flatten().collect())
    };
    (0..levels.len()).map(at).collect()
}

/// The scene with its search, without what changes readings or forces and needs a full scale.
fn bare(scene: &Scene) -> Scene {
    let mut scene = scene.clone();
    scene.hardware.take_stress();
    scene.input = InputSpec { dead: scene.input.dead.clone(), unipolar: scene.input.unipolar, ..InputSpec::default() };
    scene.threshold = ThresholdSpec::default();
    scene.output.forces = ForceOutput::Taxels;
    scene.search.noise_floor_MPa = Some(0.0);
    scene.search.deviations = None;
    scene.search.estimator = Some(EstimatorKind::Search);
    scene.hardware.estimator = Some(EstimatorKind::Search);
    scene
}

/// The model that is measured.
fn engine(scene: &Scene) -> Result<Box<dyn Engine + Send + Sync>, StudyError> {
    Ok(match scene.require_supported() {
        Ok(()) => Box::new(Model::without_fit_check(scene)?),
        Err(_) => Box::new(Golden::new(scene)?),
    })
}

/// The errors of the searched subarrays of one result that carry a part of the true load worth a μ.
fn errors_of(
    scene: &Scene,
    drawn: &DrawnFrame,
    reading: &Frame,
    result: &Reconstruction,
    noise_MPa: f64,
) -> Vec<Error> {
    let Some(truth) = &drawn.frame.cell_forces_N else { return Vec::new() };
    let negative = result.negative_share().unwrap_or(0.0);
    let counts = COUNTS_FROM * drawn.total_N[2];
    let of = |index: usize| {
        let load = Load::of(result, scene, reading, index, noise_MPa)?;
        let part = result.subarrays[index].part();
        let sum = |forces: &[f64]| part.indices(&scene.sensor).map(|k| forces[k]).sum::<f64>();
        let own = &result.forces_N;
        // Where nothing presses there is no relative error.
        let pressed = sum(&truth.fz) >= counts;
        let axes = [(&truth.fx, &own.fx), (&truth.fy, &own.fy), (&truth.fz, &own.fz)];
        let off = Some(axes).filter(|_| pressed)?.map(|(truth, own)| (sum(own) - sum(truth)).abs());
        let score = result.subarrays[index].objective_value?;
        Some(Error { score, negative, noise: load.noise, size: load.size, off: off.map(|off| off / load.normal_N) })
    };
    (0..result.subarrays.len()).filter_map(of).collect()
}

/// The sizes that separate classes with equal numbers of errors.
fn edges(errors: &[Vec<Error>]) -> Vec<f64> {
    let mut sizes: Vec<f64> = errors.iter().flatten().map(|error| error.size).collect();
    sizes.sort_by(f64::total_cmp);
    let edge = |class: usize| digits(quantile(&sizes, class as f64 / CLASSES as f64));
    let mut edges: Vec<f64> = (1..CLASSES).map(edge).collect();
    edges.dedup();
    edges
}

/// What 68.3 % of the errors of a class do not exceed; `None` for a class without errors, or where they are 0.
fn within(errors: &[Error], sizes: &[f64], class: usize) -> Option<[f64; 3]> {
    let own: Vec<&Error> = errors.iter().filter(|e| sizes.partition_point(|edge| *edge <= e.size) == class).collect();
    let most = |axis: usize| {
        let mut off: Vec<f64> = own.iter().map(|error| error.off[axis]).collect();
        off.sort_by(f64::total_cmp);
        digits(quantile(&off, WITHIN_ONE))
    };
    Some([0, 1, 2].map(most)).filter(|sigma| sigma.iter().all(|sigma| *sigma > 0.0))
}
