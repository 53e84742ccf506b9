//! `dermis reconstruct --stream` as a user runs it: from standard input, a file that grows, UDP and a serial port.

use std::fs::OpenOptions;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::UdpSocket;
use std::process::{Child, ChildStderr, ChildStdout, Command, Stdio};

use dermis_golden::data::frame::Frame;
use dermis_golden::estimate::float::Golden;
use dermis_golden::spec::scene::Scene;
use serde_json::Value;

const SCENE: &str = "eight-by-eight";

fn dermis(more: &[&str]) -> Child {
    let mut command = Command::new(env!("CARGO_BIN_EXE_dermis"));
    command.args(["reconstruct", SCENE]).args(more);
    command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap()
}

/// Stdout line by line, as JSON.
fn answers(child: &mut Child) -> impl Iterator<Item = Value> + use<> {
    let lines = BufReader::new(child.stdout.take().unwrap() as ChildStdout).lines();
    lines.map(|line| serde_json::from_str(&line.unwrap()).unwrap())
}

fn frames() -> Vec<Frame> {
    Frame::shipped(&Scene::builtin(SCENE).unwrap())
}

fn line(frame: &Frame) -> String {
    frame.stress_MPa.iter().map(f64::to_string).collect::<Vec<_>>().join(",") + "\n"
}

/// The resultant that `dermis reconstruct --json` has for a frame.
fn resultant(frame: &Frame) -> Value {
    let golden = Golden::new(&Scene::builtin(SCENE).unwrap()).unwrap();
    serde_json::to_value(golden.run(frame).unwrap().resultant_N).unwrap()
}

#[test]
fn a_bad_line_is_answered_by_its_number_and_the_stream_goes_on() {
    let frames = frames();
    let mut child = dermis(&["--stream"]);
    let mut input = child.stdin.take().unwrap();
    let mut answers = answers(&mut child);
    // Each line is answered before the next one is sent.
    for (number, frame) in [(1, &frames[0]), (2, &frames[1])] {
        input.write_all(line(frame).as_bytes()).unwrap();
        let answer = answers.next().unwrap();
        assert_eq!((&answer["line"], &answer["resultant_N"]), (&Value::from(number), &resultant(frame)));
        assert!(answer["contacts"][0]["sigma_N"].is_array(), "{answer}");
    }
    input.write_all(b"1,2\n").unwrap();
    assert_eq!(answers.next().unwrap(), serde_json::json!({"line": 3, "error": "2 values, wanted 64"}));
    input.write_all(line(&frames[2]).as_bytes()).unwrap();
    assert_eq!(answers.next().unwrap()["sequence"], 2);
    drop(input);
    assert_eq!(answers.next(), None);
    let output = child.wait_with_output().unwrap();
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr.ends_with("error: standard input: 1 of 4 lines were refused\n"), "{stderr}");
}

/// What a stream of this text gives: exit code, lines and the last line on standard error.
fn streamed(text: &str) -> (Option<i32>, Vec<Value>, String) {
    let mut child = dermis(&["--stream", "--brief"]);
    child.stdin.take().unwrap().write_all(text.as_bytes()).unwrap();
    let output = child.wait_with_output().unwrap();
    let lines = String::from_utf8(output.stdout).unwrap();
    let lines = lines.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let stderr = String::from_utf8(output.stderr).unwrap();
    (output.status.code(), lines, stderr.lines().last().unwrap_or_default().to_owned())
}

#[test]
fn what_is_no_line_is_named_and_the_program_fails() {
    let whole = line(&frames()[0]);
    let (code, lines, error) = streamed(&(whole.clone() + whole.trim_end()));
    assert_eq!((code, lines.len(), lines[1]["error"].is_string()), (Some(2), 2, true));
    assert_eq!(error, "error: standard input: 1 of 2 lines were refused");
    let (code, lines, error) = streamed("no device\n");
    assert_eq!((code, lines.len()), (Some(2), 1));
    assert_eq!(error, "error: standard input: 1 of 1 lines were refused; line 1: no numbers, wanted 64 of 8x8 taxels");
}

#[test]
fn an_output_that_is_closed_ends_the_stream() {
    let mut child = dermis(&["--stream", "--brief"]);
    drop(child.stdout.take());
    let mut input = child.stdin.take().unwrap();
    input.write_all(line(&frames()[0]).as_bytes()).unwrap();
    // Standard input is still open.
    assert!(child.wait().unwrap().success());
}

