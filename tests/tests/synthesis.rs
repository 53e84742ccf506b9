//! Yosys accepts the generated Verilog as hardware: every signal has exactly one driver, and there is no latch.

use std::process::Command;

use dermis_golden::fixed::Model;
use dermis_golden::link::LinkKind;
use dermis_hdl::link::generate_board;
use dermis_hdl::{generate, Generated};
use dermis_tests::scene;

/// Reads the Verilog, with every part of the design flattened into one module.
fn read(generated: &Generated) {
    let folder = tempfile::tempdir().unwrap();
    for file in &generated.files {
        std::fs::write(folder.path().join(&file.name), &file.text).unwrap();
    }
    let script = format!(
        "read_verilog {top}.v; hierarchy -check -top {top}; proc; select -assert-none t:$dlatch; flatten; opt_clean; \
         check -assert",
        top = generated.top
    );
    let output = Command::new("yosys")
        .current_dir(folder.path())
        .args(["-q", "-p", &script])
        .output()
        .expect("yosys is installed (make setup)");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn yosys_finds_clean_hardware() {
    let (mut scene, ..) = scene("eight-by-eight");
    read(&generate(&Model::new(&scene).unwrap()).unwrap());
    for (_, link) in LinkKind::NAMES {
        scene.hardware.link = link;
        read(&generate_board(&Model::new(&scene).unwrap()).unwrap());
    }
}

#[test]
fn an_undriven_signal_is_found() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("bad.v"), "module bad(output y); wire x; assign y = x; endmodule\n").unwrap();
    let script = "read_verilog bad.v; hierarchy -check -top bad; proc; check -assert";
    let output = Command::new("yosys").current_dir(folder.path()).args(["-q", "-p", script]).output().unwrap();
    assert!(!output.status.success());
}
