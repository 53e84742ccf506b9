//! `dermis reconstruct --record` and `dermis replay` as a user runs them.

use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

use dermis_golden::data::frame::Frame;
use dermis_golden::spec::scene::Scene;
use rustix::process::{kill_process, Pid, Signal};
use serde_json::{json, Value};

const SCENE: &str = "eight-by-eight";

/// Runs the program in a folder on an input, which may be closed before it is read.
fn dermis(folder: &Path, args: &[&str], input: &[u8]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_dermis"));
    command.current_dir(folder).args(args).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().unwrap();
    let mut stdin = child.stdin.take().unwrap();
    std::thread::scope(|scope| {
        scope.spawn(move || drop(stdin.write_all(input)));
        child.wait_with_output().unwrap()
    })
}

fn text(bytes: &[u8]) -> &str {
    std::str::from_utf8(bytes).unwrap()
}

/// The results without what differs between two runs: times, numbers of lines and names of frames.
fn results(output: &[u8]) -> Vec<Value> {
    let lines = text(output).lines().map(|line| serde_json::from_str::<Value>(line).unwrap());
    let mut results: Vec<Value> = lines.filter(|line| line["scene"].is_string()).collect();
    for result in &mut results {
        for field in ["received_s", "answered_s", "line", "frame"] {
            assert!(result.as_object_mut().unwrap().remove(field).is_some(), "{field}");
        }
    }
    results
}

/// Lines of frames whose every value has a full mantissa.
fn lines(count: u64) -> String {
    let scene = Scene::builtin(SCENE).unwrap();
    let frame = &Frame::shipped(&scene)[0];
    let line = |k: u64| {
        let stress = frame.stress_MPa.iter().map(|stress| stress * (1.0 + k as f64).sqrt()).collect::<Vec<_>>();
        if k.is_multiple_of(2) {
            json!({"id": format!("press {k}"), "stress_MPa": stress}).to_string()
        } else {
            stress.iter().map(f64::to_string).collect::<Vec<_>>().join(",")
        }
    };
    (0..count).map(|k| line(k) + "\n").collect()
}

#[test]
fn a_replayed_recording_gives_the_same_results_to_the_last_bit() {
    let work = tempfile::tempdir().unwrap();
    let scene = "[sensor]\nrows = 8\ncols = 8\npitch_x_mm = 4.0\npitch_y_mm = 4.0\nthickness_mm = 3.0\n";
    std::fs::write(work.path().join("averaging.toml"), format!("{scene}[input]\naverage = 1\n")).unwrap();
    let input = lines(6) + "no frame\n" + &lines(2);
    for (scene, engine, answered) in
        [(SCENE, "golden", 8), (SCENE, "fixed", 8), ("averaging.toml", "golden", 4), ("averaging.toml", "fixed", 4)]
    {
        let file = format!("{engine}-{answered}.mcap");
        let stream = ["reconstruct", scene, "--engine", engine, "--stream"];
        let output = dermis(work.path(), &[&stream[..], &["--record", &file]].concat(), input.as_bytes());
        let stderr = text(&output.stderr);
        assert!(stderr.contains(&format!("{file}: {answered} results recorded\n")), "{stderr}");
        let recorded = dermis(work.path(), &["replay", &file, "--results"], b"");
        assert_eq!(text(&recorded.stdout), text(&output.stdout));
        let replayed = dermis(work.path(), &["replay", &file], b"");
        assert!(replayed.status.success(), "{}", text(&replayed.stderr));
        let frames: Vec<Value> =
            text(&replayed.stdout).lines().map(|line| serde_json::from_str(line).unwrap()).collect();
        let fed = input.lines().filter(|line| *line != "no frame").map(|line| match line.starts_with('{') {
            true => serde_json::from_str::<Value>(line).unwrap()["stress_MPa"].clone(),
            false => serde_json::from_str(&format!("[{line}]")).unwrap(),
        });
        assert!(frames.iter().map(|frame| frame["stress_MPa"].clone()).eq(fed));
        let again = dermis(work.path(), &stream, &replayed.stdout);
        let (first, second) = (results(&output.stdout), results(&again.stdout));
        assert_eq!((first.len(), &first), (answered, &second));
    }
}

#[test]
fn brief_output_leaves_the_recording_whole() {
    let work = tempfile::tempdir().unwrap();
    let args = ["reconstruct", SCENE, "--stream", "--brief", "--record", "press.mcap"];
    let output = dermis(work.path(), &args, lines(1).as_bytes());
    let recorded = dermis(work.path(), &["replay", "press.mcap", "--results"], b"");
    let lengths = [&output.stdout, &recorded.stdout].map(|bytes| {
        let value: Value = serde_json::from_slice(bytes).unwrap();
        value["forces_N"]["fz"].as_array().unwrap().len()
    });
    assert_eq!(lengths, [0, 64]);
    // A recording is never written over.
    let again = dermis(work.path(), &args, lines(1).as_bytes());
    assert_eq!(again.status.code(), Some(2));
    assert_eq!(text(&again.stderr), "error: press.mcap: exists already, and a recording is never written over\n");
}

