//! A small scene from its file to the bitstream, by the tools, and no worse than its committed line. Large ones take minutes to
//! hours: `make bitstream`.

use std::path::Path;
use std::process::Command;

use dermis_sim::bitstream::baseline::Baselines;

/// What an iCE40's bitstream has ahead of its first command.
const PREAMBLE: [u8; 4] = [0x7e, 0xaa, 0x99, 0x7e];

/// Makes a scene of `sim/tests/scenes` a bitstream.
fn becomes_a_bitstream_no_worse_than_its_baseline(name: &str) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let build = tempfile::tempdir().unwrap();
    let output = Command::new(env!("CARGO_BIN_EXE_dermis"))
        .current_dir(root)
        .args(["bitstream", &format!("sim/tests/scenes/{name}.toml"), "--seeds", "1", "--build-dir"])
        .arg(build.path())
        .output()
        .unwrap();
    let texts = [output.stdout, output.stderr].map(|text| String::from_utf8(text).unwrap());
    assert!(output.status.success(), "{texts:?}");
    assert_eq!(texts[0].contains("spi_sclk: "), name.ends_with("spi"), "{texts:?}");
    assert!(Baselines::committed().get("icebreaker", name).is_some(), "constraints/baselines.json");
    let bitstream = std::fs::read(build.path().join(format!("{name}/icebreaker/{name}.bin"))).unwrap();
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
