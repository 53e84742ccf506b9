//! Slip: errors and bias of the shear of contacts in full slip, in partial slip, and with an even shear.
//!
//! The frames of the kinds of slip have the same contacts, forces and noise; only the spread of the shear differs.
//!
//! | | unit | |
//! |---|---|---|
//! | in: scene, estimators, levels, shapes | – | [`ShapeStudy`]; its `options.slip` is not used |
//! | out: e_t median and 90 % quantile, bias median | fraction | of the resultant |
//! | out: components within one standard deviation | fraction | – |

use super::outcome::{Outcome, Summary};
use super::shapes::{outcomes, readings, stated, ShapeStudy};
use super::statistic::quantile;
use super::StudyError;
use crate::steps::steps;
use dermis_golden::data::generator::draws::DrawOptions;
use dermis_golden::data::generator::slip::Slip;
use dermis_golden::spec::scene::Scene;
use serde::Serialize;

/// One line of the table.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SlipRow {
    /// Noise level σ / max |b| of a single frame.
    pub noise: f64,
    /// Name of the estimator in scenes.
    pub estimator: String,
    /// Kind of slip, as `--slip` takes it.
    pub slip: String,
    /// Number of frames.
    pub draws: usize,
    /// Median of the error along the true shear, as a fraction of it: above 0 where too much is read.
    pub bias: f64,
    /// Median and 90 % quantile of e_t, fractions.
    pub tangential: [f64; 2],
    /// Share of tangential components within one standard deviation; `None` without standard deviations.
    pub within_1: Option<f64>,
}

/// Runs a study; `progress` is called after every frame with the number of frames done and of all. Rows by level, estimator and
/// kind of slip.
///
/// ```
/// use dermis_golden::spec::scene::{EstimatorKind, Scene};
/// use dermis_study::noise::{slip_study, Candidate, ShapeStudy};
///
/// let candidates = vec![Candidate::Estimator(EstimatorKind::Evidence)];
/// let small = ShapeStudy { levels: vec![0.0], draws: 5, candidates, ..Default::default() };
/// let rows = slip_study(&Scene::builtin("sensor-1")?, &small, &|_, _| ())?;
/// assert_eq!(rows.iter().map(|row| row.slip.as_str()).collect::<Vec<_>>(), ["full", "0.8", "0.6", "0.4", "0.2", "even"]);
/// assert!(rows.iter().all(|row| row.bias.abs() < 0.1));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// As [`super::shape_study`].
pub fn slip_study(
    scene: &Scene,
    study: &ShapeStudy,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<Vec<SlipRow>, StudyError> {
    study.check()?;
    let of = |slip: Slip| {
        ShapeStudy { options: DrawOptions { slip, ..study.options.clone() }, ..study.clone() }.frames(scene)
    };
    let drawn = Slip::TABLE.into_iter().map(|slip| Ok((slip, of(slip)?))).collect::<Result<Vec<_>, StudyError>>()?;
    let total = study.levels.len() * study.candidates.len() * Slip::TABLE.len() * study.draws;
    let step = steps(progress, total);
    let mut rows = Vec::new();
    for (level, &noise) in study.levels.iter().enumerate() {
        let converter = study.converter(level);
        let stated = stated(scene, &converter, study.noise_stated);
        let read = drawn.iter().map(|(_, drawn)| readings(drawn, &converter, &stated));
        let read = read.collect::<Result<Vec<_>, _>>()?;
        for &candidate in &study.candidates {
            for ((slip, drawn), readings) in drawn.iter().zip(&read) {
                let all = outcomes(candidate, &candidate.stated(&stated), drawn, readings, &step)?;
                rows.push(row(noise, candidate.name(&stated), *slip, &all));
            }
        }
    }
    Ok(rows)
}

fn row(noise: f64, estimator: String, slip: Slip, outcomes: &[Outcome]) -> SlipRow {
    let sorted = |of: fn(&Outcome) -> Option<f64>| {
        let mut all: Vec<f64> = outcomes.iter().filter_map(of).collect();
        all.sort_by(f64::total_cmp);
        all
    };
    let errors = sorted(|outcome| outcome.tangential);
    SlipRow {
        noise,
        estimator,
        slip: slip.to_string(),
        draws: outcomes.len(),
        bias: quantile(&sorted(|outcome| outcome.bias), 0.5),
        tangential: [0.5, 0.9].map(|share| quantile(&errors, share)),
        within_1: Summary::of(&outcomes.iter().collect::<Vec<_>>()).coverage.map(|own| own.within_1.value),
    }
}
