//! The netlist after synthesis computes the same bits in the same cycles, and the test finds a defect that simulation
//! of the Verilog cannot: a constant whose sign two tools read differently.

use dermis_cosim::drive::Stimulus;
use dermis_cosim::hardware::Hardware;
use dermis_cosim::simulator::Simulator;
use dermis_cosim::{Findings, Vector};
use dermis_golden::data::frame::Frame;
use dermis_golden::fixed::Model;
use dermis_golden::spec::scene::Scene;
use dermis_report::drawn_frames::{DrawnFrames, Shapes};
use dermis_tests::{build_dir, compare, with_network};

/// Small enough for synthesis and compilation within a minute. Without a search nine tenths of the cells are gone;
/// limbs, matrix passes and force unit remain.
const SCENE: &str = "name = \"netlist\"\n[sensor]\nrows = 2\ncols = 4\npitch_x_mm = 4.0\npitch_y_mm = 4.0\n\
                     thickness_mm = 3.0\n[fixed]\nlanes = 4\ninput_bits = 18\ndata_bits = 12\ncoef_bits = 12\n\
                     inverse_bits = 20\n[search]\n";

fn setup(board: &str, mu_max: &str) -> (Hardware, Vec<Frame>) {
    let text = format!("{SCENE}mu_max = {mu_max}\n[hardware]\nboard = \"{board}\"\n");
    of_scene(&Scene::parse(&text, "netlist").unwrap())
}

fn of_scene(scene: &Scene) -> (Hardware, Vec<Frame>) {
    let frames = DrawnFrames { frames: 4, contacts: vec![1], shapes: Shapes::Elliptic, touching: false, seed: 1 };
    let frames = frames.draw(scene).unwrap();
    (Hardware::new(Model::for_frames(scene, &frames).unwrap(), &build_dir()).unwrap(), frames)
}

fn findings(hardware: &Hardware, frames: &[Frame], simulator: Simulator) -> Findings {
    let vectors = frames.iter().map(|frame| hardware.vector(std::slice::from_ref(frame)).unwrap());
    compare(hardware, simulator, &vectors.collect::<Vec<Vector>>(), Stimulus::FullSpeed)
}

fn assert_netlist_is_equal(hardware: &Hardware, frames: &[Frame]) {
    let netlist = findings(hardware, frames, Simulator::Netlist);
    assert!(netlist.is_equal(), "{:?}", netlist.kept);
}

#[test]
#[ignore = "several minutes: make netlist"]
fn the_netlist_of_a_search_equals_the_model() {
    let (hardware, frames) = setup("ulx3s-85f", "0.05");
    assert_netlist_is_equal(&hardware, &frames);
}

#[test]
fn the_netlist_equals_the_model() {
    let (hardware, frames) = setup("ulx3s-85f", "0");
    assert_netlist_is_equal(&hardware, &frames);
}

#[test]
#[ignore = "a minute: make netlist"]
fn a_sign_that_tools_read_differently_is_found_in_the_parallel_engine() {
    netlist_and_defect("ulx3s-85f", "0");
}

#[test]
#[ignore = "a minute: make netlist"]
fn the_netlist_of_the_serial_engine_equals_the_model_and_a_sign_that_tools_read_differently_is_found() {
    netlist_and_defect("icebreaker", "0.05");
}

#[test]
#[ignore = "a minute: make netlist"]
fn the_netlist_of_a_network_equals_the_model() {
    let (scene, _file) = with_network(&format!("{SCENE}mu_max = 0.05\n"), &[5]);
    let (hardware, frames) = of_scene(&scene);
    assert!(hardware.model.has_network());
    assert_netlist_is_equal(&hardware, &frames);
}

#[test]
#[ignore = "three minutes: make netlist"]
fn the_netlist_of_contacts_equals_the_model() {
    let (scene, _file) =
        with_network(&format!("{SCENE}mu_max = 0.05\n[partition]\ncase = \"contacts\"\nmax_contacts = 2\n"), &[5]);
    let (hardware, frames) = of_scene(&scene);
    assert_netlist_is_equal(&hardware, &frames);
}

fn netlist_and_defect(board: &str, mu_max: &str) {
    let (mut hardware, frames) = setup(board, mu_max);
    assert_netlist_is_equal(&hardware, &frames);

    // A signed constant without a range: −5 for Verilator, 251 for Yosys.
    let file = hardware.generated.files.iter_mut().find(|file| file.name.ends_with(".v")).unwrap();
    let sound = "    assign m_axis_tdata = forces__m_axis_tdata;\n";
    let broken = "    localparam signed seeded = 8'hfb;\n    wire signed [7:0] zero = 8'd0;\n    \
         assign m_axis_tdata = (seeded > zero) ? 96'd0 : forces__m_axis_tdata;\n";
    assert!(file.text.contains(sound), "the place of the seeded defect: {sound}");
    file.text = file.text.replacen(sound, broken, 1);
    assert!(findings(&hardware, &frames, Simulator::Verilator).is_equal());
    assert!(!findings(&hardware, &frames, Simulator::Netlist).is_equal());
}
