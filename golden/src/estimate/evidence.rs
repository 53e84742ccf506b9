//! Evidence: force and its standard deviation from noisy stress, for contacts of any shape.
//!
//! The objectives of [`crate::estimate::float`] look for the μ whose pressure looks like a contact. Here the pressure is a random
//! function, smooth over a length ℓ and zero outside the contact, and μ is what the stress makes probable when all such
//! pressures are integrated out.
//!
//! ```text
//! b ── envelope ── segment ── prior F ── model: SᵀTS, SᵀTy ── ascent: μ ── p = F w ─┬─ contact: force, σ
//!          ▲                                  ▲ clipped, noise                      │
//!          └────────────────────────── until μ stands still ────────────────────────┘
//! ```
//!
//! | file | step |
//! |---|---|
//! | `cells` | grid finer than the taxels, and its influence |
//! | `envelope` | expected size of the pressure, from the last one |
//! | `prior` | p = F w: load and smooth shape under the envelope |
//! | `model` | evidence, posterior, slope and information in μ |
//! | `ascent` | μ of all contacts |
//! | `cholesky` | factor of a matrix, on one core |
//! | `clipped` | readings of zero on an array that reads no tension |
//! | `baseline` | offset, slopes and bends that no force causes |
//! | `noise` | size of the noise, where it is not stated |
//! | `contact` | force and standard deviation |
//! | `residual` | whether what is left can be white noise |
//! | `follow` | a frame of a stream, from the fit of the frame before |
//! | `slip` | how far the shear is spread beyond the pressure |
//! | `screen`, `suspect` | taxels that read what no force explains; they are taken as missing |
//! | `failed` | Σ b·area where no fit explains the stress |
//!
//! ℓ is ⅔ h: finer structure is not visible at the depth of the taxels. ℓ² is at least a quarter of a taxel's area, and at
//! most half of it: with a larger one a contact narrower than a thick cover has no room, and its shear is wrong by more
//! than its standard deviation says. The noise has a floor of 1e-4 of the peak, the error of the cells. Where it is not known, `noise` finds it in every round.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: b | taxels | MPa |
//! | in: noise | 1 | MPa, optional |
//! | out: forces | 3 × taxels | N |
//! | out: per contact centre, μ, force, σ | – | mm, –, N |

mod ascent;
mod baseline;
pub(crate) mod cells;
pub(super) mod cholesky;
mod clipped;
mod contact;
mod envelope;
mod estimate;
mod estimator;
mod failed;
mod fit;
mod follow;
mod model;
mod noise;
pub(super) mod prior;
mod regions;
mod residual;
mod screen;
mod slip;
mod suspect;
#[cfg(test)]
mod tests;

pub use estimate::EvidenceEstimate;
pub use estimator::Evidence;
pub use follow::LastFit;

use crate::data::frame::Forces;
use fit::Fitted;
use follow::{follow, Scaled};

/// Share of Σ b·area below which a normal force does not explain the stress.
const EXPLAINED: f64 = 0.5;

impl Evidence {
    /// Estimates the contacts of stress `b` in MPa; `noise_MPa` is the standard deviation of its noise, if it is known.
    pub fn solve(&self, b: &[f64], noise_MPa: Option<f64>) -> EvidenceEstimate {
        self.solve_without(b, &[], noise_MPa)
    }

    /// The same without the readings of the taxels `missing`, row-major indices.
    pub fn solve_without(&self, b: &[f64], missing: &[usize], noise_MPa: Option<f64>) -> EvidenceEstimate {
        self.solve_after(&mut None, b, missing, noise_MPa)
    }

    /// The same of a frame of a stream, where `last` is what the frame before left, and then what this one leaves.
    pub fn solve_after(
        &self,
        last: &mut Option<LastFit>,
        b: &[f64],
        missing: &[usize],
        noise_MPa: Option<f64>,
    ) -> EvidenceEstimate {
        let there: Vec<bool> = (0..b.len()).map(|t| self.alive[t] && !missing.contains(&t)).collect();
        let Some(unit) = suspect::peak(b, &there) else {
            *last = None;
            let (forces_N, noise_MPa) = (Forces::zeros(b.len()), noise_MPa.unwrap_or(0.0));
            return EvidenceEstimate { forces_N, noise_MPa, ..EvidenceEstimate::default() };
        };
        // In units of the peak, so that no frame is too small or too large.
        let scaled: Vec<f64> = b.iter().map(|b| b / unit).collect();
        let frame = Scaled { b: &scaled, there: &there, stated: noise_MPa.map(|noise| noise / unit), unit };
        let explained = |fitted: &Fitted| {
            let normal: f64 = fitted.estimate.forces_N.fz.iter().sum();
            normal.is_finite() && normal >= EXPLAINED * fitted.load
        };
        let before = last.take().and_then(|last| Some((follow(self, frame, &last).filter(explained)?, last)));
        let (fitted, before) = match before {
            Some((fitted, last)) => (Some(fitted), Some(last)),
            None => (suspect::fit(self, &scaled, &there, frame.stated).filter(explained), None),
        };
        let Some(fitted) = fitted else {
            return self.without_fit(b, noise_MPa);
        };
        *last = LastFit::new(&fitted, frame, before.as_ref());
        let mut estimate = fitted.estimate;
        estimate.scale(unit);
        estimate.noise_MPa = noise_MPa.unwrap_or(estimate.noise_MPa);
        estimate
    }

    /// What stress `b` in MPa says without a fit: Σ b·area.
    pub fn without_fit(&self, b: &[f64], noise_MPa: Option<f64>) -> EvidenceEstimate {
        failed::estimate(self, b, noise_MPa)
    }
}
