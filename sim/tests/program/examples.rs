//! Runs every example of `--help` as printed, in a folder with the files that it names; each must succeed. Examples
//! that need a board or take minutes are listed as exceptions with the reason; an exception that is not an example
//! fails.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::time::Instant;

use rayon::prelude::*;

use crate::boards::write_example;

/// Examples that are not run here; some are covered by other tests, named by their file.
const NOT_RUN: &[(&str, &str)] = &[
    ("dermis reconstruct sensor-1 --stream=udp:127.0.0.1:9000 --latest --brief", "has no end; stream.rs"),
    ("dermis replay press.mcap --rate 100 | dermis live sensor-1 --stream", PAGE),
    ("dermis replay glove.mcap --topic /tactile/left --mpa-per-count 0.0001", "python/tests/test_recording.py"),
    ("dermis live sensor-1", PAGE),
    ("dermis live pad.toml --noise 0.002 --engine fixed", PAGE),
    ("dermis live pad.toml --stream=udp:127.0.0.1:9000", PAGE),
    ("dermis live pad.toml --stream=/dev/ttyUSB0 --baud 115200", PAGE),
    ("dermis live sensor-1 --recording press.mcap --loop", SOURCE),
    ("dermis live sensor-1 --board /dev/ttyUSB0", SOURCE),
    ("dermis live sensor-1 --listen 192.168.1.7:8317", PAGE),
    ("dermis host --port /dev/ttyUSB0 press.json", BOARD),
    ("dermis host --udp 192.168.1.50 --scene sensor-1 --check", "network.rs"),
    ("dermis host --udp 192.168.1.50#3 --scene hand.toml --forces", "network.rs"),
    ("dermis board eight-by-eight --udp 127.0.0.1:56850", "has no end; network.rs"),
    ("dermis host --port /dev/ttyUSB0 --scene sensor-1", BOARD),
    ("dermis host --port /dev/ttyUSB0 --forces --check press.json", BOARD),
    ("dermis host --port /dev/ttyUSB0 --scene sensor-1 --tare zero.json --stream <frames >answers", BOARD),
    ("dermis host --port /dev/ttyUSB1 --scene eight-by-eight --target-board icebreaker", BOARD),
    ("dermis host --port /dev/ttyUSB0 --scene hand.toml --tables left-hand.toml press.json", BOARD),
    ("dermis host --port /dev/ttyUSB0 --scene mat.toml --scans 10 --save readings", BOARD),
    ("dermis host --port /dev/ttyUSB0 --scene mat.toml --scans 1000 --stream >answers", BOARD),
    ("dermis load hand.toml left-hand.toml --port /dev/ttyUSB0", BOARD),
    ("dermis place top.json --family ecp5 --size 25k --package CABGA256 --speed-grade 6 --clock clk=pll_clkout:50", PLACE),
    (
        "dermis place board.ys --family ecp5 --size 45k --package CABGA381 --speed-grade 6 --clock core=pll:62.5 --clock rx=eth_rx:125",
        PLACE,
    ),
    ("dermis place top.json --family ice40 --size up5k --package sg48 --clock clk=clk12:12 --seeds 10", PLACE),
    ("dermis board eight-by-eight", "runs until interrupted; host.rs talks to one"),
    ("dermis table", "every scene: minutes"),
    ("dermis table sensor-3 --case contacts --fresh 40 --contacts 2 --contacts 3 --shapes other", "a minute"),
    ("dermis table --cosim", "make run"),
    ("dermis table sensor-1 eight-by-eight --cosim", "make run"),
    ("dermis stability", "a minute; one of its groups is run with a picture, all in the guide"),
    ("dermis check my-scene.toml --stream=/dev/ttyUSB0", "a device; stream.rs"),
    ("dermis check my-scene.toml", "a quarter of a minute; the same for sensor-1 is run"),
    ("dermis deviations my-scene.toml", "a minute; the same for eight-by-eight with fewer draws is run"),
    ("dermis deviations sensor-1 --check", "a quarter of a minute; guide.rs"),
    ("dermis stress", "a quarter of a minute; guide.rs"),
    ("dermis power sensor-1", "the same for eight-by-eight is run"),
    ("dermis power sensor-1 --frame a.json --frame b.csv", "no such files"),
    ("dermis faults", "a minute or two; the same for eight-by-eight is run"),
    ("dermis cosim sensor-1", "equality.rs"),
    ("dermis cosim eight-by-eight --target-board icebreaker", "serial.rs"),
    ("dermis cosim mat.toml", "scan.rs"),
    ("dermis cosim mat.toml --wire stuck-high:0", "scan.rs"),
    ("dermis noise sensor-1", "200 draws of five objectives: minutes"),
    ("dermis noise sensor-2 --objective patch --objective auto --draws 1000 --format csv", "minutes"),
    ("dermis noise sensor-1 --frames 1 --medians", "200 draws of five objectives: minutes"),
    ("dermis noise sensor-1 --shapes table --level 0.01 --gain-spread 0.01 --frames 64 --coverage", "a minute or more"),
    ("dermis noise sensor-3 --shapes table --contacts 3 --level 0.0005", "a minute or more"),
    ("dermis noise sensor-1 --shapes table --sensitivity", "minutes"),
    ("dermis train sensor-1", "three minutes; the short one is run"),
    ("dermis train my-scene.toml", "three minutes"),
    ("dermis train my-scene.toml --minutes 15", "a quarter of an hour"),
    (
        "dermis train my-scene.toml --poisson-tolerance 0.02 --thickness-tolerance 0.05",
        "minutes; golden/src/estimate/learned/tests.rs",
    ),
    (
        "dermis train my-scene.toml --pitch-over-thickness 0.5:2 --least-side 6 --steps 120000",
        "half an hour; golden/src/estimate/learned/tests.rs",
    ),
    ("dermis train my-scene.toml --limit-of my-scene.network", "needs a network of an older version"),
    ("dermis train my-scene.toml --hidden 96,48 --steps 10000 --out small.network", "minutes"),
    ("dermis study input-bits", "a minute; accuracy.rs measures the same"),
    ("dermis study contacts ellipses", "a minute; guide.rs"),
    ("dermis study sensor-faults", "minutes; guide.rs"),
    ("dermis study sensor-faults my-scene.toml --quick", "a minute; golden/study/src/sensor_faults/tests.rs"),
    ("dermis study sensor-faults sensor-1-noisy --noise 0.002 --json", "minutes"),
    ("dermis study devices", "minutes; make bench"),
    ("dermis study devices my-scene.toml --frames 2000", "minutes"),
    ("dermis study devices sensor-1 --python build/python/bin/python", "minutes; make bench"),
    ("dermis study devices eight-by-eight --frames 10 --no-power --json", "report/measure/devices.rs; guide.rs"),
    ("dermis study blind-gains", "a minute; golden/src/estimate/blind_gains/tests.rs"),
    ("dermis study blind-gains my-scene.toml --spread 0.03 --spread 0.1 --presses 600", "minutes"),
    (
        "dermis calibrate mat.toml --blind presses.mcap --out table.csv",
        "needs 200 presses; golden/src/estimate/blind_gains/tests.rs",
    ),
    ("dermis guide", PAGES),
    ("dermis guide --only stability", PAGES),
    ("dermis guide --check", PAGES),
    ("dermis guide --check --quick", PAGES),
    ("dermis guide --pictures", PAGES),
    ("dermis report", "every co-simulation: minutes; make report"),
    ("dermis report --quick", "make report QUICK=1"),
    ("dermis report sensor-1 eight-by-eight --quick --out target/small-report", "make quick writes a longer one"),
    ("dermis report --recording build/recordings/walk", IMPORTED),
    ("dermis report --paper", "repeats of 48×48: minutes; make report"),
    ("dermis bitstream eight-by-eight", PLACED),
    ("dermis bitstream eight-by-eight --board ./my-board.toml", PLACED),
    ("dermis bitstream eight-by-eight --board icebreaker", PLACED),
    ("dermis bitstream sensor-1 --search-width 2", PLACED),
    ("dermis bitstream sensor-1 --seeds 5 --jobs 2 --update-baselines", PLACED),
    ("dermis cosim eight-by-eight --device netlist", "synthesis takes minutes; netlist.rs"),
];
const SOURCE: &str = "runs until interrupted; live_sources.rs";
const PAGE: &str = "runs until interrupted; live.rs";
const IMPORTED: &str = "needs an imported recording; report.rs";
const BOARD: &str = "needs a board on a serial port";
const PLACE: &str = "needs the files of a design; place.rs";
const PAGES: &str = "needs the repository's pages; guide.rs";
const PLACED: &str = "place and route takes from minutes to hours; make bitstream";

