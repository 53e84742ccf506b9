//! `example.c`, compiled with the static library: its numbers are those of the Rust call to the bit; a board on a
//! pseudo-terminal answers it; the address sanitizer finds neither a wrong access nor a leak.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::OnceLock;

use dermis_cosim::hardware::Hardware;
use dermis_golden::data::frame::Frame;
use dermis_golden::engine::CheckedEngine;
use dermis_golden::estimate::float::Golden;
use dermis_golden::fixed::Model;
use dermis_golden::result::reconstruct::Reconstruction;
use dermis_golden::spec::scene::Scene;
use dermis_host::link::PseudoTerminal;
use tempfile::TempDir;

use super::header::folder;

const SCENE: &str = "eight-by-eight";
/// Bit rate of the simulated board: eight clock cycles per bit, to keep the simulation short.
const BAUD: u32 = 12_500_000;

/// Compiles a program with a library beside this test.
fn compile(source: &Path, program: &Path, library: &str, flags: &[&str]) -> Output {
    let deps = std::env::current_exe().unwrap().parent().unwrap().to_owned();
    let mut command = Command::new("cc");
    command
        .args(["-std=c11", "-Wall", "-Wextra", "-Werror"])
        .args(flags)
        .arg("-I")
        .arg(folder())
        .arg("-o")
        .arg(program);
    command.arg(source).arg(deps.join(library)).args(["-lpthread", "-ldl", "-lm"]);
    command.output().expect("cc is installed (make setup)")
}

/// A program that is compiled with the shared library, which takes a tenth of the static one's time.
fn shared(folder: &Path, source: &Path, flags: &[&str]) -> PathBuf {
    let program = folder.join(source.file_stem().unwrap());
    let output = compile(source, &program, "libdermis_c.so", flags);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    program
}

/// The example, compiled once with the static library.
fn example() -> &'static Path {
    static COMPILED: OnceLock<(TempDir, PathBuf)> = OnceLock::new();
    let compiled = || {
        let own = tempfile::tempdir().unwrap();
        let program = own.path().join("example");
        let output = compile(&folder().join("example.c"), &program, "libdermis_c.a", &[]);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        (own, program)
    };
    &COMPILED.get_or_init(compiled).1
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

/// A frame, and its file of comma-separated values.
fn frame(folder: &Path) -> (Frame, PathBuf) {
    let scene = Scene::builtin(SCENE).unwrap();
    let stress_MPa = Frame::shipped(&scene).remove(1).stress_MPa;
    let line = |row: &[f64]| row.iter().map(f64::to_string).collect::<Vec<_>>().join(",") + "\n";
    let path = folder.join("frame.csv");
    fs::write(&path, stress_MPa.chunks(scene.sensor.cols).map(line).collect::<String>()).unwrap();
    (Frame::from_stress("frame", &scene.sensor, stress_MPa).unwrap(), path)
}

/// What an engine printed: the numbers of each kind of line, as bits.
fn printed(output: &str, engine: &str) -> BTreeMap<String, Vec<u64>> {
    let mut lines: BTreeMap<String, Vec<u64>> = BTreeMap::new();
    for line in output.lines() {
        let words: Vec<&str> = line.split_whitespace().collect();
        if words[0] == engine {
            let numbers = words[2..].iter().filter_map(|word| word.parse::<f64>().ok()).map(f64::to_bits);
            lines.entry(words[1].to_owned()).or_default().extend(numbers);
        }
    }
    lines
}

/// The lines that a result must give.
fn wanted(result: &Reconstruction, cols: usize) -> BTreeMap<String, Vec<u64>> {
    let bits = |values: &[f64]| values.iter().map(|value| value.to_bits()).collect::<Vec<_>>();
    let forces = &result.forces_N;
    let of_taxel = |k: usize| bits(&[(k / cols) as f64, (k % cols) as f64, forces.fx[k], forces.fy[k], forces.fz[k]]);
    let contacts = result.extra.contacts.iter().flatten();
    let flags: u32 = result.flags.iter().map(|flag| flag.bit()).sum();
    BTreeMap::from([
        ("resultant".to_owned(), bits(&result.resultant_N)),
        ("flags".to_owned(), bits(&[f64::from(flags)])),
        ("force".to_owned(), (0..forces.fz.len()).flat_map(of_taxel).collect()),
        ("contact".to_owned(), contacts.flat_map(|own| bits(&[own.force_N, own.sigma_N].concat())).collect()),
    ])
}

fn check(output: &str, engine: &str, result: &Reconstruction) {
    let mut wanted = wanted(result, 8);
    if result.extra.contacts.is_none() {
        wanted.remove("contact");
        wanted.insert("contacts".to_owned(), Vec::new());
        assert!(output.contains(&format!("{engine} contacts absent\n")), "{output}");
    }
    assert_eq!(printed(output, engine), wanted, "{output}");
}

