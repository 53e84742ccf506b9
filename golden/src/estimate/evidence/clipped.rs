//! Clipped: what a reading of zero says on an array that reads no tension.
//!
//! Such a reading bounds the stress, b + noise ≤ 0, with probability Φ(−b/σ). Expectation propagation (Minka 2001)
//! replaces it by a normal reading of its own mean and precision, the one with which the posterior of b keeps its first
//! two moments: with m, v those of b without the reading, s² = σ² + v, z = −m/s, ρ = φ(z)/Φ(z), δ = ρ(z + ρ)/s²,
//!
//! ```text
//! precision τ = δ/(1 − vδ)        mean (τ m̂ − ρ/s)/τ,  m̂ = m − vρ/s
//! ```
//!
//! Where b is surely negative, τ is zero: the reading is missing. Where b is surely positive it is a reading of zero.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: b with its variance | clipped readings | MPa, MPa² |
//! | out: reading, precision | clipped readings | MPa, 1/MPa² |

use super::model::Readings;
use std::f64::consts::{FRAC_1_SQRT_2, TAU};

/// φ(z)/Φ(z).
fn mills(z: f64) -> f64 {
    if z < -6.0 {
        // Continued fraction of the ratio; 20 terms are exact to rounding from 6 on.
        return -z + (1..=20).rev().fold(0.0, |tail, k| f64::from(k) / (-z + tail));
    }
    (-0.5 * z * z).exp() / TAU.sqrt() / (0.5 * libm::erfc(-z * FRAC_1_SQRT_2))
}

/// Replaces clipped reading `t` by the one that agrees with the posterior's stress there, its mean in MPa and variance in
/// MPa²; `sigma` is the reading's noise in MPa.
pub(super) fn update(readings: &mut Readings, t: usize, [mean, variance]: [f64; 2], sigma: f64) {
    let (y, precision) = (readings.y[t], readings.precision[t]);
    // Without the reading itself.
    let rest = 1.0 / variance - precision;
    if rest.is_nan() || rest <= 0.0 {
        return;
    }
    let v = 1.0 / rest;
    let m = v * (mean / variance - precision * y);
    let s = (sigma * sigma + v).sqrt();
    let z = -m / s;
    let ratio = mills(z);
    let delta = ratio * (z + ratio) / (s * s);
    let tau = delta / (1.0 - v * delta);
    let own = tau * (m - v * ratio / s) - ratio / s;
    let found = tau.is_finite() && tau > f64::MIN_POSITIVE.sqrt();
    (readings.y[t], readings.precision[t]) = if found { (own / tau, tau) } else { (0.0, 0.0) };
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimate::evidence::model::Design;
    use faer::Mat;

    #[test]
    fn ratio_by_hand_and_without_a_step() {
        assert!((mills(0.0) - (2.0 / std::f64::consts::PI).sqrt()).abs() < 1e-15);
        // φ(−6)/Φ(−6) to ten digits.
        let (a, b) = (mills(-6.0 + 1e-9), mills(-6.0 - 1e-9));
        assert!((a - b).abs() < 1e-8 && (b - 6.158_482_604).abs() < 1e-6, "{a} {b}");
    }

    /// One coefficient, one clipped reading: the moments of the posterior are those of the exact one, by quadrature.
    #[test]
    fn moments_are_exact_for_one_reading() {
        for (shift, sigma) in [(0.0, 0.3), (2.0, 0.5), (-1.0, 0.01)] {
            let design = Design {
                s: Mat::from_fn(6, 1, |row, _| if row < 2 { 1.0 } else { 0.0 }),
                contact: vec![0],
                baseline: 0,
                spread: Mat::zeros(4, 1),
            };
            let mut readings = Readings { y: vec![shift, 0.0], precision: vec![2.0, 0.0] };
            let mu = [[0.0; 2]];
            for _ in 0..3 {
                let posterior = design.posterior(&readings, &mu).unwrap();
                let stress = posterior.stress(&readings)[1];
                update(&mut readings, 1, stress, sigma);
            }
            let posterior = design.posterior(&readings, &mu).unwrap();
            let density = |w: f64| {
                let normal = (-0.5 * (w * w + 2.0 * (w - shift).powi(2))).exp();
                normal * 0.5 * libm::erfc(w / sigma * FRAC_1_SQRT_2)
            };
            let moment = |power: i32| {
                (-80_000..80_000).map(|k| f64::from(k) * 1e-4).map(|w| w.powi(power) * density(w)).sum::<f64>()
            };
            let (zero, mean) = (moment(0), moment(1) / moment(0));
            let variance = moment(2) / zero - mean * mean;
            assert!((posterior.w[0] - mean).abs() < 1e-3, "{shift}: {} {mean}", posterior.w[0]);
            assert!((posterior.covariance()[(0, 0)] - variance).abs() < 1e-3, "{shift}");
        }
    }
}
