//! `dermis study`: comparisons that the guide shows, each one table.
//!
//! | study | compares |
//! |---|---|
//! | [`input_bits`] | golden and bit-true model at 20 and 16 bits of input |
//! | [`dead_taxels`] | errors and latency with taxels that are left out |
//! | [`contacts`] | case 0, `adaptive` and `contacts` on frames of several contacts |
//! | [`link_times`] | time of a frame's packets on each link |

pub mod contacts;
pub mod dead_taxels;
pub mod input_bits;
pub mod link_times;

use anyhow::Result;
use clap::{Args, ValueEnum};
use dermis_golden::frame::Frame;
use dermis_golden::reconstruct::Reconstruction;
use dermis_golden::scene::Scene;

use crate::compare::median;
use crate::drawn_frames::{DrawnFrames, Shapes};

/// Drawn frames of a line of a study.
pub const FRAMES: u32 = 100;

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

/// [`FRAMES`] frames of one elliptic contact each, from the first seed.
///
/// # Errors
/// A stress that is not finite.
pub fn one_contact(scene: &Scene) -> Result<Vec<Frame>> {
    let draw = DrawnFrames { frames: FRAMES, contacts: vec![1], shapes: Shapes::Elliptic, touching: false, seed: 1 };
    draw.draw(scene)
}

/// Median tangential error of results, a fraction; `None` where no frame has a shear.
pub fn tangential(results: &[Reconstruction]) -> Option<f64> {
    median(results.iter().filter_map(|result| result.error.as_ref()?.tangential).collect())
}
