//! Yosys accepts the generated Verilog as hardware: every signal has exactly one driver, and there is no latch. Without a board it is for
//! any family.

use dermis_golden::fixed::Model;
use dermis_golden::spec::link_kind::LinkKind;
use dermis_golden::spec::scene::Scene;
use dermis_hdl::bus::{generate_core, Bus, CoreShape};
use dermis_hdl::link::generate_board;
use dermis_hdl::{generate, Generated};
use dermis_tests::tools::{cells, folder_of, yosys};
use dermis_tests::{scene, variants};

/// Reads the Verilog, with every part of the design flattened into one module.
fn read(generated: &Generated) {
    let script = format!(
        "read_verilog {top}.v; hierarchy -check -top {top}; proc; select -assert-none t:$dlatch; flatten; opt_clean; \
         check -assert",
        top = generated.top
    );
    yosys(folder_of(generated).path(), &script).unwrap_or_else(|error| panic!("{error}"));
}

#[test]
fn yosys_finds_clean_hardware() {
    let (mut scene, ..) = scene("eight-by-eight");
    read(&generate(&Model::new(&scene).unwrap()).unwrap());
    for (_, link) in variants(&LinkKind::NAMES, 1) {
        scene.hardware.link = *link;
        read(&generate_board(&Model::new(&scene).unwrap()).unwrap());
    }
}

#[test]
fn an_undriven_signal_is_found() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("bad.v"), "module bad(output y); wire x; assign y = x; endmodule\n").unwrap();
    let script = "read_verilog bad.v; hierarchy -check -top bad; proc; check -assert";
    let error = yosys(folder.path(), script).unwrap_err();
    assert!(error.contains("x") && error.contains("no driver"), "{error}");
}

/// Families of which there is no board here, with the cells that hold memories; the first two have no memories of look-up tables.
const OTHERS: [(&str, &[&str]); 4] = [
    ("synth_gatemate", &["CC_BRAM_20K", "CC_BRAM_40K"]),
    ("synth_efinix", &["EFX_RAM_5K"]),
    ("synth_gowin", &["SPX9", "SDPX9B", "DPX9B", "RAM16SDP4"]),
    ("synth_intel_alm -family cyclonev", &["MISTRAL_M10K", "MISTRAL_MLAB"]),
];

/// A small core, for this board if there is one.
fn core(board: Option<&str>) -> Generated {
    let mut scene = Scene::parse(include_str!("../../soc/still.toml"), "still.toml").unwrap();
    scene.hardware.board = board.map(str::to_owned);
    generate_core(&Model::new(&scene).unwrap(), CoreShape { bus: Bus::Wishbone, words: 1 }).unwrap()
}

#[test]
fn a_core_without_a_board_is_for_any_family() {
    let core = core(None);
    for (synthesis, memories) in variants(&OTHERS, 2) {
        let cells = cells(&core, &format!("{synthesis} -run begin:map_ffram"));
        let count: usize = memories.iter().map(|cell| cells(cell)).sum();
        println!("{synthesis}: {count} cells of memories");
        assert!(count > 0, "{synthesis}");
    }
}

#[test]
fn a_kind_of_ram_that_a_family_lacks_is_refused() {
    let core = core(Some("ulx3s-85f"));
    let script = format!("read_verilog {top}.v; synth_gatemate -top {top} -run begin:map_ffram", top = core.top);
    let error = yosys(folder_of(&core).path(), &script).unwrap_err();
    assert!(error.contains("no valid mapping found for memory"), "{error}");
}
