//! The coefficient check: no false alarm on the shipped frames, every tried flip of a bit in the coefficient memory
//! flagged, no additional block RAM, multiplier or cycle; absent by default.

use dermis_cosim::drive::{record, InputFrame, Stimulus};
use dermis_cosim::hardware::Hardware;
use dermis_cosim::simulator::Simulator;
use dermis_cosim::verify::verify;
use dermis_cosim::{Vector, QUICK_SCENES};
use dermis_golden::data::frame::Frame;
use dermis_golden::fixed::plan::check::undetected;
use dermis_golden::fixed::plan::storage::word_bits;
use dermis_golden::fixed::stages::send::Status;
use dermis_golden::fixed::{Cycles, Model};
use dermis_golden::result::flags::Flag;
use dermis_golden::spec::scene::{CoefficientCheck, Scene};
use dermis_hdl::{generate, usage::total, GeneratedFile};
use dermis_tests::{assert_equal, build_dir, scene, variants, verilog_code};

/// The scenes that are simulated in seconds, first the one whose subarray has several signatures.
fn quick_scenes() -> [&'static str; QUICK_SCENES.len()] {
    let mut scenes = QUICK_SCENES;
    scenes.reverse();
    scenes
}

/// Number of flips tried in each scene.
const FLIPS: usize = 100;

fn checked(name: &str) -> (Scene, Vec<Frame>) {
    let (mut scene, frames) = scene(name);
    scene.hardware.coefficient_check = CoefficientCheck::Signature;
    (scene, frames)
}

fn small(more: &str) -> Scene {
    let text = format!(
        "name = \"checked\"\n[hardware]\ncoefficient_check = \"signature\"\n[sensor]\nrows = 8\ncols = 8\n\
         pitch_x_mm = 3.0\npitch_y_mm = 4.0\nthickness_mm = 3.0\n[search]\nmu_max = 0.05\n{more}"
    );
    Scene::parse(&text, "checked").unwrap()
}

fn check(scene: &Scene, frames: &[Frame]) {
    let verified = verify(scene, frames, &[Simulator::Verilator, Simulator::Kernel], &build_dir()).unwrap();
    assert_equal(&verified.findings, &scene.name);
    // The output equals the model's, which never raises the flag.
    assert!(verified.rows.iter().all(|row| !row.fixed.flags.contains(&Flag::CoefficientsDamaged)));
}

#[test]
fn no_false_alarm() {
    for name in variants(&quick_scenes(), 1) {
        let (scene, frames) = checked(name);
        check(&scene, &frames);
    }
    // Several subarrays and groups of rows, a list of columns; several cases, each with its own signature.
    let frames = Frame::shipped(&small(""));
    let eq2 = Frame::eq2(&small("").sensor);
    let frames = [&frames[..], &[eq2]].concat();
    for more in ["[partition]\ncase = 3\n[fixed]\nlanes = 12\nprune_bits = 8\n", "[partition]\ncases = [0, 1]\n"] {
        check(&small(more), &frames);
    }
}

/// Flips a bit of a lane's coefficient in the memory file.
fn flip(text: &str, word: usize, bit: usize) -> String {
    let mut lines: Vec<Vec<u8>> = text.lines().map(|line| line.as_bytes().to_vec()).collect();
    let digit = lines[word].len() - 1 - bit / 4;
    let value = (lines[word][digit] as char).to_digit(16).unwrap() ^ (1 << (bit % 4));
    lines[word][digit] = char::from_digit(value, 16).unwrap() as u8;
    lines.into_iter().map(|line| String::from_utf8(line).unwrap() + "\n").collect()
}

