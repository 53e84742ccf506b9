//! Files and pipes that fail, at every call: each command, by the quickest of its examples, with
//!
//! | what fails | how | must hold |
//! |---|---|---|
//! | a write to any file, at each size | a limit of the process on the size of files, which doubles until the example succeeds | exit code 2 and the name of a file; every file is as before, or as without the limit |
//! | standard output | closed; full | closed: exit code 0; full: exit code 2, by its name |
//! | standard error | closed; full | what is done and answered is the same |
//! | a folder | another user's, which may be read alone | exit code 2 and the name of a file; every file is as before |
//! | a call | interrupted by stop and continue, every 3 ms | what is done and answered is the same |

use std::collections::{BTreeMap, BTreeSet};
use std::fs::{self, Permissions};
use std::os::unix::fs::PermissionsExt;
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::Duration;

use rayon::prelude::*;
use rustix::process::Signal;
use tempfile::TempDir;

use crate::examples::{prepare, runnable};

/// Seconds of an example from which on it is left to `make nightly`.
const LONG: &str = "1.5";
/// Examples that build libraries with Verilator, whose compiler would fail.
const NOT_HERE: [&str; 5] = [" cosim ", " faults ", " power ", " stress ", "--engine rtl"];
/// Users and groups have no other files with this number.
const NOBODY: &str = "65534";

/// The program, where every user finds it.
struct Setting {
    program: TempDir,
    /// A folder with what the examples name.
    files: TempDir,
    before: Files,
}

/// Content of each file of a folder, by its path there.
type Files = BTreeMap<PathBuf, Vec<u8>>;

fn below(folder: &Path) -> Files {
    let mut all = Files::new();
    for entry in fs::read_dir(folder).unwrap().map(Result::unwrap) {
        let name = PathBuf::from(entry.file_name());
        match entry.file_type().unwrap().is_dir() {
            true => all.extend(below(&entry.path()).into_iter().map(|(path, bytes)| (name.join(path), bytes))),
            false => drop(all.insert(name, fs::read(entry.path()).unwrap())),
        }
    }
    all
}

fn copy(from: &Path, to: &Path) {
    for entry in fs::read_dir(from).unwrap().map(Result::unwrap) {
        let own = to.join(entry.file_name());
        if entry.file_type().unwrap().is_dir() {
            fs::create_dir(&own).unwrap();
            copy(&entry.path(), &own);
        } else {
            fs::copy(entry.path(), own).unwrap();
        }
    }
}

/// A run: its folder, what the program said, and the files that are there afterwards, relative to the folder.
struct Run {
    output: Output,
    files: Files,
}

impl Run {
    fn code(&self) -> Option<i32> {
        self.output.status.code()
    }

    fn stderr(&self) -> String {
        String::from_utf8_lossy(&self.output.stderr).into_owned()
    }

    /// The error that ends the program, without what it says before.
    fn error(&self) -> String {
        self.stderr().split("error: ").last().unwrap_or_default().trim().to_owned()
    }
}

impl Setting {
    fn new() -> Setting {
        let [program, files] = [(); 2].map(|()| tempfile::tempdir().unwrap());
        fs::copy(env!("CARGO_BIN_EXE_dermis"), program.path().join("dermis")).unwrap();
        fs::set_permissions(program.path(), Permissions::from_mode(0o755)).unwrap();
        prepare(files.path());
        let built =
            Command::new(env!("CARGO_BIN_EXE_dermis")).current_dir(files.path()).args(["build", "sensor-1"]).output();
        assert!(built.unwrap().status.success());
        let before = below(files.path());
        Setting { program, files, before }
    }

    /// Runs a command line in a folder of its own, in a shell after the commands `before`, by way of `by`; `during` has the running
    /// program.
    fn run(&self, line: &str, before: &str, by: &[&str], during: impl FnOnce(&mut std::process::Child)) -> Run {
        let work = tempfile::tempdir().unwrap();
        fs::set_permissions(work.path(), Permissions::from_mode(0o755)).unwrap();
        copy(self.files.path(), work.path());
        let path = format!("{}:{}", self.program.path().display(), std::env::var("PATH").unwrap());
        let script = format!("{before} {line}");
        let words = [by, &["sh", "-c", &script]].concat();
        let mut child = Command::new(words[0])
            .args(&words[1..])
            .current_dir(work.path())
            .env("PATH", path)
            .env("HOME", work.path())
            .process_group(0)
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        during(&mut child);
        let output = child.wait_with_output().unwrap();
        Run { output, files: below(work.path()) }
    }