#[test]
fn a_file_that_grows_is_followed() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.csv");
    let frames = frames();
    let mut file = OpenOptions::new().create(true).append(true).open(&path).unwrap();
    file.write_all(line(&frames[0]).as_bytes()).unwrap();
    let mut child = dermis(&[&format!("--stream={}", path.display()), "--brief"]);
    let mut answers = answers(&mut child);
    assert_eq!(answers.next().unwrap()["line"], 1);
    let text = line(&frames[1]);
    let (first, rest) = text.split_at(20);
    file.write_all(first.as_bytes()).unwrap();
    file.write_all(rest.as_bytes()).unwrap();
    let answer = answers.next().unwrap();
    assert_eq!((&answer["line"], &answer["resultant_N"]), (&Value::from(2), &resultant(&frames[1])));
    child.kill().unwrap();
    child.wait().unwrap();
}

#[test]
fn udp_is_answered_at_the_address_that_is_printed() {
    let mut child = dermis(&["--stream=udp:127.0.0.1:0", "--latest", "--queue", "2", "--engine", "fixed"]);
    let mut stderr = BufReader::new(child.stderr.take().unwrap() as ChildStderr).lines();
    let address = stderr.find_map(|line| line.unwrap().split_once("listening on udp:").map(|(_, a)| a.to_owned()));
    let sender = UdpSocket::bind("127.0.0.1:0").unwrap();
    let mut answers = answers(&mut child);
    for (sequence, frame) in frames()[..2].iter().enumerate() {
        sender.send_to(line(frame).as_bytes(), address.as_ref().unwrap()).unwrap();
        let answer = answers.next().unwrap();
        assert_eq!((&answer["sequence"], &answer["engine"]), (&Value::from(sequence), &Value::from("fixed")));
    }
    child.kill().unwrap();
    child.wait().unwrap();
}

#[test]
fn a_serial_port_is_read() {
    use rustix::pty::{grantpt, openpt, ptsname, unlockpt, OpenptFlags};
    let ours = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).unwrap();
    grantpt(&ours).unwrap();
    unlockpt(&ours).unwrap();
    let port = ptsname(&ours, Vec::new()).unwrap().into_string().unwrap();
    // Held open, so that the terminal exists before the program opens it and after.
    let _theirs = OpenOptions::new().read(true).write(true).open(&port).unwrap();
    let mut child = dermis(&[&format!("--stream={port}"), "--baud", "115200", "--brief"]);
    let mut answers = answers(&mut child);
    let frames = frames();
    // The first line waits in the terminal until the port is open, which may discard what came before.
    let mut ours = std::fs::File::from(ours);
    let answer = std::thread::scope(|scope| {
        let (answered, waiting) = std::sync::mpsc::channel::<()>();
        let (ours, frames) = (&mut ours, &frames);
        scope.spawn(move || {
            while waiting.recv_timeout(std::time::Duration::from_millis(300)).is_err() {
                ours.write_all(b"\n").unwrap();
                ours.write_all(line(&frames[0]).as_bytes()).unwrap();
            }
        });
        let answer = answers.find(|answer| answer["error"].is_null()).unwrap();
        answered.send(()).unwrap();
        answer
    });
    assert_eq!(answer["resultant_N"], resultant(&frames[0]));
    // Lines that come faster than results: the newest are answered, all others counted, and no write is held up for long.
    ours.write_all(line(&frames[1]).repeat(400).as_bytes()).unwrap();
    ours.write_all(b"end\n").unwrap();
    let is_end = |answer: &Value| answer["error"].as_str().is_some_and(|error| error.starts_with("1 values, wanted"));
    assert!(answers.any(|answer| is_end(&answer)));
    ours.write_all(line(&frames[1]).as_bytes()).unwrap();
    let last = answers.find(|answer| answer["error"].is_null()).unwrap();
    let number = |field: &str| last[field].as_u64().unwrap();
    assert!(number("dropped") > 0 && number("sequence") + number("dropped") < 800, "{last}");
    child.kill().unwrap();
    let mut rest = String::new();
    child.stderr.take().unwrap().read_to_string(&mut rest).unwrap();
    child.wait().unwrap();
}

