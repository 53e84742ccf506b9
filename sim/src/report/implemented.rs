//! A placed and routed scene as a line of the README's table, and as JSON.

use std::path::PathBuf;

use dermis_golden::fixed::{Cycles, Model};
use serde::Serialize;

use super::table::markdown;
use super::BUDGET_US;
use crate::bitstream::absorb::Absorbed;
use crate::bitstream::baseline::Baseline;
use crate::bitstream::timing::Fmax;

/// A scene on its board: cells, clocks, and how long a frame takes.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Summary {
    /// Scene name.
    pub scene: String,
    /// Board name.
    pub board: String,
    /// Cells, and the clocks of all seeds.
    #[serde(flatten)]
    pub reached: Baseline,
    /// Clock of the board.
    pub clock_MHz: f64,
    /// From the first input beat to the last output beat of the engine.
    pub cycles: u64,
    /// The same at the board's clock.
    pub time_us: f64,
    /// What that leaves of [`BUDGET_US`].
    pub margin_us: f64,
}

impl Summary {
    /// What was `reached` of a model's scene, with the cycles that the model takes.
    pub fn new(model: &Model, reached: Baseline) -> Self {
        let cycles = Cycles::longest(model).total;
        let time_us = model.board.microseconds(cycles);
        Summary {
            scene: model.scene.name.clone(),
            board: model.board.name.clone(),
            reached,
            clock_MHz: model.board.clock_MHz,
            cycles,
            time_us,
            margin_us: BUDGET_US as f64 - time_us,
        }
    }
}

/// What `dermis bitstream` reached.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Implemented {
    /// The table's line.
    #[serde(flatten)]
    pub summary: Summary,
    /// Registers that went into multipliers: operands, products.
    pub absorbed: [usize; 2],
    /// The clock that comes with the link, and its pin, where there is one.
    pub link_clock: Option<(&'static str, Fmax)>,
    /// The bitstream; none when a clock is missed.
    pub bitstream: Option<PathBuf>,
    /// What is missed or worse than the baseline.
    pub lost: Vec<String>,
}

impl Implemented {
    /// Sums up what was `reached`.
    pub fn new(
        model: &Model,
        reached: Baseline,
        absorbed: Absorbed,
        link_clock: Option<(&'static str, Fmax)>,
        bitstream: Option<PathBuf>,
        lost: Vec<String>,
    ) -> Self {
        Implemented {
            summary: Summary::new(model, reached),
            absorbed: [absorbed.operands, absorbed.products],
            link_clock,
            bitstream,
            lost,
        }
    }

    /// Whether the clock is met and nothing got worse.
    pub fn is_good(&self) -> bool {
        self.lost.is_empty()
    }
}

/// The table of scenes on their boards.
pub fn implementations(all: &[Summary]) -> String {
    markdown(&HEAD, all.iter().map(line).collect())
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
    "cycles",
    "µs",
    "margin to 1 ms",
];

fn line(one: &Summary) -> Vec<String> {
    let Baseline { luts, flip_flops, multipliers, block_rams, best_MHz, median_MHz, worst_MHz, seeds } = one.reached;
    vec![
        one.scene.clone(),
        one.board.clone(),
        luts.to_string(),
        flip_flops.to_string(),
        multipliers.to_string(),
        block_rams.to_string(),
        seeds.to_string(),
        format!("{best_MHz:.1}"),
        format!("{median_MHz:.1}"),
        format!("{worst_MHz:.1}"),
        format!("{}", one.clock_MHz),
        one.cycles.to_string(),
        format!("{:.2}", one.time_us),
        format!("{:.2} µs", one.margin_us),
    ]
}

/// The table's line and what follows from it.
pub fn implemented(one: &Implemented) -> String {
    let mut text = implementations(std::slice::from_ref(&one.summary));
    let [operands, products] = one.absorbed;
    text.push_str(&format!("registers moved into multipliers: {operands} operands, {products} products\n"));
    if let Some((pin, clock)) = &one.link_clock {
        text.push_str(&format!("{pin}: {:.1} MHz, meant for {} MHz\n", clock.achieved, clock.constraint));
    }
    match &one.bitstream {
        Some(path) => text.push_str(&format!("{}\n", path.display())),
        None => text.push_str("no bitstream: a clock is missed\n"),
    }
    for lost in &one.lost {
        text.push_str(&format!("worse: {lost}\n"));
    }
    text
}
