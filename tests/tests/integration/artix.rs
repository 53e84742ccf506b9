//! The engine on an Artix-7, synthesised by Yosys: accumulators inside the DSP48E1, block RAMs and multipliers as the
//! model counts them; the script for Vivado is complete. Place and route, and Vivado, are not run.

use std::fs;

use dermis_flow::synthesis::{commands, NETLIST};
use dermis_golden::fixed::plan::resources::Resources;
use dermis_golden::fixed::Model;
use dermis_golden::spec::board::Family;
use dermis_golden::spec::scene::Scene;
use dermis_hdl::language::Change;
use dermis_hdl::{generate, generate_changed, Generated};
use dermis_tests::tools::{self, folder_of, yosys};
use dermis_tests::{nightly, variants};
use serde_json::Value;

/// Bits 6 to 4 of a DSP48E1's OPMODE, lowest first, where it adds to its own last result.
const ADDS_TO_RESULT: [&str; 3] = ["0", "1", "0"];
/// Lanes of the scene; with the others in `make nightly`.
const LANES: [usize; 3] = [4, 8, 16];

/// A scene without a search and with so many lanes, on a board of two lines.
fn model(lanes: usize) -> Model {
    let folder = tempfile::tempdir().unwrap();
    let board = folder.path().join("own.toml");
    fs::write(&board, "device = \"XC7A35T\"\nclock_MHz = 100\n").unwrap();
    let text = format!(
        "name = \"artix\"\n[sensor]\nrows = 12\ncols = 18\npitch_x_mm = 4.0\npitch_y_mm = 4.0\nthickness_mm = 3.0\n\
         [search]\nmu_max = 0\n[input]\naverage = 2\n[fixed]\nlanes = {lanes}\n[hardware]\nboard = {board:?}\n"
    );
    Model::new(&Scene::parse(&text, "artix").unwrap()).unwrap()
}

/// Number of multipliers of the lanes that accumulate in their own result register.
fn accumulators(generated: &Generated) -> usize {
    let (folder, top) = (folder_of(generated), &generated.top);
    let lanes = format!("{top}__pass__lanes");
    let commands = commands(Family::Artix7, &lanes);
    yosys(folder.path(), &format!("read_verilog {top}.v; {commands}")).unwrap();
    let netlist: Value = serde_json::from_slice(&fs::read(folder.path().join(NETLIST)).unwrap()).unwrap();
    let cells = netlist["modules"][&lanes]["cells"].as_object().unwrap().values();
    let registered =
        |cell: &Value, register: &str| cell["parameters"][register].as_str().is_some_and(|value| value.ends_with('1'));
    let adds = |cell: &Value| (4..7).map(|bit| &cell["connections"]["OPMODE"][bit]).eq(ADDS_TO_RESULT.iter());
    let all = cells.filter(|cell| cell["type"] == "DSP48E1");
    all.filter(|cell| adds(cell) && registered(cell, "MREG") && registered(cell, "PREG")).count()
}

#[test]
fn accumulators_are_inside_the_multipliers_and_one_that_cannot_be_is_found() {
    for &lanes in variants(&LANES, 1) {
        let model = model(lanes);
        if nightly() {
            assert_eq!(accumulators(&generate(&model).unwrap()), lanes);
        }
        // A lane that does not add to its sum has none; the others have.
        let lane = "parity_0__lane_0__accumulator";
        let sum = Change::value("pass__lanes", lane, |k| k.named("parity_1__lane_0__accumulator"));
        assert_eq!(accumulators(&generate_changed(&model, &[sum]).unwrap()), lanes - 1);
    }
}

#[test]
fn block_rams_and_multipliers_are_those_of_yosys() {
    for &lanes in variants(&LANES, 1) {
        let model = model(lanes);
        // Flattened, because the statistics of a hierarchy are no JSON in Yosys 0.23.
        let synthesis = "synth_xilinx -family xc7 -flatten -run begin:map_ffram";
        let cells = tools::cells(&generate(&model).unwrap(), synthesis);
        // A RAMB36E1 is two of the model's block RAMs.
        let counted = [cells("RAMB18E1") + 2 * cells("RAMB36E1"), cells("DSP48E1")];
        let of = |resources: &Resources| [resources.block_rams(), resources.multipliers()];
        assert_eq!(counted, of(&model.resources));
        // The counts tell designs apart.
        let other = self::model(lanes + 4);
        assert_ne!(counted, of(&other.resources));
    }
}

#[test]
fn the_script_for_vivado_names_files_that_exist_and_no_unknown_command() {
    let model = model(LANES[0]);
    let mut generated = generate(&model).unwrap();
    generated.add_integration(&model);
    let folder = folder_of(&generated);
    let script = format!("{}_vivado.tcl", generated.top);
    // Stand-ins that write down how they are called; another command is an error of Tcl, which Yosys has built in.
    let commands = [
        "read_verilog",
        "read_xdc",
        "synth_design",
        "create_clock",
        "get_ports",
        "opt_design",
        "place_design",
        "phys_opt_design",
        "route_design",
        "report_utilization",
        "report_timing_summary",
        "write_checkpoint",
    ];
    // The constraints are read as Vivado reads them.
    let does = |name| if name == "read_xdc" { "source [lindex $args end]" } else { "" };
    let stand_in = |name| {
        format!("proc {name} {{args}} {{ puts $::calls [concat {name} $args]; {}; return {name} }}\n", does(name))
    };
    let stand_ins = commands.map(stand_in).concat();
    let run = |script: &str| {
        let text = format!("set calls [open calls.txt w]\n{stand_ins}source {script}\nclose $calls\n");
        fs::write(folder.path().join("run.tcl"), text).unwrap();
        yosys(folder.path(), "tcl run.tcl")
    };
    run(&script).unwrap();
    let calls = fs::read_to_string(folder.path().join("calls.txt")).unwrap();
    let read = format!(
        "read_verilog {0}.v\nread_xdc -unmanaged -mode out_of_context {0}.sdc\nget_ports clk\ncreate_clock -name clk -period 10.000 \
         get_ports\nsynth_design -top {0} -part xc7a35tcsg324-1 ",
        generated.top
    );
    assert!(calls.starts_with(&read), "{calls}");
    assert!(folder.path().join(format!("{}.v", generated.top)).exists());
    // A misspelt command is found.
    let text = fs::read_to_string(folder.path().join(&script)).unwrap().replace("opt_design\n", "optimise\n");
    fs::write(folder.path().join(&script), text).unwrap();
    assert!(run(&script).unwrap_err().contains("optimise"));
}
