//! Matrices against known values, M · Cz = 1, and errors.

use super::inverse::product;
use super::*;
use crate::spec::scene::Scene;
use crate::spec::scene::MAX_DEGREE;
use proptest::prelude::*;

/// Rounding of a product of n terms with an inverse of condition κ: n κ ε, here at most 100 · 20 · 2⁻⁵² = 5e-13.
const INVERSE_TOLERANCE: f64 = 1e-12;

fn sensor(rows: usize, cols: usize, pitch: [f64; 2], thickness_mm: f64) -> Sensor {
    Sensor { rows, cols, pitch_x_mm: pitch[0], pitch_y_mm: pitch[1], thickness_mm }
}

fn largest(m: &Mat<f64>) -> f64 {
    m.col_iter().flat_map(|col| col.iter()).fold(0.0, |size, c| c.abs().max(size))
}

fn off_identity(m: &Matrices) -> f64 {
    let n = m.sensor.taxels();
    largest(&(product(&m.cz_pinv, &m.cz) - Mat::<f64>::identity(n, n)))
}

#[test]
fn builtin_sensors_have_the_known_radius_and_degree() {
    // Condition and r to the digits of an independent study, degree by its rule.
    let known = [("sensor-1", 17.0, 0.41), ("sensor-2", 4.0, 0.28), ("eight-by-eight", 4.0, 0.28)];
    for (name, condition, radius) in known {
        let scene = Scene::builtin(name).unwrap();
        let m = Matrices::new(&scene.sensor, scene.search.mu_max).unwrap();
        assert!((m.condition - condition).abs() < 0.5, "{name}: {}", m.condition);
        assert!((m.spectral_radius - radius).abs() < 0.01, "{name}: {}", m.spectral_radius);
        assert_eq!(m.degree, 3);
        assert!(off_identity(&m) < INVERSE_TOLERANCE);
    }
}

/// The default level truncates nothing in the built-in scenes.
#[test]
fn the_level_leaves_the_builtin_scenes_as_they_are() {
    for name in Scene::builtin_names() {
        let mut scene = Scene::builtin(name).unwrap();
        let shape = Sensor { rows: scene.sensor.rows.min(12), cols: scene.sensor.cols.min(12), ..scene.sensor.clone() };
        let level = Matrices::of(&scene, &shape, MAX_DEGREE).unwrap();
        assert!(level.inversion.level > 0.0);
        scene.inverse.kind = crate::spec::scene::InverseKind::Exact;
        let exact = Matrices::of(&scene, &shape, MAX_DEGREE).unwrap();
        assert_eq!((&level.cz_pinv, &level.ax, &level.ay), (&exact.cz_pinv, &exact.ax, &exact.ay), "{name}");
        assert_eq!(level.rank.round(), shape.taxels() as f64);
    }
}

#[test]
fn a_thin_cover_needs_degree_one() {
    let m = Matrices::new(&sensor(12, 12, [8.0, 8.0], 0.91), 0.6).unwrap();
    assert_eq!(m.degree, 1);
    assert!((m.spectral_radius - 0.018).abs() < 0.001, "{}", m.spectral_radius);
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
    // The directions miss at most 0.5 %, in both searches.
    assert!((m.spectral_radius / (0.5 * largest) - 1.0).abs() < 0.006);
}

#[test]
fn errors_name_their_reason() {
    let stiff = Matrices::new(&sensor(8, 8, [1.0, 1.0], 5.0), 0.6).unwrap_err();
    assert!(stiff.to_string().contains("r = 0.549"), "{stiff}");
    // 0.6 · 0.035^(1/4) / 0.549
    assert!(stiff.to_string().contains("search.mu_max = 0.472 or less"), "{stiff}");
    assert!(Matrices::new(&sensor(8, 8, [1.0, 1.0], 5.0), 0.472).is_ok());
    let large = Matrices::new(&sensor(256, 256, [1.0, 1.0], 1.0), 0.6).unwrap_err();
    assert!(matches!(large, MatricesError::TooLarge { taxels: 65536, .. }));
    let flat = Matrices::new(&sensor(4, 4, [1e-200, 1e-200], 1e-200), 0.6).unwrap_err();
    assert!(matches!(flat, MatricesError::NotFinite { .. }));
    assert!(matches!(Matrices::new(&sensor(0, 4, [1.0, 1.0], 1.0), 0.6), Err(MatricesError::Sensor(_))));
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
