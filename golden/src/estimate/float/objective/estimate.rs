//! Objective: what every objective does, with the input and result of its search for μ in one subarray.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: subarray, b, family p(μ), largest \|μ\|, noise | –, n, –, –, scalar | mm, MPa, N, –, MPa |
//! | out: μ, its objective, evaluations | 2, scalar, count | –, of the objective, – |
//! | out: load | scalar | N, where the objective knows it more accurately than Σp |

use super::fit::misfit_limit;
use crate::estimate::float::pass::Polynomial;
use crate::estimate::float::search::{search, SearchResult, RADIUS};
use crate::estimate::learned::Gaussian;
use crate::result::checks::relative_spread;
use crate::spec::sensor::Sensor;

/// A score for candidates; the search takes the largest.
pub trait Objective {
    /// Score of the normal forces `p` in N; `None` unless Σp is above zero and finite.
    fn score(&self, p: &[f64]) -> Option<f64>;

    /// The best μ of a subarray, `None` if no candidate has a score. By default the shared search over the scores; an
    /// objective may have its own method.
    fn find(&self, input: &SearchInput) -> Option<MuEstimate> {
        let found = search(input.family, input.mu_max, &|p| self.score(p))?;
        Some(MuEstimate { found, load_N: None, sigma: None })
    }
}

/// One subarray in one frame: the input of [`Objective::find`].
#[derive(Clone, Copy, Debug)]
pub struct SearchInput<'a> {
    /// The subarray as a sensor; positions are relative to its own centre.
    pub sensor: &'a Sensor,
    /// Stress in MPa, row-major.
    pub b: &'a [f64],
    /// The polynomial p(μ) of the stress.
    pub family: &'a Polynomial,
    /// Largest |μ|.
    pub mu_max: f64,
    /// Standard deviation of the noise on b in MPa as the scene states it, 0 if unknown.
    pub noise_MPa: f64,
}

/// The best μ, and the load if the objective finds it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MuEstimate {
    /// μ, score and evaluations.
    pub found: SearchResult,
    /// Normal load in N to which the forces are scaled; `None` leaves them as they are.
    pub load_N: Option<f64>,
    /// Standard deviation of μ, [x, y], if the estimator knows it.
    pub sigma: Option<[f64; 2]>,
}

/// Ratio of a Hertz contact's radius to that of the disc where its pressure exceeds [`COUNTS_FROM`]: (1 − 0.3²)^−½.
const RIM: f64 = 1.05;
/// Radius in depths from which on a contact is wide: the fits of ellipses then take more nodes and a wider start.
pub(super) const WIDE_FROM: f64 = 2.5;

/// Fraction of the largest p₀ that a taxel must exceed to count for the centre.
const COUNTS_FROM: f64 = 0.3;
/// Distance from the largest p₀ within which taxels count, in depths; one pitch is added.
const NEAR: f64 = 2.5;

impl SearchInput<'_> {
    /// Centroid of the large p₀ around its peak in mm from the subarray's centre: the initial centre of a contact's
    /// fit.
    pub fn centre_mm(&self) -> [f64; 2] {
        let p = self.family.v(0, 0);
        let place = |index: usize| self.sensor.position_mm(index / self.sensor.cols, index % self.sensor.cols);
        let Some((peak, largest)) = p.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1)) else { return [0.0; 2] };
        let centre = place(peak);
        let near = NEAR * self.sensor.thickness_mm + self.sensor.pitch_x_mm.max(self.sensor.pitch_y_mm);
        let (mut weight, mut sum) = (0.0, [0.0; 2]);
        for (index, p) in p.iter().enumerate() {
            let [x, y] = place(index);
            let excess = p - COUNTS_FROM * largest;
            if excess > 0.0 && (x - centre[0]).hypot(y - centre[1]) <= near {
                weight += excess;
                sum = [sum[0] + excess * x, sum[1] + excess * y];
            }
        }
        if weight > 0.0 {
            sum.map(|sum| sum / weight)
        } else {
            centre
        }
    }
}

