//! `dermis study sensor-faults`: frames that a sensor's faults spoil, flagged or silently wrong, by every engine.

use anyhow::Result;
use clap::{value_parser, Args};
use dermis_study::sensor_faults::SensorFaults;

use dermis_report::study::sensor_faults;

/// Arguments of `dermis study sensor-faults`.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  dermis study sensor-faults                         sensor-1 and eight-by-eight, every fault and size: minutes
  dermis study sensor-faults my-scene.toml --quick   one size of each fault
  dermis study sensor-faults eight-by-eight --fault clipped --fault deadband --frames 1
  dermis study sensor-faults sensor-1-noisy --noise 0.002 --json

A press is drawn, grows in a stream of 12 frames, and is spoiled. The engines get the last frame alone (frame) or after the
others (stream): the golden model without and with its noise stated, then 0.05 % of the peak unless --noise says otherwise, and
the bit-true model, with the search and, where the scene names one, with its network, as sensor-1-noisy has it. A flag that an
engine raises on every clean frame of the scene does not count.")]
pub struct Arguments {
    /// Built-in names or paths of scenes; default: sensor-1, eight-by-eight.
    scenes: Vec<String>,
    /// Presses of each scene.
    #[arg(long, default_value_t = 6, value_parser = value_parser!(u32).range(1..=100_000))]
    frames: u32,
    /// Seed of presses, noise and faults.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Standard deviation of the noise over the largest stress, from 0 to 1.
    #[arg(long, value_name = "SHARE", default_value_t = 0.0)]
    noise: f64,
    /// Only this fault, by its name in the table; repeatable.
    #[arg(long = "fault", value_name = "NAME")]
    faults: Vec<String>,
    /// One size of each fault.
    #[arg(long)]
    quick: bool,
    /// Print JSON and nothing else.
    #[arg(long)]
    json: bool,
}

/// The study's tables, or JSON.
///
/// # Errors
/// A scene that cannot be loaded or is refused, a number out of range, a fault that does not exist.
pub fn run(arguments: &Arguments) -> Result<String> {
    let Arguments { scenes, frames, seed, noise, faults, quick, json } = arguments;
    let (frames, only) = (*frames as usize, faults.clone());
    sensor_faults::run(scenes, &SensorFaults { frames, seed: *seed, noise: *noise, only, quick: *quick }, *json)
}
