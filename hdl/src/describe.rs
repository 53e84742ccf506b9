//! The blocks of the parallel engine that the guide describes: ports, kernels, recordings of a run.
//!
//! Name, direction and width of a port come from a walk over the built engine, its meaning from the comment of the
//! field in the block's source. A comment reads `MEANING; WHEN.`: behind the first semicolon it says when the port is
//! valid. A single bit without it is a control signal, valid in every cycle.

use std::collections::BTreeMap;

use dermis_golden::fixed::Model;
use dermis_golden::spec::board::EngineKind;
use rust_hdl::core::probe::Probe;
use rust_hdl::prelude::*;
use serde::Serialize;
use thiserror::Error;

use crate::error::HdlError;
use crate::language::{Attributes, Hierarchy, SEPARATOR};
use crate::simulate::{design, stages, Design};
use crate::stage_list::PORTS;
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

/// The blocks of an engine whose ports have comments: the stages in the order of the data flow, then those inside.
fn entries(engine: EngineKind) -> Vec<Entry> {
    let stages = stages(engine).iter().map(|stage| Entry { instance: stage.name, source: stage.source });
    let inside: &[Entry] = match engine {
        EngineKind::Parallel => &INSIDE,
        EngineKind::Serial => &[],
    };
    stages.chain(inside.iter().copied()).collect()
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
    /// The ports in the order of the source.
    pub ports: Vec<PortText>,
}

/// Ports of the described blocks at one moment.
struct Ports<'a> {
    entries: &'a [Entry],
    path: Vec<String>,
    /// By instance: name, direction, width, value.
    found: BTreeMap<&'static str, Vec<(String, bool, usize, Word)>>,
}

impl<'a> Ports<'a> {
    /// Of the blocks `entries` of `engine`.
    fn of(engine: &dyn Design, entries: &'a [Entry]) -> Self {
        let mut ports = Ports { entries, path: Vec::new(), found: BTreeMap::new() };
        engine.accept("top", &mut ports);
        ports
    }
}

impl Probe for Ports<'_> {
    fn visit_start_scope(&mut self, name: &str, _node: &dyn Block) {
        self.path.push(name.to_owned());
    }

    fn visit_end_scope(&mut self, _name: &str, _node: &dyn Block) {
        self.path.pop();
    }

    fn visit_atom(&mut self, name: &str, signal: &dyn Atom) {
        let output = match signal.kind() {
            AtomKind::InputParameter => false,
            AtomKind::OutputParameter => true,
            _ => return,
        };
        let instance = self.path.get(1..).unwrap_or_default().join(SEPARATOR);
        let Some(entry) = self.entries.iter().find(|entry| entry.instance == instance) else { return };
        let port = (name.to_owned(), output, signal.bits(), value(signal));
        self.found.entry(entry.instance).or_default().push(port);
    }
}

/// The signal's value.
fn value(signal: &dyn Atom) -> Word {
    let mut word = Word::default();
    match signal.vcd() {
        VCDValue::Single(bit) => word.set(0, 1, u64::from(bit == vcd::Value::V1)),
        VCDValue::Vector(bits) => {
            let ones = bits.iter().rev().enumerate().filter(|(_, bit)| **bit == vcd::Value::V1);
            ones.for_each(|(at, _)| word.set(at, 1, 1));
        }
        VCDValue::String(_) | VCDValue::Composite(_) => {}
    }
    word
}

/// The described blocks of the engine of `model`, in the order of the data flow.
///
/// # Errors
/// [`DescribeError::Serial`]; an engine that cannot be built.
pub fn blocks(model: &Model) -> Result<Vec<BlockText>, DescribeError> {
    Ok(describe(Ports::of(&*engine(model)?, &entries(EngineKind::Parallel))))
}

