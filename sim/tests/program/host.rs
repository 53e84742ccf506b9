//! `dermis host` with a simulated board: the verilated board top's UART on a pseudo-terminal, opened like a serial
//! port, over error-free and noisy channels.

use std::io::Write;
use std::path::PathBuf;
use std::process::{Command, Output, Stdio};
use std::time::Duration;

use dermis_cosim::hardware::Hardware;
use dermis_golden::data::frame::Frame;
use dermis_golden::fixed::Model;
use dermis_golden::spec::link_kind::LinkKind;
use dermis_golden::spec::scene::Scene;
use dermis_host::link::{open, Session};
use dermis_host::link::{ChannelFaults, NoisyChannel, PseudoTerminal};

/// Eight clock cycles per bit, to keep the simulation short.
const BAUD: u32 = 12_500_000;

/// The model of a scene on a board with that bit rate.
fn fast(scene: &Scene) -> Model {
    Model::new(scene).unwrap().with_changed_plan(|plan| plan.board.uart_baud = Some(BAUD)).unwrap()
}

fn model() -> Model {
    fast(&Scene::builtin("eight-by-eight").unwrap())
}

/// A simulated board of the scene `eight-by-eight`, which runs until it is dropped.
pub(super) fn board(to_board: ChannelFaults, to_host: ChannelFaults) -> PseudoTerminal {
    let build = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../build");
    let hardware = Hardware::new(model(), &build).unwrap();
    PseudoTerminal::with_channels(&hardware, NoisyChannel::new(to_board), NoisyChannel::new(to_host)).unwrap()
}

#[test]
fn over_a_noisy_channel_every_answer_is_right_and_every_error_is_counted() {
    let to_board = ChannelFaults { lost: 1500, flipped: 1500, late: 200, no_stop: 2000, seed: 1 };
    let to_host = ChannelFaults { lost: 600, flipped: 600, seed: 2, ..ChannelFaults::default() };
    let terminal = board(to_board, to_host);
    let client = open(&terminal.path().to_string_lossy(), BAUD, Duration::from_millis(1000)).unwrap();
    let model = model();
    let frames = Frame::shipped(&model.scene);
    let mut session = Session::new(Box::new(client), model, None, None, false, true).unwrap();
    let mut dropped = 0;
    for round in 0..2 {
        for frame in &frames {
            let (_, answer) = session.request(frame).unwrap();
            assert_eq!(answer.difference, Some(None), "{}, round {round}", frame.id);
            dropped += usize::from(answer.dropped_before());
        }
    }
    let counters = session.board.counters().unwrap();
    let errors = session.board.link_errors();
    let [framing, crc, unknown_type, length, overrun] =
        ["framing", "CRC", "unknown type", "length", "overrun"].map(|reason| counters.dropped_for(reason));
    // Every repeated request was dropped and counted by the board, or its answer was damaged.
    let drops = framing + crc + unknown_type + length;
    assert_eq!(errors.repeated, u64::from(drops) + errors.damaged, "{counters:?}, {errors:?}");
    assert!(framing > 0 && crc > 0 && errors.damaged > 0, "{counters:?}, {errors:?}");
    // Requests accepted: identification, counters, the frames, and repetitions after damaged answers.
    assert_eq!(u64::from(counters.taken), 2 + 2 * frames.len() as u64 + errors.damaged, "{counters:?}, {errors:?}");
    assert_eq!(overrun, 0);
    // The answer after a dropped frame packet has the flag.
    assert!(dropped > 0, "{counters:?}");
}

fn host(terminal: &PseudoTerminal, scene: &str, more: &[&str], input: &str) -> Output {
    let port = terminal.path().to_string_lossy();
    run(&[&["host", "--port", &port, "--scene", scene, "--timeout", "3000"], more].concat(), input)
}

/// Runs the program with this standard input.
pub(super) fn run(arguments: &[&str], input: &str) -> Output {
    let mut child = Command::new(env!("CARGO_BIN_EXE_dermis"))
        .args(arguments)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // The write fails if the program has refused its arguments and exited.
    let _ = child.stdin.take().unwrap().write_all(input.as_bytes());
    child.wait_with_output().unwrap()
}

pub(super) fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

