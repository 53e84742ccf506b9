//! Matrices: everything about a subarray that does not depend on the frame.
//!
//! Cz⁺ is the pseudo-inverse, Ax = Cz⁺Cx, Ay = Cz⁺Cy. Cz is symmetric (the stress under cell j from cell i is that under
//! i from j), so its singular values are the sizes of its eigenvalues λ and Cz⁺ = U diag(1/λ) Uᵀ, leaving out
//! |λ| ≤ n ε max|λ|.
//!
//! r = mu_max · max over θ of ρ(cos θ Ax + sin θ Ay) says how fast the series in μ converges. Cx and Cy are antisymmetric;
//! with S = |Cz⁺|^½ the eigenvalues of cos θ Ax + sin θ Ay are those of the antisymmetric S (cos θ Cx + sin θ Cy) S where
//! Cz is positive, and bounded by its 2-norm elsewhere. The norm is convex in (cos θ, sin θ) and even in both, so a few
//! directions of one quadrant are enough: 9 miss at most 1 − cos(π/32) = 0.5 %.
//!
//! Degree d: smallest with r^(d+1) ≤ 0.035, at least 3 where r > 0.2, at least 1 where shear is wanted at all.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: sensor | n taxels, n ≤ 2304 | mm |
//! | out: Cz⁺ | n × n | mm² (N per MPa) |
//! | out: Ax, Ay | n × n | – |
//!
//! The mirror symmetry of the array holds to the bit in every matrix, so that folding them is exact.

mod inverse;
mod mirror;

use crate::influence::Influence;
use crate::sensor::{Sensor, SensorError};
use faer::Mat;
use inverse::{product, Inverse};
use mirror::mirror;
use thiserror::Error;

/// Most taxels in one subarray: the 48 × 48 of the largest sensor. A matrix then takes 42 MB.
pub const MAX_TAXELS: usize = 48 * 48;
/// Largest remainder of the series, r^(d+1).
pub const SERIES_TOLERANCE: f64 = 0.035;
/// From this r on the degree is at least 3.
pub const CUBIC_FROM: f64 = 0.2;
/// Highest degree the pipeline is built for.
pub const MAX_DEGREE: usize = 3;
/// From this r on no degree helps.
pub const MAX_RADIUS: f64 = 0.9;

/// The precomputed matrices of one subarray shape.
#[derive(Clone, Debug)]
pub struct Matrices {
    /// The subarray as a sensor.
    pub sensor: Sensor,
    /// Pseudo-inverse of Cz.
    pub cz_pinv: Mat<f64>,
    /// Cz⁺ Cx.
    pub ax: Mat<f64>,
    /// Cz⁺ Cy.
    pub ay: Mat<f64>,
    /// Stress per normal force, MPa/N.
    pub cz: Mat<f64>,
    /// Stress per force along x, MPa/N.
    pub cx: Mat<f64>,
    /// Stress per force along y, MPa/N.
    pub cy: Mat<f64>,
    /// Largest over smallest singular value of Cz; infinite when the smallest is 0.
    pub condition: f64,
    /// r at the scene's mu_max.
    pub spectral_radius: f64,
    /// Degree of the polynomial in μ.
    pub degree: usize,
}

/// A subarray without usable matrices.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum MatricesError {
    /// A size or length out of range.
    #[error("sensor.{0}")]
    Sensor(#[from] SensorError),
    /// More taxels than memory and time are meant for.
    #[error("a subarray of {taxels} taxels ({sensor}) is too large: at most {MAX_TAXELS}; cut it by [partition]")]
    TooLarge {
        /// The subarray.
        sensor: Box<Sensor>,
        /// Its size.
        taxels: usize,
    },
    /// The lengths are so far apart that the influence is not a finite number, or zero.
    #[error("{sensor}: the influence of a cell on its taxel is not representable")]
    NotFinite {
        /// The subarray.
        sensor: Box<Sensor>,
    },
    /// The eigenvalues did not converge.
    #[error("{sensor}: no eigenvalues of Cz found")]
    NotConverged {
        /// The subarray.
        sensor: Box<Sensor>,
    },
    /// The series in μ converges too slowly or not at all.
    #[error("{sensor}: r = {radius:.3} at mu_max = {mu_max} needs more than degree {MAX_DEGREE}; a smaller mu_max, or taxels further apart against the thickness, lower r")]
    SlowSeries {
        /// The subarray.
        sensor: Box<Sensor>,
        /// r, unrounded.
        radius: f64,
        /// The scene's mu_max.
        mu_max: f64,
    },
}

