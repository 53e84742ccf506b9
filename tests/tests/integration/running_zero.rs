//! A zero that runs: hardware and bit-true model are equal over a run with drift and presses, at full speed, back to back and
//! with stalls. Resets, frames cut short and tables written meanwhile are in `streams.rs` and `tables.rs`.

use dermis_cosim::drive::Stimulus;
use dermis_cosim::hardware::Hardware;
use dermis_cosim::simulator::Simulator;
use dermis_cosim::Vector;
use dermis_golden::data::input::calibration::Calibration;
use dermis_golden::fixed::stages::send::Status;
use dermis_golden::fixed::Model;
use dermis_golden::result::flags::Flag;
use dermis_golden::spec::scene::{Scene, Zero};
use dermis_hdl::generate_changed;
use dermis_hdl::language::Change;
use dermis_tests::{assert_equal, build_dir, compare, variants};
use tempfile::TempDir;

/// Frames of a run.
const FRAMES: usize = 48;

/// A scene of 4 × 3 taxels and the folder of its table, with gains of both signs if it has one.
fn scene(more: &str) -> (TempDir, Scene) {
    let folder = tempfile::tempdir().unwrap();
    let text = format!(
        "name = \"running-zero\"\n[sensor]\nrows = 4\ncols = 3\npitch_x_mm = 3.0\npitch_y_mm = 4.0\nthickness_mm = 3.0\n\
         [search]\nmu_max = 0.05\n[fixed]\ninput_bits = 16\n{more}\nfull_scale_MPa = 1.0\nzero = \"running\"\n\
         zero_average = 2\nzero_limit_MPa = 0.02\n"
    );
    let origin = folder.path().join("running.toml");
    let scene = Scene::parse(&text, &origin.display().to_string()).unwrap();
    let mut table = Calibration::identity(12);
    table.offset.iter_mut().enumerate().for_each(|(taxel, offset)| *offset = 0.01 * (taxel % 5) as f64 - 0.02);
    table.gain.iter_mut().enumerate().for_each(|(taxel, gain)| *gain = [1.0, 0.7, -0.9][taxel % 3]);
    std::fs::write(folder.path().join("table.csv"), table.to_csv(&scene.sensor)).unwrap();
    (folder, scene)
}

/// Codes of frames: noise, a side that warms up and cools down beyond the limit, a press in every other dozen.
fn codes(model: &Model) -> Vec<i32> {
    let (prepare, cols) = (&model.prepare, model.scene.sensor.cols);
    let mut random = fastrand::Rng::with_seed(8);
    let mut code = |frame: usize, taxel: usize| {
        let zero = prepare.zero.as_ref().map_or(0, |zero| zero[taxel]);
        let sign = prepare.gain.as_ref().map_or(1, |gain| gain[taxel].signum());
        let warm = 900.0 * (frame as f64 / 9.0).sin() * (taxel % cols) as f64 / 2.0;
        let press = if frame / 6 % 2 == 1 { 9000 / (1 + taxel as i32) } else { 0 };
        zero + sign * (warm as i32 + press) + random.i32(-40..=40)
    };
    (0..FRAMES)
        .flat_map(|frame| (0..12).map(move |taxel| (frame, taxel)))
        .map(|(frame, taxel)| code(frame, taxel))
        .collect()
}

fn vectors(model: &Model) -> Vec<Vector> {
    let codes = codes(model);
    let vector = |all: &[i32]| {
        let newest = model.scene.input.frames_per_result() * 12;
        let last = all[all.len() - newest..].to_vec();
        Vector::new(model, format!("{} frames", all.len() / 12), last, model.run(all))
    };
    let frames: Vec<&[i32]> = codes.chunks(12).collect();
    model.scene.input.frames_of_results(&frames).iter().map(|frames| vector(&codes[..12 * frames.len()])).collect()
}

const SCENES: [(&str, &str); 5] = [
    ("zeros alone, two subarrays", "[partition]\nrows = 2\ncols = 1\n[input]"),
    ("gains of both signs, a dead taxel, blocks", "[input]\naverage = 1\ncalibration = \"table.csv\"\ndead = [[1, 1]]"),
    ("a sliding mean, gains", "[input]\naverage = 2\nmean = \"sliding\"\ncalibration = \"table.csv\""),
    ("an adaptive mean", "[input]\naverage = 3\nmean = \"adaptive\"\ntemplate = false"),
    ("a dead taxel without gains", "[input]\ndead = [[0, 0], [3, 2]]"),
];

#[test]
fn a_run_with_presses_is_equal() {
    for (what, more) in variants(&SCENES, 2) {
        let (_folder, scene) = scene(more);
        let hardware = Hardware::new(Model::new(&scene).unwrap(), &build_dir()).unwrap();
        let vectors = vectors(&hardware.model);
        for stimulus in [Stimulus::FullSpeed, Stimulus::BackToBack, Stimulus::Stalls { seed: 3 }] {
            assert_equal(&compare(&hardware, Simulator::Verilator, &vectors, stimulus), format!("{what}, {stimulus}"));
        }
        assert_equal(&compare(&hardware, Simulator::Kernel, &vectors, Stimulus::FullSpeed), format!("{what}, kernel"));
        // Zeros move, and reach their limit and leave it.
        let mut fixed = scene.clone();
        fixed.input.zero = Zero::Fixed;
        let fixed = Model::new(&fixed).unwrap();
        let last = &vectors[vectors.len() - 1];
        assert_ne!(last.expected.beats, fixed.run(&last.codes).beats, "{what}");
        let limited =
            |vector: &&Vector| Status::all(&vector.expected.status).all(|s| s.raised.contains(Flag::ZeroLimit));
        let count = vectors.iter().filter(limited).count();
        assert!(count > 1 && count + 1 < vectors.len(), "{what}: {count} of {}", vectors.len());
    }
}

#[test]
fn a_defect_is_found() {
    let (_folder, scene) = scene(SCENES[0].1);
    let mut hardware = Hardware::new(Model::new(&scene).unwrap(), &build_dir()).unwrap();
    let vectors = vectors(&hardware.model);
    let calibrate = "prepare__calibrate";
    let defects = [
        // A touch is not seen; the step is that of the frame before the last; a zero passes its limit; what goes with a frame
        // is not told.
        Change::value(calibrate, "touched", |k| k.named("pressed")),
        Change::value(calibrate, "rest", |k| k.named("rest_stay")),
        Change::value(calibrate, "go", |k| k.named("sum").low(k.named("stay").bits()).signed()),
        Change::value(calibrate, "reached", |k| k.constant(1, 0)),
    ];
    for defect in variants(&defects, 1) {
        hardware.generated = generate_changed(&hardware.model, std::slice::from_ref(defect)).unwrap();
        let found = compare(&hardware, Simulator::Verilator, &vectors, Stimulus::BackToBack);
        assert!(!found.is_equal(), "not found: {defect}");
    }
}
