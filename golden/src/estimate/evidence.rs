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
//! | `clipped` | readings of zero on an array that reads no tension |
//! | `noise` | size of the noise, where it is not stated |
//! | `contact` | force and standard deviation |
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
pub(crate) mod cells;
mod clipped;
mod contact;
mod envelope;
mod estimate;
mod estimator;
mod fit;
mod model;
mod noise;
mod prior;
#[cfg(test)]
mod tests;

pub use estimate::Estimate;
pub use estimator::Evidence;

use crate::data::frame::Forces;
use fit::Fit;

impl Evidence {
    /// Estimates the contacts of stress `b` in MPa; `noise_MPa` is the standard deviation of its noise, if it is known.
    pub fn solve(&self, b: &[f64], noise_MPa: Option<f64>) -> Estimate {
        let peak = (0..b.len()).filter(|&t| self.alive[t]).fold(0.0f64, |peak, t| b[t].max(peak));
        let nothing = || Estimate {
            contacts: Vec::new(),
            forces_N: Forces::zeros(b.len()),
            noise_MPa: noise_MPa.unwrap_or(0.0),
            misfit_probability: None,
            rounds: 0,
            rank: 0,
        };
        if peak <= 0.0 || !peak.is_finite() {
            return nothing();
        }
        // In units of the peak, so that no frame is too small or too large.
        let scaled: Vec<f64> = b.iter().map(|b| b / peak).collect();
        match Fit::new(self, &scaled, noise_MPa.map(|noise| noise / peak)).run() {
            None => nothing(),
            Some(mut estimate) => {
                estimate.noise_MPa = noise_MPa.unwrap_or(estimate.noise_MPa * peak);
                let Forces { fx, fy, fz } = &mut estimate.forces_N;
                [fx, fy, fz].into_iter().flatten().for_each(|force| *force *= peak);
                for contact in &mut estimate.contacts {
                    contact.force_N.iter_mut().chain(&mut contact.sigma_N).for_each(|force| *force *= peak);
                }
                estimate
            }
        }
    }
}
