//! Wrong answers that once came without a flag.

use super::*;
use crate::data::frame::Contact;
use crate::data::frame::Frame;
use crate::data::generator::generate;
use crate::estimate::float::Golden;
use crate::fixed::Model;
use crate::result::flags::Flag;
use crate::result::reconstruct::Reconstruction;
use crate::spec::scene::{EstimatorKind, Medium, ObjectiveKind, Scene};
use crate::spec::sensor::Sensor;

pub(super) fn press(sensor: &Sensor, radius_mm: f64, normal_N: f64, tangential_N: [f64; 2]) -> Frame {
    let contact = Contact {
        shape: Some("hertz-circle".to_string()),
        size_mm: vec![radius_mm],
        normal_N: Some(normal_N),
        tangential_N: Some(tangential_N),
        ..Default::default()
    };
    generate("press", sensor, Medium::HalfSpace, &[contact]).unwrap()
}

/// The search, which both models have.
fn sensor_1() -> Scene {
    let mut scene = Scene::builtin("sensor-1").unwrap();
    scene.search.estimator = Some(EstimatorKind::Search);
    scene
}

fn run(scene: &Scene, frame: &Frame) -> Reconstruction {
    Golden::reference(scene).unwrap().run(frame).unwrap()
}

/// Counts of 0.00035 MPa above offsets near 600, a table, a tare frame and a dead taxel: a full scale between the
/// stress and the readings clips every code.
#[test]
fn readings_beyond_full_scale_are_flagged_by_both_models() {
    let mut scene = sensor_1();
    let stress = press(&scene.sensor, 4.0, 18.8, [3.0, -2.0]);
    let folder = tempfile::tempdir().unwrap();
    let (gain, zero) = (0.00035, |k: usize| 600.0 + (k % 7) as f64);
    let line = |k: usize| format!("{},{},0,{gain}\n", k / 10, k % 10);
    let (table, tare) = (folder.path().join("table.csv"), folder.path().join("zero.json"));
    std::fs::write(&table, "row,col,offset,gain\n".to_string() + &(0..100).map(line).collect::<String>()).unwrap();
    let zeros = Frame::from_stress("zero", &scene.sensor, (0..100).map(zero).collect()).unwrap();
    std::fs::write(&tare, zeros.to_json()).unwrap();
    (scene.input.calibration, scene.input.tare, scene.input.dead) = (Some(table), Some(tare), vec![[9, 9]]);
    let mut readings = stress.clone();
    (0..100).for_each(|k| readings.stress_MPa[k] = (stress.stress_MPa[k] / gain + zero(k)).round());
    // What a dead taxel reads does not count.
    readings.stress_MPa[99] = 1e6;
    let most = readings.stress_MPa[..99].iter().fold(0.0f64, |most, b| b.max(most)) * gain;
    assert!((0.4..0.9).contains(&most), "{most}");

    let mut both = |full_scale_MPa: f64| {
        scene.input.full_scale_MPa = Some(full_scale_MPa);
        let (golden, fixed) = (run(&scene, &readings), Model::new(&scene).unwrap().reconstruct(&readings).unwrap());
        let share = golden.checks.full_scale_share.unwrap();
        assert!((share * full_scale_MPa - most).abs() < 1e-12 && fixed.checks.full_scale_share == Some(share));
        let flagged = [&golden, &fixed].map(|result| result.flags.contains(&Flag::Saturated));
        (fixed.resultant_N[2] / golden.resultant_N[2], flagged)
    };
    let (normal, flagged) = both(0.2);
    assert!(normal.abs() < 0.01 && flagged == [true; 2], "{normal} {flagged:?}");
    let (normal, flagged) = both(0.8 * most);
    assert!(normal < 0.98 && flagged == [true; 2], "{normal} {flagged:?}");
    // Exactly the largest reading: a converter that clips reads the same.
    assert_eq!(both(most).1, [true; 2]);
    let (normal, flagged) = both(1.01 * most);
    assert!((normal - 1.0).abs() < 0.01 && flagged == [false; 2], "{normal} {flagged:?}");
}

/// The mean of two frames is within full scale, one of them is not.
#[test]
fn one_of_several_averaged_frames_beyond_full_scale_is_enough() {
    let mut scene = sensor_1();
    let frame = press(&scene.sensor, 4.0, 10.0, [2.0, 0.0]);
    scene.input.average = 1;
    scene.input.full_scale_MPa = Some(1.5 * frame.peak_MPa());
    let scaled = |factor: f64| {
        let mut frame = frame.clone();
        frame.stress_MPa.iter_mut().for_each(|b| *b *= factor);
        frame
    };
    let (golden, fixed) = (Golden::reference(&scene).unwrap(), Model::new(&scene).unwrap());
    for (factor, flagged) in [(1.6, true), (1.4, false)] {
        let frames = [scaled(factor), scaled(0.1)];
        let results = [golden.run_averaged(&frames).unwrap(), fixed.reconstruct_averaged(&frames).unwrap()];
        assert_eq!(results.map(|result| result.flags.contains(&Flag::Saturated)), [flagged; 2], "{factor}");
    }
}