#[test]
fn a_recording_that_is_interrupted_is_complete() {
    let work = tempfile::tempdir().unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_dermis"));
    command.current_dir(work.path()).args(["reconstruct", SCENE, "--stream", "--record", "press.mcap"]);
    let mut child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let mut input = child.stdin.take().unwrap();
    let mut output = BufReader::new(child.stdout.take().unwrap()).lines();
    input.write_all(lines(2).as_bytes()).unwrap();
    let answered: Vec<String> = output.by_ref().take(2).map(Result::unwrap).collect();
    // The input is still open.
    kill_process(Pid::from_child(&child), Signal::INT).unwrap();
    let ended = child.wait_with_output().unwrap();
    assert_eq!(ended.status.code(), Some(130));
    let stderr = text(&ended.stderr);
    assert!(stderr.contains("press.mcap: 2 results recorded\n"), "{stderr}");
    assert!(stderr.ends_with("error: interrupted; the recording is complete\n"), "{stderr}");
    drop(input);
    let replayed = dermis(work.path(), &["replay", "press.mcap", "--results"], b"");
    assert!(replayed.status.success(), "{}", text(&replayed.stderr));
    assert_eq!(text(&replayed.stdout).lines().collect::<Vec<_>>(), answered);
}

#[test]
fn a_recording_without_its_end_gives_what_it_has_and_an_error() {
    let work = tempfile::tempdir().unwrap();
    dermis(work.path(), &["reconstruct", SCENE, "--stream", "--record", "press.mcap"], lines(3).as_bytes());
    let whole = std::fs::read(work.path().join("press.mcap")).unwrap();
    let replay = |bytes: &[u8]| {
        std::fs::write(work.path().join("cut.mcap"), bytes).unwrap();
        let output = dermis(work.path(), &["replay", "cut.mcap"], b"");
        (output.status.code(), text(&output.stdout).lines().count(), text(&output.stderr).to_owned())
    };
    assert_eq!(replay(&whole), (Some(0), 3, String::new()));
    // Without the index, all frames are there.
    let (code, frames, error) = replay(&whole[..whole.len() - 30]);
    assert_eq!((code, frames), (Some(2), 3));
    assert!(error.starts_with("error: cut.mcap: ends early"), "{error}");
    let (code, frames, error) = replay(&whole[..whole.len() / 3]);
    assert_eq!(code, Some(2));
    assert!(frames < 3 && error.starts_with("error: cut.mcap: ends early"), "{frames}, {error}");
    let allowed = dermis(work.path(), &["replay", "cut.mcap", "--partial"], b"");
    assert_eq!((allowed.status.code(), text(&allowed.stdout).lines().count()), (Some(0), frames));
    assert!(text(&allowed.stderr).starts_with("cut.mcap: ends early"), "{}", text(&allowed.stderr));
}

/// A stream of a frame every 5 ms into a recording, until it is told to end.
struct Recording {
    child: std::process::Child,
    feeding: std::thread::JoinHandle<()>,
    /// Each line of its output, and when it came.
    answers: std::thread::JoinHandle<Vec<(Instant, String)>>,
}

impl Recording {
    fn begin(command: &mut Command, folder: &Path) -> Recording {
        command.current_dir(folder).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().unwrap();
        let (mut input, output) = (child.stdin.take().unwrap(), child.stdout.take().unwrap());
        let frames = lines(64);
        let feeding = std::thread::spawn(move || {
            // Until the program has ended.
            for line in frames.lines().cycle() {
                if writeln!(input, "{line}").is_err() {
                    return;
                }
                std::thread::sleep(Duration::from_millis(5));
            }
        });
        let read = || BufReader::new(output).lines().map_while(Result::ok).map(|line| (Instant::now(), line)).collect();
        Recording { child, feeding, answers: std::thread::spawn(read) }
    }

    /// Waits for the end of a program that was sent a signal: its answers.
    fn end(mut self) -> Vec<(Instant, String)> {
        self.child.wait().unwrap();
        self.feeding.join().unwrap();
        self.answers.join().unwrap()
    }
}

const RECORD: [&str; 5] = ["reconstruct", "searching.toml", "--stream", "--record", "killed.mcap"];

/// A folder with a scene that is answered in well below 5 ms.
fn searching() -> tempfile::TempDir {
    let work = tempfile::tempdir().unwrap();
    let sensor = "[sensor]\nrows = 8\ncols = 8\npitch_x_mm = 4.0\npitch_y_mm = 4.0\nthickness_mm = 3.0\n";
    std::fs::write(work.path().join("searching.toml"), format!("{sensor}[search]\nmu_max = 0\n")).unwrap();
    work
}

