//! The blocks of the parallel engine that the guide describes: ports, kernels, recordings of a run.
//!
//! All that is said of a port comes from its declaration. Its comment reads `MEANING; WHEN.`: behind the first semicolon it
//! says when the port is valid. A single bit without it is a control signal, valid in every cycle.

use dermis_golden::fixed::Model;
use dermis_golden::spec::board::EngineKind;
use serde::Serialize;
use thiserror::Error;

use crate::engine::stages;
use crate::error::HdlError;
use crate::language::{Hierarchy, Kernel, Slot, SEPARATOR};
use crate::simulate::{design, Running};
use crate::wire::Word;

/// What a single bit says about its validity when its comment does not.
const ALWAYS: &str = "in every cycle";

/// Name of the engine's module where the scene does not matter.
const ENGINE: &str = "engine";

/// A described block: instances from the engine on, source.
#[derive(Clone, Copy)]
struct Entry {
    instance: &'static str,
    source: &'static str,
}

impl Entry {
    /// Name of the stage or block: that of the last instance.
    fn name(&self) -> &'static str {
        self.instance.rsplit(SEPARATOR).next().unwrap_or_default()
    }
}

/// Blocks inside stages of the parallel engine that the guide takes as examples.
const INSIDE: [Entry; 2] = [
    Entry { instance: "receive__choose", source: include_str!("stages/choose.rs") },
    Entry { instance: "fold__butterfly", source: include_str!("primitives/arithmetic/butterfly.rs") },
];

/// The described blocks: the stages in the order of the data flow, then those inside.
fn entries() -> Vec<Entry> {
    let stages = stages(EngineKind::Parallel).iter();
    stages.map(|stage| Entry { instance: stage.name, source: stage.source }).chain(INSIDE).collect()
}

/// Why a block cannot be described.
#[derive(Debug, Error)]
pub enum DescribeError {
    /// The scene's engine has no such block.
    #[error("{scene} has no block {name:?}; its blocks: {}", known.join(", "))]
    Unknown {
        /// The scene.
        scene: String,
        /// The name asked for.
        name: String,
        /// The names that it has.
        known: Vec<&'static str>,
    },
    /// The serial engine has other blocks.
    #[error("{scene} on board {board}: the serial engine is not described; choose a board with engine = \"parallel\"")]
    Serial {
        /// The scene.
        scene: String,
        /// The board.
        board: String,
    },
    /// The engine cannot be built.
    #[error(transparent)]
    Hardware(#[from] HdlError),
}

/// A port of a block.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct PortText {
    /// Its name, the same in Rust and Verilog.
    pub name: String,
    /// Whether the block drives it.
    pub output: bool,
    /// Width in bits.
    pub bits: usize,
    /// What it carries.
    pub meaning: String,
    /// When it is valid.
    pub valid: String,
}

/// A block with its ports.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct BlockText {
    /// Name of the stage or block.
    pub name: &'static str,
    /// Instances from the engine on, separated by two underscores.
    pub instance: &'static str,
    /// First sentence of its source.
    pub purpose: String,
    /// The ports in the order of the source; none where the scene's engine does not have the block.
    pub ports: Vec<PortText>,
}

/// Names of the stages in the order of the data flow, then of the described blocks inside them.
pub fn names() -> Vec<&'static str> {
    entries().iter().map(Entry::name).collect()
}

/// The described blocks in the order of the data flow, with the ports of those that the engine of `model` has.
///
/// # Errors
/// [`DescribeError::Serial`]; an engine that cannot be built.
pub fn blocks(model: &Model) -> Result<Vec<BlockText>, DescribeError> {
    Ok(describe(&engine(model)?))
}

/// The block `name` of the engine of `model`.
///
/// # Errors
/// As [`blocks`]; [`DescribeError::Unknown`].
pub fn block(model: &Model, name: &str) -> Result<BlockText, DescribeError> {
    let all = present(blocks(model)?);
    let known: Vec<&str> = all.iter().map(|block| block.name).collect();
    let unknown = DescribeError::Unknown { scene: model.scene.name.clone(), name: name.to_owned(), known };
    all.into_iter().find(|block| block.name == name).ok_or(unknown)
}

/// The Verilog of a block: its ports with their comments, then the body as in the generated file.
///
/// # Errors
/// As [`fn@block`].
pub fn block_verilog(model: &Model, name: &str) -> Result<String, DescribeError> {
    let block = block(model, name)?;
    let text = engine(model)?.module(block.instance, ENGINE, None).unwrap_or_default();
    Ok(format!("// {}\n{text}", block.purpose))
}

/// The Rust source of a block, its test included.
///
/// # Errors
/// As [`fn@block`].
pub fn block_source(model: &Model, name: &str) -> Result<&'static str, DescribeError> {
    let block = block(model, name)?;
    Ok(entries().iter().find(|entry| entry.instance == block.instance).map_or("", |entry| entry.source))
}

fn engine(model: &Model) -> Result<Hierarchy, DescribeError> {
    match model.board.engine {
        EngineKind::Parallel => Ok(design(model)?),
        EngineKind::Serial => {
            Err(DescribeError::Serial { scene: model.scene.name.clone(), board: model.board.name.clone() })
        }
    }
}

/// Those of `blocks` that the engine has.
fn present(blocks: Vec<BlockText>) -> Vec<BlockText> {
    blocks.into_iter().filter(|block| !block.ports.is_empty()).collect()
}

