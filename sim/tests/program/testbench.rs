//! The testbench that `dermis build` writes: it passes under Icarus, and fails where a beat is another one or is missing.

use std::fs;
use std::path::Path;
use std::process::Command;

/// Few taxels: Icarus simulates a larger array for ten seconds.
const SCENE: &str = "name = \"small\"\n[sensor]\nrows = 2\ncols = 4\npitch_x_mm = 4.0\npitch_y_mm = 4.0\n\
                     thickness_mm = 3.0\n[search]\nmu_max = 0.1\n";

/// Compiles and runs the testbench in `folder`; what it printed, and whether it passed.
fn run(folder: &Path) -> (String, bool) {
    let files = ["dermis_small.v", "dermis_small_tb.sv"];
    let mut compiler = Command::new("iverilog");
    let compiled = compiler.current_dir(folder).args(["-g2012", "-o", "tb"]).args(files).output().unwrap();
    assert!(compiled.status.success(), "{}", String::from_utf8_lossy(&compiled.stderr));
    let output = Command::new("vvp").current_dir(folder).args(["-n", "tb"]).output().unwrap();
    (String::from_utf8_lossy(&output.stdout).into_owned(), output.status.success())
}

#[test]
fn the_testbench_passes_and_finds_a_changed_and_a_missing_beat() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("small.toml"), SCENE).unwrap();
    let mut dermis = Command::new(env!("CARGO_BIN_EXE_dermis"));
    let built = dermis.current_dir(folder.path()).args(["build", "small.toml", "--out", "rtl"]).output().unwrap();
    assert!(built.status.success(), "{}", String::from_utf8_lossy(&built.stderr));
    let rtl = folder.path().join("rtl");
    let (text, passed) = run(&rtl);
    assert!(passed && text.contains("PASS: 8 codes, 11 beats"), "{text}");
    let beats = rtl.join("dermis_small_tb_beats.hex");
    let whole = fs::read_to_string(&beats).unwrap();
    // Another last digit of the beat before the status.
    let mut lines: Vec<String> = whole.lines().map(str::to_owned).collect();
    let digit = lines[5].pop().unwrap();
    lines[5].push(if digit == '0' { '1' } else { '0' });
    fs::write(&beats, lines.join("\n")).unwrap();
    let (text, passed) = run(&rtl);
    assert!(!passed && text.contains("beat 5 is ") && !text.contains("PASS"), "{text}");
    fs::write(&beats, whole).unwrap();
    // A code fewer: the frame never ends.
    let bench = rtl.join("dermis_small_tb.sv");
    let text = fs::read_to_string(&bench).unwrap().replace("localparam CODES = 8;", "localparam CODES = 7;");
    fs::write(&bench, text).unwrap();
    let (text, passed) = run(&rtl);
    assert!(!passed && text.contains("0 of 11 beats after"), "{text}");
}
