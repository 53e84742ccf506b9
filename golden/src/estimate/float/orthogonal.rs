//! Orthogonal: the paper's Eq. 1 as it is printed, with dense matrices.
//!
//! C = [Cx Cy Cz] is n × 3n, and all forces that cause the stress b are
//!
//! ```text
//! x = C†b + (I − C†C) w          w(μ) = (μ1 p, μ2 p, p)
//! ```
//!
//! with C† the Moore–Penrose inverse. If p is that of the exact series at μ, then C w = b and x = w: this form and the
//! oblique one (p = Cz⁺ b and its series in μ) are the same. With the series cut off at a degree, C w misses b by the
//! remainder; x is then the point nearest to w with C x = b, and ‖x − w‖/‖w‖ is the truncation error.
//! | | shape | unit |
//! |---|---|---|
//! | in: b | n ≤ [`MAX_TAXELS`] | MPa |
//! | in: w | 3 × n | N |
//! | out: x | 3 × n | N |
//!
//! 3n² + 9n² multiplications for one x, against n²/4 for one term of the series: for verification, not for speed.

use crate::data::frame::Forces;
use crate::physics::matrices::Matrices;
use crate::physics::symmetry::folded::accumulate;
use crate::spec::sensor::Sensor;
use faer::Mat;
use thiserror::Error;

/// Maximum taxels of a subarray: I − C†C of 24 × 24 taxels takes 24 MB.
pub const MAX_TAXELS: usize = 576;

/// The matrices of Eq. 1.
#[derive(Clone, Debug)]
pub struct Orthogonal {
    /// C†, 3n × n, in N per MPa.
    pub pinv: Mat<f64>,
    /// I − C†C, 3n × 3n.
    pub projector: Mat<f64>,
}

/// A subarray for which Eq. 1 cannot be set up as printed.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum OrthogonalError {
    /// More than [`MAX_TAXELS`] taxels.
    #[error("search.form = orthogonal: a subarray of {taxels} taxels ({sensor}) is too large: at most {MAX_TAXELS}")]
    TooLarge {
        /// The subarray as a sensor.
        sensor: Box<Sensor>,
        /// Its number of taxels.
        taxels: usize,
    },
    /// The singular value decomposition did not converge.
    #[error("{sensor}: no singular values of C found")]
    NotConverged {
        /// The subarray as a sensor.
        sensor: Box<Sensor>,
    },
}

/// C = [Cx Cy Cz], n × 3n, in MPa/N.
pub fn influence(matrices: &Matrices) -> Mat<f64> {
    let Matrices { cx, cy, cz, .. } = matrices;
    let n = cz.nrows();
    Mat::from_fn(n, 3 * n, |i, k| [cx, cy, cz][k / n][(i, k % n)])
}

impl Orthogonal {
    /// Computes C† from the singular values of C, inverted by the same rule as for Cz⁺.
    ///
    /// # Errors
    /// [`OrthogonalError`]; the size is checked before anything is allocated.
    pub fn new(matrices: &Matrices) -> Result<Orthogonal, OrthogonalError> {
        let sensor = || Box::new(matrices.sensor.clone());
        let taxels = matrices.sensor.taxels();
        if taxels > MAX_TAXELS {
            return Err(OrthogonalError::TooLarge { sensor: sensor(), taxels });
        }
        let c = influence(matrices);
        let svd = c.thin_svd().map_err(|_| OrthogonalError::NotConverged { sensor: sensor() })?;
        let values: Vec<f64> = svd.S().column_vector().iter().copied().collect();
        let largest = values.iter().fold(0.0, |largest: f64, v| largest.max(*v));
        let invert = |v: f64| matrices.inversion.invert(v, largest, 3 * taxels);
        let scaled = Mat::from_fn(3 * taxels, taxels, |i, k| svd.V()[(i, k)] * invert(values[k]));
        let pinv = &scaled * svd.U().transpose();
        let projector = Mat::<f64>::identity(3 * taxels, 3 * taxels) - &pinv * &c;
        Ok(Orthogonal { pinv, projector })
    }

    /// x = C†b + (I − C†C) w in N, for stress `b` in MPa and forces `w` in N.
    pub fn apply(&self, b: &[f64], w: &Forces) -> Forces {
        let n = b.len();
        let joined: Vec<f64> = [&w.fx, &w.fy, &w.fz].into_iter().flatten().copied().collect();
        let mut x = vec![0.0; 3 * n];
        accumulate(&self.pinv, b, 1.0, &mut x);
        accumulate(&self.projector, &joined, 1.0, &mut x);
        let part = |k: usize| x[k * n..(k + 1) * n].to_vec();
        Forces { fx: part(0), fy: part(1), fz: part(2) }
    }
}