#[test]
fn its_numbers_are_those_of_the_rust_call() {
    let own = tempfile::tempdir().unwrap();
    let (frame, path) = frame(own.path());
    let scene = Scene::builtin(SCENE).unwrap();
    let build = folder().join("../../build");
    let model = Model::new(&scene).unwrap().with_changed_plan(|plan| plan.board.uart_baud = Some(BAUD));
    let hardware = Hardware::new(model.unwrap(), &build).unwrap();
    let terminal = PseudoTerminal::of(&hardware).unwrap();
    let output = Command::new(example()).arg(SCENE).arg(&path).arg(terminal.path()).output().unwrap();
    let (printed, error) = (text(&output.stdout), text(&output.stderr));
    assert!(output.status.success(), "{error}");
    let golden = Golden::new(&scene).unwrap().run(&frame).unwrap();
    assert!(golden.extra.contacts.as_ref().is_some_and(|contacts| !contacts.is_empty()));
    check(&printed, "golden", &golden);
    let fixed = CheckedEngine::new(Box::new(Model::new(&scene).unwrap()));
    // The board's result is that of the bits, with its cross-check.
    for engine in ["board", "fixed"] {
        check(&printed, engine, &fixed.result(std::slice::from_ref(&frame), true).unwrap());
    }
}

#[test]
fn wrong_input_is_said_and_ends_it() {
    let own = tempfile::tempdir().unwrap();
    let (_, path) = frame(own.path());
    let short = own.path().join("short.csv");
    fs::write(&short, "1,2,3\n").unwrap();
    let cases =
        [("sensor1", &path, "did you mean \"sensor-1\"?"), (SCENE, &short, "short.csv: wanted 8 lines of 8 numbers")];
    for (scene, frame, wanted) in cases {
        let output = Command::new(example()).arg(scene).arg(frame).output().unwrap();
        let error = text(&output.stderr);
        assert!(output.status.code() == Some(1) && error.contains(wanted), "{error}");
    }
    let output = Command::new(example()).arg(SCENE).arg(&path).arg("/nowhere").output().unwrap();
    assert_eq!(output.status.code(), Some(1));
}

#[test]
fn the_address_sanitizer_finds_nothing_in_it_and_what_is_wrong_elsewhere() {
    let own = tempfile::tempdir().unwrap();
    let source = |name: &str, body: &str| {
        let path = own.path().join(name);
        fs::write(&path, format!("#include \"dermis.h\"\n{body}")).unwrap();
        path
    };
    let flags = ["-g", "-fsanitize=address"];
    let empty = source("empty.c", "int main(void) { return 0; }\n");
    if !compile(&empty, &own.path().join("empty"), "libdermis_c.so", &flags).status.success() {
        eprintln!("cc has no address sanitizer: not run");
        return;
    }
    let (_, path) = frame(own.path());
    let output = Command::new(shared(own.path(), &folder().join("example.c"), &flags)).arg(SCENE).arg(&path).output();
    let output = output.unwrap();
    assert!(output.status.success(), "{}", text(&output.stderr));
    let load = "dermis_scene *scene;\n    dermis_scene_load(\"eight-by-eight\", &scene);\n";
    let leak = source(
        "leak.c",
        &format!("static void lose(void)\n{{\n    {load}}}\nint main(void)\n{{\n    lose();\n    lose();\n    return 0;\n}}\n"),
    );
    // Memory that the library has freed.
    let twice = "dermis_scene_free(scene);\n    dermis_scene_free(scene);\n    return 0;\n";
    let twice = source("twice.c", &format!("int main(void)\n{{\n    {load}    {twice}}}\n"));
    for (source, wanted) in [(leak, "LeakSanitizer"), (twice, "AddressSanitizer")] {
        let output = Command::new(shared(own.path(), &source, &flags)).output().unwrap();
        let error = text(&output.stderr);
        assert!(!output.status.success() && error.contains(wanted), "{error}");
    }
}

/// The programs of the guide's page print what stands there.
#[test]
fn the_programs_of_the_guide_print_what_stands_there() {
    let page = fs::read_to_string(folder().join("../../docs/c.md")).unwrap();
    let blocks = |language: &str| -> Vec<String> {
        let fence = format!("```{language}\n");
        page.split(&fence).skip(1).map(|after| after.split_once("```").unwrap().0.to_owned()).collect()
    };
    let (programs, texts) = (blocks("c"), blocks("text"));
    assert_eq!((programs.len(), texts.len()), (3, 3));
    let own = tempfile::tempdir().unwrap();
    for (number, (program, wanted)) in programs.iter().zip(texts).enumerate() {
        let source = own.path().join(format!("page{number}.c"));
        fs::write(&source, program).unwrap();
        let output = Command::new(shared(own.path(), &source, &[])).output().unwrap();
        assert_eq!((text(&output.stdout), text(&output.stderr)), (wanted, String::new()));
    }
}
