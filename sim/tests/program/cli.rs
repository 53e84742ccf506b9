//! The program's messages: every file of `tests/cases` is one case with arguments, exit code, input files and the
//! expected output, which is compared verbatim:
//!
//! ```text
//! # what the case tests
//! args: reconstruct flat.toml
//! exit: 2
//! --- flat.toml          an input file
//! ...
//! --- stdout             lines that stdout must contain
//! --- stderr             the complete stderr
//! ```
//! `DERMIS_ACCEPT=1 cargo test -p dermis-sim --test program cli::` rewrites the expected stderr of all cases.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use crate::fake;

struct Case {
    path: PathBuf,
    args: Vec<String>,
    exit: i32,
    sections: Vec<(String, String)>,
}

impl Case {
    fn read(path: PathBuf) -> Case {
        let text = fs::read_to_string(&path).unwrap();
        let mut parts = format!("\n{text}").split("\n--- ").map(str::to_owned).collect::<Vec<_>>().into_iter();
        let head = parts.next().unwrap();
        let value = |key: &str| head.lines().find_map(|l| l.strip_prefix(key)).unwrap().trim().to_owned();
        let sections = parts.map(|part| {
            let (name, body) = part.split_once('\n').unwrap_or((&part, ""));
            (name.to_owned(), format!("{}\n", body.trim_end_matches('\n')))
        });
        Case {
            args: value("args:").split(' ').filter(|a| !a.is_empty()).map(str::to_owned).collect(),
            exit: value("exit:").parse().unwrap(),
            sections: sections.collect(),
            path,
        }
    }

    fn section(&self, name: &str) -> &str {
        self.sections.iter().find(|(n, _)| n == name).map_or("", |(_, body)| body)
    }

    fn accept(&self, stderr: &str) {
        let text = fs::read_to_string(&self.path).unwrap();
        let kept = text.split("--- stderr\n").next().unwrap();
        let expected = if stderr.is_empty() { String::new() } else { format!("--- stderr\n{stderr}") };
        fs::write(&self.path, format!("{kept}{expected}")).unwrap();
    }
}

fn dermis(folder: &Path, args: &[String]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_dermis")).current_dir(folder).args(args).output().unwrap()
}

#[test]
fn wrong_input_ends_with_its_exit_code_and_message() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/cases");
    let mut paths: Vec<PathBuf> = fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()).collect();
    paths.sort();
    let mut failures = String::new();
    for case in paths.into_iter().map(Case::read) {
        let work = tempfile::tempdir().unwrap();
        for (name, body) in case.sections.iter().filter(|(n, _)| n != "stdout" && n != "stderr") {
            fs::write(work.path().join(name), body).unwrap();
        }
        let output = dermis(work.path(), &case.args);
        let stderr = String::from_utf8(output.stderr).unwrap();
        let stdout = String::from_utf8(output.stdout).unwrap();
        if std::env::var_os("DERMIS_ACCEPT").is_some() {
            case.accept(&stderr);
            continue;
        }
        let missing: Vec<&str> = case.section("stdout").lines().filter(|line| !stdout.contains(line)).collect();
        if output.status.code() != Some(case.exit) || stderr != case.section("stderr") || !missing.is_empty() {
            failures += &format!(
                "{}\n  exit {:?}, expected {}\n  stderr:\n{stderr}  expected:\n{}  lines missing in stdout: \
                 {missing:?}\n",
                case.path.display(),
                output.status.code(),
                case.exit,
                case.section("stderr"),
            );
        }
        assert!(!stderr.contains("panicked"), "{}: {stderr}", case.path.display());
    }
    assert!(failures.is_empty(), "{failures}");
}

/// What commands for the hardware print of a scene that names no estimator.
const NOTE: &str =
    "eight-by-eight: estimator search in hardware, evidence in floating point: the scene names no network\n";

/// Exit code and stderr of a reconstruction in simulated hardware, with `work` as the only folder in PATH.
fn rtl_in(work: &Path) -> (Option<i32>, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_dermis"))
        .current_dir(work)
        .env("PATH", work)
        .args(["reconstruct", "eight-by-eight", "--engine", "rtl"])
        .output()
        .unwrap();
    (output.status.code(), String::from_utf8(output.stderr).unwrap())
}

#[test]
fn without_verilator_the_message_says_how_to_get_it() {
    let work = tempfile::tempdir().unwrap();
    let wanted = "error: verilator is not installed; on Debian: sudo apt-get install verilator g++\n";
    assert_eq!(rtl_in(work.path()), (Some(2), NOTE.to_owned() + wanted));
}

#[test]
fn without_a_compiler_the_message_says_what_is_missing() {
    let work = tempfile::tempdir().unwrap();
    // A stand-in for Verilator that fails to build; PATH contains nothing else.
    let script = "#!/bin/sh\n[ \"$1\" = --version ] && echo Verilator 0 && exit 0\nexit 127\n";
    fake::program(work.path(), "verilator", script);
    let wanted = "error: verilator needs g++, which is not installed; on Debian: sudo apt-get install g++\n";
    assert_eq!(rtl_in(work.path()), (Some(2), NOTE.to_owned() + wanted));
}

#[test]
fn help_has_examples_for_every_command() {
    let help = |command: &[&str]| {
        let args: Vec<String> = command.iter().chain(&["--help"]).map(|a| (*a).to_owned()).collect();
        let output = dermis(Path::new("."), &args);
        assert_eq!(output.status.code(), Some(0));
        String::from_utf8(output.stdout).unwrap()
    };
    let overview = help(&[]);
    assert!(overview.contains("Examples:\n  dermis "), "{overview}");
    let listed = overview.split("Commands:\n").nth(1).unwrap().split("\n\n").next().unwrap();
    let names = listed.lines().filter_map(|line| line.split_whitespace().next()).filter(|name| *name != "help");
    let names: Vec<&str> = names.collect();
    assert!(names.len() >= 4, "{listed}");
    for name in names {
        let text = help(&[name]);
        let examples = text.split("Example").nth(1);
        assert!(examples.is_some_and(|e| e.contains(&format!("\n  dermis {name} "))), "{name}: {text}");
    }
}
