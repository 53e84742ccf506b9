//! `dermis study`: comparisons that the guide shows, each one table.

use std::path::Path;

use anyhow::Result;
use clap::{Args, Subcommand};

use super::{blind_gains, devices, sensor_faults};
use dermis_report::study::{contacts, dead_taxels, input_bits, link_times};

/// What to compare.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  dermis study input-bits                            sensor 1 to 4 and eight-by-eight
  dermis study input-bits my-scene.toml
  dermis study dead-taxels eight-by-eight
  dermis study contacts ellipses                     lines of the table by their first word
  dermis study link-times sensor-1 eight-by-eight
  dermis study sensor-faults                         flagged and silently wrong frames of faulty sensors
  dermis study devices                               a frame on CPU, microcontroller and FPGA: minutes
  dermis study blind-gains                           gains found from presses of unknown load")]
pub struct Arguments {
    #[command(subcommand)]
    study: Study,
}

/// The lines of a table.
#[derive(Args, Debug)]
struct Lines {
    /// Scenes of the table's lines (built-in names; of input-bits and link-times paths as well), of contacts their
    /// shapes; without any all lines.
    lines: Vec<String>,
}

/// A study by its name.
#[derive(Subcommand, Debug)]
enum Study {
    /// Shear error of golden and bit-true model at 20 and 16 bits of input.
    InputBits(Lines),
    /// Shear error and latency with dead taxels.
    DeadTaxels(Lines),
    /// Shear error of several contacts in case 0, adaptive and contacts.
    Contacts(Lines),
    /// Time of a frame's packets on each link.
    LinkTimes(Lines),
    /// Time and energy of a frame by estimator, on CPU, microcontroller and FPGA.
    Devices(devices::Arguments),
    /// Frames of faulty sensors, by every engine: flagged, silently wrong, right.
    SensorFaults(sensor_faults::Arguments),
    /// Shear error without gains and with those that dermis calibrate --blind finds.
    BlindGains(blind_gains::Arguments),
}

/// The study's table.
///
/// # Errors
/// A line that the study does not have, a scene that cannot be loaded or is refused.
pub fn run(arguments: &Arguments, build: &Path) -> Result<String> {
    match &arguments.study {
        Study::InputBits(Lines { lines }) => input_bits::run(lines),
        Study::DeadTaxels(Lines { lines }) => dead_taxels::run(lines),
        Study::Contacts(Lines { lines }) => contacts::run(lines),
        Study::LinkTimes(Lines { lines }) => link_times::run(lines),
        Study::Devices(arguments) => devices::run(arguments, build),
        Study::SensorFaults(arguments) => sensor_faults::run(arguments),
        Study::BlindGains(arguments) => blind_gains::run(arguments),
    }
}
