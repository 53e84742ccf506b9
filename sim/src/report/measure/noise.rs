//! Measurement of error against noise for the report.

use anyhow::Result;
use dermis_golden::noise::{shape_study, Candidate, ShapeRow, ShapeStudy};
use dermis_golden::partition::Case;
use dermis_golden::scene::{EstimatorKind, ObjectiveKind};

use super::measured::{Measured, Options};
use crate::progress::Progress;

/// Number of drawn frames: quick, full variant.
const DRAWN: [usize; 2] = [20, 200];

/// Error against noise of the first scene, for what it names, the estimator `auto` and two objectives of the search, on
/// contacts of five shapes; with the scene's name.
///
/// # Errors
/// A scene that the golden model refuses, contacts that do not fit, an interruption.
pub fn noise(measured: &[Measured], options: &Options) -> Result<Option<(String, Vec<ShapeRow>)>> {
    let Some(first) = measured.iter().find(|m| m.scene.partition.case == Case::WHOLE) else { return Ok(None) };
    let scene = &first.scene;
    let mut candidates = vec![Candidate::Scene];
    let [sparse, patch] = [ObjectiveKind::Sparse, ObjectiveKind::Patch].map(Candidate::Objective);
    for other in [Candidate::Estimator(EstimatorKind::Auto), sparse, patch] {
        if candidates.iter().all(|known| known.name(scene) != other.name(scene)) {
            candidates.push(other);
        }
    }
    let draws = DRAWN[usize::from(!options.quick)];
    let wanted = ShapeStudy { draws, candidates, ..Default::default() };
    let bar = Progress::steps(&format!("{}: noise", scene.name), 0);
    let rows = shape_study(scene, &wanted, &|done, total| bar.set_of(done as u64, total as u64))?;
    options.interrupt.check()?;
    Ok(Some((scene.name.clone(), rows)))
}
