//! Measurements of numerical stability for the report: error against condition number, extreme frames.

use anyhow::Result;
use dermis_golden::spec::partition::Case;
use dermis_golden::spec::scene::InverseKind;
use dermis_study::stability::{self, extreme, settings, Setting};

use super::measured::{Measured, Options};
use dermis_flow::jobs::parallel;

/// Largest scene, in taxels, whose extreme frames are measured, as each frame needs its own model.
const EXTREME_TAXELS: usize = 100;

/// Error against condition number; the quick variant keeps only the series over thickness with the default inverse, and
/// the frames computed with 50 digits.
///
/// # Errors
/// An interruption.
pub fn conditions(options: &Options) -> Result<Vec<stability::StabilityRow>> {
    let in_quick = |setting: &Setting| {
        setting.frame.is_some() || setting.group == "thickness" && setting.scene.inverse.kind == InverseKind::default()
    };
    let wanted = settings().into_iter().filter(|setting| !options.quick || in_quick(setting)).collect();
    parallel("stability", wanted, options.jobs, &options.interrupt, |setting| Ok(stability::measure(&setting)?))
}

/// Results of both models on the extreme frames of the small scenes, by scene name; the quick variant measures only the
/// first scene.
///
/// # Errors
/// A scene that the golden model refuses, an interruption.
pub fn extremes(measured: &[Measured], options: &Options) -> Result<Vec<(String, Vec<extreme::ExtremeRow>)>> {
    let small = |m: &&Measured| m.scene.partition.case == Case::WHOLE && m.scene.sensor.taxels() <= EXTREME_TAXELS;
    let wanted: Vec<_> = measured.iter().filter(small).take(if options.quick { 1 } else { usize::MAX }).collect();
    parallel("extreme frames", wanted, options.jobs, &options.interrupt, |m| {
        let rows = extreme::frames(&m.scene)?.iter().map(extreme::outcome).collect::<Result<_, _>>()?;
        Ok((m.scene.name.clone(), rows))
    })
}
