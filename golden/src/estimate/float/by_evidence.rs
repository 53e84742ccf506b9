//! By evidence: a frame estimated by [`crate::estimate::evidence`], as a result of the golden engine.
//!
//! The array is one subarray, whatever its contacts; its μ is the ratio of the resultants. Noise of zero means that the
//! scene states none: it is found from the frame.

use super::array::{CaseOutcome, EngineInput};
use super::error::GoldenError;
use super::estimator::{Clipped, Estimator};
use super::forces::threshold;
use crate::data::input::Input;
use crate::estimate::evidence::{Evidence, LastFit};
use crate::estimate::learned::Learned;
use crate::physics::matrices::{check_size, MatricesError};
use crate::result::flags::Flag;
use crate::result::reconstruct::Reconstruction;
use crate::spec::scene::{EstimatorKind, Scene};

/// Most taxels of an array: with a press on all of them a frame takes half a minute and a gigabyte.
const MOST_TAXELS: usize = 64 * 64;

/// The estimator `evidence`, with or without a network.
struct ByEvidence(Evidence);

/// The estimator `kind`, one with evidence.
///
/// # Errors
/// As [`Learned::of_scene`], where the estimator has a network; [`MatricesError`] for an array that has no influence or no reading.
pub(super) fn new(kind: EstimatorKind, scene: &Scene, input: &Input) -> Result<Box<dyn Estimator>, GoldenError> {
    let sensor = || Box::new(scene.sensor.clone());
    check_size(&scene.sensor, MOST_TAXELS)?;
    if !scene.input.alive(&scene.sensor).contains(&true) {
        return Err(MatricesError::TooManyDead { sensor: sensor(), dead: scene.input.dead.len() }.into());
    }
    let mut evidence = Evidence::new(scene);
    if !evidence.is_representable() {
        return Err(MatricesError::NotFinite { sensor: sensor() }.into());
    }
    if kind.has_network() {
        evidence = evidence.with_network(Learned::of_scene(scene, kind)?, !kind.mu_of_network());
    }
    if let Some(shares) = input.noise_shares() {
        evidence = evidence.with_noise_shares(shares);
    }
    Ok(Box::new(ByEvidence(evidence)))
}

impl Estimator for ByEvidence {
    fn estimate(&self, input: &EngineInput) -> Reconstruction {
        self.estimate_after(input, &mut None)
    }

    fn estimate_after(&self, input: &EngineInput, last: &mut Option<LastFit>) -> Reconstruction {
        let noise_MPa = (input.noise_MPa > 0.0).then_some(input.noise_MPa);
        // No force is worth a fit of readings that no contact causes, such as counts without calibration.
        let estimate = match input.frame.peak_MPa() > input.scene.input.plausible_MPa {
            true => self.0.without_fit(&input.frame.stress_MPa, noise_MPa),
            false => self.0.solve_after(last, &input.frame.stress_MPa, &input.frame.missing, noise_MPa),
        };
        let forces = threshold(estimate.forces_N.clone(), input.scene.threshold.min_force_N);
        let subarrays = vec![input.array_of(forces.resultant())];
        let mut result = input.finish(CaseOutcome { subarrays, forces, ..CaseOutcome::default() });
        result.checks.noise_MPa = Some(estimate.noise_MPa);
        result.checks.misfit_probability = estimate.misfit_probability;
        result.checks.baseline_MPa = (!estimate.failed).then_some(estimate.baseline_MPa);
        result.checks.residual_outlier = estimate.outlier;
        result.checks.residual_correlation = estimate.residual_correlation;
        result.flags.extend(estimate.failed.then_some(Flag::EstimateFailed));
        result.flags.extend((!estimate.suspects.is_empty()).then_some(Flag::TaxelSuspect));
        result.extra.suspects = estimate.suspects;
        result.extra.contacts = Some(estimate.contacts);
        result.checks.shear_spread = result.shear_spread();
        result.checks.missing_load = (!input.frame.missing.is_empty()).then(|| normal_spread(&result)).flatten();
        result
    }

    fn clipped_readings(&self) -> Clipped {
        Clipped::AsRead
    }
}

/// Twice the standard deviation of the normal force of all contacts over that force; `None` without one.
fn normal_spread(result: &Reconstruction) -> Option<f64> {
    let (contacts, [_, _, sigma_N]) = (result.contacts()?, result.sigma_N()?);
    let normal_N: f64 = contacts.iter().map(|contact| contact.force_N[2]).sum();
    (normal_N > 0.0).then(|| 2.0 * sigma_N / normal_N)
}
