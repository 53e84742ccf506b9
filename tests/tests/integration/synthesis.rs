//! Yosys accepts the generated Verilog as hardware: every signal has exactly one driver, and there is no latch.

use dermis_golden::fixed::Model;
use dermis_golden::spec::link_kind::LinkKind;
use dermis_hdl::link::generate_board;
use dermis_hdl::{generate, Generated};
use dermis_tests::tools::{folder_of, yosys};
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
