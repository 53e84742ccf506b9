//! Resources of a generated design by stage: block RAMs and multipliers exact, flip-flops and LUTs estimated.

use dermis_golden::fixed::plan::resources::Memory as Planned;
use dermis_golden::fixed::Model;
use dermis_golden::spec::board::{Board, EngineKind};
use serde::Serialize;

use crate::engine::{stages, CONTROL};
use crate::language::{distributed_luts, Hierarchy, Memory, SEPARATOR};
use crate::streams::Stage;

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
    pub planned: Planned,
}

impl PlacedMemory {
    pub(crate) fn new(block: &str, array: &str, planned: &Planned) -> Self {
        PlacedMemory { block: block.to_owned(), array: array.to_owned(), planned: planned.clone() }
    }

    /// Pipeline stage of the block in an engine of this kind; `engine` if it belongs to none.
    pub fn stage(&self, engine: EngineKind) -> &'static str {
        stage(stages(engine), &self.block)
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

/// Usage by stage in the order of the data flow; then that of the engine's blocks outside any stage, as `engine`, and that of
/// the blocks around the engine, as `link` of a board and as `bus` of a core.
pub type StageUsage = Vec<(&'static str, Usage)>;

/// The stage of the block with instance path `block`; `engine` if it belongs to none.
pub(crate) fn stage(stages: &[Stage], block: &str) -> &'static str {
    let instance = block.split(SEPARATOR).next();
    stages.iter().find(|stage| Some(stage.name) == instance).map_or(CONTROL, |stage| stage.name)
}

/// A module around an engine: the instance of the engine in it, and the row of all other blocks.
#[derive(Clone, Copy, Debug)]
pub(crate) struct WrapperUsage {
    pub engine: &'static str,
    pub row: &'static str,
}

/// Usage of each stage of the engine of `model`, and, where there is a module around it, of that.
pub(crate) fn by_stage(
    model: &Model,
    hierarchy: &Hierarchy,
    memories: &[PlacedMemory],
    wrapper: Option<WrapperUsage>,
) -> StageUsage {
    let list = stages(model.board.engine);
    let names = list.iter().map(|stage| stage.name).chain([CONTROL]).chain(wrapper.map(|wrapper| wrapper.row));
    let mut all: StageUsage = names.map(|name| (name, Usage::default())).collect();
    let row_of = |block: &str| match wrapper.map(|wrapper| (block.strip_prefix(wrapper.engine), wrapper.row)) {
        None => stage(list, block),
        Some((Some(inside), _)) => stage(list, inside.strip_prefix(SEPARATOR).unwrap_or_default()),
        Some((None, row)) => row,
    };
    let mut add = |row: &str, usage: Usage| {
        all.iter_mut().filter(|(name, _)| *name == row).for_each(|(_, sum)| *sum += usage);
    };
    for (block, kernel) in hierarchy.kernels() {
        let planned = memories.iter().filter(|memory| memory.block == block).map(|memory| memory.array.as_str());
        // Of the memories that no plan has, those of the link, some are to be block RAM.
        let others = kernel.memories().iter().filter(|memory| memory.style.as_deref() == Some("block"));
        let unplanned = |memory: &&Memory| memory.label.is_none();
        let block_rams = others.clone().filter(unplanned).map(|m| model.board.block_rams_for(m.words, m.bits)).sum();
        let logic = kernel.logic(&planned.chain(others.map(|memory| memory.name.as_str())).collect());
        let luts = logic.luts.round() as usize;
        add(row_of(block), Usage { block_rams, flip_flops: logic.flip_flops, luts, ..Usage::default() });
    }
    for PlacedMemory { block, planned, .. } in memories {
        add(row_of(block), Usage { block_rams: planned.block_rams, luts: luts_of(planned), ..Usage::default() });
    }
    for &(stage, multipliers) in &model.resources.multipliers {
        add(stage, Usage { multipliers, ..Usage::default() });
    }
    all
}

/// The sum over all stages.
pub fn total(stages: &StageUsage) -> Usage {
    let mut sum = Usage::default();
    stages.iter().for_each(|&(_, usage)| sum += usage);
    sum
}

fn luts_of(memory: &Planned) -> usize {
    match (memory.block_rams, memory.large_rams) {
        (0, 0) => distributed_luts(memory.words, memory.bits),
        _ => 0,
    }
}
