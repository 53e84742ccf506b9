//! `dermis live` from a recording and with a board, through the requests that its page makes.

use std::collections::BTreeMap;
use std::io::{Read, Write};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use dermis_golden::data::frame::Frame;
use dermis_golden::fixed::Model;
use dermis_golden::result::reconstruct::Reconstruction;
use dermis_golden::spec::scene::Scene;
use dermis_host::link::ChannelFaults;
use serde_json::{json, Value};

use super::host::board;
use super::live::Live;

const SCENE: &str = "eight-by-eight";
/// Longest wait for a picture.
const PATIENCE: Duration = Duration::from_secs(60);

/// The picture after the one with this number, with its own, as the page asks for it; none within a second.
fn newest(live: &Live, after: u64) -> Option<(u64, Value)> {
    let answer = live.answer(&format!("GET /newest?after={after} HTTP/1.1\r\nHost: {}\r\n\r\n", live.host()));
    let (head, body) = answer.split_once("\r\n\r\n").unwrap();
    let number = head.lines().find_map(|line| line.strip_prefix("Number: "))?.parse().unwrap();
    Some((number, serde_json::from_str(body).unwrap()))
}

/// Pictures until one meets the condition, which is the last one.
fn pictures(live: &Live, mut done: impl FnMut(&Value) -> bool) -> Vec<Value> {
    let (mut seen, mut all, begun) = (0, Vec::new(), Instant::now());
    while begun.elapsed() < PATIENCE {
        let Some((number, picture)) = newest(live, seen) else { continue };
        seen = number;
        all.push(picture);
        if done(&all[all.len() - 1]) {
            return all;
        }
    }
    panic!("not within {PATIENCE:?}: {:?}", all.last());
}

fn frames() -> Vec<Frame> {
    Frame::shipped(&Scene::builtin(SCENE).unwrap())
}

fn line(frame: &Frame) -> String {
    json!({"stress_MPa": frame.stress_MPa}).to_string() + "\n"
}

/// A recording of frames that arrive this far apart.
fn recording(folder: &Path, frames: &[Frame], apart: Duration) -> String {
    let path = folder.join("press.mcap").display().to_string();
    let mut command = Command::new(env!("CARGO_BIN_EXE_dermis"));
    command.args(["reconstruct", SCENE, "--engine", "fixed", "--stream", "--record", &path]);
    let mut child = command.stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    let mut input = child.stdin.take().unwrap();
    for frame in frames {
        input.write_all(line(frame).as_bytes()).unwrap();
        std::thread::sleep(apart);
    }
    drop(input);
    assert!(child.wait().unwrap().success());
    path
}

#[test]
fn a_recording_is_shown_at_its_pace_and_again() {
    let (work, frames) = (tempfile::tempdir().unwrap(), &frames()[..3]);
    let apart = Duration::from_millis(400);
    let path = recording(work.path(), frames, apart);
    let live = Live::start(&["--engine", "fixed", "--recording", &path, "--loop"]);
    // Each frame is called by its line: 1 to 3 in the first round. The first one may be replaced before it is asked for.
    let number = |picture: &Value| {
        picture["result"]["frame"].as_str().unwrap().strip_prefix("line ").unwrap().parse::<usize>().unwrap()
    };
    let shown = pictures(&live, |picture| number(picture) >= 7);
    let mut received = BTreeMap::new();
    for picture in &shown {
        let wanted = serde_json::to_value(&frames[(number(picture) - 1) % 3].stress_MPa).unwrap();
        assert_eq!(picture["stress_MPa"], wanted);
        received.insert(number(picture), picture["received_s"].as_f64().unwrap());
    }
    // In their order, the second round as long after the first as its frames are from one another.
    let times: Vec<f64> = received.values().copied().collect();
    assert!(times.len() >= 4 && times.is_sorted(), "{received:?}");
    let (from, to) = (received.first_key_value().unwrap(), received.last_key_value().unwrap());
    let wanted = apart.as_secs_f64() * (to.0 - from.0) as f64;
    assert!(to.1 - from.1 > 0.8 * wanted, "{received:?}");
    let page = live.answer(&format!("GET / HTTP/1.1\r\nHost: {}\r\n\r\n", live.host()));
    assert!(page.contains(&format!("{SCENE}, frames from {path}")), "the page names its source");
}

