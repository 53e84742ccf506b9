//! Stress of forces on the surface: that of the Rust function to the bit, and wrong arguments.

use std::ptr::{null, null_mut};

use dermis_c::guard::dermis_status;
use dermis_c::scene::*;
use dermis_c::stress::*;
use dermis_golden::physics::forward::{ForwardModel, PointForce};
use dermis_golden::spec::scene::Scene;

use super::input::{last_error, scene};

const TAXELS: usize = 64;

/// Two frames of forces.
fn forces() -> Vec<f64> {
    (0..2 * 3 * TAXELS).map(|k| ((k * k + 5 * k) % 23) as f64 / 11.0 - 1.0).collect()
}

#[test]
fn stress_is_that_of_the_library() {
    let (scene, model) = (scene("eight-by-eight"), ForwardModel::of_scene(&Scene::builtin("eight-by-eight").unwrap()));
    let (forces_N, mut stress_MPa) = (forces(), [0.0; 2 * TAXELS]);
    let [at_mm, force_N] = [[0.5, -3.0, 40.0, 2.0, 0.0, 0.0], [0.0, 0.5, 2.0, 1.0, 0.0, -0.25]];
    let points = [0, 1].map(|k| PointForce {
        at_mm: [at_mm[2 * k], at_mm[2 * k + 1]],
        force_N: [force_N[3 * k], force_N[3 * k + 1], force_N[3 * k + 2]],
    });
    unsafe {
        let done = dermis_stress(scene, forces_N.as_ptr(), forces_N.len(), stress_MPa.as_mut_ptr());
        assert_eq!(done, dermis_status::Ok, "{}", last_error());
        assert_eq!(stress_MPa[..], model.of_cells(&forces_N).unwrap());
        assert!(stress_MPa[..TAXELS] != stress_MPa[TAXELS..] && stress_MPa[0] != 0.0);
        let own = stress_MPa.as_mut_ptr();
        assert_eq!(dermis_stress_of_points(scene, at_mm.as_ptr(), force_N.as_ptr(), 2, own), dermis_status::Ok);
        assert_eq!(stress_MPa[..TAXELS], model.of_points(&[points.to_vec()]).unwrap());
        assert_eq!(dermis_stress_of_points(scene, null(), null(), 0, own), dermis_status::Ok);
        assert_eq!(stress_MPa[..TAXELS], [0.0; TAXELS]);
        dermis_scene_free(scene);
    }
}

#[test]
fn forces_that_cannot_be_used_are_named() {
    let scene = scene("eight-by-eight");
    let (mut forces_N, mut stress_MPa) = (forces(), [0.0; 2 * TAXELS]);
    let own = stress_MPa.as_mut_ptr();
    let refused = |forces_N: *const f64, count: usize, stress_MPa: *mut f64| {
        assert_eq!(unsafe { dermis_stress(scene, forces_N, count, stress_MPa) }, dermis_status::Input);
        last_error()
    };
    assert_eq!(refused(forces_N.as_ptr(), 100, own), "forces_N has 100 values, wanted a multiple of 8 · 8 · 3");
    assert_eq!(refused(null(), 192, own), "forces_N is NULL");
    assert_eq!(refused(forces_N.as_ptr(), 192, null_mut()), "stress_MPa is NULL");
    assert!(refused(forces_N.as_ptr(), usize::MAX, own).ends_with("more than memory has"));
    forces_N[192 + 4] = f64::NAN;
    assert_eq!(refused(forces_N.as_ptr(), 384, own), "forces_N[0, 1, 1] of frame 1 = NaN is not a finite number");
    let points = |at_mm: *const f64, count: usize| {
        let done = unsafe { dermis_stress_of_points(scene, at_mm, forces_N.as_ptr(), count, own) };
        assert_eq!(done, dermis_status::Input);
        last_error()
    };
    assert_eq!(points([f64::INFINITY, 0.0].as_ptr(), 1), "at_mm[0, 0] of frame 0 = inf is not a finite number");
    assert_eq!(points(null(), 1), "at_mm is NULL");
    assert!(points([0.0; 2].as_ptr(), usize::MAX).contains("points = "));
    unsafe { dermis_scene_free(scene) };
}
