//! Every state bit of a design: the registers and memories of its kernels, so that new ones are covered by themselves.

use serde::Serialize;

use crate::language::Hierarchy;
use crate::streams::Stage;
use crate::usage::{stage, PlacedMemory};

/// Kind of storage that holds a bit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum StorageClass {
    /// Memories that are never written: coefficients, column lists, calibration.
    Rom,
    /// Memories that are written: buffers, operands.
    Ram,
    /// Registers, and memories that the resource model does not plan: queues of registers.
    Register,
}

/// Classes in the order of the table.
pub const CLASSES: [StorageClass; 3] = [StorageClass::Rom, StorageClass::Ram, StorageClass::Register];

impl StorageClass {
    /// Name in tables.
    pub fn name(self) -> &'static str {
        match self {
            StorageClass::Rom => "ROM",
            StorageClass::Ram => "RAM",
            StorageClass::Register => "register",
        }
    }
}

/// A register or a memory.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StateElement {
    /// Kind of storage.
    pub class: StorageClass,
    /// Pipeline stage by its name in the hardware; `engine` for what belongs to no stage.
    pub stage: &'static str,
    /// Instance path from the design's top, separated by dots; empty at the top.
    pub scope: String,
    /// Name of the variable in that instance.
    pub signal: String,
    /// Number of words.
    pub words: usize,
    /// Bits per word.
    pub bits: usize,
}

/// The state elements of a design with these stages and planned memories, by block, then by name.
pub(crate) fn state_elements(hierarchy: &Hierarchy, stages: &[Stage], memories: &[PlacedMemory]) -> Vec<StateElement> {
    let mut all = Vec::new();
    for (block, scope, kernel) in hierarchy.scopes() {
        let first = all.len();
        let mut add = |class, name: &str, words, bits| {
            let (scope, signal) = (scope.clone(), name.to_owned());
            all.push(StateElement { class, stage: stage(stages, block), scope, signal, words, bits });
        };
        for (name, bits) in kernel.register_widths() {
            add(StorageClass::Register, name, 1, bits);
        }
        for memory in kernel.memories() {
            let planned = memories.iter().any(|planned| planned.block == block && planned.array == memory.name);
            let class = match (planned, memory.is_written()) {
                (true, false) => StorageClass::Rom,
                (true, true) => StorageClass::Ram,
                (false, true) => StorageClass::Register,
                // A table of constants in logic.
                (false, false) => continue,
            };
            add(class, &memory.name, memory.words, memory.bits);
        }
        all[first..].sort_by(|a, b| a.signal.cmp(&b.signal));
    }
    all
}
