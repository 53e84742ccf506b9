//! Lines of a link that loses a byte of each, in the formats in which sensors write numbers: what is read wrong is flagged.

use std::io::Write;
use std::path::Path;
use std::process::{Command, Stdio};

use dermis_golden::data::generator::draws::{DrawOptions, Draws};
use dermis_golden::data::generator::presses::{Motion, Press};
use dermis_golden::result::errors::Errors;
use dermis_golden::result::flags::Flag;
use dermis_golden::spec::scene::Scene;
use fastrand::Rng;
use serde_json::Value;

/// Largest e_t and e_n of a result that is right.
const RIGHT: [f64; 2] = [0.2, 0.1];
/// Largest stress of a frame in MPa.
const PEAK_MPA: f64 = 0.45;
/// Of the frames and of the bytes that are lost.
const SEED: u64 = 1;
/// An array whose taxels stand far apart for its cover: a reading says little of the next one. Its noise is not stated.
const SENSOR: &str = "rows = 8\ncols = 8\npitch_x_mm = 4.0\npitch_y_mm = 4.0\nthickness_mm = 3.0\n";

/// A format of the numbers: its name, the unit in MPa, lines, and a number in that unit as text.
type Format = (&'static str, f64, usize, fn(f64) -> String);
const FORMATS: [Format; 4] = [
    ("whole kPa", 1e-3, 400, |b| format!("{b:.0}")),
    ("four decimals", 1.0, 100, |b| format!("{b:.4}")),
    ("exponents of two digits", 1.0, 100, |b| {
        let text = format!("{b:.6e}");
        let (mantissa, exponent) = text.split_once('e').unwrap();
        format!("{mantissa}e{:+03}", exponent.parse::<i32>().unwrap())
    }),
    ("as short as it is exact", 1.0, 100, |b| (b as f32).to_string()),
];
/// Lines of a press.
const PRESS: usize = 160;
const OF_A_PRESS: [Format; 3] = [
    ("kPa with a decimal", 1e-3, PRESS, |b| format!("{b:.1}")),
    ("six digits at most", 1.0, PRESS, |b| ((1e6 * b).round() / 1e6).to_string()),
    ("as short as it is exact", 1.0, PRESS, |b| b.to_string()),
];

/// What became of the lines of a stream.
#[derive(Debug, Default)]
struct Outcome {
    refused: usize,
    flagged: usize,
    right: usize,
    /// Wrong and without a flag.
    silent: usize,
    /// Wrong, and flagged for what a lost character does alone.
    torn: usize,
}

/// The scene, whose readings are in a `unit` in MPa, as a file in `folder`.
fn scene(folder: &Path, unit: f64) -> String {
    let taxels = (0..64).map(|k| format!("{},{},0,{unit}\n", k / 8, k % 8)).collect::<String>();
    std::fs::write(folder.join("gains.csv"), format!("row,col,offset,gain\n{taxels}")).unwrap();
    let path = folder.join("pad.toml");
    std::fs::write(&path, format!("[sensor]\n{SENSOR}[input]\ncalibration = \"gains.csv\"\n")).unwrap();
    path.to_str().unwrap().to_owned()
}

/// Frames that have nothing to do with one another: stress in MPa and forces in N.
fn unrelated(scene: &Scene, frames: usize) -> Vec<(Vec<f64>, [f64; 3])> {
    let options = DrawOptions { seed: SEED, peak_MPa: Some(PEAK_MPA), ..DrawOptions::default() };
    let draws = Draws::new(scene, options).unwrap();
    let frame = |number| draws.frame(number).unwrap();
    (0..frames as u64).map(frame).map(|frame| (frame.exact_MPa, frame.total_N)).collect()
}

/// Frames of a press, one after the other.
fn press(scene: &Scene, frames: usize) -> Vec<(Vec<f64>, [f64; 3])> {
    let press = Press::new(Motion::Ramp).of_frames(frames, 0.0);
    press.frames(scene, SEED).unwrap().into_iter().map(|own| (own.stress_MPa, own.resultant_N.unwrap())).collect()
}

/// What a stream answers to a line: its number, and force and flags of the result if it is not refused.
type Answer = (usize, Option<([f64; 3], Vec<String>)>);

/// Frames as lines of a format, each `every`th without one of its bytes, as a stream.
fn run(path: &str, frames: &[(Vec<f64>, [f64; 3])], format: Format, every: usize, random: &mut Rng) -> Vec<Answer> {
    let (_, unit, _, text) = format;
    let mut sent = String::new();
    for (number, (stress, _)) in frames.iter().enumerate() {
        let numbers: Vec<String> = stress.iter().map(|b| text(b / unit)).collect();
        let mut line = numbers.join(",");
        if number % every == every - 1 {
            line.remove(random.usize(..line.len()));
        }
        sent += &(line + "\n");
    }
    let mut child = Command::new(env!("CARGO_BIN_EXE_dermis"))
        .args(["reconstruct", path, "--stream", "--brief"])
        .current_dir(Path::new(path).parent().unwrap())
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let mut input = child.stdin.take().unwrap();
    let writer = std::thread::spawn(move || input.write_all(sent.as_bytes()).unwrap());
    let output = child.wait_with_output().unwrap();
    writer.join().unwrap();
    let answer = |line: &str| {
        let answer: Value = serde_json::from_str(line).unwrap();
        let of = |field: &str| answer.get(field).cloned();
        let force = of("resultant_N").map(|force| serde_json::from_value(force).unwrap());
        let flags = of("flags").map(|flags| serde_json::from_value(flags).unwrap());
        (answer["line"].as_u64().unwrap() as usize, force.zip(flags))
    };
    let answers: Vec<Answer> = String::from_utf8(output.stdout).unwrap().lines().map(answer).collect();
    assert_eq!(answers.len(), frames.len());
    answers
}

/// What became of lines whose forces are these.
fn outcome(answers: &[Answer], forces: &[[f64; 3]]) -> Outcome {
    let mut outcome = Outcome::default();
    for (line, result) in answers {
        let Some((found, flags)) = result else {
            outcome.refused += 1;
            continue;
        };
        let errors = Errors::new(forces[line - 1], *found);
        let wrong = [errors.tangential, errors.normal].iter().zip(RIGHT).any(|(e, right)| e.is_some_and(|e| e > right));
        match &flags[..] {
            [] if wrong => outcome.silent += 1,
            [] => outcome.right += 1,
            [only] if wrong && only == Flag::TornFrame.name() => outcome.torn += 1,
            _ => outcome.flagged += 1,
        }
    }
    outcome
}

/// 400 lines of whole numbers and 300 of others: no force that is wrong is without a flag. Without that of lines that lost characters
/// there would be one, of whole numbers: beside the peak of such an array nothing else tells 291 kPa from 91.
#[test]
fn a_link_that_loses_a_byte_of_each_line_makes_no_silent_error() {
    let mut random = Rng::with_seed(SEED);
    let outcomes = FORMATS.map(|format| {
        let folder = tempfile::tempdir().unwrap();
        let path = scene(folder.path(), format.1);
        let frames = unrelated(&Scene::load(&path).unwrap(), format.2);
        let forces: Vec<[f64; 3]> = frames.iter().map(|(_, force)| *force).collect();
        let outcome = outcome(&run(&path, &frames, format, 1, &mut random), &forces);
        println!("{}: {outcome:?}", format.0);
        outcome
    });
    assert_eq!(outcomes.each_ref().map(|outcome| outcome.silent), [0; 4]);
    assert!(outcomes[0].torn > 0);
    // Numbers that show what they lose are not in doubt for it.
    assert!(outcomes[1].right > 0, "{outcomes:?}");
}

/// The same of a press, where lines that are whole stand between those that are cut: against the forces of the lines without a loss,
/// none of which is doubted.
#[test]
fn a_link_that_loses_a_byte_now_and_then_makes_no_silent_error_in_a_press() {
    let (mut random, mut torn) = (Rng::with_seed(SEED), 0);
    for format in OF_A_PRESS {
        let folder = tempfile::tempdir().unwrap();
        let path = scene(folder.path(), format.1);
        let frames = press(&Scene::load(&path).unwrap(), format.2);
        let whole = run(&path, &frames, format, usize::MAX, &mut random);
        let is_torn = |(_, result): &Answer| {
            result.as_ref().is_none_or(|(_, flags)| flags.iter().any(|flag| flag == Flag::TornFrame.name()))
        };
        assert_eq!(whole.iter().filter(|answer| is_torn(answer)).count(), 0, "{}", format.0);
        let forces: Vec<[f64; 3]> = whole.iter().map(|(_, result)| result.as_ref().unwrap().0).collect();
        for every in [1, 8] {
            let outcome = outcome(&run(&path, &frames, format, every, &mut random), &forces);
            println!("{}, every {every}: {outcome:?}", format.0);
            assert_eq!(outcome.silent, 0, "{}, every {every}: {outcome:?}", format.0);
            torn += outcome.torn;
        }
    }
    // Nothing else showed these.
    assert!(torn > 0);
}
