//! Co-simulation of one scene: every frame through the golden model, the bit-true model and the simulated hardware,
//! with their differences.
//!
//! ```text
//! frame -> golden ------------------------------> Reconstruction --+
//!       -> bit-true model --> Trace, Reconstruction ---------------+--> FrameResult
//!       -> Verilator: full speed, back to back, with stalls --> Findings, Times -+
//!       -> kernel: full speed ----------------> Findings --------+
//!       -> netlist, on request: full speed -----> Findings --------+
//! ```

use std::path::Path;

use anyhow::Result;
use dermis_golden::data::frame::Frame;
use dermis_golden::data::reception::full_scale;
use dermis_golden::fixed::plan::contact_cycles::ContactTiming;
use dermis_golden::fixed::plan::interval::{self, frame_interval};
use dermis_golden::fixed::Model;
use dermis_golden::result::reconstruct::Reconstruction;
use dermis_golden::spec::board::Board;
use dermis_golden::spec::scene::Scene;

use super::against_model::{run, DeviceUnderTest, Vector};
use super::array_frames::{ArrayFrames, ArrayResult};
use super::drive::{Stimulus, Times};
use super::findings::Findings;
use super::hardware::Hardware;
use super::simulator::Simulator;
use crate::compare::{comparable_forces, difference, Difference};
use dermis_flow::progress::Progress;

/// Seed of the stalls, fixed so that runs are reproducible.
const SEED: u64 = 1;

/// Result of one frame, or of the mean of several.
#[derive(Clone, Debug)]
pub struct FrameResult {
    /// Frame name.
    pub frame: String,
    /// Stress of the largest code, MPa.
    pub full_scale_MPa: f64,
    /// The floating-point result.
    pub golden: Reconstruction,
    /// The bit-true result; the hardware's as well where `equal` is set.
    pub fixed: Reconstruction,
    /// Difference of `fixed` from `golden`.
    pub difference: Difference,
    /// Whether every run equalled the bit-true model on this frame.
    pub equal: bool,
    /// Cycles at full speed.
    pub times: Times,
}

/// Result of one scene.
#[derive(Clone, Debug)]
pub struct Verified {
    /// The scene.
    pub scene: Scene,
    /// Its board.
    pub board: Board,
    /// Results of the frames, in the given order.
    pub rows: Vec<FrameResult>,
    /// Mismatches of all runs.
    pub findings: Findings,
    /// Longest distance of two frames' last output beats where frames follow one another without a gap, in cycles;
    /// `None` without Verilator or with fewer than three frames.
    pub frame_interval: Option<u64>,
    /// The same by the model, for frames of which every subarray is searched, with the contacts of these frames where each has
    /// a μ of its own.
    pub planned_interval: u64,
    /// Labels of the runs, for example `verilator, full speed`.
    pub runs: Vec<String>,
    /// Whether at least one run simulated the generated Verilog or its netlist.
    pub verilog: bool,
}

/// Co-simulates `frames` (at least one) on the given simulators; cycles are those of the first simulator.
///
/// # Errors
/// A scene that cannot be built, a frame of another sensor, no Verilator.
pub fn verify(scene: &Scene, frames: &[Frame], simulators: &[Simulator], build: &Path) -> Result<Verified> {
    verify_specimen(scene, None, frames, simulators, build)
}