/// Whether each subarray's status flags its coefficients.
fn tells(hardware: &Hardware, vector: &Vector) -> bool {
    let mut device = hardware.device(Simulator::Verilator).unwrap();
    let forces = vector.expected.beats.len();
    let beats = forces + vector.expected.status.len();
    let play = InputFrame { codes: &vector.codes, taxels: vector.taxels, beats, array: 0 };
    let recording = record(device.as_mut(), 0, &[play], Stimulus::FullSpeed, 100_000);
    assert_eq!(recording.beats.len(), beats);
    let status: Vec<[i32; 3]> = recording.beats[forces..].iter().map(|beat| beat.data).collect();
    let mut all = Status::all(&status);
    all.all(|status| status.flags().contains(Flag::CoefficientsDamaged))
}

#[test]
fn every_tried_flip_is_told() {
    for name in variants(&quick_scenes(), 1) {
        let (scene, frames) = checked(name);
        let mut hardware = Hardware::new(Model::for_frames(&scene, &frames).unwrap(), &build_dir()).unwrap();
        let vector = hardware.vector(&frames[..1]).unwrap();
        assert!(!tells(&hardware, &vector), "{name}: a false alarm");
        // Every word is read, and no flip is undetected.
        let words = hardware.model.storage().words();
        assert_eq!(undetected(hardware.model.first()), [0; 0], "{name}");
        let file = hardware.generated.files.iter().position(|file| file.name.ends_with("__coefficients.hex")).unwrap();
        let good = hardware.generated.files[file].text.clone();
        let bits = word_bits(hardware.model.formats());
        let mut random = fastrand::Rng::with_seed(1);
        for _ in 0..FLIPS {
            let (word, bit) = (random.usize(..words), random.usize(..bits));
            hardware.generated.files[file].text = flip(&good, word, bit);
            assert!(tells(&hardware, &vector), "{name}: bit {bit} of word {word} went unnoticed");
        }
    }
}

/// A simulator, and a device, has zeros for a file that is missing.
#[test]
fn the_file_of_another_core_and_a_missing_one_are_told() {
    let (scene, frames) = checked("eight-by-eight");
    let mut hardware = Hardware::new(Model::for_frames(&scene, &frames).unwrap(), &build_dir()).unwrap();
    let vector = hardware.vector(&frames[..1]).unwrap();
    let of = |files: &[GeneratedFile]| files.iter().position(|file| file.name.ends_with("__coefficients.hex")).unwrap();
    let mut thicker = scene.clone();
    thicker.sensor.thickness_mm *= 1.25;
    let other = generate(&Model::new(&thicker).unwrap()).unwrap();
    let other = other.files[of(&other.files)].text.clone();
    let own = of(&hardware.generated.files);
    let right = hardware.generated.files[own].text.clone();
    // Nothing else notices.
    assert!(other.len() == right.len() && other != right);
    let missing = right.replace(|digit: char| digit.is_ascii_hexdigit(), "0");
    for wrong in [other, missing] {
        hardware.generated.files[own].text = wrong;
        assert!(tells(&hardware, &vector));
    }
    hardware.generated.files[own].text = right;
    assert!(!tells(&hardware, &vector));
}

#[test]
fn it_costs_some_logic_and_nothing_else() {
    let [with, without] = [checked("sensor-1").0, scene("sensor-1").0].map(|scene| Model::new(&scene).unwrap());
    let of = |model: &Model| (total(&generate(model).unwrap().usage), Cycles::of(model, &[true]));
    let ((with, cycles_with), (without, cycles_without)) = (of(&with), of(&without));
    println!("{} flip-flops, {} LUTs", with.flip_flops - without.flip_flops, with.luts - without.luts);
    assert_eq!((with.block_rams, with.multipliers), (without.block_rams, without.multipliers));
    assert_eq!(cycles_with, cycles_without);
    assert!(with.flip_flops > without.flip_flops && with.luts > without.luts);
}

#[test]
fn it_is_left_out_by_default() {
    let logic = ["signature", "odd_lanes", "damages"];
    let (with, without) = (verilog_code(&checked("eight-by-eight").0), verilog_code(&scene("eight-by-eight").0));
    assert!(logic.iter().all(|name| with.contains(name)) && !logic.iter().any(|name| without.contains(name)));
}