/// The block `name` of the engine of `model`.
///
/// # Errors
/// As [`blocks`]; [`DescribeError::Unknown`].
pub fn block(model: &Model, name: &str) -> Result<BlockText, DescribeError> {
    let all = blocks(model)?;
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
    let hierarchy = Hierarchy::of(&*engine(model)?);
    let text = hierarchy
        .module(block.instance, ENGINE, &Attributes::new(), &port_comments(EngineKind::Parallel))
        .unwrap_or_default();
    Ok(format!("// {}\n{text}", block.purpose))
}

/// What the Verilog says of a port by the path of its block in the engine, and by its name: meaning, and when it is valid.
/// The engine's own path is empty.
pub(crate) fn port_comments(engine: EngineKind) -> impl Fn(&str, &str) -> Option<String> {
    let entries = entries(engine);
    move |path, port| {
        let own = || entries.iter().find(|entry| entry.instance == path).map(|entry| entry.source);
        comments(if path.is_empty() { Some(PORTS) } else { own() }?).remove(port)
    }
}

/// The Rust source of a block, its test included.
///
/// # Errors
/// As [`fn@block`].
pub fn block_source(model: &Model, name: &str) -> Result<&'static str, DescribeError> {
    let block = block(model, name)?;
    Ok(entries(EngineKind::Parallel)
        .iter()
        .find(|entry| entry.instance == block.instance)
        .map_or("", |entry| entry.source))
}

fn engine(model: &Model) -> Result<Box<dyn Design>, DescribeError> {
    match model.board.engine {
        EngineKind::Parallel => Ok(design(model)?),
        EngineKind::Serial => {
            Err(DescribeError::Serial { scene: model.scene.name.clone(), board: model.board.name.clone() })
        }
    }
}

fn describe(mut ports: Ports) -> Vec<BlockText> {
    let described = |entry: &Entry| {
        let comments = comments(entry.source);
        let text = |(name, output, bits, _): (String, bool, usize, Word)| {
            let comment = comments.get(name.as_str()).map(String::as_str).unwrap_or_default();
            let (meaning, valid) = comment.split_once("; ").unwrap_or((comment, if bits == 1 { ALWAYS } else { "" }));
            let tidy = |text: &str| text.trim_start_matches("valid ").trim_end_matches('.').to_owned();
            PortText { name, output, bits, meaning: tidy(meaning), valid: tidy(valid) }
        };
        let ports = ports.found.remove(entry.instance)?.into_iter().map(text).collect();
        let purpose = entry.source.lines().next().and_then(|line| line.strip_prefix("//! ")).unwrap_or_default();
        Some(BlockText { name: entry.name(), instance: entry.instance, purpose: purpose.to_owned(), ports })
    };
    ports.entries.iter().filter_map(described).collect()
}

/// The comments of the public fields of a source that are signals, by name.
pub(crate) fn comments(source: &str) -> BTreeMap<&str, String> {
    let mut found = BTreeMap::new();
    let mut comment = String::new();
    for line in source.lines().map(str::trim) {
        if let Some(text) = line.strip_prefix("/// ") {
            comment.push_str(if comment.is_empty() { "" } else { " " });
            comment.push_str(text);
            continue;
        }
        let field = line.strip_prefix("pub ").and_then(|field| field.split_once(": "));
        if let Some((name, _)) = field.filter(|(_, ty)| ty.starts_with("Signal<") || ty.starts_with("Wire<")) {
            found.insert(name, without_links(&comment));
        }
        comment.clear();
    }
    found
}

/// A comment without the targets of its links, which mean nothing outside the docs of the crate.
fn without_links(comment: &str) -> String {
    let mut parts = comment.split("](");
    let mut text = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        text.push_str(part.split_once(')').map_or(part, |(_, behind)| behind));
    }
    text.replace("[`", "`")
}

/// A run's values of a block's ports.
#[derive(Clone, Debug)]
pub struct Trace {
    /// The block.
    pub block: BlockText,
    /// For each cycle the value of each port, before the rising edge that ends the cycle.
    pub cycles: Vec<Vec<Word>>,
}

/// The engine in rust-hdl's simulation, with the ports of the described blocks recorded in every cycle.
pub struct Recorder {
    engine: Box<dyn Design>,
    entries: Vec<Entry>,
    traces: Vec<Trace>,
}

