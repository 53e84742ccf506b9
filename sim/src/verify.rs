//! One scene's co-simulation: every frame through the golden model, the bit-true model and the
//! simulated hardware, and how they differ.
//!
//! ```text
//! frame -> golden ------------------------------> Reconstruction --+
//!       -> bit-true model --> Trace, Reconstruction ---------------+--> FrameResult
//!       -> Verilator: full speed, then stalls --> Findings, Times -+
//!       -> rust-hdl: full speed ----------------> Findings --------+
//!       -> netlist, when asked for: full speed -> Findings --------+
//! ```

use std::path::Path;

use anyhow::Result;
use dermis_golden::board::Board;
use dermis_golden::fixed::Model;
use dermis_golden::frame::Frame;
use dermis_golden::quantise::full_scale;
use dermis_golden::reconstruct::{Golden, Reconstruction};
use dermis_golden::scene::Scene;

use crate::compare::{comparable_forces, difference, Difference};
use crate::cosim::{run, DeviceUnderTest, Findings, Vector};
use crate::drive::{Stimulus, Times};
use crate::hardware::{Hardware, Simulator};
use crate::progress::Progress;

/// Of the stalls; any number serves, a fixed one repeats.
const SEED: u64 = 1;

/// One frame's outcome.
#[derive(Clone, Debug)]
pub struct FrameResult {
    /// Frame name.
    pub frame: String,
    /// Stress of the largest code, MPa.
    pub full_scale_MPa: f64,
    /// The floating-point result.
    pub golden: Reconstruction,
    /// The bit-true result, which the hardware's equals when `equal`.
    pub fixed: Reconstruction,
    /// Of `fixed` against `golden`.
    pub difference: Difference,
    /// Whether no run differed from the bit-true model on this frame.
    pub equal: bool,
    /// Cycles at full speed.
    pub times: Times,
}

/// One scene's outcome.
#[derive(Clone, Debug)]
pub struct Verified {
    /// The scene.
    pub scene: Scene,
    /// Its board.
    pub board: Board,
    /// Per frame, in the given order.
    pub rows: Vec<FrameResult>,
    /// All mismatches of all runs.
    pub findings: Findings,
    /// Every run, for example `verilator, full speed`.
    pub runs: Vec<String>,
    /// Whether a run was one of the generated Verilog or of its netlist.
    pub verilog: bool,
}

/// Co-simulates `frames` (at least one) on the given simulators; cycles come from the first.
///
/// # Errors
/// A scene that cannot be built, a frame of another sensor, no Verilator.
pub fn verify(scene: &Scene, frames: &[Frame], simulators: &[Simulator], build: &Path) -> Result<Verified> {
    let board = Board::load(&scene.hardware.board)?;
    let hardware = Hardware::new(Model::for_frames(scene, frames)?, build)?;
    // With the full scale that the model has settled on: all models judge the same codes.
    let golden = Golden::new(&hardware.model.scene)?;
    let vectors =
        frames.chunks(1 << scene.input.average).map(|frames| hardware.vector(frames)).collect::<Result<Vec<_>>>()?;

    let mut verified = Verified {
        scene: scene.clone(),
        board,
        rows: Vec::new(),
        findings: Findings::default(),
        runs: Vec::new(),
        verilog: simulators.iter().any(|&simulator| simulator != Simulator::RustHdl),
    };
    let mut times: Vec<Times> = Vec::new();
    for &simulator in simulators {
        let seen = simulate(&hardware, simulator, &vectors, &mut verified)?;
        if times.is_empty() {
            times = seen;
        }
    }
    for (index, ((frames, vector), times)) in
        frames.chunks(1 << scene.input.average).zip(&vectors).zip(times).enumerate()
    {
        let frame = &hardware.model.stress(frames)?;
        let full_scale_MPa = full_scale(&hardware.model.scene, frame);
        let golden = golden.run_averaged(frames)?;
        let fixed = hardware.model.decode(frame, "fixed", &vector.expected.beats, &vector.expected.status)?;
        let lsb_N = hardware.model.force_lsb_N(full_scale_MPa);
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

/// All runs on one simulator; returns the times at full speed.
fn simulate(
    hardware: &Hardware,
    simulator: Simulator,
    vectors: &[Vector],
    verified: &mut Verified,
) -> Result<Vec<Times>> {
    let stimuli: &[Stimulus] = match simulator {
        Simulator::Verilator => &[Stimulus::FullSpeed, Stimulus::Stalls { seed: SEED }],
        Simulator::RustHdl | Simulator::Netlist => &[Stimulus::FullSpeed],
    };
    let mut device = hardware.device(simulator)?;
    let (taps, vectors) = hardware.observable(simulator, vectors);
    let mut full_speed = Vec::new();
    for &stimulus in stimuli {
        let label = format!("{}, {stimulus}", simulator.name());
        let _progress = Progress::start(&format!("{}: {label}", verified.scene.name));
        let dut = DeviceUnderTest { name: simulator.name(), device: device.as_mut(), taps: &taps };
        let (findings, times) = run(dut, &vectors, stimulus);
        verified.findings.extend(findings);
        verified.runs.push(label);
        if stimulus == Stimulus::FullSpeed {
            full_speed = times;
        }
    }
    Ok(full_speed)
}
