//! `dermis study devices`: time and energy of a frame on CPU, microcontroller and FPGA.

use std::path::{Path, PathBuf};

use anyhow::Result;
use clap::{value_parser, Args};

use dermis_report::measure::{DeviceOptions, DEVICE_FRAMES};
use dermis_report::study::devices;

/// Arguments of `dermis study devices`.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  dermis study devices                               search, network, contacts, and evidence on the CPU: minutes
  dermis study devices my-scene.toml --frames 2000
  dermis study devices sensor-1 --python build/python/bin/python     beside NumPy and SciPy
  dermis study devices eight-by-eight --frames 10 --no-power --json

Times of the CPU are of one core of this machine: median of the frames while nothing else is started, and the time that 99.9 % of
them do not exceed while a thread per core computes something else. Microcontrollers run the C of dermis build --target c in QEMU,
which counts instructions. The FPGA's cycles are exact, at the clock of place and route where the scene has a baseline.")]
pub struct Arguments {
    /// Built-in names or paths of scenes; default: sensor-1, sensor-1-noisy, eight-by-eight-contacts.
    scenes: Vec<String>,
    /// Frames of each row of the CPU.
    #[arg(long, default_value_t = DEVICE_FRAMES, value_parser = value_parser!(u32).range(1..=1_000_000))]
    frames: u32,
    /// Interpreter with NumPy and SciPy, which solve Eq. 1 beside the others.
    #[arg(long, value_name = "FILE")]
    python: Option<PathBuf>,
    /// Do not simulate the hardware for its energy, which takes minutes.
    #[arg(long)]
    no_power: bool,
    /// Draw the times into this SVG file.
    #[arg(long, value_name = "FILE")]
    picture: Option<PathBuf>,
    /// Print JSON and nothing else.
    #[arg(long)]
    json: bool,
}

/// The study's table, or JSON.
///
/// # Errors
/// A scene that cannot be loaded or is refused, an interpreter or a simulation that fails.
pub fn run(arguments: &Arguments, build: &Path) -> Result<String> {
    let Arguments { scenes, frames, python, no_power, picture, json } = arguments;
    let (frames, power) = (*frames as usize, !no_power);
    let options = DeviceOptions { frames, python: python.clone(), power, build: build.to_owned() };
    devices::run(scenes, &options, picture.as_deref(), *json)
}