#[test]
fn a_friction_ratio_beyond_mu_max_is_flagged() {
    let mut scene = sensor_1();
    for (ratio, flagged) in [(50.0, true), (0.8, true), (0.3, false)] {
        let frame = press(&scene.sensor, 4.0, 1.0, [ratio, 0.0]);
        let both = [run(&scene, &frame), Model::new(&scene).unwrap().reconstruct(&frame).unwrap()];
        for result in both {
            let share = result.checks.mu_share.unwrap();
            assert_eq!(share >= MU_AT_BOUND, flagged, "{ratio}: {share}");
            assert_eq!(result.flags.contains(&Flag::MuAtBound), flagged, "{ratio}: {share}");
        }
    }
    scene.search.mu_max = 0.0;
    assert_eq!(run(&scene, &press(&scene.sensor, 4.0, 1.0, [50.0, 0.0])).checks.mu_share, None);
}

/// A subarray that carries next to nothing may have any μ.
#[test]
fn a_subarray_without_load_does_not_count_for_mu() {
    let mut scene = sensor_1();
    scene.partition.case = crate::spec::partition::Case::numbered(1).unwrap();
    let mut frame = press(&scene.sensor, 3.0, 5.0, [0.5, 0.0]);
    frame.stress_MPa = (0..100).map(|k| if k / 10 < 5 && k % 10 < 5 { 1.0 } else { 1e-9 }).collect();
    let mut result = run(&scene, &frame);
    result.subarrays.iter_mut().for_each(|part| part.mu = [0.6, 0.0]);
    result.subarrays[0].mu = [0.3, 0.0];
    assert_eq!(result.figures(&scene, &frame).mu_share, Some(0.5));
}

/// Counts of a 10-bit converter taken for MPa.
#[test]
fn implausible_stress_is_flagged() {
    let mut scene = sensor_1();
    let mut frame = press(&scene.sensor, 4.0, 10.0, [2.0, 0.0]);
    assert!(!run(&scene, &frame).flags.contains(&Flag::ImplausibleStress));
    let factor = 900.0 / frame.peak_MPa();
    frame.stress_MPa.iter_mut().for_each(|b| *b = (*b * factor).round());
    for result in [run(&scene, &frame), Model::new(&scene).unwrap().reconstruct(&frame).unwrap()] {
        assert_eq!((result.checks.peak_MPa, result.flags.contains(&Flag::ImplausibleStress)), (900.0, true));
    }
    scene.input.plausible_MPa = 1000.0;
    assert!(!run(&scene, &frame).flags.contains(&Flag::ImplausibleStress));
}

#[test]
fn the_share_of_the_border_grows_towards_the_edge() {
    let scene = sensor_1();
    let contact = |x: f64| Contact {
        shape: Some("hertz-circle".to_string()),
        size_mm: vec![3.0],
        centre_mm: Some([x, 0.0]),
        normal_N: Some(5.0),
        ..Default::default()
    };
    let share = |x: f64| {
        let frame = generate("edge", &scene.sensor, Medium::HalfSpace, &[contact(x)]).unwrap();
        let result = run(&scene, &frame);
        (result.checks.border_share.unwrap(), result.flags.contains(&Flag::LoadOutside))
    };
    let [inside, near, over] = [0.0, 6.5, 9.5].map(share);
    assert!(inside.0 < 0.01 && !inside.1, "{inside:?}");
    assert!(near.0 > 0.05 && !near.1, "{near:?}");
    assert!(over.0 > 0.4 && over.1, "{over:?}");
}

#[test]
fn a_normal_force_far_from_that_without_shear_is_flagged() {
    let scene = sensor_1();
    for (load_ratio, flagged) in [(0.89, true), (0.91, false), (1.09, false), (8.6, true)] {
        let checks = Checks { load_ratio: Some(load_ratio), ..Checks::default() };
        assert_eq!(checks.flags(&scene).collect::<Vec<_>>() == [Flag::LoadMismatch], flagged, "{load_ratio}");
    }
}

/// Noise-free contacts several cover thicknesses wide: `symmetric` gave 28 to 129 N for 15 N.
#[test]
fn large_contacts_are_right_or_flagged() {
    let thin = Sensor { rows: 10, cols: 8, pitch_x_mm: 5.0, pitch_y_mm: 4.0, thickness_mm: 2.0 };
    for sensor in [Scene::builtin("sensor-1").unwrap().sensor, thin] {
        for objective in [ObjectiveKind::Symmetric, ObjectiveKind::Patch, ObjectiveKind::Auto] {
            let mut scene = Scene::of_sensor(&sensor, "large");
            (scene.search.estimator, scene.search.objective) = (Some(EstimatorKind::Search), objective);
            for radius in [6.0, 8.0, 10.0] {
                let frame = press(&sensor, radius, 15.0, [3.0, 2.0]);
                let result = run(&scene, &frame);
                let error = result.error.unwrap();
                let (shear, normal) = (error.tangential.unwrap(), error.normal.unwrap());
                let warned = [Flag::ShapeMismatch, Flag::LoadMismatch].iter().any(|flag| result.flags.contains(flag));
                let right = shear < 0.1 && normal.abs() < 0.05;
                assert!(right || warned, "{sensor}, {radius} mm, {}: {shear} {normal}", objective.name());
            }
        }
    }
}
