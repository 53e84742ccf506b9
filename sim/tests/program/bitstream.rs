//! Small scenes from scene file to bitstream with the real tools, without regression against their committed baselines;
//! and a scene that misses its clock. Large scenes take minutes to hours: `make bitstream`.

use std::fs;
use std::path::Path;
use std::process::Command;

use dermis_golden::fixed::Model;
use dermis_golden::scene::Scene;
use dermis_sim::flow::baseline::Baselines;

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

/// Block RAMs of the link: the packet counters.
const LINK_BLOCK_RAMS: usize = 1;

/// Place and route of these takes too long for a test; a baseline of other hardware shows by its exact counts.
#[test]
fn the_baselines_of_large_scenes_are_of_the_hardware_generated_now() {
    let (board, baselines) = ("ulx3s-85f", Baselines::committed());
    for name in ["eight-by-eight", "sensor-1", "sensor-2", "sensor-3", "sensor-4"] {
        let baseline = baselines.get(board, name).expect(name);
        let model = Model::new(&Scene::builtin(name).unwrap()).unwrap();
        assert_eq!(model.board.name, board);
        let planned = [model.resources.multipliers(), model.resources.block_rams() + LINK_BLOCK_RAMS];
        assert_eq!([baseline.multipliers, baseline.block_rams].map(|count| count as usize), planned, "{name}");
    }
}

#[test]
fn a_small_scene_behind_a_uart() {
    makes_a_bitstream_without_regression("tiny");
}

#[test]
fn a_small_scene_behind_an_spi() {
    makes_a_bitstream_without_regression("tiny-spi");
}

/// A stand-in for nextpnr that reaches half of the required clock.
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