/// The described blocks, with the ports of those that `engine` has.
fn describe(engine: &Hierarchy) -> Vec<BlockText> {
    let described = |entry: &Entry| {
        let kernel = engine.kernels().find(|(path, _)| *path == entry.instance);
        let purpose = entry.source.lines().next().and_then(|line| line.strip_prefix("//! ")).unwrap_or_default();
        BlockText {
            name: entry.name(),
            instance: entry.instance,
            purpose: purpose.to_owned(),
            ports: kernel.map(|(_, kernel)| ports(kernel)).unwrap_or_default(),
        }
    };
    entries().iter().map(described).collect()
}

/// The ports of a block, the clock first.
fn ports(kernel: &Kernel) -> Vec<PortText> {
    let text = |(name, output, bits, doc): (&str, bool, usize, &str)| {
        let (meaning, valid) = doc.split_once("; ").unwrap_or((doc, if bits == 1 { ALWAYS } else { "" }));
        let tidy = |text: &str| text.trim_start_matches("valid ").trim_end_matches('.').to_owned();
        PortText { name: name.to_owned(), output, bits, meaning: tidy(meaning), valid: tidy(valid) }
    };
    kernel.port_list().map(text).collect()
}

/// A run's values of a block's ports.
#[derive(Clone, Debug)]
pub struct Trace {
    /// The block.
    pub block: BlockText,
    /// For each cycle the value of each port, before the rising edge that ends the cycle.
    pub cycles: Vec<Vec<Word>>,
}

/// The engine in kernel simulation, with the ports of the described blocks recorded in every cycle.
pub struct Recorder {
    engine: Running,
    /// The ports of each block.
    slots: Vec<Vec<Slot>>,
    traces: Vec<Trace>,
}

impl Recorder {
    /// Starts the engine of `model`.
    ///
    /// # Errors
    /// As [`blocks`].
    pub fn new(model: &Model) -> Result<Self, DescribeError> {
        let hierarchy = engine(model)?;
        let blocks = present(describe(&hierarchy));
        let ports = blocks.iter().flat_map(|block| block.ports.iter().map(|port| (block.instance, port.name.as_str())));
        let engine = Running::new(&hierarchy, &ports.collect::<Vec<_>>());
        let slot =
            |block: &BlockText| block.ports.iter().map(|port| engine.run().slot(block.instance, &port.name)).collect();
        let slots = blocks.iter().map(slot).collect();
        let traces = blocks.into_iter().map(|block| Trace { block, cycles: Vec::new() }).collect();
        Ok(Recorder { engine, slots, traces })
    }

    /// What was recorded, one trace per block.
    pub fn into_traces(self) -> Vec<Trace> {
        self.traces
    }
}

impl crate::device::Device for Recorder {
    fn cycle(&mut self, inputs: &crate::device::Inputs) -> crate::device::Outputs {
        let Recorder { engine, slots, traces } = self;
        engine.cycle(inputs, |run| {
            for (trace, slots) in traces.iter_mut().zip(slots) {
                trace.cycles.push(slots.iter().map(|&slot| run.get(slot)).collect());
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use dermis_golden::spec::partition::Case;
    use dermis_golden::spec::scene::{ForceOutput, Scene};

    fn model(adaptive: bool) -> Model {
        let mut scene = Scene::builtin("eight-by-eight").unwrap();
        if adaptive {
            scene.partition.case = Case::Adaptive;
        }
        Model::new(&scene).unwrap()
    }

    #[test]
    fn every_port_has_its_meaning_and_says_when_it_is_valid() {
        let mut sums = Scene::builtin("eight-by-eight").unwrap();
        (sums.input.average, sums.output.forces) = (1, ForceOutput::Resultants);
        let contacts = Scene::builtin("eight-by-eight-contacts").unwrap();
        let models = [model(true), Model::new(&sums).unwrap(), Model::new(&contacts).unwrap()];
        let all: Vec<BlockText> = models.iter().flat_map(|model| present(blocks(model).unwrap())).collect();
        let missing = entries().into_iter().find(|entry| all.iter().all(|block| block.instance != entry.instance));
        assert!(missing.is_none(), "{:?}", missing.map(|entry| entry.instance));
        for block in &all {
            assert!(!block.purpose.is_empty() && block.ports.len() >= 3, "{block:?}");
            for port in &block.ports {
                assert!(!port.meaning.is_empty() && !port.valid.is_empty(), "{}: {port:?}", block.name);
            }
        }
    }

    #[test]
    fn ports_are_those_of_the_scene() {
        let model = model(false);
        let fold = block(&model, "fold").unwrap();
        let port = |name: &str| fold.ports.iter().find(|port| port.name == name).unwrap();
        assert_eq!(port("folded").bits, 4 * model.formats().fold_bits as usize);
        assert!(port("folded").output && !port("normalised").output);
        let error = block(&model, "choose").unwrap_err().to_string();
        assert!(error.contains("no block \"choose\"; its blocks: receive, normalise, fold"), "{error}");
    }

    #[test]
    fn verilog_is_that_of_the_kernel() {
        let model = model(false);
        let text = block_verilog(&model, "butterfly").unwrap();
        assert!(text.contains("\nmodule engine__fold__butterfly (\n    // Clock"), "{text}");
        assert!(text.contains("always @(posedge clk)"), "{text}");
        let text = block_verilog(&model, "fold").unwrap();
        assert!(text.contains("engine__fold__butterfly butterfly (\n"), "{text}");
    }
}
