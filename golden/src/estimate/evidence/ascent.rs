//! Ascent: the μ of every contact at which the evidence, times a prior on μ, is largest.
//!
//! ```text
//! log posterior = log evidence − |μ|²/2s²        s = 0.4 mu_max
//! step = (J + 1/s²)⁻¹ (slope − μ/s²)             J the information of μ
//! ```
//!
//! A step that does not raise the log posterior is halved. The prior is that of friction: without it a noisy frame gives
//! a shear that is worse than none. μ stays within mu_max.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: μ | contacts × 2 | – |
//! | out: μ, covariance (J + 1/s²)⁻¹ | contacts × 2, square of it | – |

use super::cholesky::Cholesky;
use super::model::{Design, Posterior, Readings, Slope};
use faer::Mat;

/// Halvings of a step before the ascent ends.
const HALVINGS: usize = 6;
/// s in units of mu_max.
const SPREAD: f64 = 0.4;
/// Rounding of J relative to its largest entry.
const ROUNDING: f64 = 1e-6;
/// Length of a step, in units of mu_max, below which the ascent ends.
pub(super) const TOLERANCE: f64 = 1e-4;

/// Range and prior of μ.
#[derive(Clone, Copy)]
pub(super) struct Prior {
    /// Largest |μ|.
    pub mu_max: f64,
}

/// The top that an ascent reached.
pub(super) struct Top {
    /// μ of each contact.
    pub mu: Vec<[f64; 2]>,
    /// The posterior there.
    pub posterior: Posterior,
    /// Slope and information there.
    pub slope: Slope,
    /// Number of posteriors on the way.
    pub posteriors: usize,
}

impl Prior {
    /// 1/s².
    pub fn precision(self) -> f64 {
        (SPREAD * self.mu_max).powi(-2)
    }

    fn log(self, mu: &[[f64; 2]]) -> f64 {
        -0.5 * self.precision() * mu.iter().map(|[x, y]| x * x + y * y).sum::<f64>()
    }

    fn within(self, [x, y]: [f64; 2]) -> [f64; 2] {
        let size = x.hypot(y);
        if size > self.mu_max {
            [x, y].map(|mu| mu * self.mu_max / size)
        } else {
            [x, y]
        }
    }

    /// J + 1/s², whose inverse is the covariance of μ, factored. J is a difference of large matrices: where rounding makes it
    /// indefinite, it is raised by the rounding that it can have. `None` if it is not representable.
    fn information(self, slope: &Slope) -> Option<Cholesky> {
        let n = slope.gradient.len();
        let factor = |raised: f64| {
            let own =
                |i: usize, j: usize| slope.information[(i, j)] + if i == j { self.precision() + raised } else { 0.0 };
            Cholesky::new(Mat::from_fn(n, n, own))
        };
        let largest = (0..n).map(|i| slope.information[(i, i)].abs()).fold(0.0, f64::max);
        factor(0.0).or_else(|| factor(ROUNDING * largest)).or_else(|| factor(largest))
    }

    /// The covariance of `unknowns` entries of μ of which the stress says nothing.
    pub fn unresolved(self, unknowns: usize) -> Mat<f64> {
        Mat::from_fn(unknowns, unknowns, |i, j| if i == j { 1.0 / self.precision() } else { 0.0 })
    }

    /// The covariance of all μ; `None` if it is not representable.
    pub fn covariance(self, slope: &Slope) -> Option<Mat<f64>> {
        self.information(slope).map(|factor| factor.inverse())
    }
}

/// Ascends from `mu` by at most `steps` steps; `None` if the model is not representable there.
pub(super) fn ascend(design: &Design, readings: &Readings, mu: &[[f64; 2]], prior: Prior, steps: usize) -> Option<Top> {
    let top = |mu: Vec<[f64; 2]>, posterior: Posterior| {
        let slope = design.slope(readings, &posterior);
        Top { mu, posterior, slope, posteriors: 0 }
    };
    let mut best = Top { posteriors: 1, ..top(mu.to_vec(), design.posterior(readings, mu)?) };
    if prior.mu_max == 0.0 {
        return Some(best);
    }
    for _ in 0..steps {
        let value = best.posterior.value + prior.log(&best.mu);
        let uphill = |i: usize| best.slope.gradient[i] - prior.precision() * best.mu[i / 2][i % 2];
        let mut step: Vec<f64> = (0..best.slope.gradient.len()).map(uphill).collect();
        prior.information(&best.slope)?.solve(&mut step);
        let longest = step.iter().fold(0.0f64, |longest, step| step.abs().max(longest));
        if longest <= TOLERANCE * prior.mu_max {
            break;
        }
        let mut share = (prior.mu_max / longest).min(1.0);
        let (mut higher, mut posteriors) = (None, best.posteriors);
        for _ in 0..HALVINGS {
            let moved = |k: usize| {
                let [x, y] = best.mu[k];
                prior.within([x + share * step[2 * k], y + share * step[2 * k + 1]])
            };
            let mu: Vec<[f64; 2]> = (0..best.mu.len()).map(moved).collect();
            posteriors += 1;
            let next = design.posterior(readings, &mu).filter(|next| next.value + prior.log(&mu) > value);
            if let Some(posterior) = next {
                higher = Some(top(mu, posterior));
                break;
            }
            share /= 2.0;
        }
        let ended = higher.is_none();
        best = Top { posteriors, ..higher.unwrap_or(best) };
        if ended {
            break;
        }
    }
    Some(best)
}
