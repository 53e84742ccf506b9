//! A small scene from its file to the bitstream, by the tools, and no worse than its committed line. Large ones take minutes to
//! hours: `make bitstream`.

use std::path::Path;
use std::process::Command;

use dermis_sim::bitstream::baseline::Baselines;

/// What an iCE40's bitstream has ahead of its first command.
const PREAMBLE: [u8; 4] = [0x7e, 0xaa, 0x99, 0x7e];

#[test]
fn a_small_scene_becomes_a_bitstream_no_worse_than_its_baseline() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let build = tempfile::tempdir().unwrap();
    let output = Command::new(env!("CARGO_BIN_EXE_dermis"))
        .current_dir(root)
        .args(["bitstream", "sim/tests/scenes/tiny.toml", "--seeds", "1", "--build-dir"])
        .arg(build.path())
        .output()
        .unwrap();
    let texts = [output.stdout, output.stderr].map(|text| String::from_utf8(text).unwrap());
    assert!(output.status.success(), "{texts:?}");
    assert!(Baselines::committed().get("icebreaker", "tiny").is_some(), "constraints/baselines.json");
    let bitstream = std::fs::read(build.path().join("tiny/icebreaker/tiny.bin")).unwrap();
    assert!(bitstream.windows(PREAMBLE.len()).any(|window| window == PREAMBLE));
}
