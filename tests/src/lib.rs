//! What the tests of this crate share: scenes, their shipped frames, and where built libraries live.
//!
//! | test | claims |
//! |---|---|
//! | `equality` | generated Verilog = rust-hdl's simulation = bit-true model, on every shipped frame; cycle budgets |
//! | `accuracy` | golden against the truth, bit-true against golden |
//! | `dead` | dead taxels: the same equality, blind to what they read, near the golden model |
//! | `flipped_bit` | one wrong bit in a coefficient, a vector or the expected output is found |
//! | `choice` | several cases in one design: equality in mixed order, wrong constants found, what the choice is worth |
//! | `resources` | block RAMs and multipliers as Yosys counts them, flip-flops and LUTs near |
//! | `extreme` | zero, saturated, 1e±9 of full scale, at edges and corners: equal in hardware |
//! | `fuzz` | readers, and the whole way from a scene to forces, on mutated and random input; counts for the report |
//! | `explain` | what is left out is not in the Verilog, and what that saves; refusals name what fits |
//! | `framing` | early and missing `tlast`: what is dropped, what is flagged, and equality right after |
//! | `streams` | gaps, back-pressure, wrong `tlast`, a reset at every cycle: nothing lost or invented, right after |
//! | `coefficients` | the coefficient check: no false alarm, every tried flip told, left out by default |
//! | `faults` | flipped bits in ROM, RAM and registers: all of them are found, outcomes add up, a reset helps |
//! | `proofs` | handshakes and queues lose, invent and change nothing, words are held to their range: proved, not tried |
//! | `link` | the board's UART and SPI: answers, counters, recovery; Verilator = rust-hdl, pin by pin |
//! | `synthesis` | Yosys reads the Verilog without latch or undriven signal |
//! | `scenes` | the same equality for scenes of other shapes, degrees, words and conditions |
//! | `scale` | the largest array, and a thousand random frames with stalls on both streams |
//! | `words` | no file has a phrase of `tests/words.txt` |
//! | `lint` | the generated Verilog is clean under Verilator with its waivers, and needs every one of them |
#![deny(missing_docs)]

use std::path::PathBuf;

use dermis_golden::frame::Frame;
use dermis_golden::scene::Scene;

/// Scenes that are verified on real frames, with the most cycles from the last input to the last output beat.
pub const SCENES: [(&str, u64); 2] = [("sensor-1", 1_400), ("eight-by-eight", 900)];

/// A built-in scene and its shipped half-space frames.
///
/// # Panics
/// When the scene does not exist or has no frames; this crate holds tests only.
pub fn scene(name: &str) -> (Scene, Vec<Frame>) {
    let scene = Scene::builtin(name).expect("a built-in scene");
    let frames = Frame::shipped(&scene);
    assert!(!frames.is_empty(), "{name} has no frames");
    (scene, frames)
}

/// The workspace's folder for built things: the libraries that `make run` has built serve here too.
pub fn build_dir() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../build")
}

/// How much a test tries: what the environment's variable says, else the short part that every run has.
///
/// # Panics
/// When the variable is no number.
pub fn wanted(variable: &str, short: u64) -> u64 {
    std::env::var(variable).map_or(short, |text| text.parse().unwrap_or_else(|_| panic!("{variable}: a number")))
}