/// As [`verify`]; the hardware of `scene` takes the tables of `specimen` first, if there is one, whose frames follow.
///
/// # Errors
/// As [`verify`], and for tables that the hardware does not take.
pub fn verify_specimen(
    scene: &Scene,
    specimen: Option<&Scene>,
    frames: &[Frame],
    simulators: &[Simulator],
    build: &Path,
) -> Result<Verified> {
    let board = Board::load(scene.hardware.board_name())?;
    let mut hardware = Hardware::new(Model::for_frames(scene, frames)?, build)?;
    if let Some(specimen) = specimen {
        hardware.load(specimen, 1)?;
    }
    let arrays = ArrayFrames::all(&hardware.model, frames)?;
    // Of the models' scenes, which have the full scale filled in, so that both use the same codes.
    let references = arrays.iter().map(|own| own.model.reference()).collect::<Result<Vec<_>, _>>()?;
    let results = ArrayFrames::results(&arrays);
    let vectors = results.iter().map(|result| result.vector()).collect::<Result<Vec<_>>>()?;

    let mut verified = Verified {
        scene: scene.clone(),
        board,
        rows: Vec::new(),
        findings: Findings::default(),
        frame_interval: None,
        planned_interval: planned_interval(&hardware.model, &vectors),
        runs: Vec::new(),
        verilog: simulators.iter().any(|&simulator| simulator != Simulator::Kernel),
    };
    let mut times: Vec<Times> = Vec::new();
    for &simulator in simulators {
        let seen = simulate(&hardware, simulator, &vectors, &mut verified)?;
        if times.is_empty() {
            times = seen;
        }
    }
    for (index, ((result, vector), times)) in results.into_iter().zip(&vectors).zip(times).enumerate() {
        let ArrayResult { array, model, frames } = result;
        let frame = &model.stress(frames)?;
        let full_scale_MPa = full_scale(&model.scene, frame);
        let golden = references[array].run_averaged(frames)?;
        let fixed = model.decode(frames, "fixed", &vector.expected.beats, &vector.expected.status)?;
        let lsb_N = model.force_lsb_N(full_scale_MPa);
        verified.rows.push(FrameResult {
            frame: frame.id.clone(),
            full_scale_MPa,
            difference: difference(&comparable_forces(&golden), &comparable_forces(&fixed), lsb_N),
            golden,
            fixed,
            equal: !verified.findings.unequal.contains(&index),
            times,
        });
    }
    Ok(verified)
}

/// Runs the vectors on one simulator at full speed, and with stalls under Verilator; returns the times at full speed.
fn simulate(
    hardware: &Hardware,
    simulator: Simulator,
    vectors: &[Vector],
    verified: &mut Verified,
) -> Result<Vec<Times>> {
    let stimuli: &[Stimulus] = match simulator {
        Simulator::Verilator => &[Stimulus::FullSpeed, Stimulus::BackToBack, Stimulus::Stalls { seed: SEED }],
        Simulator::Kernel | Simulator::Netlist => &[Stimulus::FullSpeed],
    };
    let mut device = hardware.device_for(simulator, vectors, stimuli.len())?;
    let image = hardware.image();
    let images = image.iter().len();
    let all: Vec<Vector> = image.into_iter().chain(vectors.iter().cloned()).collect();
    let (taps, vectors) = hardware.observable(simulator, &all);
    let mut full_speed = Vec::new();
    for &stimulus in stimuli {
        let label = format!("{}, {stimulus}", simulator.name());
        let _progress = Progress::start(&format!("{}: {label}", verified.scene.name));
        let dut = DeviceUnderTest { name: simulator.name(), device: device.as_mut(), taps: &taps };
        let (findings, mut times) = run(dut, &vectors, stimulus);
        verified.findings.extend(findings.without_first(images));
        times.drain(..images);
        verified.runs.push(label);
        match stimulus {
            Stimulus::FullSpeed => full_speed = times,
            Stimulus::BackToBack => verified.frame_interval = longest_interval(&times),
            Stimulus::Stalls { .. } => {}
        }
    }
    Ok(full_speed)
}

/// The interval of the model for these vectors.
fn planned_interval(model: &Model, vectors: &[Vector]) -> u64 {
    let timings: Option<Vec<ContactTiming>> = vectors.iter().map(|vector| vector.expected.timing).collect();
    let own = timings.and_then(|timings| interval::longest_interval(model, &timings));
    own.unwrap_or_else(|| frame_interval(model, model.first()))
}

/// The longest distance of two frames' last output beats, from the second frame on: the first finds an idle device.
fn longest_interval(times: &[Times]) -> Option<u64> {
    times
        .iter()
        .skip(1)
        .zip(times.iter().skip(2))
        .map(|(one, next)| Some(next.last_out? - one.last_out?))
        .max()
        .flatten()
}