/// Truncation error ‖x − w‖/‖w‖, a fraction; 0 where both are equal.
pub fn truncation(x: &Forces, w: &Forces) -> f64 {
    let pairs = [(&x.fx, &w.fx), (&x.fy, &w.fy), (&x.fz, &w.fz)];
    let (mut off, mut size) = (0.0, 0.0);
    for (x, w) in pairs.into_iter().flat_map(|(x, w)| x.iter().zip(w)) {
        off += (x - w) * (x - w);
        size += w * w;
    }
    if off == 0.0 {
        0.0
    } else {
        (off / size).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::frame::Frame;
    use crate::estimate::float::forces::{force, residual};
    use crate::estimate::float::pass::{solve_direct, Polynomial};
    use crate::spec::scene::Scene;

    /// Required agreement of both forms; rounding and condition cause 1e-13.
    const AGREE: f64 = 1e-9;
    /// Rounding of products over 1200 terms with an inverse of condition 20: 1200 · 20 · 2⁻⁵² = 5e-12.
    const ROUNDING: f64 = 5e-12;

    fn setting(sensor: &str) -> (Matrices, Orthogonal, Frame) {
        let scene = Scene::builtin(sensor).unwrap();
        let matrices = Matrices::new(&scene.sensor, scene.search.mu_max).unwrap();
        let orthogonal = Orthogonal::new(&matrices).unwrap();
        (matrices, orthogonal, Frame::shipped(&scene).remove(0))
    }

    fn check(sensor: &str) {
        let (matrices, orthogonal, frame) = setting(sensor);
        let b = &frame.stress_MPa;
        let family = Polynomial::new(&matrices, b);
        for mu in [[0.0, 0.0], [0.25, 0.15], [-0.4, 0.3], [0.0, -0.6]] {
            let w = force(&solve_direct(&matrices, b, mu), mu, 0.0);
            let off = truncation(&orthogonal.apply(b, &w), &w);
            assert!(off <= AGREE, "{sensor}, {mu:?}: {off:e}");
            // The series: what is left out is of the order ratio^(d+1), the ratio of its terms at this μ.
            let w = force(&family.eval(mu), mu, 0.0);
            let x = orthogonal.apply(b, &w);
            let ratio = matrices.spectral_radius * mu[0].hypot(mu[1]) / 0.6;
            let bound = ratio.powi(matrices.degree as i32 + 1) / (1.0 - ratio) + AGREE;
            assert!(truncation(&x, &w) <= bound, "{sensor}, {mu:?}: {:e} {bound:e}", truncation(&x, &w));
            // For any w, C x = b.
            assert!(residual(&matrices, b, &x).iter().all(|rest| rest.abs() <= ROUNDING * frame.peak_MPa()));
        }
    }

    #[test]
    fn both_forms_agree_on_sensors_1_2_and_8() {
        for sensor in ["sensor-1", "sensor-2", "eight-by-eight"] {
            check(sensor);
        }
    }

    #[test]
    fn both_forms_agree_on_sensor_3() {
        check("sensor-3");
    }

    #[test]
    fn moore_and_penrose() {
        for sensor in ["sensor-1", "eight-by-eight"] {
            let (matrices, Orthogonal { pinv, projector }, _) = setting(sensor);
            let c = influence(&matrices);
            let near = |a: &Mat<f64>, b: &Mat<f64>| (a - b).norm_max() <= ROUNDING * b.norm_max();
            let (left, right) = (&c * &pinv, &pinv * &c);
            assert!(near(&(&left * &c), &c));
            assert!(near(&(&right * &pinv), &pinv));
            assert!(near(&left.transpose().to_owned(), &left));
            assert!(near(&right.transpose().to_owned(), &right));
            // I − C†C is a projection, onto the null space of C.
            assert!(near(&(&projector * &projector), &projector));
            assert!((&c * &projector).norm_max() <= ROUNDING * c.norm_max());
        }
    }

    #[test]
    fn a_large_subarray_is_refused() {
        let sensor = Sensor { rows: 25, cols: 24, pitch_x_mm: 8.0, pitch_y_mm: 8.0, thickness_mm: 0.91 };
        let matrices = Matrices::new(&sensor, 0.6).unwrap();
        let error = Orthogonal::new(&matrices).unwrap_err();
        assert!(matches!(error, OrthogonalError::TooLarge { taxels: 600, .. }));
    }
}