/// What is wrong with the results that are read of a recording whose program was killed at an instant.
fn lost(answers: &[(Instant, String)], killed: Instant, read: &[&str]) -> Option<String> {
    let due = answers.iter().filter(|(at, _)| *at + Duration::from_secs(1) < killed).count();
    if read.len() < due {
        return Some(format!("{} results, {due} are older than a second", read.len()));
    }
    // The last ones may be recorded, but not yet written to standard output.
    let other = answers.iter().zip(read).position(|((_, answer), read)| answer != read);
    other.map(|line| format!("result {line} is another one"))
}

#[test]
fn a_recording_that_is_killed_at_any_moment_has_every_frame_older_than_a_second() {
    let kill = |seed: u64| {
        let mut random = fastrand::Rng::with_seed(seed);
        let work = searching();
        // Under nohup SIGHUP would be ignored.
        let mut command = Command::new("env");
        command.args(["--default-signal=HUP", env!("CARGO_BIN_EXE_dermis")]).args(RECORD);
        let recording = Recording::begin(&mut command, work.path());
        std::thread::sleep(Duration::from_secs_f64(1.2 + 1.5 * random.f64()));
        let signal = if random.bool() { Signal::KILL } else { Signal::HUP };
        let killed = Instant::now();
        kill_process(Pid::from_child(&recording.child), signal).unwrap();
        let answers = recording.end();
        let replay = |what: &[&str]| {
            let output = dermis(work.path(), &[&["replay", "killed.mcap"], what].concat(), b"");
            let words = text(&output.stderr).to_owned();
            assert!(words.contains("was not completed") || words.contains("ends early"), "{words}");
            text(&output.stdout).to_owned()
        };
        let (frames, results) = (replay(&[]), replay(&["--results"]));
        let read: Vec<&str> = results.lines().collect();
        assert_eq!(lost(&answers, killed, &read), None, "seed {seed}");
        assert!(frames.lines().count() >= read.len(), "seed {seed}");
        assert!(answers.len() > 20, "seed {seed}: {} answers", answers.len());
        // Seeded faults: a second that is lost, and another result.
        let due = answers.iter().filter(|(at, _)| *at + Duration::from_secs(1) < killed).count();
        assert!(due == 0 || lost(&answers, killed, &read[..due - 1]).is_some());
        assert!(lost(&answers, killed, &[&["other"], &read[1..]].concat()).is_some());
    };
    // Some at a time: a program that waits for the processor would answer late.
    let count = if is_nightly() { 200 } else { 5 };
    for seeds in (0..count).collect::<Vec<u64>>().chunks(5) {
        std::thread::scope(|scope| seeds.iter().for_each(|seed| drop(scope.spawn(|| kill(*seed)))));
    }
}

/// Whether `make nightly` runs the test.
fn is_nightly() -> bool {
    std::env::var_os("DERMIS_NIGHTLY").is_some()
}

#[test]
fn a_full_disk_is_said_at_once_and_the_answers_go_on() {
    let work = searching();
    // A file of more than this size cannot be written, as on a full disk; dash counts blocks of 512 bytes.
    let mut shell = Command::new("sh");
    shell.args(["-c", "trap '' XFSZ; ulimit -f 2048; exec \"$@\"", "sh", env!("CARGO_BIN_EXE_dermis")]).args(RECORD);
    let mut recording = Recording::begin(&mut shell, work.path());
    let mut words = BufReader::new(recording.child.stderr.take().unwrap()).lines().map_while(Result::ok);
    let said = words.find(|line| line.starts_with("killed.mcap")).unwrap();
    let (at, end) = (Instant::now(), "the answers go on");
    assert!(said.contains("File too large") && said.ends_with(end), "{said}");
    let count: usize = said.split("it ends with ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
    std::thread::sleep(Duration::from_millis(500));
    kill_process(Pid::from_child(&recording.child), Signal::INT).unwrap();
    let last = words.last().unwrap();
    let answers = recording.end();
    assert!(last.starts_with("error: killed.mcap: File too large"), "{last}");
    assert!(last.contains(&format!("it has {count} of {} results", answers.len())), "{last}");
    // The first result that the file lacks is at most a second old.
    let since = at.saturating_duration_since(answers[count].0);
    assert!(count > 0 && since < Duration::from_secs(1), "{count} results, said after {since:?}");
    assert!(answers.last().unwrap().0 > at + Duration::from_millis(300));
    let replayed = dermis(work.path(), &["replay", "killed.mcap", "--results"], b"");
    let wanted: Vec<&str> = answers[..count].iter().map(|(_, line)| line.as_str()).collect();
    assert_eq!((replayed.status.code(), text(&replayed.stdout).lines().collect::<Vec<_>>()), (Some(0), wanted));
    assert!(text(&replayed.stderr).contains("was not completed"), "{}", text(&replayed.stderr));
}
