//! Contact: force and standard deviation of each contact, from the posterior of its pressure and its μ.
//!
//! The load Fz = 1ᵀp given μ has the variance fᵀM⁻¹f, f = Fᵀ1; it moves with μ by j = fᵀ ∂w/∂μ. With the covariance V
//! of all μ, to first order,
//!
//! ```text
//! dFz = j·dμ + ε        dT = Fz dμ + μ dFz
//! ```
//!
//! The envelope is taken as known, which makes the variances too small: on drawn frames of sensor-1 and sensor-2 the
//! error of the load has another 0.5 % at every noise level, which are added to its variance.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: f | r | N |
//! | out: force and standard deviation | 3 per contact | N, [x, y, normal] |

use super::ascent::Top;
use super::model::{Design, Readings};
use faer::Mat;

/// Standard deviation, as a share of the load, of what the envelope leaves out.
const ENVELOPE_SHARE: f64 = 0.005;

/// Force of a contact with its standard deviation.
pub(super) struct ContactForce {
    /// N, [x, y, normal].
    pub force_N: [f64; 3],
    /// N, [x, y, normal].
    pub sigma_N: [f64; 3],
    /// Covariance of μ, [xx, xy, yy].
    pub mu_covariance: [f64; 3],
}

/// The force of every contact; `loads` is f for each of them, 0 for the coefficients of the others,
/// `covariance` that of all μ.
pub(super) fn forces(
    (design, readings): (&Design, &Readings),
    top: &Top,
    covariance: &Mat<f64>,
    loads: &[Vec<f64>],
) -> Vec<ContactForce> {
    let unknowns = 2 * loads.len();
    let drift = design.drift(readings, &top.posterior);
    let one = |k: usize| {
        let f = &loads[k];
        let r = f.len();
        let dot = |i: usize| -> f64 { (0..r).map(|j| top.posterior.covariance()[(i, j)] * f[j]).sum() };
        let given: f64 = (0..r).map(|i| f[i] * dot(i)).sum();
        let normal: f64 = f.iter().zip(&top.posterior.w).map(|(f, w)| f * w).sum();
        let slope: Vec<f64> = (0..unknowns).map(|u| (0..r).map(|i| f[i] * drift[(i, u)]).sum()).collect();
        let quadratic = |a: &[f64]| -> f64 {
            (0..unknowns).map(|i| (0..unknowns).map(|j| a[i] * covariance[(i, j)] * a[j]).sum::<f64>()).sum()
        };
        let along = |axis: usize| {
            let mu = top.mu[k][axis];
            let total: Vec<f64> =
                (0..unknowns).map(|u| mu * slope[u] + if u == 2 * k + axis { normal } else { 0.0 }).collect();
            (mu * normal, (quadratic(&total) + mu * mu * given).max(0.0).sqrt())
        };
        let load_N = (quadratic(&slope) + given).max(0.0).sqrt().hypot(ENVELOPE_SHARE * normal);
        let ((x, sx), (y, sy)) = (along(0), along(1));
        let at = |a: usize, b: usize| covariance[(2 * k + a, 2 * k + b)];
        ContactForce {
            force_N: [x, y, normal],
            sigma_N: [sx, sy, load_N],
            mu_covariance: [at(0, 0), at(0, 1), at(1, 1)],
        }
    };
    (0..loads.len()).map(one).collect()
}
