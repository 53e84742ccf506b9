//! `dermis stress`: tests the two AXI streams of the generated Verilog with gaps, back-pressure, wrong `tlast` and
//! resets.
//!
//! | experiment | stimulus | requirement |
//! |---|---|---|
//! | `stalls` | frames back to back at changing valid and ready rates; now and then one frame alone at full speed | every frame leaves once, in order, equal to the bit-true model; alone, every beat in the model's cycle |
//! | `tlast` | every other frame has an early, missing, doubled or late `tlast`; random valid and ready rates | frames cut short are dropped; the next frame carries the framing flag, once |
//! | `reset` | a reset at a given cycle of a frame, held for one cycle up to a frame's time | no beat of the frames inside leaves; the next frame is right, without flag, and in time |
//!
//! Each experiment runs for about the requested number of cycles; `reset` ends earlier once every cycle of a frame has
//! had a reset. The expected effect of a wrong `tlast` is defined in `stress/scoreboard.rs`.

mod handshake_rates;
mod resets;
mod samples;
mod scoreboard;
mod testbench;

use std::path::Path;
use std::time::Instant;

use anyhow::Result;
use clap::Args;
use dermis_golden::fixed::Model;
use dermis_golden::frame::Frame;
use dermis_golden::scene::Scene;
use serde::Serialize;

pub(crate) use samples::{shipped_samples, synthetic_samples, Sample};
pub use scoreboard::Violation;

use crate::hardware::{Hardware, Simulator};
use crate::progress::Progress;
use crate::report;
use crate::run_log::{RunLog, TargetCounts};
use handshake_rates::HandshakeRates;
use testbench::{Burst, Testbench, RESET_CYCLES};

/// Arguments of `dermis stress`.
#[derive(Args, Debug)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    /// Built-in names or paths of scenes.
    #[arg(default_value = "sensor-1")]
    scenes: Vec<String>,
    /// Cycles of each experiment.
    #[arg(long, value_name = "N", default_value_t = 1_000_000)]
    cycles: u64,
    /// Seed of rates, codes, wrong tlast and resets.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Print the outcomes as JSON and nothing else.
    #[arg(long)]
    json: bool,
}

const EXAMPLES: &str = "Examples:
  dermis stress                                      gaps, wrong tlast and resets on sensor-1
  dermis stress eight-by-eight --cycles 50000 --seed 7 --json";

/// Counts of one experiment.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Outcome {
    /// Scene name.
    pub scene: String,
    /// `stalls`, `tlast` or `reset`.
    pub experiment: &'static str,
    /// Clock cycles simulated.
    pub cycles: u64,
    /// Cycles in which the device was ready without input, or had a beat waiting for ready.
    pub stalled: u64,
    /// Complete frames accepted and not discarded by a reset.
    pub frames_in: u64,
    /// Frames delivered.
    pub frames_out: u64,
    /// Of these, frames alone at full speed, for which the cycle of every beat was checked.
    pub timed: u64,
    /// Input beats with a wrong `tlast`.
    pub wrong_tlast: u64,
    /// Frames cut short by an early `tlast`, which deliver nothing.
    pub cut: u64,
    /// Frames delivered with the framing flag, as expected.
    pub flagged: u64,
    /// Number of resets.
    pub resets: u64,
    /// Number of cycles of a frame at full speed, at each of which a reset can start.
    #[serde(rename = "reset_places")]
    pub possible_reset_cycles: u64,
    /// Longest reset in cycles.
    pub longest_reset: u64,
    /// Number of violated requirements.
    pub violations: u64,
    /// The first violations.
    pub first: Vec<Violation>,
}

/// Runs all experiments on the hardware's Verilog, with the codes of `frames` and synthetic ones.
///
/// # Errors
/// No Verilator, a design that it refuses, or frames of another sensor.
pub fn stress(hardware: &Hardware, frames: &[Frame], cycles: u64, seed: u64) -> Result<Vec<Outcome>> {
    let mut random = fastrand::Rng::with_seed(seed);
    let mut samples = shipped_samples(&hardware.model, frames)?;
    samples.extend(synthetic_samples(&hardware.model, &mut random));
    let mut device = hardware.device(Simulator::Verilator)?;
    let mut outcomes = Vec::new();
    for experiment in ["stalls", "tlast", "reset"] {
        let mut bench = Testbench::new(device.as_mut(), &samples);
        bench.reset(RESET_CYCLES, &mut random);
        match experiment {
            "stalls" => stalls(&mut bench, &mut random, cycles),
            "tlast" => tlast(&mut bench, &mut random, cycles),
            _ => resets::resets(&mut bench, &mut random, cycles),
        }
        let scene = hardware.model.scene.name.clone();
        outcomes.push(Outcome { scene, experiment, ..bench.finish() });
    }
    Ok(outcomes)
}

