//! Power of the engine, estimated from the register bits that change in the simulated Verilog.
//!
//! Frames that follow one another back to back are simulated, and the changes of every register bit are counted by stage.
//! With the energies of the board's device ([`Power`]), each a range:
//!
//! | part | energy |
//! |---|---|
//! | logic of a stage, per frame | `toggle_pJ` for each bit that changes; glitches are in the upper figure |
//! | its multipliers and block RAMs, per frame | `product_pJ`, `block_ram_pJ` for each of them and each time that half of the stage's register bits have changed, which is what random words do in a cycle |
//! | clock, per cycle, also at rest | `clock_pJ` for each register bit |
//! | static | by the device |
//!
//! Without pins, link and oscillator.

use anyhow::{anyhow, bail, Result};
use dermis_golden::data::frame::Frame;
use dermis_golden::spec::board::{Board, Power};
use dermis_hdl::device::Device;
use dermis_hdl::state::{StateElement, StorageClass};
use serde::Serialize;

use super::against_model::Vector;
use super::drive::{record, InputFrame, Stimulus};
use super::hardware::{Hardware, WATCHDOG};
use super::toggles::ToggleCounter;
use super::verilator::Optimisation;

/// Frames simulated at least; fewer are repeated.
const FEWEST: usize = 4;
/// Rate that touch control needs, frames per second.
const TOUCH_RATE: f64 = 1000.0;
/// Share of the bits of a random word that change from one to the next.
const RANDOM: f64 = 0.5;

/// A lower and an upper estimate.
type Range = [f64; 2];

/// Changes of a stage's register bits.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StageToggles {
    /// Stage by its name in the hardware; `engine` for what belongs to no stage.
    pub stage: &'static str,
    /// Number of register bits.
    pub register_bits: usize,
    /// Bits that change per frame, mean over the frames.
    pub toggles: f64,
}

/// Changes of all register bits.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Toggles {
    /// By stage in the order of the data flow.
    pub stages: Vec<StageToggles>,
    /// Cycles from one frame to the next, mean.
    pub interval: f64,
    /// Number of frames simulated.
    pub frames: usize,
}

/// Power at a rate of frames.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Rate {
    /// `1 kHz` or `back to back`.
    pub name: &'static str,
    /// Frames per second.
    pub frames_per_second: f64,
    /// Power, mW.
    pub power_mW: Range,
    /// Energy per frame, static and clock included, µJ.
    pub frame_uJ: Range,
}

/// The estimate for an engine on its board.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PowerEstimate {
    /// Name of the scene.
    pub scene: String,
    /// The board's device.
    pub device: String,
    /// Clock of the engine, MHz.
    pub clock_MHz: f64,
    /// What changes.
    pub toggles: Toggles,
    /// Energy of each stage per frame, nJ, in the order of `toggles`.
    pub stages_nJ: Vec<Range>,
    /// Power of the clock, mW.
    pub clock_mW: Range,
    /// Static power, mW.
    pub static_mW: Range,
    /// At 1 kHz, where the engine is that fast, and back to back.
    pub rates: Vec<Rate>,
    /// Where the energies come from.
    pub source: String,
}

/// Counts the changes of all register bits over `frames` back to back.
///
/// # Errors
/// No frame, one of another sensor, no Verilator, a design that stops.
pub fn count_toggles(hardware: &Hardware, frames: &[Frame]) -> Result<Toggles> {
    let vectors = hardware.vectors(frames)?;
    let Some(first) = vectors.first() else { bail!("scene {}: no frame", hardware.model.scene.name) };
    let mut device = hardware.device_with_open_state(Optimisation::Off)?;
    // Registers that are never reset have random values until the first frame.
    run(&mut device, std::slice::from_ref(first))?;
    let repeated: Vec<Vector> = vectors.iter().cycle().take(vectors.len().max(FEWEST)).cloned().collect();
    let mut counter = ToggleCounter::new(&mut device, registers_of(hardware))?;
    let interval = run(&mut counter, &repeated)?;
    let counts: Vec<(&StateElement, u64)> = registers_of(hardware).zip(counter.toggles()).collect();
    let stages = hardware.generated.usage.iter().map(|(stage, _)| {
        let own = || counts.iter().filter(|(register, _)| register.stage == *stage);
        StageToggles {
            stage,
            register_bits: own().map(|(register, _)| register.words * register.bits).sum(),
            toggles: own().map(|(_, toggles)| *toggles).sum::<u64>() as f64 / repeated.len() as f64,
        }
    });
    let stages = stages.filter(|own| own.register_bits > 0).collect();
    Ok(Toggles { stages, interval, frames: repeated.len() })
}