impl Matrices {
    /// Computes the matrices of a (sub)array for shear ratios up to `mu_max` (0 to 2).
    ///
    /// # Errors
    /// [`MatricesError`]; the size is checked before anything is allocated.
    pub fn new(sensor: &Sensor, mu_max: f64) -> Result<Matrices, MatricesError> {
        sensor.check()?;
        let boxed = || Box::new(sensor.clone());
        let n = sensor.taxels();
        if n > MAX_TAXELS {
            let sensor = boxed();
            return Err(MatricesError::TooLarge { sensor, taxels: n });
        }
        let Influence { cx, cy, cz } = Influence::new(sensor);
        let finite = |m: &Mat<f64>| m.col_iter().all(|col| col.iter().all(|c| c.is_finite()));
        if !(finite(&cx) && finite(&cy) && finite(&cz) && cz[(0, 0)] > 0.0) {
            return Err(MatricesError::NotFinite { sensor: boxed() });
        }
        let inverse =
            Inverse::new(&cz).ok_or_else(|| MatricesError::NotConverged { sensor: boxed() })?;
        let mut cz_pinv = inverse.power(1);
        mirror(sensor, &mut cz_pinv, 1.0, 1.0);
        let [mut ax, mut ay] = [&cx, &cy].map(|c| product(&cz_pinv, c));
        mirror(sensor, &mut ax, -1.0, 1.0);
        mirror(sensor, &mut ay, 1.0, -1.0);
        let spectral_radius = mu_max
            * if mu_max > 0.0 {
                inverse.largest_radius(&cx, &cy)
            } else {
                0.0
            };
        let degree = degree(spectral_radius, mu_max).ok_or_else(|| MatricesError::SlowSeries {
            sensor: boxed(),
            radius: spectral_radius,
            mu_max,
        })?;
        Ok(Matrices {
            sensor: sensor.clone(),
            condition: inverse.condition,
            cz_pinv,
            ax,
            ay,
            cz,
            cx,
            cy,
            spectral_radius,
            degree,
        })
    }
}

