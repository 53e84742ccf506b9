//! Extreme frames in hardware: the codes of every one of [`dermis_study::stability::extreme::frames`], through the generated
//! Verilog (full speed and with stalls) and kernel simulation, against the bit-true model, to the bit and the cycle.

use dermis_cosim::drive::Stimulus;
use dermis_cosim::hardware::Hardware;
use dermis_cosim::simulator::Simulator;
use dermis_cosim::Vector;
use dermis_golden::fixed::Model;
use dermis_golden::spec::partition::Case;
use dermis_golden::spec::scene::Scene;
use dermis_study::stability::extreme::frames;
use dermis_tests::{assert_equal, build_dir, compare};

/// The frames with the scene's own partition, as codes with their own full scales.
fn vectors(scene: &Scene, hardware: &Hardware) -> Vec<Vector> {
    let all = frames(scene).unwrap().into_iter();
    let own = all.filter(|e| e.scene.partition.case == scene.partition.case && e.scene.require_supported().is_ok());
    own.map(|extreme| {
        let frame = std::slice::from_ref(&extreme.frame);
        let codes = Model::for_frames(&extreme.scene, frame).unwrap().readings(frame).unwrap();
        let expected = hardware.model.run(&codes);
        Vector::new(&hardware.model, extreme.frame.id.clone(), codes, expected)
    })
    .collect()
}

fn check(scene: &Scene, least: usize) {
    let hardware = Hardware::new(Model::new(scene).unwrap(), &build_dir()).unwrap();
    let vectors = vectors(scene, &hardware);
    assert!(vectors.len() >= least, "{} frames", vectors.len());
    let runs = [
        (Simulator::Verilator, Stimulus::FullSpeed),
        (Simulator::Verilator, Stimulus::Stalls { seed: 5 }),
        (Simulator::Kernel, Stimulus::FullSpeed),
    ];
    for (simulator, stimulus) in runs {
        let findings = compare(&hardware, simulator, &vectors, stimulus);
        assert_equal(&findings, format!("{}, {}", scene.name, simulator.name()));
    }
}

#[test]
fn extreme_frames_of_sensor_1_are_equal() {
    check(&Scene::builtin("sensor-1").unwrap(), 24);
}

#[test]
fn extreme_frames_of_eight_by_eight_are_equal() {
    check(&Scene::builtin("eight-by-eight").unwrap(), 24);
}

#[test]
fn extreme_frames_of_a_cut_array_are_equal() {
    let mut scene = Scene::builtin("eight-by-eight").unwrap();
    scene.partition.case = Case::numbered(1).unwrap();
    check(&scene, 24);
}
