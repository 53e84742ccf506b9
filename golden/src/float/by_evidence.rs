//! By evidence: a frame estimated by [`crate::evidence`], as a result of the golden engine.
//!
//! The array is one subarray, whatever its contacts; its μ is the ratio of the resultants. Noise of zero means that the
//! scene states none: it is found from the frame.

use super::forces::threshold;
use super::golden::{CaseOutcome, EngineInput, Golden};
use crate::checks::{largest_spread, relative_spread};
use crate::evidence::{ContactEstimate, Evidence};
use crate::frame::Frame;
use crate::partition::Subarray;
use crate::reconstruct::{Reconstruction, SubarrayResult};

impl Golden {
    /// Estimates the contacts of calibrated stress, clipped readings as they are.
    pub(super) fn by_evidence(&self, evidence: &Evidence, frame: &Frame, input: &EngineInput) -> Reconstruction {
        let stated = (input.noise_MPa > 0.0).then_some(input.noise_MPa);
        // No force is worth a fit of readings that no contact causes, such as counts without calibration.
        let estimate = match frame.peak_MPa() > self.scene.input.plausible_MPa {
            true => evidence.without_fit(input.stress_MPa, stated),
            false => evidence.solve(input.stress_MPa, stated),
        };
        let forces = threshold(estimate.forces_N.clone(), self.scene.threshold.min_force_N);
        let subarrays = vec![self.array_of(input, forces.resultant())];
        let mut result = self.finish(frame, CaseOutcome { subarrays, forces, ..CaseOutcome::default() });
        result.checks.noise_MPa = Some(estimate.noise_MPa);
        result.checks.misfit_probability = estimate.misfit_probability;
        result.checks.shear_spread = shear_spread(&estimate.contacts);
        result.add_findings(&estimate);
        result.extra.contacts = Some(estimate.contacts);
        result
    }

    /// The array as one subarray that is not searched; its μ is the ratio of the resultants.
    pub(super) fn array_of(&self, input: &EngineInput, resultant_N: [f64; 3]) -> SubarrayResult {
        let (rows, cols) = (self.scene.sensor.rows, self.scene.sensor.cols);
        let part = Subarray { row0: 0, col0: 0, rows, cols };
        SubarrayResult::of_regions(&part, &self.receive(input, &part), resultant_N)
    }
}

/// Standard deviation of the shear over its size, the largest of all contacts with a share of the load. Below a
/// hundredth of the normal force a shear counts as none, and its standard deviation is taken over that.
fn shear_spread(contacts: &[ContactEstimate]) -> Option<f64> {
    let spread = |contact: &ContactEstimate| {
        let ([x, y, normal], [sx, sy, _]) = (contact.force_N, contact.sigma_N);
        (normal, Some(relative_spread([x, y], [sx, sy], normal)))
    };
    largest_spread(&contacts.iter().map(spread).collect::<Vec<_>>())
}