/// A stuck taxel in a stream of the bit-true search: every result is cross-checked, or as many as are wanted.
#[test]
fn results_of_a_search_are_cross_checked_in_a_stream() {
    let mut stuck = frames()[1].clone();
    stuck.stress_MPa[56] = -0.5 * stuck.peak_MPa();
    for (every, ages) in [(None, [Some(0), Some(0)]), (Some("2"), [Some(0), Some(1)]), (Some("0"), [None; 2])] {
        let more: Vec<&str> = every.into_iter().flat_map(|every| ["--check-every", every]).collect();
        let mut child = dermis(&[&["--stream", "--brief", "--engine", "fixed"], &more[..]].concat());
        child.stdin.take().unwrap().write_all(line(&stuck).repeat(2).as_bytes()).unwrap();
        let answers: Vec<Value> = answers(&mut child).collect();
        assert!(child.wait().unwrap().success());
        for (answer, age) in std::iter::zip(&answers, ages) {
            assert_eq!(answer["checks"]["cross_check_age"].as_u64(), age, "{answer}");
            let suspect = answer["flags"].as_array().unwrap().contains(&"taxel-suspect".into());
            assert_eq!((suspect, answer["suspects"][0]["row"].as_u64()), (age.is_some(), age.map(|_| 7)));
        }
    }
}

/// `dermis check --stream`: the scene of a new sensor states no noise, and everyone says so until it is measured.
#[test]
fn noise_of_a_device_is_measured_and_written_into_the_scene() {
    let folder = tempfile::tempdir().unwrap();
    let run = |arguments: &[&str], input: &str| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_dermis"));
        command.args(arguments).current_dir(folder.path());
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().unwrap();
        // A program that ends early does not read it.
        let _ = child.stdin.take().unwrap().write_all(input.as_bytes());
        let output = child.wait_with_output().unwrap();
        let text = |bytes| String::from_utf8(bytes).unwrap();
        (output.status.code(), text(output.stdout), text(output.stderr))
    };
    let new =
        ["new", "pad.toml", "--rows", "8", "--cols", "8", "--pitch", "4", "--thickness", "3", "--full-scale", "0.5"];
    assert_eq!(run(&[&new[..], &["--cover", "free"]].concat(), "").0, Some(0));
    let frame = line(&frames()[1]);
    let flags = || -> Vec<String> {
        let json = run(&["reconstruct", "pad.toml", "--stream", "--engine", "fixed", "--check-every", "0"], &frame).1;
        serde_json::from_value(serde_json::from_str::<Value>(&json).unwrap()["flags"].clone()).unwrap()
    };
    assert_eq!(flags(), ["noise-not-stated"]);
    let said = "noise-not-stated; `dermis check SCENE --stream` measures it";
    assert!(run(&["check", "pad.toml", "--draws", "1"], "").1.contains(said));
    assert!(run(&["build", "pad.toml"], "").2.contains(said));

    // Readings of noise alone, a standard deviation of 1.2e-4 MPa; while something presses nothing is written.
    let mut random = fastrand::Rng::with_seed(1);
    let mut normal = || (0..12).map(|_| random.f64()).sum::<f64>() - 6.0;
    let mut noisy = |pressed: f64| {
        let reading = |b: f64| (pressed * b + 1.2e-4 * normal()).to_string();
        frames()[1].stress_MPa.iter().copied().map(reading).collect::<Vec<_>>().join(",") + "\n"
    };
    let pressed: String = (0..20).map(|moment| noisy(f64::from(moment / 10))).collect();
    let idle: String = (0..20).map(|_| noisy(0.0)).collect();
    let measure = ["check", "pad.toml", "--stream", "--frames", "20", "--draws", "1"];
    let (code, _, error) = run(&measure, &pressed);
    assert!(code == Some(2) && error.contains("something presses"), "{error}");
    let half: String = idle.lines().take(10).map(|line| line.to_owned() + "\n").collect();
    let (code, _, error) = run(&measure, &half);
    assert!(code == Some(2) && error.contains("of 20 frames"), "{error}");
    assert_eq!(flags(), ["noise-not-stated"]);
    let (code, text, error) = run(&measure, &idle);
    assert!(code == Some(0) && error.contains("measured from 20 frames without load"), "{error}");
    assert!(!text.contains(said), "{text}");
    let stated = Scene::load(&folder.path().join("pad.toml").display().to_string()).unwrap().search.noise_floor_MPa;
    assert!(stated.is_some_and(|noise| (noise / 1.2e-4 - 1.0).abs() < 0.1), "{stated:?}");
    assert!(!flags().contains(&"noise-not-stated".to_owned()));
}
