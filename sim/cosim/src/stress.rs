//! Tests the two AXI streams of the generated Verilog with gaps, back-pressure, wrong `tlast` and
//! resets.
//!
//! | experiment | stimulus | requirement |
//! |---|---|---|
//! | `stalls` | frames back to back at changing valid and ready rates; now and then one frame alone at full speed | every frame leaves once, in order, equal to the bit-true model; alone, every beat in the model's cycle |
//! | `tlast` | every other frame has an early, missing, doubled or late `tlast`; random valid and ready rates | frames cut short are dropped; the next frame carries the framing flag, once |
//! | `tables` | with writable tables: frames and images of tables, half of them damaged, too short or long, for other hardware, inside a frame, broken off by a frame or a reset | every frame leaves once, with the forces of the tables of its time, their version and state |
//! | `reset` | a reset at a given cycle of a frame, held for one cycle up to a frame's time | no beat of the frames inside leaves; the next frame is right, without flag, and in time |
//!
//! Where the engine serves several arrays, every frame is of one drawn at random.
//!
//! Each experiment runs for about the requested number of cycles; `reset` ends earlier once every cycle of a frame has
//! had a reset. The expected effect of a wrong `tlast` is defined in `stress/scoreboard.rs`.

mod handshake_rates;
mod outcome;
mod resets;
mod samples;
mod scoreboard;
mod tables;
mod testbench;

use anyhow::Result;
use dermis_golden::data::frame::Frame;

pub use outcome::{Outcome, Violation};
pub(crate) use samples::{shipped_samples, synthetic_samples, Sample};

use super::hardware::Hardware;
use super::simulator::Simulator;
use handshake_rates::HandshakeRates;
use testbench::{Burst, Testbench, RESET_CYCLES};

/// Runs all experiments on the hardware's Verilog, with the codes of `frames` and synthetic ones.
///
/// # Errors
/// No Verilator, a design that it refuses, or frames of another sensor.
pub fn stress(hardware: &Hardware, frames: &[Frame], cycles: u64, seed: u64) -> Result<Vec<Outcome>> {
    let mut random = fastrand::Rng::with_seed(seed);
    let mut samples = shipped_samples(&hardware.model, frames)?;
    samples.extend(synthetic_samples(&hardware.model, &mut random));
    let mut device = hardware.device(Simulator::Verilator)?;
    let arrays = 0..hardware.model.scene.hardware.arrays;
    let models = arrays.map(|array| hardware.model.of_array(array)).collect::<Result<Vec<_>, _>>()?;
    let mut outcomes = Vec::new();
    let all = ["stalls", "tlast", "reset", "tables"];
    let written = hardware.model.has_writable_tables();
    for experiment in all.into_iter().filter(|experiment| *experiment != "tables" || written) {
        let mut bench = Testbench::new(device.as_mut(), &models, &samples);
        bench.reset(RESET_CYCLES, &mut random);
        match experiment {
            "stalls" => stalls(&mut bench, &mut random, cycles),
            "tlast" => tlast(&mut bench, &mut random, cycles),
            "tables" => tables::tables(&mut bench, &hardware.model, &mut random, cycles),
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
            bench.send(&bench.any(random), &mut rates);
        }
        if random.u32(..8) == 0 {
            bench.send_alone(&bench.any(random));
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
            bench.send(&burst.of_array(random.usize(..bench.arrays())), &mut rates);
        }
    }
    bench.drain(&mut HandshakeRates::full_speed());
}
