//! What the commands print: the JSON contract of `cosim` and the tables for people; and the report.
//!
//! ```text
//! run ─ measure ─ sections ─┬─ tables ───┬─ document ─┬─ html
//!                           └─ pictures ─┘            └─ data: Markdown, CSV, JSON
//! ```
//!
//! Times are total cycles (first input beat to last output beat) at the engine's clock; the margin is
//! what they leave of [`BUDGET_US`].

mod bitstream_report;
mod cases;
mod csv;
#[cfg(test)]
mod csv_reader;
mod data;
mod document;
mod errors;
mod extremes;
mod faults;
mod host;
mod html;
mod measure;
mod noise;
mod pictures;
mod resource_report;
mod result;
mod run;
mod save;
mod sections;
mod stability;
mod stress;
mod style;
mod table;

pub use crate::jobs::Interrupted;
pub use bitstream_report::{bitstream, BitstreamReport};
pub use cases::cases;
pub use errors::errors;
pub use extremes::extremes;
pub use faults::faults;
pub use host::{equality, resultants, wire_times};
pub use noise::noise;
pub use resource_report::{features, resources};
pub use result::{difference, reconstruction};
pub use run::{run, Arguments};
pub use sections::stability_picture;
pub use stability::stability;
pub use stress::stress;
pub use table::{cosim, scenes};

use serde::Serialize;

use crate::cosim::Mismatch;
use crate::verify::Verified;

/// Form of a table.
#[derive(clap::ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// For people.
    Markdown,
    /// For spreadsheets.
    Csv,
    /// For programs.
    Json,
}

/// Time that touch allows for a frame, in µs.
pub const BUDGET_US: u64 = 1000;

/// Smallest, middle and largest of some counts; none where no frame was finished.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Spread {
    /// Smallest.
    pub min: Option<u64>,
    /// Middle; of an even number of values the larger of the two middle ones.
    pub median: Option<u64>,
    /// Largest.
    pub max: Option<u64>,
}

impl Spread {
    fn of(values: impl Iterator<Item = u64>) -> Self {
        let mut values: Vec<u64> = values.collect();
        values.sort_unstable();
        let median = values.get(values.len() / 2).copied();
        Spread { min: values.first().copied(), median, max: values.last().copied() }
    }
}

/// Middle and largest time in µs.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Time {
    /// Middle.
    pub median: Option<f64>,
    /// Largest.
    pub max: Option<f64>,
}

/// The JSON of `dermis cosim --json`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CosimReport {
    /// Scene name.
    pub scene: String,
    /// Frames co-simulated.
    pub frames: usize,
    /// Whether every run equalled the bit-true model to the bit.
    pub equal: bool,
    /// The first differences of every frame.
    pub mismatches: Vec<Mismatch>,
    /// From the last input beat to the last output beat.
    pub cycles: Spread,
    /// From the first input beat to the last output beat.
    pub total_cycles: Spread,
    /// The engine's clock.
    pub clock_MHz: f64,
    /// Of the total cycles.
    pub time_us: Time,
    /// [`BUDGET_US`].
    pub budget_us: u64,
}

impl CosimReport {
    /// Sums up a co-simulation.
    pub fn new(verified: &Verified) -> Self {
        let total_cycles = Spread::of(verified.rows.iter().filter_map(|row| row.times.total()));
        let time = |cycles: Option<u64>| cycles.map(|c| verified.board.microseconds(c));
        CosimReport {
            scene: verified.scene.name.clone(),
            frames: verified.rows.len(),
            equal: verified.findings.is_equal(),
            mismatches: verified.findings.kept.clone(),
            cycles: Spread::of(verified.rows.iter().filter_map(|row| row.times.latency())),
            total_cycles,
            clock_MHz: verified.board.clock_MHz,
            time_us: Time { median: time(total_cycles.median), max: time(total_cycles.max) },
            budget_us: BUDGET_US,
        }
    }
}