impl SearchInput<'_> {
    /// Radius in mm of a wide contact, from the area where p₀ exceeds [`COUNTS_FROM`]; `None` below [`WIDE_FROM`].
    pub(super) fn wide_radius_mm(&self) -> Option<f64> {
        let p = self.family.v(0, 0);
        let largest = p.iter().copied().fold(0.0, f64::max);
        let cells = p.iter().filter(|p| **p > COUNTS_FROM * largest).count();
        let area = cells as f64 * self.sensor.pitch_x_mm * self.sensor.pitch_y_mm;
        Some(RIM * (area / std::f64::consts::PI).sqrt()).filter(|radius| *radius > WIDE_FROM * self.sensor.thickness_mm)
    }
}

impl MuEstimate {
    /// A normal density of μ: its mean, standard deviation, and the mean's position on the search grid. The objective is ln
    /// of the density at the mean.
    pub fn of_density(mu: [f64; 2], sigma: [f64; 2], position: [i32; 2]) -> MuEstimate {
        let objective = -sigma.iter().map(|sigma| (sigma * std::f64::consts::TAU.sqrt()).ln()).sum::<f64>();
        let found = SearchResult { mu, position, objective, evaluations: 1 };
        MuEstimate { found, load_N: None, sigma: Some(sigma) }
    }

    /// The output of a network, at the nearest position of the search grid.
    pub fn of_network(output: &Gaussian, mu_max: f64) -> MuEstimate {
        let position = output.mean.map(|mu| (mu * f64::from(RADIUS) / mu_max).round() as i32);
        MuEstimate::of_density(output.mean, output.sigma, position)
    }

    /// Standard deviation of the shear over its size, that of a hundredth of the normal force at least, if σ is known.
    pub fn shear_spread(&self) -> Option<f64> {
        self.sigma.map(|sigma| relative_spread(self.found.mu, sigma, 1.0))
    }

    /// Root mean square of the misfit over what the noise and the fit's own error explain, for the estimate of a fit;
    /// above 1 the contact is of another shape or the noise larger than stated.
    pub fn shape_misfit(&self, b: &[f64], noise_MPa: f64) -> Option<f64> {
        self.load_N.map(|_| (-self.found.objective / misfit_limit(b, noise_MPa)).sqrt())
    }

    /// p(μ) in N, scaled to the load if the objective finds it: the sum over cells is inaccurate by up to 2 % where the
    /// pitch exceeds the depth.
    pub fn pressure(&self, family: &Polynomial) -> Vec<f64> {
        let mut p = family.eval(self.found.mu);
        let sum: f64 = p.iter().sum();
        if let Some(scale) = self.load_N.map(|load| load / sum).filter(|scale| *scale > 0.0 && scale.is_finite()) {
            p.iter_mut().for_each(|p| *p *= scale);
        }
        p
    }

    /// The estimate for a contact force in N, [x, y, normal]; `None` if it is not compressive. Shear beyond `mu_max` is
    /// reduced to it.
    pub(super) fn of_force(force: [f64; 3], mu_max: f64, objective: f64, evaluations: usize) -> Option<MuEstimate> {
        let [x, y, load] = force;
        if !(load > 0.0 && force.iter().all(|f| f.is_finite())) {
            return None;
        }
        let ratio = (x / load).hypot(y / load);
        let cut = if ratio > mu_max { mu_max / ratio } else { 1.0 };
        let mu = [x, y].map(|f| f / load * cut);
        // The position on the search grid, rounded towards 0.
        let unit = f64::from(RADIUS) / mu_max.max(f64::MIN_POSITIVE);
        let position = mu.map(|mu| (mu * unit) as i32);
        Some(MuEstimate {
            found: SearchResult { mu, position, objective, evaluations },
            load_N: Some(load),
            sigma: None,
        })
    }
}
