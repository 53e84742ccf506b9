//! Contacts made by the cell model itself: what comes back is what was put in.

use super::*;
use crate::float::objective::Sparse;
use crate::folded::accumulate;
use crate::frame::Contact;
use crate::generator::generate;
use crate::scene::Medium;
use crate::sensor::Sensor;

fn sensor() -> Sensor {
    Sensor { rows: 16, cols: 16, pitch_x_mm: 3.0, pitch_y_mm: 3.0, thickness_mm: 3.0 }
}

/// Spheres at x, y in mm of radius 6 mm, each with its μ, and the stress they cause.
fn pressed(matrices: &Matrices, spheres: &[([f64; 2], [f64; 2])]) -> (Vec<f64>, Vec<f64>) {
    let sensor = &matrices.sensor;
    let (mut p, mut fx, mut fy) = (vec![0.0; 256], vec![0.0; 256], vec![0.0; 256]);
    for (k, p) in p.iter_mut().enumerate() {
        let at = sensor.position_mm(k / 16, k % 16);
        for (centre, mu) in spheres {
            let own = (1.0 - ((at[0] - centre[0]).powi(2) + (at[1] - centre[1]).powi(2)) / 36.0).max(0.0).sqrt();
            *p += own;
            fx[k] += mu[0] * own;
            fy[k] += mu[1] * own;
        }
    }
    let mut b = vec![0.0; 256];
    accumulate(&matrices.cz, &p, 1.0, &mut b);
    accumulate(&matrices.cx, &fx, 1.0, &mut b);
    accumulate(&matrices.cy, &fy, 1.0, &mut b);
    (p, b)
}

fn solve(matrices: &Matrices, b: &[f64], searched: &dyn Fn(&Segments, usize) -> bool) -> Contacts {
    let family = Polynomial::new(matrices, b);
    let objective = &Sparse::default();
    let found = search(&family, 0.6, objective).unwrap();
    let taxels = Taxels::new(&matrices.sensor, Medium::HalfSpace);
    let stress = Some(MeasuredStress { taxels: &taxels, b, noise_MPa: 0.0 });
    Solver { matrices, mu_max: 0.6, objective, p0: family.v(0, 0), stress, searched }.solve(&family, found)
}

#[test]
fn two_contacts_come_back() {
    let matrices = Matrices::new(&sensor(), 0.6).unwrap();
    let spheres = [([-12.0, -10.0], [0.3, 0.1]), ([11.0, 9.0], [-0.2, 0.25])];
    let (truth, b) = pressed(&matrices, &spheres);
    let contacts = solve(&matrices, &b, &|_, _| true);
    assert_eq!((contacts.segments.count, contacts.converged), (2, true));
    // A finest step of the search is 0.6/384 along each axis.
    for (region, (_, mu)) in spheres.iter().enumerate() {
        let found = contacts.mu(region);
        assert!((found[0] - mu[0]).hypot(found[1] - mu[1]) < 2.0 * 0.6 / 384.0, "{found:?} {mu:?}");
    }
    let off = contacts.p.iter().zip(&truth).map(|(p, q)| (p - q).abs()).fold(0.0, f64::max);
    assert!(off < 0.01, "{off}");
}

#[test]
fn equal_contacts_are_one_region_and_the_plain_method() {
    let matrices = Matrices::new(&sensor(), 0.6).unwrap();
    let (_, b) = pressed(&matrices, &[([-12.0, -10.0], [0.3, 0.1]), ([11.0, 9.0], [0.3, 0.1])]);
    let contacts = solve(&matrices, &b, &|_, _| true);
    let family = Polynomial::new(&matrices, &b);
    let plain = search(&family, 0.6, &Sparse::default()).unwrap();
    assert_eq!(contacts.segments, Segments::whole(256));
    assert_eq!((contacts.found, contacts.p), (vec![Some(plain)], family.eval(plain.mu)));
}

#[test]
fn a_region_that_is_not_searched_has_no_shear() {
    let matrices = Matrices::new(&sensor(), 0.6).unwrap();
    let (_, b) = pressed(&matrices, &[([-12.0, -10.0], [0.3, 0.1]), ([11.0, 9.0], [0.0, 0.0])]);
    let contacts = solve(&matrices, &b, &|_, region| region == 0);
    assert_eq!((contacts.segments.count, contacts.mu(1)), (2, [0.0; 2]));
    assert!(contacts.found[1].is_none());
    assert!((contacts.mu(0)[0] - 0.3).abs() < 0.01);
}

/// Stress of two contacts that touch, by the generator's quadrature.
fn touching(shape: &str) -> Vec<f64> {
    let contact = |x: f64, tangential: [f64; 2]| Contact {
        shape: Some(shape.to_string()),
        centre_mm: Some([x, 1.0]),
        size_mm: vec![5.0, 4.0, 0.0],
        normal_N: Some(4.0),
        tangential_N: Some(tangential),
        ..Default::default()
    };
    let contacts = [contact(-5.0, [1.2, 0.0]), contact(5.2, [-0.4, 0.8])];
    generate("touching", &sensor(), Medium::HalfSpace, &contacts).unwrap().stress_MPa
}

#[test]
fn ellipses_that_touch_are_told_apart() {
    let matrices = Matrices::new(&sensor(), 0.6).unwrap();
    let contacts = solve(&matrices, &touching("hertz-ellipse"), &|_, _| true);
    assert_eq!(contacts.segments.count, 2);
    let left = contacts.segments.labels[8 * 16 + 6];
    for (region, mu) in [(left, [0.3, 0.0]), (1 - left, [-0.1, 0.2])] {
        let found = contacts.mu(region);
        // The quadrature of the fit is good to 1e-4 of the peak.
        assert!((found[0] - mu[0]).hypot(found[1] - mu[1]) < 0.005, "{found:?} {mu:?}");
    }
    let load: f64 = contacts.p.iter().sum();
    assert!((load - 8.0).abs() < 0.02, "{load}");
}

#[test]
fn what_is_no_ellipse_is_searched_in_the_better_regions() {
    let matrices = Matrices::new(&sensor(), 0.6).unwrap();
    let b = touching("rectangle");
    let family = Polynomial::new(&matrices, &b);
    let objective = &Sparse::default();
    let found = search(&family, 0.6, objective).unwrap();
    let plain = Solver {
        matrices: &matrices,
        mu_max: 0.6,
        objective,
        p0: family.v(0, 0),
        stress: None,
        searched: &|_, _| true,
    };
    let contacts = solve(&matrices, &b, &|_, _| true);
    let score = |contacts: &Contacts| objective.score(&contacts.p);
    // The ellipses' regions are one drawing more; what is found in them is no fit.
    assert!(score(&contacts) >= score(&plain.solve(&family, found)));
    let left = contacts.segments.labels[8 * 16 + 6];
    for (region, mu) in [(left, [0.3, 0.0]), (1 - left, [-0.1, 0.2])] {
        let found = contacts.mu(region);
        assert!((found[0] - mu[0]).hypot(found[1] - mu[1]) < 0.005, "{found:?} {mu:?}");
        assert_eq!(contacts.found[region].unwrap().evaluations, 85);
    }
}
