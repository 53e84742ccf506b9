//! Parameter sweeps: one field of a scene changed at a time; effect on errors, cycles and resources.

use anyhow::Result;
use dermis_golden::data::frame::Frame;
use dermis_golden::fixed::{Cycles, FixedError, Model};
use dermis_golden::spec::partition::Case;
use dermis_golden::spec::scene::Scene;

use super::measured::Options;
use dermis_flow::jobs::parallel;
use dermis_golden::quantile::{median, quantile};

/// Errors, cycles and resources of one setting.
#[derive(Clone, Debug, PartialEq)]
pub struct SweepPoint {
    /// Scene name.
    pub scene: String,
    /// Case of the unchanged scene, as named in scene files.
    pub case: String,
    /// Name of the swept field, as in scene files.
    pub field: &'static str,
    /// Value of the field.
    pub value: String,
    /// Whether it is the value of the unchanged scene.
    pub own: bool,
    /// Tangential error of the bit-true model, median over the frames.
    pub tangential: Option<f64>,
    /// 90 % quantile of the tangential error.
    pub ninety: Option<f64>,
    /// Normal error of the bit-true model, median over the frames.
    pub normal: Option<f64>,
    /// Cycles from the first input beat to the last output beat if every subarray is searched.
    pub cycles: u64,
    /// Number of block RAMs.
    pub block_rams: usize,
    /// Number of multipliers.
    pub multipliers: usize,
    /// Whether the design fits the board.
    pub fits: bool,
}

/// A sweep's task: name of the field, value, change of the scene, degree of the series if that is swept.
type Task = (&'static str, String, Box<dyn Fn(&mut Scene) + Send>, Option<usize>);

/// Runs all sweeps of a scene.
///
/// # Errors
/// A frame of another sensor; an interruption.
pub fn sweep(scene: &Scene, frames: &[Frame], options: &Options) -> Result<Vec<SweepPoint>> {
    let tasks = tasks(scene);
    let own = Model::new(scene)?;
    let one = |(field, value, change, degree): Task| -> Result<Option<SweepPoint>> {
        let mut changed = scene.clone();
        // A table of standard deviations is that of the scene as it stands.
        changed.search.deviations = None;
        change(&mut changed);
        let model = match degree {
            Some(degree) => Model::of_degree(&changed, degree),
            None => Model::new(&changed),
        };
        match model {
            Ok(model) => Ok(Some(point(&model, &own, field, value, frames)?)),
            // Settings that the scene does not support are skipped.
            Err(
                FixedError::DoesNotFit(_) | FixedError::Scene(_) | FixedError::Format { .. } | FixedError::Partition(_),
            ) => Ok(None),
            Err(error) => Err(error.into()),
        }
    };
    let what = format!("{}: sweeps", scene.name);
    Ok(parallel(&what, tasks, options.jobs, &options.interrupt, one)?.into_iter().flatten().collect())
}

fn tasks(scene: &Scene) -> Vec<Task> {
    let mut all: Vec<Task> = Vec::new();
    let mut field = |name: &'static str, values: &[u32], set: fn(&mut Scene, u32)| {
        for &value in values {
            all.push((name, value.to_string(), Box::new(move |scene: &mut Scene| set(scene, value)), None));
        }
    };
    field("input_bits", &[12, 14, 16, 18, 20, 22, 24], |s, v| s.fixed.input_bits = v);
    field("data_bits", &[12, 14, 16, 18], |s, v| s.fixed.data_bits = v);
    field("coef_bits", &[8, 10, 12, 14, 16, 18], |s, v| s.fixed.coef_bits = v);
    field("inverse_bits", &[18, 20, 22, 24, 28], |s, v| s.fixed.inverse_bits = v);
    field("prune_bits", &[8, 10, 12, 14, 17, 20], |s, v| s.fixed.prune_bits = v);
    field("lanes", &[16, 20, 28, 36, 52, 100, 144], |s, v| s.fixed.lanes = Some(v));
    for degree in 1..=dermis_golden::spec::scene::MAX_DEGREE {
        all.push(("degree", degree.to_string(), Box::new(|_| {}), Some(degree)));
    }
    let numbered: Vec<Case> = (0..4).filter_map(Case::numbered).collect();
    for case in scene.cases_of(&numbered) {
        let change = move |scene: &mut Scene| scene.partition.case = case;
        if dermis_golden::spec::partition::subarrays(case, &scene.sensor).is_ok() {
            all.push(("case", case.to_string(), Box::new(change), None));
        }
    }
    all
}

fn point(model: &Model, own: &Model, field: &'static str, value: String, frames: &[Frame]) -> Result<SweepPoint> {
    let results = frames.iter().map(|frame| model.reconstruct(frame)).collect::<Result<Vec<_>, _>>()?;
    let errors: Vec<_> = results.iter().filter_map(|result| result.error).collect();
    let shear: Vec<f64> = errors.iter().filter_map(|e| e.tangential).collect();
    Ok(SweepPoint {
        scene: own.scene.name.clone(),
        case: own.scene.partition.case.to_string(),
        field,
        value,
        own: model.scene == own.scene && model.formats() == own.formats(),
        ninety: quantile(shear.clone(), 0.9),
        tangential: median(shear),
        normal: median(errors.iter().filter_map(|e| e.normal).collect()),
        cycles: Cycles::longest(model).total,
        block_rams: model.resources.block_rams(),
        multipliers: model.resources.multipliers(),
        fits: model.resources.shortages(&model.board).is_empty(),
    })
}