#[test]
fn a_recording_of_another_sensor_is_named() {
    let work = tempfile::tempdir().unwrap();
    let path = recording(work.path(), &frames()[..1], Duration::ZERO);
    let mut command = Command::new(env!("CARGO_BIN_EXE_dermis"));
    let output = command.args(["live", "sensor-1", "--listen", "127.0.0.1:0", "--recording", &path]).output().unwrap();
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert!(
        stderr.ends_with(&format!("{path}: /dermis/stress_exact, message 0: 8×8 taxels, wanted 10×10\n")),
        "{stderr}"
    );
}

/// The forces of the bit-true model on a picture's stress, and those of the picture.
fn forces(picture: &Value) -> [Value; 2] {
    let model = Model::new(&Scene::builtin(SCENE).unwrap()).unwrap();
    let stress = serde_json::from_value(picture["stress_MPa"].clone()).unwrap();
    let frame = Frame::from_stress("shown", &model.scene.sensor, stress).unwrap();
    let wanted: Reconstruction = model.reconstruct(&frame).unwrap();
    [serde_json::to_value(wanted.forces_N).unwrap(), picture["result"]["forces_N"].clone()]
}

#[test]
fn the_forces_of_a_board_are_shown_for_the_finger_and_for_a_stream() {
    let terminal = board(ChannelFaults::default(), ChannelFaults::default());
    let port = terminal.path().to_string_lossy().into_owned();
    {
        let live = Live::start(&["--board", &port, "--rate", "5"]);
        let host = live.host();
        let body = json!({"centre_mm": [1.0, -2.0], "force_N": [0.5, 0.0, 2.0]}).to_string();
        let length = body.len();
        let post = format!("POST /finger HTTP/1.1\r\nHost: {host}\r\nContent-Length: {length}\r\n\r\n{body}");
        assert!(live.answer(&post).starts_with("HTTP/1.1 204"));
        let pressed = |picture: &Value| picture["truth"]["resultant_N"] == json!([0.5, 0.0, 2.0]);
        let shown = pictures(&live, pressed).pop().unwrap();
        assert_eq!(shown["result"]["engine"], "board");
        let [wanted, found] = forces(&shown);
        assert_eq!(found, wanted);
        assert!(found["fz"].as_array().unwrap().iter().any(|force| force.as_f64() > Some(0.0)), "{found}");
    }
    let mut live = Live::start(&["--board", &port, "--stream"]);
    let mut input = live.child.stdin.take().unwrap();
    input.write_all(b"1,2\n").unwrap();
    input.write_all(line(&frames()[1]).as_bytes()).unwrap();
    let shown = pictures(&live, |_| true).pop().unwrap();
    assert_eq!(shown["result"]["engine"], "board");
    // Only the newest line is answered: the wrong one is refused, or dropped where the frame was there before its turn.
    let count = |field: &str| shown[field].as_u64().unwrap();
    assert_eq!(count("refused") + count("dropped"), 1, "{shown}");
    let [wanted, found] = forces(&shown);
    assert_eq!(found, wanted);
}

#[test]
fn what_a_board_does_not_take_is_refused() {
    let work = tempfile::tempdir().unwrap();
    let table: String = (0..64).map(|k| format!("{},{},0,0.001\n", k / 8, k % 8)).collect();
    std::fs::write(work.path().join("table.csv"), format!("row,col,offset,gain\n{table}")).unwrap();
    let sensor = "[sensor]\nrows = 8\ncols = 8\npitch_x_mm = 4.0\npitch_y_mm = 4.0\nthickness_mm = 3.0\n";
    let input = "[input]\ncalibration = \"table.csv\"\nfull_scale_MPa = 1.0\n";
    std::fs::write(work.path().join("pad.toml"), format!("{sensor}{input}")).unwrap();
    let run = |args: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_dermis"));
        command.current_dir(work.path()).arg("live").args(args).args(["--listen", "127.0.0.1:0", "--board", "absent"]);
        let mut child = command.stderr(Stdio::piped()).stdout(Stdio::null()).spawn().unwrap();
        let mut stderr = String::new();
        child.stderr.take().unwrap().read_to_string(&mut stderr).unwrap();
        assert_eq!(child.wait().unwrap().code(), Some(2), "{stderr}");
        stderr
    };
    let finger = run(&["pad.toml"]);
    assert!(finger.contains("--board absent: the board applies input.calibration of scene pad"), "{finger}");
    let port = run(&["pad.toml", "--stream"]);
    assert!(port.ends_with("error: port absent: No such file or directory\n"), "{port}");
    let rate = run(&["pad.toml", "--stream", "--rate", "100"]);
    assert!(
        rate.ends_with("--rate = 100 is not allowed: the board at absent computes every frame that arrives\n"),
        "{rate}"
    );
}
