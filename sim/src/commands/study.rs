//! `dermis study`: comparisons that the guide shows, each one table.

use anyhow::Result;
use clap::{Args, ValueEnum};

use crate::report::study::{contacts, dead_taxels, input_bits, link_times};

/// What to compare.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  dermis study input-bits                            sensor 1 to 4 and eight-by-eight
  dermis study input-bits my-scene.toml
  dermis study dead-taxels eight-by-eight
  dermis study contacts ellipses                     lines of the table by their first word
  dermis study link-times sensor-1 eight-by-eight")]
pub struct Arguments {
    /// The study.
    #[arg(value_enum)]
    study: Name,
    /// Scenes of the table's lines (built-in names; of input-bits and link-times paths as well), of contacts their
    /// shapes; without any all lines.
    lines: Vec<String>,
}

/// A study by its name.
#[derive(ValueEnum, Clone, Copy, Debug)]
enum Name {
    /// Shear error of golden and bit-true model at 20 and 16 bits of input.
    InputBits,
    /// Shear error and latency with dead taxels.
    DeadTaxels,
    /// Shear error of several contacts in case 0, adaptive and contacts.
    Contacts,
    /// Time of a frame's packets on each link.
    LinkTimes,
}

/// The study's table.
///
/// # Errors
/// A line that the study does not have, a scene that cannot be loaded or is refused.
pub fn run(arguments: &Arguments) -> Result<String> {
    let lines = &arguments.lines;
    match arguments.study {
        Name::InputBits => input_bits::run(lines),
        Name::DeadTaxels => dead_taxels::run(lines),
        Name::Contacts => contacts::run(lines),
        Name::LinkTimes => link_times::run(lines),
    }
}
