//! Shared by the tests of this crate: scenes, their shipped frames, the folder of built libraries, committed figures
//! ([`baseline`]), and tools on generated files ([`tools`]).
//!
//! | test | claims |
//! |---|---|
//! | `equality` | generated Verilog = kernel simulation = bit-true model, on every shipped frame; cycles against a committed table |
//! | `event_driven` | every word and cycle under Icarus; no X after a reset; undefined registers found |
//! | `accuracy` | golden model against known forces, bit-true against golden model, both against a committed table |
//! | `bonded` | the Verilog of a bonded layer is that of the half-space, coefficients and widths of the search's words aside |
//! | `arrays` | several arrays on one engine: each as if alone, over frames in any order, stalls, resets, damaged frames |
//! | `dead` | dead taxels: the same equality, independence of their readings, agreement with the golden model |
//! | `flipped_bit` | one wrong bit in a coefficient, a vector or the expected output is found |
//! | `choice` | several cases in one design: equality in mixed order, wrong constants found, benefit of the choice |
//! | `resources` | block RAMs and multipliers equal Yosys's counts, flip-flops and LUTs are close |
//! | `artix` | accumulators inside the DSP48E1, block RAMs and multipliers as Yosys counts them, the script for Vivado |
//! | `extreme` | zero, saturated, 1e±9 of full scale, at edges and corners: equal in hardware |
//! | `fuzz` | readers, and the path from a scene to forces, on mutated and random input; counts for the report |
//! | `explain` | disabled features are not in the Verilog, and what that saves; errors suggest changes that fit |
//! | `framing` | early and missing `tlast`: dropped frames, flags, and equality of the next frame |
//! | `streams` | gaps, back-pressure, wrong `tlast`, a reset at every cycle: nothing lost or invented, the next frame correct |
//! | `coefficients` | the coefficient check: no false alarm, every tried flip flagged, absent by default |
//! | `faults` | flipped bits in ROM, RAM and registers: every bit is reachable, outcomes add up, a reset recovers |
//! | `constraints` | clocks and resets of the timing constraints are those of the registers in the Verilog; a missing clock found |
//! | `features` | tests, program and Python package compile the same crates once |
//! | `proofs` | formal proofs: handshakes and queues lose, invent and change nothing, words saturate |
//! | `link` | the board's UART and SPI: answers, counters, recovery; Verilator = kernel simulation, pin by pin |
//! | `microcontroller` | C: every word, with the host's compiler and on a Cortex-M7 and M4 under QEMU; a wrong table found |
//! | `synthesis` | Yosys reads the Verilog without latch or undriven signal |
//! | `tables` | images of tables between frames: equality before, after, and while tables are not whole |
//! | `scenes` | the same equality for scenes of other shapes, degrees, words and conditions |
//! | `scan` | a scan by the hardware with modelled converters: equality, faults of the wires, seeded defects |
//! | `scale` | the largest array, and hundreds of random frames with stalls on both streams |
//! | `circles` | no two modules of a crate use one another, directly or through others; layers are in order |
//! | `versions` | the version is the same in all files that state it; the files from which pip installs have what is asked for |
//! | `words` | no file has a phrase of `tests/words.txt` |
//! | `lint` | the generated Verilog is clean under Verilator with its waivers, and every waiver is needed |

pub mod baseline;
pub mod readers;
pub mod tools;
mod variants;

use std::fmt::Display;
use std::path::PathBuf;

use dermis_cosim::drive::Stimulus;
use dermis_cosim::hardware::Hardware;
use dermis_cosim::simulator::Simulator;
use dermis_cosim::{run, DeviceUnderTest, Findings, Vector};
use dermis_golden::data::frame::Frame;
use dermis_golden::estimate::learned::{self, Training};
use dermis_golden::fixed::Model;
use dermis_golden::spec::scene::{EstimatorKind, Scene};
use dermis_hdl::generate;
use tempfile::NamedTempFile;
pub use variants::{nightly, variants};

/// Findings that a failed assertion shows.
const SHOWN: usize = 3;

/// A built-in scene and its shipped half-space frames.
///
/// # Panics
/// If the scene does not exist or has no frames; this crate holds tests only.
pub fn scene(name: &str) -> (Scene, Vec<Frame>) {
    let scene = Scene::builtin(name).expect("a built-in scene");
    let frames = Frame::shipped(&scene);
    assert!(!frames.is_empty(), "{name} has no frames");
    (scene, frames)
}

/// A scene whose μ comes from a network with hidden layers of these widths, which is hardly trained; `text` is the scene
/// without its estimator.
///
/// # Panics
/// If there is no such scene or network.
pub fn with_network(text: &str, hidden: &[usize]) -> (Scene, NamedTempFile) {
    let mut scene = Scene::parse(text, "network.toml").expect("a scene");
    scene.search.estimator = Some(EstimatorKind::EvidenceNetwork);
    learned::with_network(scene, &Training::trial(hidden)).expect("a network")
}

/// The Verilog of a scene's engine without its comments, which name stages that a scene may lack.
///
/// # Panics
/// If no hardware can be generated.
pub fn verilog_code(scene: &Scene) -> String {
    let generated = generate(&Model::new(scene).expect("a model")).expect("hardware");
    let lines = generated.files[0].text.lines().filter(|line| !line.trim_start().starts_with("//"));
    lines.collect::<Vec<_>>().join("\n")
}

/// The workspace's build folder; libraries that `make run` has built are used here too.
pub fn build_dir() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../build")
}

/// Differences between `vectors` and a new device of `simulator`: of all stages, where the simulator shows them.
///
/// # Panics
/// If the device cannot be built.
pub fn compare(hardware: &Hardware, simulator: Simulator, vectors: &[Vector], stimulus: Stimulus) -> Findings {
    let mut device = hardware.device_for(simulator, vectors, 1).expect("a device");
    let (taps, vectors) = hardware.observable(simulator, vectors);
    let dut = DeviceUnderTest { name: simulator.name(), device: device.as_mut(), taps: &taps };
    run(dut, &vectors, stimulus).0
}

/// Asserts that nothing differs; `what` names what was compared.
///
/// # Panics
/// With the first differences.
pub fn assert_equal(findings: &Findings, what: impl Display) {
    let first: Vec<String> = findings.kept.iter().take(SHOWN).map(ToString::to_string).collect();
    assert!(findings.is_equal(), "{what}: {} {first:#?}", findings.count);
}

/// Number of trials of a test: the value of an environment variable, else the default of a normal run.
///
/// # Panics
/// If the variable is not a number.
pub fn wanted(variable: &str, short: u64) -> u64 {
    std::env::var(variable).map_or(short, |text| text.parse().unwrap_or_else(|_| panic!("{variable}: a number")))
}

/// Asserts that the slowest frame took as many cycles from the last input to the last output beat as `baselines/cycles.csv`
/// has for this `line`.
///
/// # Panics
/// If it took more or fewer.
pub fn check_cycles(line: &str, latencies: impl Iterator<Item = Option<u64>>) {
    let slowest = latencies.map(|latency| latency.expect("a complete frame")).max().expect("a frame");
    baseline::check("cycles", &[(line.to_owned(), slowest as f64)], |was, is, _| is == was);
}