#[test]
fn the_program_sends_checks_tares_and_streams() {
    let terminal = board(ChannelFaults::default(), ChannelFaults::default());
    let scene = "eight-by-eight";

    let all = host(&terminal, scene, &["--check"], "");
    assert_eq!(all.status.code(), Some(0), "{}", text(&all.stderr));
    let shown = text(&all.stdout);
    assert_eq!(shown.matches("against model   equal, every bit\n").count(), 5, "{shown}");
    assert!(shown.contains(" per second in the simulation, not on a board\n"), "{shown}");
    assert_eq!(text(&all.stderr), "");
    assert!(shown.contains("board dropped   0 framing, 0 CRC, 0 unknown type, 0 length, 0 overrun\n"), "{shown}");

    let folder = tempfile::tempdir().unwrap();
    let frame = folder.path().join("press.csv");
    let stress: Vec<f64> = (0..64).map(|taxel| f64::from(taxel % 9) / 100.0).collect();
    let rows: Vec<String> =
        stress.chunks(8).map(|row| row.iter().map(f64::to_string).collect::<Vec<_>>().join(",")).collect();
    std::fs::write(&frame, rows.join("\n")).unwrap();
    let frame = frame.to_string_lossy();
    let forces = host(&terminal, scene, &["--check", "--forces", &frame], "");
    assert_eq!(forces.status.code(), Some(0), "{}", text(&forces.stderr));
    assert!(text(&forces.stdout).contains("engine board\n"), "{}", text(&forces.stdout));

    // A frame minus itself as tare is zero.
    let nothing = host(&terminal, scene, &["--baud", "9600", "--tare", &frame, &frame], "");
    assert!(text(&nothing.stderr).contains("a pseudo-terminal has no bit rate: --baud has no effect\n"));
    assert!(text(&nothing.stdout).contains("no-contact"), "{}", text(&nothing.stdout));

    let line = format!("{{\"id\": [7], \"stress_MPa\": {stress:?}}}\n");
    let wrong = "{\"id\": 8, \"stress_MPa\": [1]}\n";
    let streamed = host(&terminal, scene, &["--stream", "--check", "--forces"], &[&line, wrong, &line].concat());
    assert_eq!(streamed.status.code(), Some(2));
    let lines: Vec<serde_json::Value> =
        text(&streamed.stdout).lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!(lines.len(), 3);
    for answer in [&lines[0], &lines[2]] {
        assert_eq!((&answer["id"][0], &answer["equal"]), (&7.into(), &true.into()), "{answer}");
        assert!(answer["answered_s"].as_f64() > answer["sent_s"].as_f64(), "{answer}");
        assert_eq!(answer["forces_N"]["fz"].as_array().unwrap().len(), 64);
    }
    assert_eq!(lines[1]["error"], "stress_MPa has 1 values, wanted 64");
    assert_eq!(text(&streamed.stderr).lines().last(), Some("error: standard input: 1 of 3 lines were refused"));

    let other = host(&terminal, "sensor-1", &[], "");
    assert_eq!(other.status.code(), Some(2));
    let message = text(&other.stderr);
    assert!(message.contains("the board was built for another scene: 8×8 taxels"), "{message}");
}

#[test]
fn the_host_sums_the_forces_of_a_board_that_does_not() {
    let mut scene = Scene::builtin("eight-by-eight").unwrap();
    scene.hardware.board = Some("icebreaker".into());
    let model = Model::new(&scene).unwrap();
    let build = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../build");
    let terminal = PseudoTerminal::of(&Hardware::new(model.clone(), &build).unwrap()).unwrap();
    let baud = LinkKind::Uart.bit_rate(&model.board).unwrap();
    let client = open(&terminal.path().to_string_lossy(), baud, Duration::from_millis(5000)).unwrap();
    let mut session = Session::new(Box::new(client), model, None, None, false, true).unwrap();
    let (_, answer) = session.request(&Frame::shipped(&scene)[0]).unwrap();
    assert_eq!((answer.difference, answer.forces), (Some(None), None));
    assert_ne!(answer.sums.map_or(0, |sums| sums.fz), 0);
}

/// Tables of another specimen, over a channel that loses and alters bytes: the board holds them, and every answer is that of the
/// model with them.
#[test]
fn tables_are_written_over_a_noisy_channel() {
    let folder = tempfile::tempdir().unwrap();
    let sensor = "rows = 3\ncols = 4\npitch_x_mm = 2.0\npitch_y_mm = 2.0\nthickness_mm = 2.0\n";
    let hand = format!(
        "name = \"hand\"\n[sensor]\n{sensor}[input]\nfull_scale_MPa = 1.0\n[hardware]\ntables = \"writable\"\n"
    );
    let path = |name: &str| folder.path().join(name).to_string_lossy().into_owned();
    std::fs::write(path("hand.toml"), &hand).unwrap();
    std::fs::write(path("left.toml"), format!("{hand}[search]\nnoise_floor_MPa = 0.05\n")).unwrap();
    std::fs::write(path("press.csv"), "0.5,0.4,0.04,0\n0.4,0.3,0.04,0\n0,0.04,0,0\n").unwrap();

    let model = fast(&Scene::load(&path("hand.toml")).unwrap());
    let build = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../build");
    let faults =
        |seed| NoisyChannel::new(ChannelFaults { lost: 1200, flipped: 1200, seed, ..ChannelFaults::default() });
    let hardware = Hardware::new(model.clone(), &build).unwrap();
    let terminal = PseudoTerminal::with_channels(&hardware, faults(1), faults(2)).unwrap();
    let port = terminal.path().to_string_lossy().into_owned();
    let left = Scene::load(&path("left.toml")).unwrap();
    let press = Frame::load(std::path::Path::new(&path("press.csv")), Some(&left)).unwrap();
    let mut repeated = 0;
    for version in 1..6 {
        let client = open(&port, BAUD, Duration::from_millis(1000)).unwrap();
        let own = model.with_tables(&left, version).unwrap();
        let mut session = Session::new(Box::new(client), model.clone(), Some(own), None, true, true).unwrap();
        let (_, answer) = session.request(&press).unwrap();
        assert_eq!(answer.difference, Some(None), "version {version}");
        repeated += session.board.link_errors().repeated;
    }
    assert!(repeated > 0);

    // The program, as its user would.
    let run = |arguments: &[&str]| {
        let output =
            Command::new(env!("CARGO_BIN_EXE_dermis")).current_dir(folder.path()).args(arguments).output().unwrap();
        assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
        text(&output.stdout)
    };
    let loaded = run(&["load", "hand.toml", "left.toml", "--tables-version", "9", "--port", &port]);
    assert!(loaded.ends_with(&format!("board        {port} holds them\n")), "{loaded}");
    let sent = run(&["host", "--port", &port, "--scene", "hand.toml", "--tables", "left.toml", "--check", "press.csv"]);
    assert!(sent.contains("against model   equal, every bit\n"), "{sent}");
}

