//! A small scene from its file to the bitstream, by the tools, and no worse than its committed line; and one whose clock is
//! missed. Large ones take minutes to hours: `make bitstream`.

mod fake;

use std::fs;
use std::path::Path;
use std::process::Command;

use dermis_sim::bitstream::baseline::Baselines;

/// What an iCE40's bitstream has ahead of its first command.
const PREAMBLE: [u8; 4] = [0x7e, 0xaa, 0x99, 0x7e];

/// One seed of a scene of `sim/tests/scenes`, from `folder`.
fn bitstream(name: &str, folder: &Path) -> Command {
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("tests/scenes/{name}.toml"));
    let mut command = Command::new(env!("CARGO_BIN_EXE_dermis"));
    command.current_dir(folder).arg("bitstream").arg(scene).args(["--seeds", "1"]);
    command
}

/// Makes a scene of `sim/tests/scenes` a bitstream.
fn becomes_a_bitstream_no_worse_than_its_baseline(name: &str) {
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

#[test]
fn a_small_scene_behind_a_uart() {
    becomes_a_bitstream_no_worse_than_its_baseline("tiny");
}

#[test]
fn a_small_scene_behind_an_spi() {
    becomes_a_bitstream_no_worse_than_its_baseline("tiny-spi");
}

/// A router that reaches half of the clock.
const SLOW: &str = r#"#!/bin/sh
[ "$1" = --version ] && echo 'nextpnr 0.0' && exit
while [ $# -gt 0 ]; do
  [ "$1" = --report ] && report=$2
  shift
done
echo '{"fmax": {"clk": {"achieved": 12.75, "constraint": 25.5}}, "utilization": {}}' > "$report"
"#;

#[test]
fn a_missed_clock_fails_and_leaves_neither_bitstream_nor_baseline() {
    let folder = tempfile::tempdir().unwrap();
    let (tools, baselines) = (folder.path().join("tools"), folder.path().join("constraints"));
    [&tools, &baselines].into_iter().for_each(|folder| fs::create_dir(folder).unwrap());
    fake::program(&tools, "nextpnr-ice40", SLOW);
    let path = format!("{}:{}", tools.display(), std::env::var("PATH").unwrap());
    let output = bitstream("tiny", folder.path()).arg("--update-baselines").env("PATH", path).output().unwrap();
    let texts = [output.stdout, output.stderr].map(|text| String::from_utf8(text).unwrap());
    assert_eq!(output.status.code(), Some(1), "{texts:?}");
    assert!(texts[0].contains("clk 12.8 MHz of 25.5 MHz"), "{texts:?}");
    assert!(folder.path().join("build/tiny/icebreaker/seed1.report.json").exists());
    assert!(!folder.path().join("build/tiny/icebreaker/tiny.bin").exists());
    assert_eq!(fs::read_dir(baselines).unwrap().count(), 0);
}
