//! The comparison can fail: one flipped bit in a coefficient, an input vector or the expected output is found, in the
//! stage concerned.

use dermis_cosim::drive::Stimulus;
use dermis_cosim::hardware::Hardware;
use dermis_cosim::simulator::Simulator;
use dermis_cosim::{Findings, Vector};
use dermis_golden::fixed::Model;
use dermis_tests::{build_dir, compare, scene};

fn setup() -> (Hardware, Vec<Vector>) {
    let (scene, frames) = scene("eight-by-eight");
    let hardware = Hardware::new(Model::new(&scene).unwrap(), &build_dir()).unwrap();
    let vectors = vec![hardware.vector(&frames[..1]).unwrap()];
    (hardware, vectors)
}

fn check(hardware: &Hardware, vectors: &[Vector]) -> Findings {
    compare(hardware, Simulator::Verilator, vectors, Stimulus::FullSpeed)
}

/// Flips bit 0 of the first non-zero hexadecimal word in the middle of a memory file.
fn flip(text: &str) -> String {
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    let is_word = |line: &String| {
        line.chars().all(|c| c.is_ascii_hexdigit()) && line.chars().any(|c| c != '0' && c.is_ascii_hexdigit())
    };
    let middle = lines.len() / 2;
    let word = lines[middle..].iter_mut().find(|line| is_word(line)).expect("a word in the file");
    let last = word.pop().and_then(|c| c.to_digit(16)).expect("a hexadecimal digit");
    word.push(char::from_digit(last ^ 1, 16).expect("a digit"));
    lines.join("\n") + "\n"
}

#[test]
fn in_a_coefficient() {
    let (mut hardware, vectors) = setup();
    assert!(check(&hardware, &vectors).is_equal());
    let memories: Vec<usize> =
        (0..hardware.generated.files.len()).filter(|&i| hardware.generated.files[i].name.ends_with(".hex")).collect();
    assert!(!memories.is_empty(), "the design has no memory files");
    for index in memories {
        let good = hardware.generated.files[index].text.clone();
        hardware.generated.files[index].text = flip(&good);
        let findings = check(&hardware, &vectors);
        assert!(!findings.is_equal(), "a flipped bit in {} went unnoticed", hardware.generated.files[index].name);
        hardware.generated.files[index].text = good;
    }
}

#[test]
fn in_an_input_vector() {
    let (hardware, mut vectors) = setup();
    vectors[0].codes[27] ^= 1;
    let findings = check(&hardware, &vectors);
    assert_eq!((findings.kept[0].stage.as_str(), findings.kept[0].taxel), ("receive", Some([3, 3])));
}

#[test]
fn in_the_expected_output() {
    let (hardware, mut vectors) = setup();
    vectors[0].expected.beats[63][0] ^= 1 << 31;
    let findings = check(&hardware, &vectors);
    assert_eq!(findings.count, 1);
    let first = &findings.kept[0];
    assert_eq!((first.stage.as_str(), first.taxel), ("beats", Some([7, 7])));
    assert!(first.cycle.is_some() && first.expected != first.got);
}