fn program() -> &'static Path {
    Path::new(env!("CARGO_BIN_EXE_dermis"))
}

/// The build folder, shared with the other tests.
fn build_dir() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../build")
}

fn help(command: &[&str]) -> String {
    let output = Command::new(program()).args(command).arg("--help").output().unwrap();
    String::from_utf8(output.stdout).unwrap()
}

/// The command lines of a help text, without the remarks behind them.
fn examples(text: &str) -> Vec<String> {
    let joined = text.replace("\\\n", " ");
    let lines = joined.lines().filter_map(|line| line.strip_prefix("  ")).filter(|line| line.starts_with("dermis "));
    let command = |line: &str| {
        // Continuation lines are also separated by spaces: they begin with an option, remarks do not.
        let mut parts: Vec<&str> = line.split("  ").map(str::trim).filter(|part| !part.is_empty()).collect();
        parts.truncate(1 + parts[1..].iter().take_while(|part| part.starts_with("--")).count());
        parts.join(" ")
    };
    lines.map(command).collect()
}

/// Examples that run everywhere and end, in order.
pub(crate) fn runnable() -> Vec<String> {
    let not_run: BTreeSet<String> = NOT_RUN.iter().map(|(line, _)| (*line).to_owned()).collect();
    all_examples().difference(&not_run).cloned().collect()
}

