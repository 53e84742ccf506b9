//! What every Verilator program shares, compiled once: Verilator's runtime and a precompiled `verilated.h`.
//!
//! They stand in cargo's target folder, under a checksum of the compiler's version, its arguments and every file of
//! Verilator's runtime, so that another Verilator or compiler makes others. A lock lets one process build them.

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::OnceLock;

/// For models of a few hundred lines, optimising takes longer than it saves.
const ARGUMENTS: [&str; 9] = [
    "-std=gnu++17",
    "-O0",
    "-DVERILATOR=1",
    "-DVM_COVERAGE=0",
    "-DVM_SC=0",
    "-DVM_TRACE=0",
    "-DVM_TRACE_FST=0",
    "-DVM_TRACE_VCD=0",
    "-pthread",
];
/// Sources of the runtime that a model without traces, coverage and DPI needs.
const SOURCES: [&str; 2] = ["verilated", "verilated_threads"];

/// Runs a program to its end and returns what it wrote; panics with that if it fails.
pub(super) fn succeed(command: &mut Command) -> String {
    let run = command.output().unwrap_or_else(|e| panic!("{:?}: {e} (make setup)", command.get_program()));
    let log = String::from_utf8_lossy(&[run.stdout, run.stderr].concat()).into_owned();
    assert!(run.status.success(), "{command:?}: {log}");
    log
}

/// The compiler with the arguments of all programs, the precompiled header included.
pub(super) fn compiler() -> Command {
    let mut compiler = plain_compiler();
    compiler.arg("-include").arg(folder().join("verilated.h"));
    compiler
}

/// The objects to link.
pub(super) fn objects() -> [PathBuf; 2] {
    SOURCES.map(|name| folder().join(format!("{name}.o")))
}

/// Folder with Verilator's headers and runtime.
fn include() -> &'static Path {
    static INCLUDE: OnceLock<PathBuf> = OnceLock::new();
    INCLUDE.get_or_init(|| {
        let root = succeed(Command::new("verilator").args(["--getenv", "VERILATOR_ROOT"]));
        Path::new(root.trim()).join("include")
    })
}

fn plain_compiler() -> Command {
    let mut compiler = Command::new("g++");
    compiler.args(ARGUMENTS).arg("-I").arg(include()).arg("-I").arg(include().join("vltstd"));
    compiler
}

/// The folder with header and objects, complete.
fn folder() -> &'static Path {
    static FOLDER: OnceLock<PathBuf> = OnceLock::new();
    FOLDER.get_or_init(|| {
        // target/debug/deps/<test program>
        let program = std::env::current_exe().unwrap();
        let cache = program.ancestors().nth(2).unwrap().join("verilator-runtime");
        fs::create_dir_all(&cache).unwrap();
        let folder = cache.join(format!("{:08x}", fingerprint(include())));
        let lock = File::create(cache.join("lock")).unwrap();
        lock.lock().unwrap();
        if !folder.exists() {
            // A folder of this name is complete: an interrupted build leaves another one.
            let staging = tempfile::tempdir_in(&cache).unwrap();
            build(staging.path());
            fs::rename(staging.keep(), &folder).unwrap();
        }
        folder
    })
}

/// CRC-32 of the compiler's version and arguments and of all files of the runtime.
fn fingerprint(include: &Path) -> u32 {
    let mut hash = crc32fast::Hasher::new();
    hash.update(succeed(Command::new("g++").arg("--version")).as_bytes());
    hash.update(format!("{ARGUMENTS:?}{}", include.display()).as_bytes());
    let mut files: Vec<PathBuf> = fs::read_dir(include).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    for file in files.iter().filter(|file| file.is_file()) {
        hash.update(file.file_name().unwrap().as_encoded_bytes());
        hash.update(&fs::read(file).unwrap());
    }
    hash.finalize()
}

/// Compiles header and runtime, each in a process of its own.
fn build(folder: &Path) {
    // The compiler takes `verilated.h.gch` instead of this header if it fits, and reads the header if not.
    let header = folder.join("verilated.h");
    fs::copy(include().join("verilated.h"), &header).unwrap();
    let mut commands: Vec<Command> = SOURCES
        .iter()
        .map(|name| {
            let mut compile = plain_compiler();
            compile.arg("-c").arg(include().join(format!("{name}.cpp")));
            compile.arg("-o").arg(folder.join(format!("{name}.o")));
            compile
        })
        .collect();
    let mut precompile = plain_compiler();
    precompile.args(["-x", "c++-header"]).arg(&header).arg("-o").arg(folder.join("verilated.h.gch"));
    commands.push(precompile);
    let running: Vec<_> = commands
        .iter_mut()
        .map(|command| command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("g++ starts (make setup)"))
        .collect();
    for (command, run) in commands.iter().zip(running) {
        let run = run.wait_with_output().unwrap();
        assert!(run.status.success(), "{command:?}: {}", String::from_utf8_lossy(&run.stderr));
    }
}

#[test]
fn another_runtime_has_another_fingerprint() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("verilated.cpp");
    let mut seen = Vec::new();
    for text in ["5.006", "5.007"] {
        fs::write(&file, text).unwrap();
        seen.push(fingerprint(folder.path()));
    }
    assert_ne!(seen[0], seen[1]);
    assert!(objects().iter().all(|object| object.is_file()));
}
