//! Yosys reads the generated Verilog as hardware: every signal driven, and driven once, and no latch.

use std::process::Command;

use dermis_golden::fixed::Model;
use dermis_hdl::generate;
use dermis_tests::scene;

#[test]
fn yosys_finds_clean_hardware() {
    let (scene, _) = scene("eight-by-eight");
    let generated = generate(&Model::new(&scene).unwrap()).unwrap();
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
fn an_undriven_signal_is_found() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("bad.v"), "module bad(output y); wire x; assign y = x; endmodule\n").unwrap();
    let script = "read_verilog bad.v; hierarchy -check -top bad; proc; check -assert";
    let output = Command::new("yosys").current_dir(folder.path()).args(["-q", "-p", script]).output().unwrap();
    assert!(!output.status.success());
}