impl Recorder {
    /// Starts the engine of `model`.
    ///
    /// # Errors
    /// As [`blocks`].
    pub fn new(model: &Model) -> Result<Self, DescribeError> {
        let engine = engine(model)?;
        let entries = entries(EngineKind::Parallel);
        let blocks = describe(Ports::of(&*engine, &entries));
        let traces = blocks.into_iter().map(|block| Trace { block, cycles: Vec::new() }).collect();
        Ok(Recorder { engine, entries, traces })
    }

    /// What was recorded, one trace per block.
    pub fn into_traces(self) -> Vec<Trace> {
        self.traces
    }
}

impl crate::device::Device for Recorder {
    fn cycle(&mut self, inputs: &crate::device::Inputs) -> crate::device::Outputs {
        let Recorder { engine, entries, traces } = self;
        crate::simulate::cycle(&mut **engine, inputs, |engine| {
            let mut ports = Ports::of(engine, entries);
            for trace in traces {
                let values = ports.found.remove(trace.block.instance).unwrap_or_default();
                trace.cycles.push(values.into_iter().map(|(.., value)| value).collect());
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use dermis_golden::spec::partition::Case;
    use dermis_golden::spec::scene::Scene;

    fn model(adaptive: bool) -> Model {
        let mut scene = Scene::builtin("eight-by-eight").unwrap();
        if adaptive {
            scene.partition.case = Case::Adaptive;
        }
        Model::new(&scene).unwrap()
    }

    #[test]
    fn every_port_has_its_meaning_and_says_when_it_is_valid() {
        let all = blocks(&model(true)).unwrap();
        assert_eq!(all.len(), entries(EngineKind::Parallel).len());
        for block in &all {
            assert!(!block.purpose.is_empty() && block.ports.len() >= 3, "{block:?}");
            for port in &block.ports {
                assert!(!port.meaning.is_empty() && !port.valid.is_empty(), "{}: {port:?}", block.name);
            }
        }
    }

    #[test]
    fn comments_have_no_links() {
        let source = "/// As `a` of\n/// [`Ram`](super::Ram), or [`b`](B); then.\npub port: Wire<Out>,\n";
        assert_eq!(comments(source)["port"], "As `a` of `Ram`, or `b`; then.");
    }

    #[test]
    fn ports_are_those_of_the_scene() {
        let model = model(false);
        let fold = block(&model, "fold").unwrap();
        let port = |name: &str| fold.ports.iter().find(|port| port.name == name).unwrap();
        assert_eq!(port("folded").bits, 4 * model.formats().fold_bits as usize);
        assert!(port("folded").output && !port("normalised").output);
        let error = block(&model, "choose").unwrap_err().to_string();
        assert!(error.contains("no block \"choose\"; its blocks: prepare, receive, normalise, fold"), "{error}");
    }

    #[test]
    fn ports_of_either_engine_have_the_comments_of_its_own_blocks() {
        for engine in [EngineKind::Parallel, EngineKind::Serial] {
            let mut model = model(true);
            if engine == EngineKind::Serial {
                let mut scene = Scene::builtin("eight-by-eight").unwrap();
                scene.hardware.board = "icebreaker".into();
                model = Model::new(&scene).unwrap();
            }
            let entries = entries(engine);
            let (comment, ports) = (port_comments(engine), Ports::of(&*design(&model).unwrap(), &entries));
            for entry in &entries {
                for (name, ..) in &ports.found[entry.instance] {
                    assert!(
                        comment(entry.instance, name).is_some_and(|text| !text.is_empty()),
                        "{} {name}",
                        entry.instance
                    );
                }
            }
        }
        // The same instance and port, in different words.
        let [parallel, serial] =
            [EngineKind::Parallel, EngineKind::Serial].map(|e| port_comments(e)("unfold", "address"));
        assert!(parallel.is_some() && serial.is_some() && parallel != serial, "{parallel:?} {serial:?}");
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
