//! By evidence: a frame estimated by [`crate::evidence`], as a result of the golden engine.
//!
//! The array is one subarray, whatever its contacts; its μ is the ratio of the resultants. Noise of zero means that the
//! scene states none: it is found from the frame.

use super::{assemble, Golden, GoldenError, Reconstruction, SubarrayResult};
use crate::evidence::{ContactEstimate, Evidence};
use crate::flags::frame_flags;
use crate::float::force::threshold;
use crate::float::receive::receive;
use crate::frame::Frame;
use crate::partition::Subarray;
use crate::quantise::{full_scale, noise_floor_codes, quantise};

impl Golden {
    /// Estimates the contacts of calibrated stress, clipped readings as they are; `noise_MPa` is the standard deviation of
    /// its noise, 0 if it is not known.
    pub(super) fn by_evidence(
        &self,
        evidence: &Evidence,
        frame: &Frame,
        noise_MPa: f64,
    ) -> Result<Reconstruction, GoldenError> {
        let scene = &self.scene;
        frame.check(scene)?;
        let codes = quantise(&frame.stress_MPa, scene.fixed.input_bits, full_scale(scene, frame));
        let floor = noise_floor_codes(scene, &codes);
        let (rows, cols) = (scene.sensor.rows, scene.sensor.cols);
        let part = Subarray { row0: 0, col0: 0, rows, cols };
        let received = receive(&scene.sensor, &part, &codes.codes, floor, scene.partition.condition);
        let estimate = evidence.solve(&frame.stress_MPa, (noise_MPa > 0.0).then_some(noise_MPa));
        let finite = |contact: &ContactEstimate| contact.force_N.iter().all(|force| force.is_finite());
        if !estimate.contacts.iter().all(finite) {
            return Err(GoldenError::TooStrong { frame: frame.id.clone(), peak_MPa: frame.peak_MPa() });
        }
        let forces = threshold(estimate.forces_N, scene.threshold.min_force_N);
        let [x, y, normal] = forces.resultant();
        let subarray = SubarrayResult {
            row0: 0,
            col0: 0,
            rows,
            cols,
            centroid_condition: received.condition_met,
            compression_centroid_mm: received.compression_centroid_mm,
            tension_centroid_mm: received.tension_centroid_mm,
            mu: if normal > 0.0 { [x / normal, y / normal] } else { [0.0; 2] },
            objective_value: None,
        };
        let flags = frame_flags(scene, frame, &codes);
        let mut result = assemble(scene, frame, "golden", vec![subarray], forces, flags);
        result.checks.noise_MPa = Some(estimate.noise_MPa);
        result.checks.misfit_probability = estimate.misfit_probability;
        result.checks.shear_spread = shear_spread(&estimate.contacts);
        result.extra.contacts = Some(estimate.contacts);
        Ok(result)
    }
}

/// Standard deviation of the shear over its size, the largest of all contacts with a share of the load. Below a
/// hundredth of the normal force a shear counts as none, and its standard deviation is taken over that.
fn shear_spread(contacts: &[ContactEstimate]) -> Option<f64> {
    let total: f64 = contacts.iter().map(|contact| contact.force_N[2]).sum();
    let spread = |contact: &ContactEstimate| {
        let ([x, y, normal], [sx, sy, _]) = (contact.force_N, contact.sigma_N);
        sx.hypot(sy) / x.hypot(y).max(NO_SHEAR * normal)
    };
    let counts = contacts.iter().filter(|contact| contact.force_N[2] >= COUNTS_FROM * total);
    counts.map(spread).filter(|spread| spread.is_finite()).reduce(f64::max)
}

/// Share of the normal force below which a shear counts as none.
const NO_SHEAR: f64 = 0.01;
/// Share of the array's normal force below which a contact does not count.
const COUNTS_FROM: f64 = 0.05;