    fn plain(&self, line: &str) -> Run {
        self.run(line, "", &[], |_| ())
    }
}

/// Examples of each command that are done before [`LONG`], two or with `make nightly` all, and a run of each in which nothing fails.
fn tried(setting: &Setting) -> Vec<(String, Run)> {
    let nightly = std::env::var_os("DERMIS_NIGHTLY").is_some();
    let (limit, most) = if nightly { ("600", usize::MAX) } else { (LONG, 2) };
    let mut by_command: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for line in runnable().into_iter().filter(|line| !NOT_HERE.iter().any(|words| line.contains(words))) {
        by_command.entry(command(&line).to_owned()).or_default().push(line);
    }
    let plain = |line: String| {
        let run = setting.run(&line, "", &["timeout", limit], |_| ());
        let done = run.code() != Some(124);
        assert!(!done || run.code() == Some(0), "{line}: {}", run.stderr());
        done.then_some((line, run))
    };
    let quick = |lines: Vec<String>| lines.into_iter().filter_map(plain).take(most);
    by_command.into_values().collect::<Vec<_>>().into_par_iter().flat_map_iter(quick).collect()
}

/// The command of an example.
fn command(line: &str) -> &str {
    line.split_whitespace().nth(1).unwrap_or_default()
}

/// The files that the shell writes for the program, which are cut where the program fails.
fn redirected(line: &str) -> Vec<&Path> {
    line.split(" >").skip(1).filter_map(|rest| rest.split_whitespace().next()).map(Path::new).collect()
}

/// What is wrong with a run in which files could not be written, as `whole` could.
fn wrong_write(setting: &Setting, line: &str, whole: &Run, run: &Run, why: &str) -> Option<String> {
    let error = run.error();
    if run.code() == Some(0) {
        return None;
    }
    // A compiler that cannot write says so in its log.
    if run.code() == Some(1) && run.stderr().contains(" failed; ") && run.stderr().contains(&format!(": {why}")) {
        return None;
    }
    // A shell that cannot open a file has an error of its own.
    if run.code() != Some(2) || !error.contains(&format!(": {why}")) || run.stderr().contains("panicked") {
        return Some(format!("exit code {:?}: {}", run.code(), run.stderr()));
    }
    let changed = run.files.iter().find(|(path, bytes)| {
        let is = |files: &Files| files.get(*path) == Some(*bytes);
        // A recording is written piece by piece; recording.rs reads those that end early.
        let is_recording = run.stderr().contains(&format!("{}: {why}", path.display())) && line.contains("--record");
        let is_cut = redirected(line).contains(&path.as_path()) || is_recording;
        !is(&setting.before) && !is(&whole.files) && !is_cut
    });
    changed.map(|(path, bytes)| format!("{}: {} bytes stay after: {error}", path.display(), bytes.len()))
}

/// The run with a limit on the size of files that doubles until nothing fails.
fn limited(setting: &Setting, line: &str, whole: &Run) -> Vec<String> {
    let mut failures = Vec::new();
    for blocks in (0..17).map(|power| (1u64 << power) / 2) {
        let run = setting.run(line, &format!("trap '' XFSZ; ulimit -f {blocks};"), &[], |_| ());
        failures.extend(
            wrong_write(setting, line, whole, &run, "File too large").map(|what| format!("{blocks} blocks: {what}")),
        );
        if run.code() == Some(0) {
            return failures;
        }
    }
    failures.push("fails with 32 MB".to_owned());
    failures
}

/// The run as a user who may only read the folder.
fn read_only(setting: &Setting, line: &str, whole: &Run) -> Vec<String> {
    let other = ["setpriv", "--reuid", NOBODY, "--regid", NOBODY, "--clear-groups"];
    let by: &[&str] = if rustix::process::geteuid().is_root() { &other } else { &[] };
    let run = setting.run(line, "chmod u-w . 2>/dev/null;", by, |_| ());
    wrong_write(setting, line, whole, &run, "Permission denied").into_iter().collect()
}

