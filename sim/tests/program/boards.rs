//! The guide's board of one's own, from its page to a bitstream: synthesised by the real tool, in `make nightly` placed and routed too;
//! what its files lack is told before synthesis.

use std::fs;
use std::path::Path;
use std::process::Command;

use crate::fake;

/// The page with the example.
const PAGE: &str = include_str!("../../../docs/your-board.md");
/// Names of the example's files.
const FILES: [&str; 3] = ["my-board.toml", "my-board.v", "my-board.pcf"];

/// The first block of code behind the line that begins with `name`.
fn block(name: &str) -> &'static str {
    let (_, rest) = PAGE.split_once(&format!("\n`{name}`")).expect(name);
    let (_, rest) = rest.split_once("```").expect(name);
    let (_, rest) = rest.split_once('\n').expect(name);
    rest.split_once("```").expect(name).0
}

/// Writes the example's files into `folder`.
pub fn write_example(folder: &Path) {
    FILES.iter().for_each(|name| fs::write(folder.join(name), block(name)).unwrap());
}

/// A folder with the example's files and the smallest scene.
fn example() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    write_example(folder.path());
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/scenes/tiny.toml");
    fs::copy(scene, folder.path().join("tiny.toml")).unwrap();
    folder
}

/// What `dermis` prints in `folder`, and its exit code; tools in `folder/tools` are taken first.
fn dermis(folder: &Path, args: &str) -> ([String; 2], Option<i32>) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_dermis"));
    command.env("PATH", fake::path(&folder.join("tools")));
    let output = command.current_dir(folder).args(args.split(' ')).output().unwrap();
    ([output.stdout, output.stderr].map(|text| String::from_utf8(text).unwrap()), output.status.code())
}

/// Makes the bitstream of the guide's board, and a baseline; its number of bytes.
fn make_bitstream(folder: &Path) -> usize {
    let (texts, code) = dermis(folder, "bitstream tiny.toml --board ./my-board.toml --seeds 1 --update-baselines");
    assert_eq!(code, Some(0), "{texts:?}");
    let baselines = fs::read_to_string(folder.join("baselines.json")).unwrap();
    assert!(baselines.contains("\"my-board\"") && baselines.contains("\"tiny\""), "{baselines}");
    fs::read(folder.join("build/tiny/my-board/tiny.bin")).unwrap().len()
}

#[test]
#[ignore = "half a minute; the next one has no place and route, place.rs that of a counter: make nightly"]
fn the_board_of_the_guide_is_built_placed_and_routed() {
    assert!(make_bitstream(example().path()) > 100_000);
}

#[test]
fn the_board_of_the_guide_is_synthesised_and_its_baseline_written() {
    let folder = example();
    let tools = folder.path().join("tools");
    fs::create_dir(&tools).unwrap();
    fake::program(&tools, "nextpnr-ice40", &fake::nextpnr(30.0, 24.0));
    fake::program(&tools, "icepack", "#!/bin/sh\ncp \"$1\" \"$2\"\n");
    assert_eq!(make_bitstream(folder.path()), 0);
}

#[test]
fn scenes_and_options_take_the_file() {
    let folder = example();
    let manifest = |args: &str| {
        let (texts, code) = dermis(folder.path(), &format!("build {args} --out rtl"));
        assert_eq!(code, Some(0), "{texts:?}");
        let text = fs::read_to_string(folder.path().join("rtl/manifest.json")).unwrap();
        let manifest: serde_json::Value = serde_json::from_str(&text).unwrap();
        (manifest["board"].as_str().unwrap().to_owned(), manifest["clock_MHz"].as_f64().unwrap())
    };
    assert_eq!(manifest("tiny.toml"), ("icebreaker".to_owned(), 25.5));
    assert_eq!(manifest("tiny.toml --target-board my-board.toml"), ("my-board".to_owned(), 24.0));
    // Relative to the scene's folder.
    let scene = fs::read_to_string(folder.path().join("tiny.toml")).unwrap();
    fs::create_dir(folder.path().join("scenes")).unwrap();
    let own = scene.replace("\"icebreaker\"", "\"../my-board.toml\"");
    fs::write(folder.path().join("scenes/own.toml"), own).unwrap();
    assert_eq!(manifest("scenes/own.toml"), ("my-board".to_owned(), 24.0));
    // An engine without pins, with a budget below what the scene takes.
    let alone = "device = \"iCE40UP5K\"\nclock_MHz = 20\n";
    fs::write(folder.path().join("alone.toml"), alone).unwrap();
    assert_eq!(manifest("tiny.toml --target-board alone.toml"), ("alone".to_owned(), 20.0));
    let (texts, code) = dermis(folder.path(), "build tiny.toml --target-board alone.toml --board");
    assert_eq!(code, Some(2));
    assert!(texts[1].contains("board alone has no pins for it (no uart_baud in alone.toml)"), "{texts:?}");
    fs::write(folder.path().join("alone.toml"), format!("{alone}multipliers = 3\n")).unwrap();
    let (texts, code) = dermis(folder.path(), "build tiny.toml --target-board alone.toml");
    assert_eq!(code, Some(2));
    assert!(texts[1].contains("does not fit alone: it needs") && texts[1].contains("multipliers"), "{texts:?}");
}

