//! Accuracy: the golden model against the truth, the bit-true model (which the hardware equals) against the golden model
//! on the same quantised input, at 20 bits and at the 16 of a common converter, on drawn frames of one contact each.
//!
//! `cargo test --release -p dermis-tests --test accuracy -- --nocapture` prints the table.

use dermis_golden::fixed::Model;
use dermis_golden::frame::Frame;
use dermis_golden::quantise::{full_scale, quantise};
use dermis_golden::reconstruct::{Golden, Reconstruction};
use dermis_golden::scene::Scene;
use dermis_sim::compare::median;
use dermis_sim::drawn_frames::{DrawnFrames, Shapes};
use dermis_tests::scene;

/// Largest median tangential error of the golden model on sensor 1: twice what a study in f64 found (1.4 %).
const GOLDEN_TANGENTIAL: f64 = 0.03;
/// Largest normal error of the golden model on sensor 1, each frame.
const GOLDEN_NORMAL: f64 = 0.015;
/// Drawn frames of each sensor.
const FRAMES: u32 = 100;
/// How much the bit-true model may add to the median of a sensor at 20 bits.
const FIXED_ADDS: f64 = 0.02;

fn tangential(results: &[Reconstruction]) -> f64 {
    let errors = results.iter().filter_map(|r| r.error.as_ref()?.tangential);
    median(errors.collect()).unwrap()
}

/// The frame as its codes have it.
fn quantised(scene: &Scene, frame: &Frame) -> Frame {
    let codes = quantise(&frame.stress_MPa, scene.fixed.input_bits, full_scale(scene, frame));
    let stress = codes.codes.iter().map(|&code| f64::from(code) * codes.lsb_MPa()).collect();
    Frame { stress_MPa: stress, ..frame.clone() }
}

/// Medians of e_t: float, float on codes of `bits` bits, fixed on the same codes.
fn medians(name: &str, board: Option<&str>, bits: u32) -> [f64; 3] {
    let (mut scene, _) = scene(name);
    if let Some(board) = board {
        scene.hardware.board = board.to_string();
    }
    let draw = DrawnFrames { frames: FRAMES, contacts: vec![1], shapes: Shapes::Elliptic, touching: false, seed: 1 };
    let frames = draw.draw(&scene).unwrap();
    scene.fixed.input_bits = bits;
    let golden = Golden::new(&scene).unwrap();
    let model = Model::new(&scene).unwrap();
    let float = |frames: &[Frame]| tangential(&frames.iter().map(|f| golden.run(f).unwrap()).collect::<Vec<_>>());
    let codes: Vec<Frame> = frames.iter().map(|frame| quantised(&scene, frame)).collect();
    let fixed: Vec<_> = frames.iter().map(|f| model.reconstruct(f).unwrap()).collect();
    [float(&frames), float(&codes), tangential(&fixed)]
}

#[test]
fn fixed_adds_little_to_every_sensor() {
    println!("| scene | input | float | float, same codes | fixed |\n|---|---:|---:|---:|---:|");
    let scenes = [
        ("sensor-1", None),
        ("sensor-2", None),
        ("sensor-3", None),
        ("eight-by-eight", None),
        // 16-bit multipliers.
        ("eight-by-eight", Some("icebreaker")),
        ("sensor-4", None),
    ];
    for (name, board) in scenes {
        for bits in [20, 16] {
            let [float, codes, fixed] = medians(name, board, bits);
            let percent = [float, codes, fixed].map(|e| format!("{:.2} %", 100.0 * e)).join(" | ");
            let on = board.map_or_else(String::new, |board| format!(" on {board}"));
            println!("| {name}{on} | {bits} bits | {percent} |");
            // Sensor 4 is reported: its cells are too wide against the cover, whatever computes.
            assert!(
                bits < 20 || name == "sensor-4" || fixed <= float + FIXED_ADDS,
                "{name}: fixed {fixed}, float {float}"
            );
        }
    }
}

#[test]
fn sensor_1_meets_its_targets() {
    let (scene, frames) = scene("sensor-1");
    let golden = Golden::new(&scene).unwrap();
    let golden: Vec<_> = frames.iter().map(|f| golden.run(f).unwrap()).collect();
    for result in &golden {
        let normal = result.error.as_ref().unwrap().normal.unwrap();
        assert!(normal <= GOLDEN_NORMAL, "{}: e_n {normal}", result.frame);
    }
    let float = tangential(&golden);
    assert!(float <= GOLDEN_TANGENTIAL, "golden e_t {float}");
}