/// The runs in which standard output or error takes nothing.
fn closed_or_full(setting: &Setting, line: &str, whole: &Run) -> Vec<String> {
    let mut runs = Vec::new();
    if redirected(line).is_empty() && !whole.output.stdout.is_empty() {
        let full = setting.run(line, "exec >/dev/full;", &[], |_| ());
        runs.push(("standard output is full", 2, "standard output: No space left", full));
        let closed = setting.run(line, "", &[], |child| drop(child.stdout.take()));
        runs.push(("standard output is closed", 0, "", closed));
    }
    runs.push(("standard error is full", 0, "", setting.run(line, "exec 2>/dev/full;", &[], |_| ())));
    runs.push(("standard error is closed", 0, "", setting.run(line, "", &[], |child| drop(child.stderr.take()))));
    let wrong = |(what, code, error, run): (&str, i32, &str, Run)| {
        let right = run.code() == Some(code) && run.error().starts_with(error) && !run.stderr().contains("panicked");
        (!right).then(|| format!("{what}: exit code {:?}: {}", run.code(), run.stderr()))
    };
    runs.into_iter().filter_map(wrong).collect()
}

/// The run that is stopped and goes on every few milliseconds, which interrupts what it waits for.
fn interrupted(setting: &Setting, line: &str, whole: &Run) -> Vec<String> {
    let run = setting.run(line, "", &[], |child| {
        let group = rustix::process::Pid::from_child(child);
        // Not to its end: nothing reads what it writes meanwhile.
        for _ in 0..100 {
            if child.try_wait().unwrap().is_some() {
                break;
            }
            for (signal, wait) in [(Signal::STOP, 1), (Signal::CONT, 2)] {
                // It may have ended meanwhile.
                let _ = rustix::process::kill_process_group(group, signal);
                std::thread::sleep(Duration::from_millis(wait));
            }
        }
    });
    if run.code() != Some(0) {
        return vec![format!("interrupted: exit code {:?}: {}", run.code(), run.stderr())];
    }
    // Some write times, and differ by themselves.
    let again = (run.files != whole.files || run.output.stdout != whole.output.stdout).then(|| setting.plain(line));
    let differs = |again: Run| {
        let files = again.files == whole.files && run.files != whole.files;
        files || again.output.stdout == whole.output.stdout && run.output.stdout != whole.output.stdout
    };
    again.is_some_and(differs).then(|| "interrupted: another result".to_owned()).into_iter().collect()
}

#[test]
fn what_fails_is_said_and_leaves_no_part_of_a_file() {
    let setting = Setting::new();
    let all = tried(&setting);
    let commands: BTreeSet<&str> = all.iter().map(|(line, _)| command(line)).collect();
    println!("{} examples of {commands:?}", all.len());
    assert!(commands.len() >= 15, "{commands:?}");
    type Failing = fn(&Setting, &str, &Run) -> Vec<String>;
    let ways: [Failing; 4] = [limited, read_only, closed_or_full, interrupted];
    let failures: Vec<String> = all
        .par_iter()
        .flat_map_iter(|(line, whole)| {
            ways.map(|way| way(&setting, line, whole)).concat().into_iter().map(move |what| format!("{line}: {what}"))
        })
        .collect();
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

#[test]
fn a_part_of_a_file_and_an_error_without_a_name_are_found() {
    let setting = Setting::new();
    let wrong = |script: &str| {
        let whole = setting.plain("true");
        let run = setting.plain(&format!("{script} 2>&1; exit 2"));
        let run = Run { output: Output { stderr: run.output.stdout.clone(), ..run.output }, ..run };
        wrong_write(&setting, script, &whole, &run, "File too large")
    };
    assert_eq!(wrong("echo error: scene.toml: File too large"), None);
    let part = wrong("printf part | tee scene.toml >/dev/null; echo error: scene.toml: File too large").unwrap();
    assert!(part.starts_with("scene.toml: 4 bytes stay"), "{part}");
    assert!(wrong("echo error: scene.toml").is_some() && wrong("echo panicked at: File too large").is_some());
}
