//! `dermis place` of a counter, with the real tools.

use std::fs;
use std::path::Path;
use std::process::Command;

use serde_json::Value;

const VERILOG: &str = "module top(input clk, output reg led);
  reg [23:0] count = 0;
  always @(posedge clk) {led, count} <= {led, count} + 1;
endmodule
";
const SCRIPT: &str = "read_verilog top.v; synth_ice40 -top top -json top.json\n";

/// Places the counter with a clock of this frequency in MHz: the exit code, the figures if there are any, and the errors.
fn place(folder: &Path, constraint_MHz: f64, more: &[&str]) -> (Option<i32>, Option<Value>, String) {
    let pins = format!("set_io clk 35\nset_io led 11\nset_frequency clk {constraint_MHz}\n");
    for (name, text) in [("top.v", VERILOG), ("top.ys", SCRIPT), ("top.pcf", &pins)] {
        fs::write(folder.join(name), text).unwrap();
    }
    // What an earlier run made.
    fs::write(folder.join("top.bin"), "earlier").unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_dermis"));
    command.current_dir(folder).args(["place", "top.ys", "--family", "ice40", "--size", "up5k", "--package", "sg48"]);
    let output = command.args(more).output().unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    let figures = (!text.is_empty()).then(|| serde_json::from_str(&text).unwrap());
    (output.status.code(), figures, String::from_utf8(output.stderr).unwrap())
}

#[test]
fn a_counter_is_placed_and_routed() {
    let folder = tempfile::tempdir().unwrap();
    let (code, figures, error) = place(folder.path(), 12.0, &["--clock", "clock=clk:12"]);
    let figures = figures.unwrap_or_else(|| panic!("{error}"));
    assert_eq!((code, &figures["seed"], &figures["is_met"]), (Some(0), &1.into(), &true.into()), "{figures}");
    assert_eq!(figures["cells"]["flip_flops"]["used"], 25);
    assert_eq!(figures["cells"]["luts"]["available"], 5280);
    let clock = &figures["clocks"]["clock"];
    assert!(clock["reached_MHz"].as_f64().unwrap() > clock["wanted_MHz"].as_f64().unwrap(), "{figures}");
    assert!(clock["longest_path"]["logic_ns"].as_f64().unwrap() > 1.0, "{figures}");
    assert!(figures["tools"]["nextpnr-ice40"].as_str().unwrap().contains("nextpnr"), "{figures}");
    assert_eq!(figures["bitstream"], "top.bin");
    assert!(fs::read(folder.path().join("top.bin")).unwrap().len() > 100_000);
    assert!(!folder.path().join("seed2.report.json").exists());
}

#[test]
fn a_missed_clock_tries_every_seed_and_makes_no_bitstream() {
    let folder = tempfile::tempdir().unwrap();
    let (code, figures, _) = place(folder.path(), 400.0, &["--clock", "clock=clk:400", "--seeds", "2"]);
    let figures = figures.unwrap();
    assert_eq!((code, &figures["is_met"], &figures["bitstream"]), (Some(1), &false.into(), &Value::Null));
    let reached = |seed: u64| {
        let text = fs::read_to_string(folder.path().join(format!("seed{seed}.report.json"))).unwrap();
        let report: Value = serde_json::from_str(&text).unwrap();
        report["fmax"].as_object().unwrap().values().next().unwrap()["achieved"].as_f64().unwrap()
    };
    let [own, other] = [1, 2].map(reached);
    assert_eq!(figures["seed"], if own >= other { 1 } else { 2 });
    let best = figures["clocks"]["clock"]["reached_MHz"].as_f64().unwrap();
    assert!((0.0..0.01).contains(&(own.max(other) - best)), "{own} {other} {best}");
    assert!(figures["missed"][0].as_str().unwrap().ends_with(" of 400 MHz"), "{figures}");
    assert!(!folder.path().join("top.bin").exists());
}

#[test]
fn what_is_wrong_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let error = |more: &[&str]| {
        let (code, figures, error) = place(folder.path(), 12.0, more);
        assert!(code != Some(0) && figures.is_none(), "{error}");
        error
    };
    let message = error(&["--clock", "clock=clk:20"]);
    assert!(message.contains("error: clock clock: nextpnr was told 12.000 MHz, not 20"), "{message}");
    assert!(!folder.path().join("top.bin").exists());
    let message = error(&["--clock", "clock=other:12"]);
    assert!(message.contains("clocks clk$SB_IO_IN_$glb_clk: known are other"), "{message}");
    let message = error(&["--clock", "clock=clk:0"]);
    assert!(message.contains("must be as core=pll_clkout:62.5"), "{message}");
    let of = |family: &str| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_dermis"));
        command.current_dir(folder.path()).args([
            "place",
            "top.v",
            "--size",
            "up5k",
            "--package",
            "sg48",
            "--clock",
            "a=b:1",
        ]);
        let output = command.args(["--family", family]).output().unwrap();
        (output.status.code(), String::from_utf8(output.stderr).unwrap())
    };
    let (code, message) = of("artix7");
    assert!(code == Some(2) && message.contains("must be one of ecp5, ice40"), "{message}");
    let (code, message) = of("ice40");
    let wanted = "error: top.v: must be a netlist, NAME.json, or a script of Yosys that writes it, NAME.ys";
    assert!(code == Some(2) && message.contains(wanted), "{message}");
}
