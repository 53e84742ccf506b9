//! `dermis stress`: the generated Verilog's two streams under gaps, back-pressure, wrong `tlast` and resets.
//!
//! | experiment | what happens | what must hold |
//! |---|---|---|
//! | `stalls` | frames back to back, both sides paced in many ways, now and then one at full speed alone | every whole frame leaves once, in order, equal to the bit-true model; alone, every beat in its promised cycle |
//! | `tlast` | every other frame's `tlast` is early, missing, doubled or late, at random pace | what a wrong one cuts is dropped, the next frame that leaves carries the flag, once |
//! | `reset` | a reset at a cycle of a frame, held from one cycle to as long as a frame takes | nothing leaves of what was inside; the next frame is right, unflagged and in time |
//!
//! Each experiment takes about the asked number of cycles; resets end earlier, with one at each cycle of a frame. What a
//! wrong `tlast` does is `stress/scoreboard.rs`'s to say.

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

/// What to try.
#[derive(Args, Debug)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    /// Built-in names or paths of scenes.
    #[arg(default_value = "sensor-1")]
    scenes: Vec<String>,
    /// Cycles of each experiment.
    #[arg(long, value_name = "N", default_value_t = 1_000_000)]
    cycles: u64,
    /// Of pace, codes, errors and resets.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Print the outcomes as JSON and nothing else.
    #[arg(long)]
    json: bool,
}

const EXAMPLES: &str = "Examples:
  dermis stress                                      gaps, wrong tlast and resets, sensor-1
  dermis stress eight-by-eight --cycles 50000 --seed 7 --json";

/// What one experiment did and found.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Outcome {
    /// The scene.
    pub scene: String,
    /// `stalls`, `tlast` or `reset`.
    pub experiment: &'static str,
    /// Clock cycles run.
    pub cycles: u64,
    /// Cycles in which nothing was offered to a device that was ready, or a beat of the device was kept waiting.
    pub stalled: u64,
    /// Whole frames that the device took and that no reset swept away.
    pub frames_in: u64,
    /// Frames that left, each of them right where there is no violation.
    pub frames_out: u64,
    /// Of these, frames alone at full speed, whose every beat was asked for its cycle.
    pub timed: u64,
    /// Beats whose `tlast` was wrong.
    pub wrong_tlast: u64,
    /// Frames cut short, which leave nothing.
    pub cut: u64,
    /// Frames out with the framing flag, as they must.
    pub flagged: u64,
    /// Resets.
    pub resets: u64,
    /// Cycles of a frame at full speed, where a reset may fall.
    #[serde(rename = "reset_places")]
    pub possible_reset_cycles: u64,
    /// Longest reset in cycles.
    pub longest_reset: u64,
    /// How often something was other than it must.
    pub violations: u64,
    /// The first of them.
    pub first: Vec<Violation>,
}

/// Runs all experiments on the hardware's Verilog, with the codes of `frames` and drawn ones.
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

/// Frames back to back; the pace changes every few frames.
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

/// Every other frame has a wrong `tlast`.
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

/// What the report keeps of an experiment.
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

/// The outcomes as text, and whether nothing was violated; the counts stay in the build folder for the report.
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
        // Of the time together each experiment has its share by its cycles.
        let per_cycle = begun.elapsed().as_secs_f64() / cycles.max(1) as f64;
        log.targets.extend(own.iter().map(|outcome| target_counts(outcome, per_cycle * outcome.cycles as f64)));
        outcomes.extend(own);
    }
    log.save(build, "stress")?;
    let good = outcomes.iter().all(|outcome| outcome.violations == 0);
    let text = if arguments.json { serde_json::to_string(&outcomes)? + "\n" } else { report::stress(&outcomes) };
    Ok((text, good))
}
