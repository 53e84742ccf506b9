//! Ascent: the log gains at which the presses are most probable, by Fisher scoring with a line search.
//!
//! ```text
//! log posterior = Σ log L − |θ|²/2τ²        on the rough θ, Uᵀθ = 0
//! step = (J + 1/τ² + κ U Uᵀ)⁻¹ (slope − θ/τ²)        J the information, κ far above all of it
//! ```
//!
//! A step is halved until the log posterior rises: where the model is far from the readings the whole step can lead away from the
//! top. κ keeps the smooth patterns U where they are.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: modelled presses, first θ | –, taxels | – |
//! | out: θ, its standard deviations, noise found over noise assumed | taxels, taxels, 1 | – |

use super::likelihood::{Modelled, Sums};
use super::smooth::Smooth;
use crate::estimate::evidence::cholesky::Cholesky;
use faer::Mat;
use rayon::prelude::*;

/// κ over the largest information of a taxel.
const FROZEN: f64 = 1e3;
/// Halvings of a step before the ascent ends.
const HALVINGS: usize = 8;
/// Rise of the log posterior below which the ascent ends.
const SETTLED: f64 = 0.5;
/// Presses whose sums one task makes: the sums do not depend on the number of cores.
const PER_TASK: usize = 16;

/// What is looked for.
pub(super) struct Ascent<'a> {
    /// The taxels whose gain is looked for, ascending; the others keep theirs.
    pub taxels: &'a [usize],
    /// The patterns over them that stay.
    pub smooth: &'a Smooth,
    /// τ, standard deviation of a log gain before a press is looked at.
    pub prior: f64,
}

/// Where an ascent ended.
pub(super) struct Top {
    /// Log gain of each taxel of the array.
    pub theta: Vec<f64>,
    /// Standard deviation of the rough part of each log gain that is looked for.
    pub sigma: Vec<f64>,
    /// Noise that the readings leave over that of the models.
    pub noise_ratio: f64,
}

impl Ascent<'_> {
    /// Ascends from `theta` by at most `steps` steps; `None` where no press can be modelled. `done` is called after each press.
    pub fn climb(
        &self,
        presses: &[&Modelled],
        mut theta: Vec<f64>,
        steps: usize,
        done: &(dyn Fn() + Sync),
    ) -> Option<Top> {
        let mut now = sums(presses, &theta, done);
        let mut height = self.height(&now.values, &theta);
        for _ in 0..steps {
            let step = self.step(&now, &theta)?;
            let (mut share, mut higher) = (1.0, None);
            for _ in 0..HALVINGS {
                let mut next = theta.clone();
                self.taxels.iter().zip(&step).for_each(|(&taxel, step)| next[taxel] += share * step);
                let values: Vec<f64> = presses.par_iter().map(|press| press.value(&next)).collect();
                let reached = self.height(&values, &next);
                if reached > height {
                    higher = Some((next, reached));
                    break;
                }
                share /= 2.0;
            }
            let Some((next, reached)) = higher else { break };
            let rise = reached - height;
            (theta, height) = (next, reached);
            now = sums(presses, &theta, done);
            if rise < SETTLED {
                break;
            }
        }
        let covariance = self.precision(&now)?.inverse();
        let sigma = (0..self.taxels.len()).map(|i| covariance[(i, i)].sqrt()).collect();
        Some(Top { theta, sigma, noise_ratio: (now.left[0] / now.left[1]).sqrt() })
    }

    /// The log posterior.
    fn height(&self, values: &[f64], theta: &[f64]) -> f64 {
        let square: f64 = self.taxels.iter().map(|&taxel| theta[taxel].powi(2)).sum();
        values.iter().sum::<f64>() - square / (2.0 * self.prior.powi(2))
    }

    /// J + 1/τ² + κ U Uᵀ, factored.
    fn precision(&self, now: &Sums) -> Option<Cholesky> {
        let own = |i: usize, j: usize| now.information[(self.taxels[i], self.taxels[j])];
        let largest = (0..self.taxels.len()).map(|i| own(i, i)).fold(0.0, f64::max);
        let n = self.taxels.len();
        let prior = |i: usize, j: usize| if i == j { self.prior.powi(-2) } else { 0.0 };
        Cholesky::new(Mat::from_fn(n, n, |i, j| own(i, j) + prior(i, j) + FROZEN * largest * self.smooth.product(i, j)))
    }

    /// The whole step of the rough part.
    fn step(&self, now: &Sums, theta: &[f64]) -> Option<Vec<f64>> {
        let uphill = |&taxel: &usize| now.slope[taxel] - theta[taxel] / self.prior.powi(2);
        let mut step: Vec<f64> = self.taxels.iter().map(uphill).collect();
        self.smooth.take_off(&mut step);
        self.precision(now)?.solve(&mut step);
        self.smooth.take_off(&mut step);
        Some(step)
    }
}

/// The sums over all presses.
fn sums(presses: &[&Modelled], theta: &[f64], done: &(dyn Fn() + Sync)) -> Sums {
    let of = |presses: &[&Modelled]| {
        let mut own = Sums::none(theta.len());
        for press in presses {
            press.add_to(theta, &mut own);
            done();
        }
        own
    };
    let parts: Vec<Sums> = presses.par_chunks(PER_TASK).map(of).collect();
    parts.into_iter().fold(Sums::none(theta.len()), Sums::and)
}
