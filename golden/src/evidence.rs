//! Evidence: force and its standard deviation from noisy stress, for contacts of any shape.
//!
//! The objectives of [`crate::float`] look for the μ whose pressure looks like a contact. Here the pressure is a random
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
mod fit;
mod model;
mod noise;
mod prior;
#[cfg(test)]
mod tests;

use crate::frame::Forces;
use crate::learned::Learned;
use crate::scene::Scene;
use ascent::Prior;
use cells::Cells;
use fit::advice::Adviser;
use fit::Fit;
use serde::{Deserialize, Serialize};

/// ℓ in units of the depth.
const LENGTH_PER_DEPTH: f64 = 2.0 / 3.0;
/// Least and largest ℓ² in units of a taxel's area.
const LENGTH_PER_TAXEL: [f64; 2] = [0.25, 0.5];
/// Number of taxels above which only those near the contacts are read.
const WINDOW_FROM: usize = 400;
/// Distance from the cells of a contact within which taxels are read, in units of the depth.
const WINDOW: f64 = 4.0;

/// The estimator of one scene.
pub struct Evidence {
    cells: Cells,
    length_mm: f64,
    prior: Prior,
    /// Taxels that are not dead.
    alive: Vec<bool>,
    unipolar: bool,
    gain_spread: f64,
    /// Noise of each taxel over the root mean square of all.
    noise_shares: Vec<f64>,
    adviser: Option<Adviser>,
}

/// One contact.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ContactEstimate {
    /// Centre of pressure in mm from the array's centre.
    pub centre_mm: [f64; 2],
    /// Ratio of shear to normal force, [x, y].
    pub mu: [f64; 2],
    /// Force in N, [x, y, normal].
    pub force_N: [f64; 3],
    /// Standard deviation of the force in N, [x, y, normal].
    pub sigma_N: [f64; 3],
    /// Covariance of μ, [xx, xy, yy].
    pub mu_covariance: [f64; 3],
}

/// What one frame says.
#[derive(Clone, Debug, PartialEq)]
pub struct Estimate {
    /// The contacts; none without a reading above zero.
    pub contacts: Vec<ContactEstimate>,
    /// Force on each taxel in N.
    pub forces_N: Forces,
    /// Standard deviation of the noise in MPa, as it was given or as it was found.
    pub noise_MPa: f64,
    /// Probability that noise of the given size leaves as much unexplained; `None` where the noise was found from the
    /// frame itself.
    pub misfit_probability: Option<f64>,
    /// Rounds until μ stood still.
    pub rounds: usize,
    /// Number of coefficients r of the pressures.
    pub rank: usize,
}

impl Evidence {
    /// Prepares the estimator: tables of influence, milliseconds for 20 × 20 taxels.
    pub fn new(scene: &Scene) -> Evidence {
        let sensor = &scene.sensor;
        let area_mm2 = sensor.pitch_x_mm * sensor.pitch_y_mm;
        let [least, most] = LENGTH_PER_TAXEL.map(|share| (share * area_mm2).sqrt());
        let length_mm = (LENGTH_PER_DEPTH * sensor.thickness_mm).clamp(least, most);
        let mut alive = vec![true; sensor.taxels()];
        scene.input.dead.iter().for_each(|[row, col]| alive[row * sensor.cols + col] = false);
        Evidence {
            cells: Cells::new(sensor, scene.medium, length_mm),
            length_mm,
            prior: Prior { mu_max: scene.search.mu_max },
            alive,
            unipolar: scene.input.unipolar,
            gain_spread: scene.input.gain_spread,
            noise_shares: vec![1.0; sensor.taxels()],
            adviser: None,
        }
    }

    /// The same estimator with noise that differs between taxels: `shares` is the standard deviation of each one over
    /// the root mean square of all, a value per taxel.
    pub fn with_noise_shares(self, shares: Vec<f64>) -> Evidence {
        Evidence { noise_shares: shares, ..self }
    }

    /// The same with the μ of each contact from a trained network; `combined` with the evidence's own or in its place.
    pub fn advised_by(self, network: Learned, combined: bool) -> Evidence {
        Evidence { adviser: Some(Adviser { network, combined }), ..self }
    }

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

    /// The taxels that are read: all of a small array, those near the pressure `p` (N per cell) of a large one.
    fn window(&self, p: &[f64], sigma: f64) -> Vec<usize> {
        let all = (0..self.alive.len()).filter(|&taxel| self.alive[taxel]);
        if self.alive.len() <= WINDOW_FROM {
            return all.collect();
        }
        let sensor = &self.cells.sensor;
        let lines = |pitch: f64| (WINDOW * sensor.thickness_mm / pitch).ceil() as usize + 1;
        let (along_x, along_y) = (lines(sensor.pitch_x_mm), lines(sensor.pitch_y_mm));
        let mut near = vec![false; self.alive.len()];
        let loaded = envelope::envelope(&self.cells, p, self.length_mm, sigma);
        let mut seen = vec![false; self.alive.len()];
        for cell in (0..loaded.len()).filter(|&cell| loaded[cell] > 0.0) {
            let taxel = self.cells.taxel_of(cell);
            if std::mem::replace(&mut seen[taxel], true) {
                continue;
            }
            let (row, col) = (taxel / sensor.cols, taxel % sensor.cols);
            for r in row.saturating_sub(along_y)..(row + along_y + 1).min(sensor.rows) {
                for c in col.saturating_sub(along_x)..(col + along_x + 1).min(sensor.cols) {
                    near[r * sensor.cols + c] = true;
                }
            }
        }
        all.filter(|&taxel| near[taxel]).collect()
    }
}
