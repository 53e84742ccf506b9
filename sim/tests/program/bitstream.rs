//! Small scenes from scene file to bitstream with the real tools, without regression against their committed baselines;
//! and a scene that misses its clock. Large scenes take minutes to hours: `make bitstream`.

use std::fs;
use std::path::Path;
use std::process::Command;

use dermis_flow::baseline::{Baseline, Baselines};
use dermis_golden::fixed::Model;
use dermis_hdl::link::generate_board;
use dermis_hdl::usage::{total, Usage};

use crate::fake;

/// Synchronisation word of an iCE40 bitstream.
const PREAMBLE: [u8; 4] = [0x7e, 0xaa, 0x99, 0x7e];

/// `dermis bitstream` with one seed for a scene of `sim/tests/scenes`, run in `folder`.
fn bitstream(name: &str, folder: &Path) -> Command {
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("tests/scenes/{name}.toml"));
    let mut command = Command::new(env!("CARGO_BIN_EXE_dermis"));
    command.current_dir(folder).arg("bitstream").arg(scene).args(["--seeds", "1"]);
    command
}

/// Makes the bitstream of a scene of `sim/tests/scenes` and compares it with the baseline.
fn makes_a_bitstream_without_regression(name: &str) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let build = tempfile::tempdir().unwrap();
    let output = bitstream(name, &root).arg("--build-dir").arg(build.path()).output().unwrap();
    let texts = [output.stdout, output.stderr].map(|text| String::from_utf8(text).unwrap());
    assert!(output.status.success(), "{texts:?}");
    assert_eq!(texts[0].contains("spi_sclk: "), name.ends_with("spi"), "{texts:?}");
    assert!(Baselines::committed().get("icebreaker", name).is_some(), "constraints/baselines.json");
    let bitstream = fs::read(build.path().join(format!("{name}/icebreaker/{name}.bin"))).unwrap();
    assert!(bitstream.windows(PREAMBLE.len()).any(|window| window == PREAMBLE));
}

/// Largest relative error of the estimated LUTs against place and route.
const NEAR: f64 = 0.10;

/// In what a baseline is not of the hardware that `usage` counts; the LUTs of the estimate over those routed, signed.
fn differences(baseline: &Baseline, usage: &Usage) -> Vec<String> {
    let [block_rams, multipliers, _, luts] = usage.counts().map(|count| count as u64);
    let error = luts as f64 / baseline.luts as f64 - 1.0;
    let all = [
        (baseline.multipliers != multipliers, format!("{multipliers} multipliers, routed {}", baseline.multipliers)),
        (baseline.block_rams != block_rams, format!("{block_rams} block RAMs, routed {}", baseline.block_rams)),
        (error.abs() > NEAR, format!("{luts} LUTs, routed {}: {:+.1} %", baseline.luts, 100.0 * error)),
    ];
    all.into_iter().filter(|(differs, _)| *differs).map(|(_, text)| text).collect()
}

/// Place and route of most takes too long for a test; a baseline of other hardware shows by its exact counts.
#[test]
fn the_baselines_are_of_the_hardware_generated_now() {
    let baselines = Baselines::committed();
    let built_in = baselines.built_in();
    for name in ["eight-by-eight", "sensor-1", "sensor-2", "sensor-3", "sensor-4"] {
        assert!(
            built_in.iter().any(|(scene, _)| scene.name == name && scene.hardware.board_name() == "ulx3s-85f"),
            "{name}"
        );
    }
    for (scene, baseline) in built_in {
        let usage = total(&generate_board(&Model::new(&scene).unwrap()).unwrap().usage);
        let wrong = differences(baseline, &usage);
        assert!(wrong.is_empty(), "{} on {}: {wrong:?}", scene.name, scene.hardware.board_name());
        // An error in either direction is found, and a count that is wrong by one.
        let more = |share: f64| Baseline { luts: (usage.luts as f64 * share) as u64, ..baseline.clone() };
        assert_eq!([0.90, 1.12].map(|share| differences(&more(share), &usage).len()), [1, 1]);
        let one = Usage { block_rams: usage.block_rams + 1, multipliers: usage.multipliers + 1, ..usage };
        assert_eq!(differences(baseline, &one).len(), 2);
    }
}

#[test]
#[ignore = "half a minute; place.rs places and routes a counter by the same functions: make nightly"]
fn a_small_scene_behind_a_uart() {
    makes_a_bitstream_without_regression("tiny");
}

#[test]
#[ignore = "half a minute more: make nightly"]
fn a_small_scene_behind_an_spi() {
    makes_a_bitstream_without_regression("tiny-spi");
}

/// A stand-in for Yosys, which takes most of the time: a netlist without cells or ports.
const EMPTY: &str = r#"#!/bin/sh
[ "$1" = --version ] && echo 'Yosys 0.0' && exit
for last; do :; done
for name in ports.json netlist.json; do
  case $last in *" $name"*) echo '{"modules": {"board": {"ports": {}}}}' > $name;; esac
done
"#;

#[test]
fn a_missed_clock_fails_and_leaves_neither_bitstream_nor_baseline() {
    let folder = tempfile::tempdir().unwrap();
    let (tools, baselines) = (folder.path().join("tools"), folder.path().join("constraints"));
    [&tools, &baselines].into_iter().for_each(|folder| fs::create_dir(folder).unwrap());
    fake::program(&tools, "yosys", EMPTY);
    fake::program(&tools, "nextpnr-ice40", &fake::nextpnr(12.75, 25.5));
    let mut command = bitstream("tiny", folder.path());
    let output = command.arg("--update-baselines").env("PATH", fake::path(&tools)).output().unwrap();
    let texts = [output.stdout, output.stderr].map(|text| String::from_utf8(text).unwrap());
    assert_eq!(output.status.code(), Some(1), "{texts:?}");
    assert!(texts[0].contains("clk 12.75 MHz of 25.5 MHz"), "{texts:?}");
    assert!(folder.path().join("build/tiny/icebreaker/seed1.report.json").exists());
    assert!(!folder.path().join("build/tiny/icebreaker/tiny.bin").exists());
    assert_eq!(fs::read_dir(baselines).unwrap().count(), 0);
}
