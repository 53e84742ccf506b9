//! Residual: whether what the estimate leaves of each reading can be noise.
//!
//! With T the precision of reading t, r what is left of it and v the variance of the posterior's stress there, the other
//! readings alone would predict it with an error of r/(1 − T v), whose variance is 1/(T (1 − T v)). So
//!
//! ```text
//! u_t = r √T / √(1 − T v)        is normal with variance 1 where only noise is left
//! C = Σ u_s u_t / √pairs         over pairs of neighbours is normal with variance 1 where the noise is white (Moran 1950)
//! ```
//!
//! Where the noise is found from the frame, a reading that no force explains enlarges it: u is compared with the noise of the
//! other readings (externally studentised).
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: readings, stress of the posterior | readings | MPa, 1/MPa² |
//! | out: u, C, the worst reading | readings, 1, 1 | – |

use super::model::Readings;
use crate::spec::sensor::Sensor;

/// Smallest share of its variance that a reading leaves; below it the others say nothing of it.
const FREE: f64 = 1e-6;

/// What an estimate leaves of its readings.
pub(super) struct Residual {
    /// u of each reading; `None` of clipped and missing ones.
    pub u: Vec<Option<f64>>,
    /// Readings less coefficients: what is free of the sum of u².
    freedom: f64,
    /// Σ r² T.
    square: f64,
}

impl Residual {
    /// The residual of `readings`; `counts` says which count, `stress` is mean and variance of the posterior's stress.
    pub fn new(readings: &Readings, counts: impl Fn(usize) -> bool, stress: &[[f64; 2]]) -> Residual {
        let (mut freedom, mut square) = (0.0, 0.0);
        let mut own = |(k, &[mean, variance]): (usize, &[f64; 2])| {
            let precision = readings.precision[k];
            let free = 1.0 - precision * variance;
            let left = (readings.y[k] - mean) * precision.sqrt();
            counts(k).then(|| {
                freedom += free;
                square += left * left;
                left / free.max(FREE).sqrt()
            })
        };
        let u = stress.iter().enumerate().map(&mut own).collect();
        Residual { u, freedom, square }
    }

    /// The reading with the largest |u|, and that over the noise of the others; `least` is the smallest noise over the one
    /// that the precisions assume: 1 where the noise is stated.
    pub fn worst(&self, least: f64) -> Option<(usize, f64)> {
        let sizes = self.u.iter().enumerate().filter_map(|(k, u)| Some((k, u.as_ref()?.abs())));
        let (k, size) = sizes.max_by(|a, b| a.1.total_cmp(&b.1))?;
        let others = ((self.square - size * size) / (self.freedom - 1.0).max(1.0)).max(0.0).sqrt();
        Some((k, size / others.max(least)))
    }

    /// C over the neighbours among the readings of `taxels`.
    pub fn correlation(&self, sensor: &Sensor, taxels: &[usize]) -> f64 {
        let mut of_taxel = vec![None; sensor.taxels()];
        taxels.iter().zip(&self.u).for_each(|(&taxel, u)| of_taxel[taxel] = *u);
        let (mut sum, mut pairs) = (0.0, 0.0f64);
        for taxel in 0..of_taxel.len() {
            let right = ((taxel + 1) % sensor.cols > 0).then_some(taxel + 1);
            let below = (taxel + sensor.cols < of_taxel.len()).then_some(taxel + sensor.cols);
            for other in [right, below].into_iter().flatten() {
                if let (Some(a), Some(b)) = (of_taxel[taxel], of_taxel[other]) {
                    sum += a * b;
                    pairs += 1.0;
                }
            }
        }
        sum / pairs.max(1.0).sqrt()
    }
}