/// The degree a series of radius `r` needs, `None` when it is more than [`MAX_DEGREE`].
fn degree(r: f64, mu_max: f64) -> Option<usize> {
    if mu_max == 0.0 {
        return Some(0);
    }
    let least = if r > CUBIC_FROM { 3 } else { 1 };
    let enough = |d: &usize| r.powi(*d as i32 + 1) <= SERIES_TOLERANCE;
    (least..=MAX_DEGREE).find(enough).filter(|_| r < MAX_RADIUS)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Scene;
    use proptest::prelude::*;

    /// Rounding of a product of n terms with an inverse of condition κ: n κ ε, here at most 100 · 20 · 2⁻⁵² = 5e-13.
    const INVERSE_TOLERANCE: f64 = 1e-12;

    fn sensor(rows: usize, cols: usize, pitch: [f64; 2], thickness_mm: f64) -> Sensor {
        Sensor {
            rows,
            cols,
            pitch_x_mm: pitch[0],
            pitch_y_mm: pitch[1],
            thickness_mm,
        }
    }

    fn largest(m: &Mat<f64>) -> f64 {
        m.col_iter()
            .flat_map(|col| col.iter())
            .fold(0.0, |size, c| c.abs().max(size))
    }

    fn off_identity(m: &Matrices) -> f64 {
        let n = m.sensor.taxels();
        largest(&(product(&m.cz_pinv, &m.cz) - Mat::<f64>::identity(n, n)))
    }

    #[test]
    fn builtin_sensors_have_the_known_radius_and_degree() {
        // Condition and r to the digits of an independent study, degree by its rule.
        let known = [
            ("sensor-1", 17.0, 0.41),
            ("sensor-2", 4.0, 0.28),
            ("eight-by-eight", 4.0, 0.28),
        ];
        for (name, condition, radius) in known {
            let scene = Scene::builtin(name).unwrap();
            let m = Matrices::new(&scene.sensor, scene.search.mu_max).unwrap();
            assert!(
                (m.condition - condition).abs() < 0.5,
                "{name}: {}",
                m.condition
            );
            assert!(
                (m.spectral_radius - radius).abs() < 0.01,
                "{name}: {}",
                m.spectral_radius
            );
            assert_eq!(m.degree, 3);
            assert!(off_identity(&m) < INVERSE_TOLERANCE);
        }
    }

    #[test]
    fn a_thin_cover_needs_degree_one() {
        let m = Matrices::new(&sensor(12, 12, [8.0, 8.0], 0.91), 0.6).unwrap();
        assert_eq!(m.degree, 1);
        assert!(
            (m.spectral_radius - 0.018).abs() < 0.001,
            "{}",
            m.spectral_radius
        );
    }

    #[test]
    fn radius_equals_the_largest_eigenvalue() {
        let m = Matrices::new(&sensor(4, 5, [2.0, 4.0], 3.0), 0.5).unwrap();
        let mut largest: f64 = 0.0;
        for step in 0..64 {
            let (sin, cos) = (std::f64::consts::TAU * f64::from(step) / 64.0).sin_cos();
            let a = Mat::from_fn(20, 20, |i, j| cos * m.ax[(i, j)] + sin * m.ay[(i, j)]);
            for value in a.eigenvalues().unwrap() {
                largest = largest.max(value.norm());
            }
        }
        // The directions tried miss 0.5 % at most, in both searches.
        assert!((m.spectral_radius / (0.5 * largest) - 1.0).abs() < 0.006);
    }

    #[test]
    fn degree_rule_at_its_edges() {
        assert_eq!(degree(0.5, 0.0), Some(0));
        assert_eq!(degree(0.0, 0.6), Some(1));
        assert_eq!(degree(0.187, 0.6), Some(1));
        assert_eq!(degree(0.19, 0.6), Some(2));
        assert_eq!(degree(0.201, 0.6), Some(3));
        assert_eq!(degree(0.43, 0.6), Some(3));
        assert_eq!(degree(0.44, 0.6), None);
        assert_eq!(degree(f64::NAN, 0.6), None);
    }

    #[test]
    fn refusals_name_their_reason() {
        let stiff = Matrices::new(&sensor(8, 8, [1.0, 1.0], 5.0), 0.6).unwrap_err();
        assert!(stiff.to_string().contains("r = 0.549"), "{stiff}");
        let large = Matrices::new(&sensor(256, 256, [1.0, 1.0], 1.0), 0.6).unwrap_err();
        assert!(matches!(
            large,
            MatricesError::TooLarge { taxels: 65536, .. }
        ));
        let flat = Matrices::new(&sensor(4, 4, [1e-200, 1e-200], 1e-200), 0.6).unwrap_err();
        assert!(matches!(flat, MatricesError::NotFinite { .. }));
        assert!(matches!(
            Matrices::new(&sensor(0, 4, [1.0, 1.0], 1.0), 0.6),
            Err(MatricesError::Sensor(_))
        ));
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]
        #[test]
        fn symmetric_to_the_bit_and_inverse(
            rows in 2usize..6, cols in 2usize..6, px in 2.0f64..5.0, py in 2.0f64..5.0, h in 0.8f64..3.0,
        ) {
            let sensor = sensor(rows, cols, [px, py], h);
            let m = Matrices::new(&sensor, 0.3).unwrap();
            prop_assert!(off_identity(&m) < INVERSE_TOLERANCE);
            let flip_x = |i: usize| i - i % cols + (cols - 1 - i % cols);
            let flip_y = |i: usize| (rows - 1 - i / cols) * cols + i % cols;
            for i in 0..sensor.taxels() {
                for j in 0..sensor.taxels() {
                    let (x, y) = ((flip_x(i), flip_x(j)), (flip_y(i), flip_y(j)));
                    for even in [&m.cz_pinv, &m.cz] {
                        prop_assert!(even[(i, j)] == even[x] && even[(i, j)] == even[y]);
                    }
                    for (odd_x, odd_y) in [(&m.ax, &m.ay), (&m.cx, &m.cy)] {
                        prop_assert!(odd_x[(i, j)] == -odd_x[x] && odd_x[(i, j)] == odd_x[y]);
                        prop_assert!(odd_y[(i, j)] == odd_y[x] && odd_y[(i, j)] == -odd_y[y]);
                    }
                }
            }
        }
    }
}
