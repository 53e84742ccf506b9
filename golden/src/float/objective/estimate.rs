//! Subject and estimate: what an objective is given of a subarray, and what it gives back.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: subarray, b, family p(μ), largest \|μ\|, noise | –, n, –, –, scalar | mm, MPa, N, –, MPa |
//! | out: μ, its objective, evaluations | 2, scalar, count | –, of the objective, – |
//! | out: load | scalar | N, where the objective knows it better than Σp |

use crate::float::pass::Polynomial;
use crate::float::search::{SearchResult, RADIUS};
use crate::sensor::Sensor;

/// One subarray in one frame.
#[derive(Clone, Copy, Debug)]
pub struct SearchInput<'a> {
    /// The subarray as a sensor; positions count from its own centre.
    pub sensor: &'a Sensor,
    /// Stress, row-major.
    pub b: &'a [f64],
    /// Its consistent family.
    pub family: &'a Polynomial,
    /// Largest |μ|.
    pub mu_max: f64,
    /// Standard deviation of the noise on b as the scene states it, 0 when unknown.
    pub noise_MPa: f64,
}

/// What was found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// μ, score and evaluations.
    pub found: SearchResult,
    /// Normal load, to which the forces are to be scaled.
    pub load_N: Option<f64>,
}

/// Share of the largest p₀ a taxel must exceed to count for the centre.
const COUNTS_FROM: f64 = 0.3;
/// Distance from the largest p₀ in depths (and one pitch) within which taxels count.
const NEAR: f64 = 2.5;

impl SearchInput<'_> {
    /// Centroid of the strong p₀ around its peak, in mm: where a contact's fit starts.
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

impl Estimate {
    /// p(μ) in N, scaled to the load where the objective knows it. The sum over cells is off by their coarseness, up to
    /// 2 % where the pitch exceeds the depth.
    pub fn pressure(&self, family: &Polynomial) -> Vec<f64> {
        let mut p = family.eval(self.found.mu);
        let sum: f64 = p.iter().sum();
        if let Some(scale) = self.load_N.map(|load| load / sum).filter(|scale| *scale > 0.0 && scale.is_finite()) {
            p.iter_mut().for_each(|p| *p *= scale);
        }
        p
    }

    /// The estimate of an objective that finds the contact's force, `None` when it pulls. Shear beyond `mu_max` is cut
    /// to it.
    pub(super) fn of_force(force: [f64; 3], mu_max: f64, objective: f64, evaluations: usize) -> Option<Estimate> {
        let [x, y, load] = force;
        if !(load > 0.0 && force.iter().all(|f| f.is_finite())) {
            return None;
        }
        let ratio = (x / load).hypot(y / load);
        let cut = if ratio > mu_max { mu_max / ratio } else { 1.0 };
        let mu = [x, y].map(|f| f / load * cut);
        // The nearest place of the grid, for those who need whole numbers.
        let unit = f64::from(RADIUS) / mu_max.max(f64::MIN_POSITIVE);
        let position = mu.map(|mu| (mu * unit) as i32);
        Some(Estimate { found: SearchResult { mu, position, objective, evaluations }, load_N: Some(load) })
    }
}
