//! Auto: the objective that fits the frame.
//!
//! Shear and an asymmetric pressure look alike in normal stress, so that with noise a prior on the shape must tell them
//! apart, and without noise a wrong prior does harm. Which prior holds is asked of the frame: a fit explains it when
//! its misfit is what the stated noise σ and the quadrature's error leave,
//!
//! ```text
//! misfit ≤ n (σ² + (10⁻⁴ max|b|)²) (1 + 4 √(2/n))
//! ```
//!
//! | order | taken when |
//! |---|---|
//! | `patch` | it explains the frame |
//! | `sparse` | σ ≤ 5·10⁻⁵ max\|b\|: any shape |
//! | `symmetric` | it explains the frame, or its misfit is below `patch`'s |
//! | `patch` | else |
//!
//! σ is the noise after averaging. With σ stated too small a noisy frame looks like one of another shape.

use super::{Estimate, Objective, Patch, Sparse, Subject, Symmetric};
use crate::flags::SPARSE_NOISE_LIMIT;
use crate::sensor::Sensor;

/// Error of the fits' own over the peak: their quadrature's, and that of frames made by another.
const OWN_ERROR: f64 = 1e-4;
/// Deviations of χ² beyond which a misfit is no accident.
const DEVIATIONS: f64 = 4.0;

/// Largest squared misfit in MPa² of a fit that explains b.
pub(crate) fn explained(b: &[f64], noise_MPa: f64) -> f64 {
    let peak = b.iter().fold(0.0f64, |peak, b| b.abs().max(peak));
    let n = b.len() as f64;
    let variance = noise_MPa.powi(2) + (OWN_ERROR * peak).powi(2);
    n * variance * (1.0 + DEVIATIONS * (2.0 / n).sqrt())
}

/// The objective.
#[derive(Clone, Debug)]
pub struct Auto {
    sparse: Sparse,
    symmetric: Symmetric,
    patch: Patch,
}

impl Auto {
    /// For subarrays of one shape.
    pub fn new(sensor: &Sensor) -> Auto {
        Auto { sparse: Sparse::default(), symmetric: Symmetric::new(sensor), patch: Patch::default() }
    }
}

impl Objective for Auto {
    /// That of `sparse`.
    fn score(&self, p: &[f64]) -> Option<f64> {
        self.sparse.score(p)
    }

    fn find(&self, subject: &Subject) -> Option<Estimate> {
        let peak = subject.b.iter().fold(0.0f64, |peak, b| b.abs().max(peak));
        let most = explained(subject.b, subject.noise_MPa);
        // The objective of a fit is its negative misfit.
        let explains = |estimate: &Estimate| -estimate.found.objective <= most;
        let mut evaluations = 0;
        let mut counted = |estimate: Option<Estimate>| {
            evaluations += estimate.map_or(0, |estimate| estimate.found.evaluations);
            estimate.map(|mut estimate| {
                estimate.found.evaluations = evaluations;
                estimate
            })
        };
        let patch = counted(self.patch.find(subject));
        if patch.as_ref().is_some_and(explains) {
            return patch;
        }
        if subject.noise_MPa <= SPARSE_NOISE_LIMIT * peak {
            return counted(self.sparse.find(subject)).or(patch);
        }
        let symmetric = counted(self.symmetric.find(subject));
        match (patch, symmetric) {
            (Some(patch), Some(symmetric)) if patch.found.objective > symmetric.found.objective => {
                counted(Some(Estimate {
                    found: crate::float::search::Found { evaluations: 0, ..patch.found },
                    ..patch
                }))
            }
            (patch, symmetric) => symmetric.or(patch),
        }
    }
}