/// Experiment `stalls`: frames back to back, with new valid and ready rates every few frames.
fn stalls(bench: &mut Testbench, random: &mut fastrand::Rng, cycles: u64) {
    while bench.can_continue() && bench.cycle() < cycles {
        let mut rates = HandshakeRates::random(random);
        for _ in 0..1 + random.usize(..6) {
            let sample = random.usize(..bench.sample_count());
            bench.send(&Burst::whole(bench.sample(sample), sample), &mut rates);
        }
        if random.u32(..8) == 0 {
            let sample = random.usize(..bench.sample_count());
            bench.send_alone(&Burst::whole(bench.sample(sample), sample));
        }
    }
    bench.drain(&mut HandshakeRates::full_speed());
}

/// Experiment `tlast`: every other frame on average has a wrong `tlast`.
fn tlast(bench: &mut Testbench, random: &mut fastrand::Rng, cycles: u64) {
    while bench.can_continue() && bench.cycle() < cycles {
        let mut rates = HandshakeRates::random(random);
        for _ in 0..1 + random.usize(..6) {
            let sample = random.usize(..bench.sample_count());
            let codes = bench.sample(sample);
            let burst = match random.u32(..8) {
                0 => Burst::cut(codes, sample, 1 + random.usize(..codes.codes.len() - 1)),
                1 => Burst::missing(codes, sample),
                2 => Burst::doubled(codes, sample),
                3 => Burst::late(codes, sample),
                _ => Burst::whole(codes, sample),
            };
            bench.send(&burst, &mut rates);
        }
    }
    bench.drain(&mut HandshakeRates::full_speed());
}

/// The counts of an experiment for the run log.
fn target_counts(outcome: &Outcome, seconds: f64) -> TargetCounts {
    let counts = [
        ("frames out", outcome.frames_out),
        ("wrong tlast", outcome.wrong_tlast),
        ("frames cut short", outcome.cut),
        ("frames flagged", outcome.flagged),
        ("resets", outcome.resets),
        ("violations", outcome.violations),
    ];
    TargetCounts::new(format!("{}, {}", outcome.scene, outcome.experiment), "cycles", outcome.cycles, counts, seconds)
}

/// Runs the command: the outcomes as text, and whether there was no violation. The counts are saved in the build folder
/// for the report.
///
/// # Errors
/// An unknown scene, one without hardware, no Verilator.
pub fn run(arguments: &Arguments, build: &Path) -> Result<(String, bool)> {
    let mut outcomes = Vec::new();
    let Arguments { scenes, cycles, seed, .. } = arguments;
    let mut log = RunLog::new(&format!("dermis stress {} --cycles {cycles} --seed {seed}", scenes.join(" ")));
    for name in scenes {
        let scene = Scene::load(name)?;
        let frames = Frame::shipped(&scene);
        let hardware = Hardware::new(Model::for_frames(&scene, &frames)?, build)?;
        let _progress = Progress::start(&format!("{}: stress", scene.name));
        let begun = Instant::now();
        let own = stress(&hardware, &frames, *cycles, *seed)?;
        let cycles: u64 = own.iter().map(|outcome| outcome.cycles).sum();
        // Each experiment's share of the time is proportional to its cycles.
        let per_cycle = begun.elapsed().as_secs_f64() / cycles.max(1) as f64;
        log.targets.extend(own.iter().map(|outcome| target_counts(outcome, per_cycle * outcome.cycles as f64)));
        outcomes.extend(own);
    }
    log.save(build, "stress")?;
    let good = outcomes.iter().all(|outcome| outcome.violations == 0);
    let text = if arguments.json { serde_json::to_string(&outcomes)? + "\n" } else { report::stress(&outcomes) };
    Ok((text, good))
}