fn all_examples() -> BTreeSet<String> {
    let overview = help(&[]);
    let listed = overview.split("Commands:\n").nth(1).unwrap().split("\n\n").next().unwrap();
    let commands = listed.lines().filter_map(|line| line.split_whitespace().next()).filter(|name| *name != "help");
    let texts = commands.map(|name| help(&[name])).chain([
        overview.clone(),
        help(&["study", "sensor-faults"]),
        help(&["study", "blind-gains"]),
        help(&["study", "devices"]),
    ]);
    texts.flat_map(|text| examples(&text)).collect()
}

/// Creates the files that examples name.
pub(crate) fn prepare(work: &Path) {
    write_example(work);
    let scene =
        fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("../golden/scenes/sensor-1.toml")).unwrap();
    // A calibration is written into its scene.
    for name in ["my-scene.toml", "mat.toml"] {
        fs::write(work.join(name), &scene).unwrap();
    }
    fs::write(work.join("averaging.toml"), format!("{scene}\n[input]\naverage = 1\n")).unwrap();
    let array = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("../golden/scenes/eight-by-eight.toml"));
    let written = "\n[input]\nfull_scale_MPa = 1.0\n\n[hardware]\ntables = \"writable\"\n";
    let hand = array.unwrap().replace("\"eight-by-eight\"", "\"hand\"") + written;
    fs::write(work.join("left-hand.toml"), format!("{hand}\n[threshold]\nmin_force_N = 0.01\n")).unwrap();
    fs::write(work.join("hand.toml"), hand).unwrap();
    let frame = |out: &str, seed: &str| {
        let args = ["generate", "sensor-1", "--random", "1", "--seed", seed, "--out", out];
        assert!(Command::new(program()).current_dir(work).args(args).status().unwrap().success());
    };
    frame("press.json", "1");
    frame("a.json", "2");
    let row =
        |k: usize| (0..10).map(|c| format!("{}", (k * c % 7) as f64 / 100.0)).collect::<Vec<_>>().join(",") + "\n";
    let csv: String = (0..10).map(row).collect();
    for name in ["press.csv", "1.csv", "2.csv", "b.csv"] {
        fs::write(work.join(name), &csv).unwrap();
    }
    // One frame per line.
    let flat = csv.trim_end().replace('\n', ",") + "\n";
    fs::write(work.join("frames.csv"), flat.repeat(3)).unwrap();
    let stream = "dermis reconstruct sensor-1 --stream --brief --record press.mcap <frames.csv";
    assert!(in_shell(work, stream).status.success());
    for (name, counts) in [("zero.csv", 120), ("half.csv", 220), ("full.csv", 320)] {
        fs::write(work.join(name), format!("{}\n", vec![counts.to_string(); 10].join(",")).repeat(20)).unwrap();
    }
    let recordings = Path::new(env!("CARGO_MANIFEST_DIR")).join("../golden/data/recordings");
    for (name, file) in
        [("walk.asf", "fscan-walk.asf"), ("finger.csv", "iscan-finger.csv"), ("press.npy", "numpy/i2.npy")]
    {
        fs::copy(recordings.join(file), work.join(name)).unwrap();
    }
    // Frames of 16×32 counts, and of a sensor of 4×6 taxels that measures three axes.
    fs::write(work.join("skin.bin"), [&[0xaa, 0x55][..], &[7; 512]].concat().repeat(40)).unwrap();
    let axes = |of: String| ["X", "Y", "Z"].map(|axis| of.replace("AXIS", axis)).join(",");
    let taxels: Vec<String> = (0..24).map(|k| axes(format!("0-1-NxN-AXIS[{k}]"))).collect();
    let row = format!("09:41:07.250,0,0,48{}\n", ",0,0,2".repeat(24));
    let log = format!("Timestamp,{},{}\n{}", axes("0-1-1x1-AXIS".into()), taxels.join(","), row.repeat(20));
    fs::write(work.join("paxini.csv"), log).unwrap();
    for name in ["log.csv", "glove.csv", "left.csv"] {
        fs::write(work.join(name), "0,0,0,0,0,5,6,0,0,7,9,0,0,0,0,0\n".repeat(20)).unwrap();
    }
}