#[test]
fn what_the_files_lack_is_told_before_synthesis() {
    let message = |file: &str, from: &str, to: &str| {
        let folder = example();
        let path = folder.path().join(file);
        let text = fs::read_to_string(&path).unwrap();
        assert!(text.contains(from), "{text}");
        fs::write(path, text.replace(from, to)).unwrap();
        let (texts, code) = dermis(folder.path(), "bitstream tiny.toml --board ./my-board.toml --seeds 1");
        assert_eq!((code, texts[0].as_str()), (Some(2), ""), "{texts:?}");
        assert!(!folder.path().join("build/tiny/my-board/netlist.json").exists());
        texts[1].clone()
    };
    let cases = [
        (
            "my-board.pcf",
            "set_io led[1] 11\nset_io led[2] 26",
            "# no lamps",
            "my-board.toml, line 4: pins: ./my-board.pcf: no site for led[1], led[2]; every port of the module board must",
        ),
        ("my-board.v", "module board", "module bord", "my-board.toml, line 3: verilog: none of the files has the module board"),
        ("my-board.v", "endmodule", "", "my-board.toml, line 3: verilog: "),
        ("my-board.toml", "my-board.pcf", "board.pcf", "my-board.toml, line 4: pins: ./board.pcf: No such file"),
        ("my-board.toml", "\"my-board.v\"", "\"dermis_tiny_board.v\"", "my-board.toml, line 3: verilog: ./dermis_tiny_board.v: No"),
        ("my-board.toml", "pins = \"my-board.pcf\"\n", "", "my-board.toml: pins is missing; it must be the pin file beside"),
        ("my-board.toml", "iCE40UP5K", "XC7A35T", "my-board.toml, line 4: pins = \"my-board.pcf\" is not allowed"),
        ("my-board.toml", "24.0", "0", "my-board.toml, line 5: clock_MHz = 0 is not allowed; it must be a number above 0"),
    ];
    for (file, from, to, wanted) in cases {
        let message = message(file, from, to);
        assert!(message.contains(&format!("error: ./{wanted}")), "{message}\n{wanted}");
    }
}

#[test]
fn the_list_has_boards_and_devices_as_text_and_as_json() {
    let folder = example();
    let (texts, code) = dermis(folder.path(), "boards");
    assert_eq!(code, Some(0));
    let line = texts[0].lines().find(|line| line.starts_with("| LFE5U-85F")).unwrap();
    assert!(["ecp5", "156", "208", "83640"].iter().all(|figure| line.contains(figure)), "{line}");
    let json = |args: &str| -> serde_json::Value { serde_json::from_str(&dermis(folder.path(), args).0[0]).unwrap() };
    let list = json("boards --json");
    assert_eq!(list["devices"].as_array().unwrap().len(), 6);
    let board = list["boards"].as_array().unwrap().iter().find(|board| board["name"] == "icebreaker").unwrap();
    assert_eq!((&board["device"], &board["luts"]), (&"iCE40UP5K".into(), &5280.into()));
    let own = json("boards my-board.toml --json");
    assert_eq!((&own["name"], &own["clock_MHz"], &own["block_rams"]), (&"my-board".into(), &24.0.into(), &30.into()));
    // What is printed is a file to start from.
    let (texts, code) = dermis(folder.path(), "boards my-board.toml");
    assert_eq!(code, Some(0), "{texts:?}");
    fs::write(folder.path().join("copy.toml"), &texts[0]).unwrap();
    let again = json("boards copy.toml --json");
    assert_eq!((&again["clock_MHz"], &again["uart_baud"]), (&own["clock_MHz"], &own["uart_baud"]));
    // A file that it names must be there.
    fs::remove_file(folder.path().join("my-board.v")).unwrap();
    let (texts, code) = dermis(folder.path(), "boards my-board.toml");
    assert_eq!(code, Some(2));
    assert!(texts[1].starts_with("error: my-board.toml, line 3: verilog: my-board.v: No such file"), "{texts:?}");
}
