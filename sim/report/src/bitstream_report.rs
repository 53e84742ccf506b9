//! Result of `dermis bitstream`, as a row of the README's table and as JSON.

use std::path::PathBuf;

use dermis_golden::fixed::{Cycles, Model};
use serde::Serialize;

use super::table::markdown;
use super::BUDGET_US;
use dermis_flow::baseline::Baseline;
use dermis_flow::bitstream::Made;
use dermis_flow::timing::Fmax;

/// A scene on its board: cells, clocks, and the time of a frame.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Summary {
    /// Scene name.
    pub scene: String,
    /// Board name.
    pub board: String,
    /// Cells of the best seed and clocks of all seeds.
    #[serde(flatten)]
    pub achieved: Baseline,
    /// Required clock, from the board's file, in MHz.
    pub clock_MHz: f64,
    /// Cycles from the engine's first input beat to its last output beat, of the frame that takes longest.
    pub cycles: u64,
    /// Time of these cycles at the board's clock.
    pub time_us: f64,
    /// [`BUDGET_US`] minus that time.
    pub margin_us: f64,
}

impl Summary {
    /// The `achieved` cells and clocks of a model's scene, with the cycles that the model takes.
    pub fn new(model: &Model, achieved: Baseline) -> Self {
        let cycles = Cycles::longest(model).total;
        let time_us = model.board.microseconds(cycles);
        Summary {
            scene: model.scene.name.clone(),
            board: model.board.name.clone(),
            achieved,
            clock_MHz: model.board.clock_MHz,
            cycles,
            time_us,
            margin_us: BUDGET_US as f64 - time_us,
        }
    }
}

/// Result of `dermis bitstream`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BitstreamReport {
    /// Row of the table.
    #[serde(flatten)]
    pub summary: Summary,
    /// Number of operands and of products whose registers were moved into multipliers.
    #[serde(rename = "absorbed")]
    pub packed_registers: [usize; 2],
    /// Number of block RAMs whose output registers are used.
    pub registered_block_rams: usize,
    /// The link's own clock with its pin, if the link has one.
    pub link_clock: Option<(String, Fmax)>,
    /// Path of the bitstream; none if a clock is missed.
    pub bitstream: Option<PathBuf>,
    /// Missed clocks and regressions against the baseline.
    #[serde(rename = "lost")]
    pub failures: Vec<String>,
}

impl BitstreamReport {
    /// Summary of a run of place and route.
    pub fn new(model: &Model, made: Made) -> Self {
        let Made { achieved, packed, link_clock, bitstream, failures } = made;
        BitstreamReport {
            summary: Summary::new(model, achieved),
            packed_registers: [packed.operands, packed.products],
            registered_block_rams: packed.block_rams,
            link_clock: link_clock.map(|clock| (clock.wanted.name, clock.fmax)),
            bitstream,
            failures,
        }
    }

    /// Whether the clocks are met without a regression.
    pub fn is_good(&self) -> bool {
        self.failures.is_empty()
    }
}

/// The table of scenes on their boards.
pub fn summaries(all: &[Summary]) -> String {
    markdown(&HEAD, all.iter().map(row).collect())
}

const HEAD: [&str; 14] = [
    "scene",
    "board",
    "logic cells",
    "flip-flops",
    "multipliers",
    "block RAMs",
    "seeds",
    "Fmax best",
    "median",
    "worst",
    "clock, MHz",
    "cycles, worst case",
    "µs",
    "margin to 1 ms",
];

fn row(summary: &Summary) -> Vec<String> {
    let Baseline { luts, flip_flops, multipliers, block_rams, best_MHz, median_MHz, worst_MHz, seeds } =
        summary.achieved;
    vec![
        summary.scene.clone(),
        summary.board.clone(),
        luts.to_string(),
        flip_flops.to_string(),
        multipliers.to_string(),
        block_rams.to_string(),
        seeds.to_string(),
        format!("{best_MHz:.1}"),
        format!("{median_MHz:.1}"),
        format!("{worst_MHz:.1}"),
        format!("{}", summary.clock_MHz),
        summary.cycles.to_string(),
        format!("{:.2}", summary.time_us),
        format!("{:.2} µs", summary.margin_us),
    ]
}

/// The row of the table, and details below it.
pub fn bitstream(report: &BitstreamReport) -> String {
    let mut text = summaries(std::slice::from_ref(&report.summary));
    let [operands, products] = report.packed_registers;
    text.push_str(&format!("registers moved into multipliers: {operands} operands, {products} products; "));
    text.push_str(&format!("behind {} block RAMs\n", report.registered_block_rams));
    if let Some((pin, clock)) = &report.link_clock {
        text.push_str(&format!("{pin}: {:.1} MHz, required {} MHz\n", clock.achieved, clock.constraint));
    }
    match &report.bitstream {
        Some(path) => text.push_str(&format!("{}\n", path.display())),
        None => text.push_str("no bitstream: a clock is missed\n"),
    }
    for failure in &report.failures {
        text.push_str(&format!("failed: {failure}\n"));
    }
    text
}
