//! The serial engine: equal to the bit-true model in every stage, beat and cycle, in kernel simulation and under Verilator;
//! scenes that it does not support are rejected by field.

use dermis_cosim::drive::Stimulus;
use dermis_cosim::hardware::Hardware;
use dermis_cosim::simulator::Simulator;
use dermis_cosim::verify::verify;
use dermis_cosim::Vector;
use dermis_golden::data::frame::Frame;
use dermis_golden::fixed::{Cycles, Model};
use dermis_golden::spec::scene::Scene;
use dermis_hdl::generate;
use dermis_report::drawn_frames::{DrawnFrames, Shapes};
use dermis_tests::tools::cells;
use dermis_tests::{assert_equal, build_dir, compare, scene};

const BOARD: &str = "icebreaker";
const BOTH: &[Simulator] = &[Simulator::Verilator, Simulator::Kernel];

fn on_board(mut scene: Scene) -> Scene {
    scene.hardware.board = Some(BOARD.into());
    scene
}

fn check(scene: &Scene, frames: &[Frame], simulators: &[Simulator]) {
    let verified = verify(scene, frames, simulators, &build_dir()).unwrap();
    assert_equal(&verified.findings, &scene.name);
}

fn sensor(rows: usize, cols: usize, more: &str) -> Scene {
    let text = format!(
        "name = \"serial-{rows}x{cols}\"\n[hardware]\nboard = \"{BOARD}\"\n[sensor]\nrows = {rows}\ncols = {cols}\n\
         pitch_x_mm = 4.0\npitch_y_mm = 3.0\nthickness_mm = 3.0\n{more}"
    );
    Scene::parse(&text, "serial").unwrap()
}

fn drawn(scene: &Scene, frames: u32) -> Vec<Frame> {
    let draw = DrawnFrames { frames, contacts: vec![1], shapes: Shapes::Elliptic, touching: false, seed: 1 };
    draw.draw(scene).unwrap()
}

#[test]
fn eight_by_eight_is_equal_on_shipped_and_drawn_frames_within_a_millisecond() {
    let (scene, mut frames) = scene("eight-by-eight");
    let scene = on_board(scene);
    frames.extend(drawn(&scene, 5));
    check(&scene, &frames, BOTH);
    let model = Model::new(&scene).unwrap();
    assert!(model.board.microseconds(Cycles::of(&model, &[true]).total) < 1000.0);
}

#[test]
fn degenerate_frames_are_equal() {
    let (scene, frames) = scene("eight-by-eight");
    let scene = on_board(scene);
    let with = |id: &str, stress: Vec<f64>| Frame { id: id.into(), stress_MPa: stress, ..frames[0].clone() };
    let taxels = scene.sensor.taxels();
    let mut corner = vec![0.0; taxels];
    corner[0] = -0.1;
    let checks = (0..taxels).map(|i| if (i / 8 + i) % 2 == 0 { 0.2 } else { -0.2 }).collect();
    let tension = frames[0].stress_MPa.iter().map(|b| -b).collect();
    let frames = [
        with("zeros", vec![0.0; taxels]),
        with("one corner in tension", corner),
        with("all at full scale", vec![0.3; taxels]),
        with("checkerboard", checks),
        with("all in tension", tension),
    ];
    check(&scene, &frames, BOTH);
}

#[test]
fn other_arrays_degrees_widths_and_options_are_equal() {
    let scenes = [
        // A number of quads that is no power of two; a rectangle.
        sensor(6, 10, ""),
        // Degree 1; neither input nor inverse has a low limb.
        sensor(
            6,
            6,
            "[search]\nmu_max = 0.05\n[fixed]\ninput_bits = 12\ninverse_bits = 16\ndata_bits = 14\ncoef_bits = 14\n",
        ),
        // Degree 2; a condition that not every frame meets, a threshold.
        sensor(
            4,
            8,
            "[search]\nmu_max = 0.25\n[partition]\ncondition = \"both-signs\"\n[input]\nfull_scale_MPa = 0.2\n\
             [threshold]\nmin_force_N = 0.01\n",
        ),
    ];
    for scene in scenes {
        check(&scene, &drawn(&scene, 3), BOTH);
    }
}

