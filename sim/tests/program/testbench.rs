//! The testbench that `dermis build` writes: it passes under Icarus, beside another core's files too, and fails where a beat or a memory
//! file is another one or is missing.

use std::fs;
use std::path::Path;
use std::process::Command;

/// Few taxels: Icarus simulates a larger array for ten seconds.
const SCENE: &str = "name = \"small\"\n[sensor]\nrows = 2\ncols = 4\npitch_x_mm = 4.0\npitch_y_mm = 4.0\n\
                     thickness_mm = 3.0\n[search]\nmu_max = 0.1\n";

/// Generates the engine of the array under a cover of this thickness into the folder `rtl` of `folder`.
fn build(folder: &Path, name: &str, thickness_mm: &str) {
    let text = SCENE.replace("small", name).replace("thickness_mm = 3.0", &format!("thickness_mm = {thickness_mm}"));
    let file = format!("{name}.toml");
    fs::write(folder.join(&file), text).unwrap();
    let mut dermis = Command::new(env!("CARGO_BIN_EXE_dermis"));
    let built = dermis.current_dir(folder).args(["build", &file, "--out", "rtl"]).output().unwrap();
    assert!(built.status.success(), "{}", String::from_utf8_lossy(&built.stderr));
}

/// Compiles and runs the testbench of `scene` in `folder`; what it printed, and whether it passed.
fn run(folder: &Path, scene: &str) -> (String, bool) {
    let files = [format!("dermis_{scene}.v"), format!("dermis_{scene}_tb.sv")];
    let mut compiler = Command::new("iverilog");
    let compiled = compiler.current_dir(folder).args(["-g2012", "-o", "tb"]).args(files).output().unwrap();
    assert!(compiled.status.success(), "{}", String::from_utf8_lossy(&compiled.stderr));
    let output = Command::new("vvp").current_dir(folder).args(["-n", "tb"]).output().unwrap();
    (String::from_utf8_lossy(&output.stdout).into_owned(), output.status.success())
}

#[test]
fn the_testbench_passes_and_finds_a_changed_and_a_missing_beat() {
    let folder = tempfile::tempdir().unwrap();
    build(folder.path(), "small", "3.0");
    let rtl = folder.path().join("rtl");
    let (text, passed) = run(&rtl, "small");
    assert!(passed && text.contains("PASS: 8 codes, 11 beats"), "{text}");
    let beats = rtl.join("dermis_small_tb_beats.hex");
    let whole = fs::read_to_string(&beats).unwrap();
    // Another last digit of the beat before the status.
    let mut lines: Vec<String> = whole.lines().map(str::to_owned).collect();
    let digit = lines[5].pop().unwrap();
    lines[5].push(if digit == '0' { '1' } else { '0' });
    fs::write(&beats, lines.join("\n")).unwrap();
    let (text, passed) = run(&rtl, "small");
    assert!(!passed && text.contains("beat 5 is ") && !text.contains("PASS"), "{text}");
    fs::write(&beats, whole).unwrap();
    // A code fewer: the frame never ends.
    let bench = rtl.join("dermis_small_tb.sv");
    let text = fs::read_to_string(&bench).unwrap().replace("localparam CODES = 8;", "localparam CODES = 7;");
    fs::write(&bench, text).unwrap();
    let (text, passed) = run(&rtl, "small");
    assert!(!passed && text.contains("0 of 11 beats after"), "{text}");
}

/// The core's own memory files, of which a frame may read a part alone.
#[test]
fn two_cores_share_a_folder_and_the_memory_file_of_another_is_found() {
    let folder = tempfile::tempdir().unwrap();
    build(folder.path(), "small", "3.0");
    build(folder.path(), "thick", "4.0");
    let rtl = folder.path().join("rtl");
    let passes = |scene| {
        let (text, passed) = run(&rtl, scene);
        passed && text.contains("PASS")
    };
    assert!(passes("small") && passes("thick"));
    // Of the same length, which no simulator notices.
    let (own, other) = (rtl.join("dermis_small__coefficients.hex"), rtl.join("dermis_thick__coefficients.hex"));
    let right = fs::read_to_string(&own).unwrap();
    assert_eq!(right.len(), fs::read_to_string(&other).unwrap().len());
    let is_reported = || {
        let (text, passed) = run(&rtl, "small");
        let reported = text.contains("dermis_small__coefficients.hex: missing, or not the file of this core");
        assert!(reported && !passed && !text.contains("PASS"), "{text}");
    };
    fs::copy(&other, &own).unwrap();
    is_reported();
    fs::remove_file(&own).unwrap();
    is_reported();
    fs::write(&own, right).unwrap();
    assert!(passes("small"));
    // One name for both cores: one of them gets the coefficients of the other.
    for scene in ["small", "thick"] {
        let verilog = rtl.join(format!("dermis_{scene}.v"));
        let text = fs::read_to_string(&verilog).unwrap().replace(&format!("dermis_{scene}__"), "");
        assert!(text.contains("$readmemh(\"coefficients.hex\""));
        fs::write(&verilog, text).unwrap();
    }
    fs::copy(&other, rtl.join("coefficients.hex")).unwrap();
    assert!(passes("thick") && !passes("small"));
}