/// Runs a command line in which the program is found by its name.
fn in_shell(work: &Path, line: &str) -> Output {
    let path = format!("{}:{}", program().parent().unwrap().display(), std::env::var("PATH").unwrap());
    Command::new("sh").current_dir(work).env("PATH", path).args(["-c", line]).output().unwrap()
}

#[test]
fn every_example_works() {
    let all = all_examples();
    let not_run: BTreeSet<String> = NOT_RUN.iter().map(|(line, _)| (*line).to_owned()).collect();
    assert!(not_run.is_subset(&all), "no examples: {:?}", not_run.difference(&all));
    let work = tempfile::tempdir().unwrap();
    prepare(work.path());
    // Uses the Verilator libraries built by other tests.
    fs::create_dir_all(build_dir().join("verilator")).unwrap();
    fs::create_dir(work.path().join("build")).unwrap();
    std::os::unix::fs::symlink(build_dir().join("verilator"), work.path().join("build/verilator")).unwrap();
    // The folder for the example of `dermis check`.
    let built = Command::new(program()).current_dir(work.path()).args(["build", "sensor-1"]).output().unwrap();
    assert!(built.status.success(), "{}", String::from_utf8_lossy(&built.stderr));
    let run: Vec<&String> = all.difference(&not_run).collect();
    assert!(run.len() >= 15, "{run:?}");
    let failure = |line: &&String| {
        let begun = Instant::now();
        let output = in_shell(work.path(), line);
        println!("{:5.1} s  {line}", begun.elapsed().as_secs_f64());
        (!output.status.success()).then(|| format!("{line}\n{}\n", String::from_utf8_lossy(&output.stderr)))
    };
    // Several build into the same folder: those run one after the other, beside all others.
    let (builds, others): (Vec<&String>, Vec<&String>) =
        run.into_iter().partition(|line| line.starts_with("dermis build") || line.starts_with("dermis check"));
    let (of_builds, of_others) = rayon::join(
        || builds.iter().filter_map(failure).collect::<Vec<_>>(),
        || others.par_iter().filter_map(failure).collect::<Vec<_>>(),
    );
    let failures = [of_builds, of_others].concat().concat();
    assert!(failures.is_empty(), "{failures}");
}