fn registers_of(hardware: &Hardware) -> impl Iterator<Item = &StateElement> {
    hardware.generated.state.iter().filter(|own| own.class == StorageClass::Register)
}

/// Sends the frames back to back; the mean cycles from the last beat of one to that of the next.
fn run(device: &mut dyn Device, vectors: &[Vector]) -> Result<f64> {
    let inputs: Vec<InputFrame> = vectors.iter().map(Vector::input).collect();
    let recording = record(device, 0, &inputs, Stimulus::BackToBack, WATCHDOG);
    if let Some(timeout) = recording.timeout {
        bail!("cycle {}: {}", timeout.cycle, timeout.rule);
    }
    let ends: Vec<u64> = recording.times.iter().filter_map(|times| times.last_out).collect();
    let cycles = ends.last().zip(ends.first()).map_or(0, |(last, first)| last - first);
    Ok(cycles as f64 / ends.len().saturating_sub(1).max(1) as f64)
}

/// Estimates the power of `hardware` on its board from the frames.
///
/// # Errors
/// As [`count_toggles`]; a device without energies.
pub fn estimate_power(hardware: &Hardware, frames: &[Frame]) -> Result<PowerEstimate> {
    let board = &hardware.model.board;
    let (device, power) = energies(board)?;
    let toggles = count_toggles(hardware, frames)?;
    let static_power = power.static_mW(device).ok_or_else(|| no_energies(board))?;
    let large = |stage: &str| {
        let memories = hardware.generated.memories.iter().filter(|memory| memory.stage(board.engine) == stage);
        memories.map(|memory| memory.planned.large_rams).sum::<usize>()
    };
    let stages = toggles.stages.iter().map(|stage| {
        let usage = hardware.generated.usage.iter().find(|(name, _)| *name == stage.stage);
        let (multipliers, block_rams) = usage.map_or((0, 0), |(_, usage)| (usage.multipliers, usage.block_rams));
        let busy = (stage.toggles / (RANDOM * stage.register_bits as f64)).min(toggles.interval);
        std::array::from_fn(|k| {
            let words = (block_rams + large(stage.stage)) as f64 * power.block_ram_pJ[k];
            (stage.toggles * power.toggle_pJ[k] + busy * (multipliers as f64 * power.product_pJ[k] + words)) / 1e3
        })
    });
    let stages_nJ: Vec<Range> = stages.collect();
    let bits: usize = toggles.stages.iter().map(|stage| stage.register_bits).sum();
    // 1 pJ at 1 MHz is 1 µW.
    let clock_mW = power.clock_pJ.map(|energy| bits as f64 * energy * board.clock_MHz / 1e3);
    let fastest = board.clock_MHz * 1e6 / toggles.interval;
    let rates = [("1 kHz", TOUCH_RATE), ("back to back", fastest)].into_iter().filter(|(_, rate)| *rate <= fastest);
    let rates = rates.map(|(name, rate)| {
        // 1 nJ at 1 Hz is 1e-6 mW.
        let frames = |k: usize| stages_nJ.iter().map(|stage_nJ| stage_nJ[k]).sum::<f64>() * rate / 1e6;
        let power_mW = std::array::from_fn(|k| static_power[k] + clock_mW[k] + frames(k));
        Rate { name, frames_per_second: rate, power_mW, frame_uJ: power_mW.map(|power| 1e3 * power / rate) }
    });
    Ok(PowerEstimate {
        scene: hardware.model.scene.name.clone(),
        device: device.to_owned(),
        clock_MHz: board.clock_MHz,
        rates: rates.collect(),
        stages_nJ,
        clock_mW,
        static_mW: static_power,
        toggles,
        source: power.source,
    })
}

/// Device and energies of a board.
///
/// # Errors
/// A board whose device has no energies.
pub fn energies(board: &Board) -> Result<(&str, Power)> {
    let power = board.power()?.filter(|power| board.device.as_ref().is_some_and(|own| power.static_mW(own).is_some()));
    board.device.as_deref().zip(power).ok_or_else(|| no_energies(board))
}

fn no_energies(board: &Board) -> anyhow::Error {
    let device = board.device.as_deref().unwrap_or("no device");
    anyhow!("{}: {device}: no energies of its resources are known, which an estimate of power needs", board.file())
}
