//! Resources of a generated design by stage: block RAMs and multipliers exact, flip-flops and LUTs estimated.

use std::collections::BTreeMap;

use dermis_golden::board::Board;
use dermis_golden::fixed::plan::resources::Memory;
use dermis_golden::fixed::Model;
use serde::Serialize;

use crate::language::{distributed_luts, Hierarchy, SEPARATOR};

/// Instance names of the stages, in pipeline order: parallel engine, then serial engine. Blocks outside any stage count
/// as `engine`.
pub const STAGES: [&str; 27] = [
    "prepare",
    "receive",
    "normalise",
    "fold",
    "pass",
    "rescale",
    "unfold",
    "search",
    "forces",
    "send",
    "resultants",
    "reorder",
    "pass_sequencer",
    "rounder",
    "butterfly",
    "raw",
    "banks",
    "search_sequencer",
    "along_x",
    "transposed",
    "along_y",
    "coefficient_shift",
    "candidates",
    "score",
    "floors",
    "totals",
    "engine",
];

/// Resources of a part of the design.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Usage {
    /// Block RAMs, exact.
    pub block_rams: usize,
    /// Multipliers, exact.
    pub multipliers: usize,
    /// Flip-flops, estimated.
    pub flip_flops: usize,
    /// Four-input LUTs including carry chains and distributed RAM, estimated.
    pub luts: usize,
}

impl Usage {
    /// Block RAMs, multipliers, flip-flops, LUTs.
    pub fn counts(&self) -> [usize; 4] {
        [self.block_rams, self.multipliers, self.flip_flops, self.luts]
    }

    /// The same counts as shares of what `board` has, in %.
    pub fn shares(&self, board: &Board) -> [f64; 4] {
        let has = [board.block_rams, board.multipliers, board.flip_flops, board.luts];
        let counts = self.counts();
        std::array::from_fn(|k| 100.0 * counts[k] as f64 / f64::from(has[k]))
    }
}

/// A memory that the model plans, and where it is in the hardware.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct PlacedMemory {
    /// Instances from the top to its block, levels separated by two underscores.
    pub block: String,
    /// Its name in the block.
    pub array: String,
    /// What it holds, its size, and the RAMs that it takes.
    #[serde(flatten)]
    pub planned: Memory,
}

impl PlacedMemory {
    pub(crate) fn new(block: &str, array: &str, planned: &Memory) -> Self {
        PlacedMemory { block: block.to_owned(), array: array.to_owned(), planned: planned.clone() }
    }
}

impl std::ops::AddAssign for Usage {
    fn add_assign(&mut self, other: Usage) {
        self.block_rams += other.block_rams;
        self.multipliers += other.multipliers;
        self.flip_flops += other.flip_flops;
        self.luts += other.luts;
    }
}

/// The stage of the block with instance path `block`; `engine` if it belongs to none.
pub fn stage(block: &str) -> &str {
    block.split(SEPARATOR).next().filter(|stage| STAGES.contains(stage)).unwrap_or("engine")
}

/// Usage of each stage by its instance name; blocks outside any stage under `engine`.
pub(crate) fn stages(model: &Model, hierarchy: &Hierarchy, memories: &[PlacedMemory]) -> BTreeMap<String, Usage> {
    let mut all: BTreeMap<String, Usage> = BTreeMap::new();
    let mut add = |block: &str, usage: Usage| {
        *all.entry(stage(block).to_string()).or_default() += usage;
    };
    for (block, kernel) in hierarchy.kernels() {
        let own = memories.iter().filter(|memory| memory.block == block).map(|memory| memory.array.as_str());
        let logic = kernel.logic(&own.collect());
        add(block, Usage { flip_flops: logic.flip_flops, luts: logic.luts.round() as usize, ..Usage::default() });
    }
    for PlacedMemory { block, planned, .. } in memories {
        add(block, Usage { block_rams: planned.block_rams, luts: luts_of(planned), ..Usage::default() });
    }
    for &(stage, multipliers) in &model.resources.multipliers {
        // Verilog keeps the word `force` for itself.
        add(if stage == "force" { "forces" } else { stage }, Usage { multipliers, ..Usage::default() });
    }
    all
}

/// The sum over all stages.
pub fn total(stages: &BTreeMap<String, Usage>) -> Usage {
    let mut sum = Usage::default();
    stages.values().for_each(|&usage| sum += usage);
    sum
}

fn luts_of(memory: &Memory) -> usize {
    match (memory.block_rams, memory.large_rams) {
        (0, 0) => distributed_luts(memory.words, memory.bits),
        _ => 0,
    }
}
