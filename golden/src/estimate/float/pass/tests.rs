//! The polynomial against reference values, the direct solve, the stress and Eq. 1 as printed.

use super::*;
use crate::data::frame::Frame;
use crate::estimate::float::objective::{Objective, Sparse};
use crate::physics::symmetry::folded::accumulate;
use crate::reference::values;
use crate::spec::scene::Scene;

/// Against numpy: both round a solve of condition 20; the stress has 9 digits and is the same.
const REFERENCE: f64 = 1e-9;

fn setting(sensor: &str, frame: &str) -> (Matrices, Vec<f64>) {
    let scene = Scene::builtin(sensor).unwrap();
    let frame = Frame::shipped(&scene).into_iter().find(|f| f.id == frame).unwrap();
    let matrices = Matrices::new(&scene.sensor, scene.search.mu_max).unwrap();
    (matrices, frame.stress_MPa)
}

fn agree(got: &[f64], wanted: &[f64]) {
    let size = wanted.iter().fold(0.0f64, |size, w| w.abs().max(size));
    for (got, wanted) in got.iter().zip(wanted) {
        assert!((got - wanted).abs() <= REFERENCE * size, "{got:e} {wanted:e}");
    }
}

#[test]
fn places_are_in_order() {
    let order = [(0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2), (3, 0), (2, 1)];
    for (k, (i, j)) in order.into_iter().enumerate() {
        assert_eq!(term_index(i, j), k);
    }
}

#[test]
fn agrees_with_the_reference_family() {
    for r in &values().family {
        let (matrices, b) = setting(&r.sensor, &r.frame);
        let family = Polynomial::new(&matrices, &b);
        agree(family.v(0, 0), &r.p0);
        agree(family.v(1, 0), &r.v10);
        agree(family.v(0, 1), &r.v01);
        agree(family.v(2, 1), &r.v21);
        agree(&[family.v(0, 0).iter().sum()], &[r.p0_sum]);
        for at in &r.at {
            let p = solve_direct(&matrices, &b, at.mu);
            agree(&p, &at.p_first_ten);
            agree(&[p.iter().sum()], &[at.p_sum]);
            let score = Sparse { epsilon: 1e-5 }.score(&p).unwrap();
            agree(&[score], &[at.sparse_exact]);
        }
    }
}

#[test]
fn series_differs_from_the_solve_by_its_truncation() {
    let (matrices, b) = setting("sensor-1", "S1-hs-hertz");
    let norm = |p: &[f64]| p.iter().map(|p| p * p).sum::<f64>().sqrt();
    let family = Polynomial::new(&matrices, &b);
    for mu in [[0.0, 0.0], [0.26, 0.145], [-0.4, 0.3], [0.0, 0.6]] {
        let direct = solve_direct(&matrices, &b, mu);
        let off: Vec<f64> = family.eval(mu).iter().zip(&direct).map(|(p, q)| p - q).collect();
        // Ratio of terms at this μ, r in proportion; the terms that are left out sum to ratio^4/(1 − ratio).
        let ratio = matrices.spectral_radius * mu[0].hypot(mu[1]) / 0.6;
        let bound = ratio.powi(4) / (1.0 - ratio) + 1e-13;
        assert!(norm(&off) <= bound * norm(&direct), "{mu:?}: {:e}", norm(&off) / norm(&direct));
    }
}

/// At one μ the orders are summed as they come: the same but for rounding, also with dead taxels.
#[test]
fn at_one_mu_the_series_is_the_polynomial() {
    let (whole, b) = setting("sensor-1", "S1-hs-hertz");
    for matrices in [whole.without(&[37]).unwrap(), whole] {
        let family = Polynomial::new(&matrices, &b);
        for mu in [[0.0, 0.0], [0.26, -0.145], [-0.4, 0.3]] {
            agree(&at(&matrices, &b, mu), &family.eval(mu));
        }
    }
}

#[test]
fn family_meets_the_stress() {
    let (m, b) = setting("eight-by-eight", "S8-hs-random-1");
    let mu = [0.3, -0.2];
    let p = solve_direct(&m, &b, mu);
    let mut rest: Vec<f64> = b.iter().map(|b| -b).collect();
    accumulate(&m.cz, &p, 1.0, &mut rest);
    accumulate(&m.cx, &p, mu[0], &mut rest);
    accumulate(&m.cy, &p, mu[1], &mut rest);
    let peak = b.iter().fold(0.0f64, |peak, b| b.abs().max(peak));
    assert!(rest.iter().all(|r| r.abs() < 1e-13 * peak));
}

/// Eq. 1 as printed: x = C†b + (I − C†C) w with w = (μ1 p, μ2 p, p) returns w if p is that of the exact solve.
#[test]
fn orthogonal_form_is_the_same() {
    let (m, b) = setting("eight-by-eight", "S8-hs-random-1");
    let n = b.len();
    let mu = [0.25, 0.15];
    let p = solve_direct(&m, &b, mu);
    let c = Mat::from_fn(n, 3 * n, |i, k| [&m.cx, &m.cy, &m.cz][k / n][(i, k % n)]);
    let w = Col::from_fn(3 * n, |k| [mu[0], mu[1], 1.0][k / n] * p[k % n]);
    let pinv = c.thin_svd().unwrap().pseudoinverse();
    let x = &pinv * ColRef::from_slice(&b) + &w - &pinv * (&c * &w);
    assert!((x - &w).norm_l2() <= 1e-13 * w.norm_l2());
}
