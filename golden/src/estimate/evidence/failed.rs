//! Failed: what is known of a frame that no fit explains.
//!
//! Shear adds nothing to Σ b·area, which is therefore the normal force whatever the contact, but for a baseline and for load
//! beyond the array's edge. Neither is known where the fit failed: the standard deviation is half of the sum of all |b|, and
//! that of the shear half of what the largest μ admits. The force is distributed like the compressive readings.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: stress | taxels | MPa |
//! | out: forces, one contact | 3 × taxels | N |

use super::estimate::EvidenceEstimate;
use super::estimator::Evidence;
use crate::data::frame::Forces;
use crate::result::reconstruct::ContactEstimate;

/// Standard deviation of the normal force over Σ |b|·area, and of μ over the largest.
const UNKNOWN: f64 = 0.5;

/// The estimate without a fit; `stated_MPa` is the noise, if it is known.
pub(super) fn estimate(scene: &Evidence, b: &[f64], stated_MPa: Option<f64>) -> EvidenceEstimate {
    let sensor = &scene.cells.sensor;
    let read: Vec<f64> = b.iter().zip(&scene.alive).map(|(b, alive)| if *alive { *b } else { 0.0 }).collect();
    let sum = |of: fn(f64) -> f64| sensor.sum_of_stress_N(&read.iter().map(|b| of(*b)).collect::<Vec<_>>());
    let (all, pressed, size) = (sum(|b| b), sum(|b| b.max(0.0)), sum(f64::abs));
    let normal = all.max(0.0);
    let mut forces_N = Forces::zeros(b.len());
    let (mut moment, area) = ([0.0; 2], sensor.pitch_x_mm * sensor.pitch_y_mm);
    for (taxel, b) in read.iter().enumerate().filter(|(_, b)| **b > 0.0) {
        let share = b * area / pressed;
        let [x, y] = scene.cells.taxel_mm(taxel);
        forces_N.fz[taxel] = share * normal;
        moment = [moment[0] + share * x, moment[1] + share * y];
    }
    let mu = UNKNOWN * scene.prior.mu_max;
    let contact = ContactEstimate {
        centre_mm: moment,
        mu: [0.0; 2],
        force_N: [0.0, 0.0, normal],
        sigma_N: [mu * normal, mu * normal, UNKNOWN * size],
        mu_covariance: [mu * mu, 0.0, mu * mu],
    };
    let noise_MPa = stated_MPa.unwrap_or(0.0);
    EvidenceEstimate { contacts: vec![contact], forces_N, noise_MPa, failed: true, ..EvidenceEstimate::default() }
}