/// A row has as many products as there are quads: with fewer than four it is shorter than the way of its words.
#[test]
fn arrays_of_few_quads_are_equal() {
    for [rows, cols] in [[2, 2], [2, 4], [6, 2]] {
        let scene = sensor(rows, cols, "");
        check(&scene, &drawn(&scene, 3), BOTH);
    }
}

#[test]
fn memories_and_multipliers_are_those_of_yosys() {
    let (scene, _) = scene("eight-by-eight");
    let model = Model::new(&on_board(scene)).unwrap();
    let generated = generate(&model).unwrap();
    let cells = cells(&generated, "synth_ice40 -dsp -run begin:map_ffram");
    let cells = ["SB_RAM40_4K", "SB_SPRAM256KA", "SB_MAC16"].map(cells);
    let resources = &model.resources;
    assert_eq!(cells, [resources.block_rams(), resources.large_rams(), resources.multipliers()]);
}

/// A device without single-port RAMs has the banks of polynomials in block RAM.
#[test]
fn without_single_port_rams_block_rams_are_those_of_yosys() {
    let folder = tempfile::tempdir().unwrap();
    let board = folder.path().join("small.toml");
    std::fs::write(&board, "device = \"LFE5U-25F\"\nengine = \"serial\"\nclock_MHz = 50\n").unwrap();
    let mut scene = scene("eight-by-eight").0;
    scene.hardware.board = Some(board.display().to_string());
    let model = Model::new(&scene).unwrap();
    let cells = cells(&generate(&model).unwrap(), "synth_ecp5 -run begin:map_ffram");
    let resources = &model.resources;
    let [block_rams, multipliers] = ["DP16KD", "MULT18X18D"].map(cells);
    assert_eq!([block_rams, 0], [resources.block_rams(), resources.large_rams()]);
    // The plan splits an operand of 19 bits, of which Yosys may find one to be constant.
    assert!(multipliers <= resources.multipliers());
    assert!(block_rams > 0 && block_rams <= model.board.block_rams as usize);
}

#[test]
fn a_wrong_coefficient_is_found() {
    let (scene, frames) = scene("eight-by-eight");
    let right = Model::new(&on_board(scene)).unwrap();
    let wrong = right.clone().with_changed_plan(|plan| plan.first_mut().quantised.ax.flips[0].parity[2][5] ^= 1);
    let wrong = wrong.unwrap();
    let [right, wrong] = [right, wrong].map(|model| Hardware::new(model, &build_dir()).unwrap());
    let vectors: Vec<Vector> = frames.iter().map(|frame| right.vector(std::slice::from_ref(frame)).unwrap()).collect();
    let findings = |hardware: &Hardware| compare(hardware, Simulator::Verilator, &vectors, Stimulus::FullSpeed);
    assert!(findings(&right).is_equal());
    // The first words that differ are those that the coefficient enters.
    assert_eq!(findings(&wrong).kept.first().map(|first| first.stage.as_str()), Some("pass"));
}

#[test]
fn what_it_has_not_is_refused_by_field() {
    let refused = |scene: Scene| Model::new(&scene).unwrap_err().to_string();
    for (scene, names) in [
        (sensor(7, 8, ""), ["sensor.rows", "7"]),
        (sensor(8, 5, ""), ["sensor.cols", "5"]),
        (sensor(8, 8, "[search]\nmu_max = 0\n"), ["search.mu_max", "0"]),
        (sensor(8, 8, "[partition]\nrows = 2\ncols = 2\n"), ["partition.case", "1"]),
        (sensor(8, 8, "[input]\naverage = 2\n"), ["input.average", "2"]),
        (sensor(8, 8, "[input]\naverage = 2\nmean = \"sliding\"\n"), ["input.average", "2"]),
        (sensor(8, 8, "[input]\nfull_scale_MPa = 1.0\nzero = \"running\"\n"), ["input.zero", "running"]),
        (sensor(8, 8, "[output]\nforces = \"resultants\"\n"), ["output.forces", "resultants"]),
        (sensor(8, 8, "[fixed]\nlanes = 8\n"), ["fixed.lanes", "8"]),
        // The coefficients of 25 quads need more block RAMs than the board has.
        (on_board(Scene::builtin("sensor-1").unwrap()), ["block RAMs", BOARD]),
    ] {
        let error = refused(scene);
        assert!(names.iter().all(|name| error.contains(name)), "{error}");
    }
}
