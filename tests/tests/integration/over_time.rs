//! Means over time: hardware and bit-true model are equal in every word and cycle over whole presses.

use dermis_cosim::drive::Stimulus;
use dermis_cosim::hardware::Hardware;
use dermis_cosim::simulator::Simulator;
use dermis_cosim::Vector;
use dermis_golden::data::generator::presses::{Motion, Press};
use dermis_golden::fixed::stages::send::{Status, WINDOW};
use dermis_golden::fixed::Model;
use dermis_golden::spec::scene::{MeanKind, Scene};
use dermis_tests::{assert_equal, build_dir, compare, nightly};

/// Frames of a press.
const FRAMES: usize = 1000;

fn scene() -> Scene {
    let mut scene = Scene::builtin("eight-by-eight").unwrap();
    (scene.input.mean, scene.input.template, scene.input.full_scale_MPa) = (MeanKind::Adaptive, false, Some(0.2));
    scene.search.mu_max = 0.0;
    scene
}

/// A press in which the contact loads, turns its shear and leaves, with the noise and codes of a real array.
fn vectors(model: &Model, motion: Motion) -> Vec<Vector> {
    let frames = Press::new(motion).of_frames(FRAMES, 0.01).frames(&model.scene, 7).unwrap();
    let mut prepared = model.prepare.empty();
    let vector = |(number, frame)| {
        let codes = model.codes(frame).unwrap().codes;
        model.add(&mut prepared, &codes);
        Vector::new(model, format!("frame {number}"), codes, model.run_prepared(&prepared))
    };
    frames.iter().enumerate().map(vector).collect()
}

#[test]
fn an_adaptive_mean_is_equal_over_a_thousand_frames() {
    let hardware = Hardware::new(Model::new(&scene()).unwrap(), &build_dir()).unwrap();
    let motions: &[Motion] = if nightly() { &Motion::LASTING } else { &Motion::LASTING[3..5] };
    for motion in motions {
        let vectors = vectors(&hardware.model, *motion);
        for stimulus in [Stimulus::FullSpeed, Stimulus::BackToBack, Stimulus::Stalls { seed: 5 }] {
            let what = format!("{}, {stimulus}", motion.name());
            assert_equal(&compare(&hardware, Simulator::Verilator, &vectors, stimulus), what);
        }
        let taken: std::collections::BTreeSet<u32> = vectors
            .iter()
            .flat_map(|vector| Status::all(&vector.expected.status))
            .map(|status| status.window)
            .collect();
        assert!(taken.len() > 3 && taken.iter().all(|window| *window < 1 << WINDOW.bits), "{taken:?}");
    }
}