/// A board that scans its array: results of its scans, their readings in files and lines, tables of a specimen.
#[test]
fn a_board_that_scans_is_asked_for_scans() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_string_lossy().into_owned();
    let scan = "[hardware.adc_scan]\nconverter = \"max11125\"\nsclk_MHz = 12.5\nperiod_us = 300\n";
    let sensor = "[sensor]\nrows = 8\ncols = 8\npitch_x_mm = 4.0\npitch_y_mm = 4.0\nthickness_mm = 3.0\n";
    let hardware = "[hardware]\nsource = \"adc-scan\"\ntables = \"writable\"\n";
    let mat = format!("name = \"mat\"\n{sensor}[input]\nfull_scale_MPa = 0.5\n{hardware}{scan}");
    std::fs::write(path("mat.toml"), &mat).unwrap();
    std::fs::write(path("own.toml"), format!("{mat}[threshold]\nmin_force_N = 0.05\n")).unwrap();
    let scene = path("mat.toml");

    let model = fast(&Scene::load(&scene).unwrap());
    let build = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../build");
    let hardware = Hardware::new(model.clone(), &build).unwrap();
    let faults =
        |seed| NoisyChannel::new(ChannelFaults { lost: 1500, flipped: 1500, seed, ..ChannelFaults::default() });
    let terminal = PseudoTerminal::with_channels(&hardware, faults(1), faults(2)).unwrap();

    let shown = host(&terminal, &scene, &["--check", "--forces", "--scans", "2", "--save", &path("readings")], "");
    assert_eq!(shown.status.code(), Some(0), "{}", text(&shown.stderr));
    assert_eq!(text(&shown.stdout).matches("against model   equal, every bit\n").count(), 2, "{}", text(&shown.stdout));
    let own = Scene::load(&scene).unwrap();
    let saved = [1, 2].map(|number| {
        Frame::load(folder.path().join(format!("readings/scan-{number}.json")), Some(&own)).unwrap().stress_MPa
    });
    // The same to a few LSB of the converter as one of the frames that the array shows.
    let shows = |readings: &[f64]| {
        let near = |shown: f64, reading: f64| (shown.clamp(0.0, 0.5) - reading).abs() < 5.0 * 0.5 / 4096.0;
        let is = |frame: &Frame| frame.stress_MPa.iter().zip(readings).all(|(shown, reading)| near(*shown, *reading));
        Frame::shipped(&own).iter().any(is)
    };
    assert!(saved.iter().all(|readings| shows(readings)));

    let tables = ["--stream", "--check", "--scans", "3", "--tables", &path("own.toml"), "--tables-version", "7"];
    let streamed = host(&terminal, &scene, &tables, "");
    assert_eq!(streamed.status.code(), Some(0), "{}", text(&streamed.stderr));
    let lines: Vec<serde_json::Value> =
        text(&streamed.stdout).lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!(
        lines.iter().map(|line| line["id"].as_str().unwrap()).collect::<Vec<_>>(),
        ["scan-1", "scan-2", "scan-3"]
    );
    for line in &lines {
        let readings: Vec<f64> = serde_json::from_value(line["readings"].clone()).unwrap();
        assert!(line["equal"] == true && shows(&readings), "{line}");
    }

    let refused = |scene: &str, more: &[&str], message: &str| {
        let output = host(&terminal, scene, more, "");
        assert_eq!(output.status.code(), Some(2), "{more:?}");
        assert!(text(&output.stderr).contains(message), "{}", text(&output.stderr));
    };
    refused(&scene, &["press.csv"], "mat: a frame is not possible with hardware.source = adc-scan");
    refused(&scene, &["--tare", "press.csv"], "mat: --tare is not possible with hardware.source = adc-scan");
    refused(
        "eight-by-eight",
        &["--scans", "2"],
        "eight-by-eight: --scans is not possible with hardware.source = stream",
    );
}
