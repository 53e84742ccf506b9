//! Measurements, and what is printed of all results: text, JSON, CSV, HTML, pictures.
//!
//! ```text
//! measure ─ sections ─┬─ tables ───┬─ document ─┬─ html
//!                           └─ pictures ─┘            └─ data: Markdown, CSV, JSON
//! ```
//!
//! Times are total cycles (first input beat to last output beat) divided by the engine's clock; the margin is
//! [`BUDGET_US`] minus the time. [`drawn_frames`] draws frames of random contacts, [`run_log`] keeps counts of long test runs.
// They panic where nothing takes the text.
#![cfg_attr(not(test), deny(clippy::print_stderr, clippy::print_stdout))]

mod bitstream_report;
mod board_list;
mod calibration;
mod cases;
mod check;
mod converters;
mod csv;
#[cfg(test)]
mod csv_reader;
mod data;
mod deviations;
pub mod document;
pub mod drawn_frames;
mod errors;
mod extremes;
mod faults;
mod flags;
mod guide;
pub mod host;
mod html;
mod load;
pub mod measure;
mod microcontroller;
mod network;
mod noise;
mod noise_presses;
mod noise_shapes;
mod pictures;
mod ports;
mod power;
mod registers;
mod resource_report;
mod result;
pub mod run_log;
pub mod save;
mod scan;
mod scene_fields;
pub mod sections;
mod stability;
mod stress;
pub mod study;
pub mod style;
pub mod table;
pub mod tabulate;

pub use bitstream_report::{bitstream, summaries, BitstreamReport, Summary};
pub use board_list::{boards, BoardList, NamedBoard};
pub use calibration::{blind_gains, calibration};
pub use cases::cases;
pub use check::{build_check, scene_check, BuildCheck, HardwareCheck, RateRow, SceneCheck, NOISE_NOT_STATED};
pub use converters::converters;
pub use deviations::{deviations, deviations_covered};
pub use errors::errors;
pub use extremes::extremes;
pub use faults::faults;
pub use flags::flags;
pub use guide::{fixed_pictures, time_picture, timing_picture, PictureFile};
pub use host::{equality, link_times, resultants, wire_times};
pub use load::{load, LoadReport};
pub use measure::{trace, ComparedWords};
pub use microcontroller::{microcontroller_needs, microcontrollers};
pub use noise::{noise, noise_medians};
pub use noise_presses::presses;
pub use noise_shapes::{coverage, sensitivity, shape_medians, shapes, slips, unlike};
pub use ports::{blocks, ports};
pub use power::power;
pub use registers::registers;
pub use resource_report::{features, program, resources};
pub use result::{difference, reconstruction};
pub use scan::{scan, ScanReport};
pub use scene_fields::scene_fields;
pub use sections::stability_picture;
pub use stability::stability;
pub use stress::stress;
pub use table::aligned;
pub use table::{cosim, scenes};

use serde::Serialize;

use dermis_cosim::verify::Verified;
use dermis_cosim::Mismatch;

/// Output format of a table.
#[derive(clap::ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Aligned Markdown table.
    Markdown,
    /// CSV with full precision.
    Csv,
    /// JSON with full precision.
    Json,
}

/// Time budget of a frame for tactile sensing, in µs.
pub const BUDGET_US: u64 = 1000;

/// Smallest, median and largest of some counts; none if no frame was completed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Spread {
    /// Smallest.
    pub min: Option<u64>,
    /// Median; of an even number of values the larger of the two middle ones.
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

/// Median and largest time in µs.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Time {
    /// Median.
    pub median: Option<f64>,
    /// Largest.
    pub max: Option<f64>,
}

/// The JSON of `dermis cosim --json`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CosimReport {
    /// Scene name.
    pub scene: String,
    /// Number of frames co-simulated.
    pub frames: usize,
    /// Whether every run equalled the bit-true model in every bit and cycle.
    pub equal: bool,
    /// The first mismatches of every frame.
    pub mismatches: Vec<Mismatch>,
    /// Latency: cycles from the last input beat to the last output beat.
    pub cycles: Spread,
    /// Cycles from the first input beat to the last output beat.
    pub total_cycles: Spread,
    /// Longest distance of two frames' last output beats, in cycles, where frames follow one another without a gap; none
    /// without Verilator or with fewer than three frames.
    pub frame_interval: Option<u64>,
    /// The same by the model, for frames of which every subarray is searched.
    pub planned_interval: u64,
    /// The engine's clock in MHz.
    pub clock_MHz: f64,
    /// Time of the total cycles.
    pub time_us: Time,
    /// [`BUDGET_US`].
    pub budget_us: u64,
}

impl CosimReport {
    /// Summary of a co-simulation.
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
            frame_interval: verified.frame_interval,
            planned_interval: verified.planned_interval,
            clock_MHz: verified.board.clock_MHz,
            time_us: Time { median: time(total_cycles.median), max: time(total_cycles.max) },
            budget_us: BUDGET_US,
        }
    }
}
