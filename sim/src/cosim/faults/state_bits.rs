//! Every state bit of a design: registers and memories, read from Verilator's XML listing.
//!
//! A register is a variable written by a non-blocking assignment. A memory is one that the resource model lists; it is
//! a ROM where nothing writes it. Nothing is listed by hand, so that new registers are covered automatically.

use std::collections::{BTreeMap, BTreeSet};

use anyhow::{anyhow, Result};
use dermis_hdl::language::SEPARATOR;
use dermis_hdl::usage::{stage, PlacedMemory};
use roxmltree::{Document, Node};
use serde::Serialize;

/// Kind of storage that holds a bit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum StorageClass {
    /// Memories that are never written: coefficients, column lists, calibration.
    Rom,
    /// Memories that are written: buffers, operands.
    Ram,
    /// Registers.
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
    pub stage: String,
    /// Instance path from the design's top, separated by dots; empty at the top.
    pub scope: String,
    /// Name of the variable in that instance.
    pub signal: String,
    /// Number of words.
    pub words: usize,
    /// Bits per word.
    pub bits: usize,
}

/// Reads the state elements of `dut`, the design's instance in the bench, from Verilator's listing.
///
/// # Errors
/// A listing that cannot be parsed, or that does not contain all `memories`.
pub fn state_elements(listing: &str, dut: &str, memories: &[PlacedMemory]) -> Result<Vec<StateElement>> {
    let document = Document::parse(listing).map_err(|error| anyhow!("Verilator's listing: {error}"))?;
    let modules: BTreeMap<&str, Node> = document
        .descendants()
        .filter(|node| node.has_tag_name("module"))
        // `origName` is the name that cells refer to, with dollar signs unescaped.
        .filter_map(|node| Some((node.attribute("origName")?, node)))
        .collect();
    let widths = Widths::new(&document);
    let mut all = Vec::new();
    for cell in document.descendants().filter(|node| node.has_tag_name("cell")) {
        let (Some(path), Some(module)) = (cell.attribute("hier"), cell.attribute("submodname")) else { continue };
        let Some(own) = path.strip_prefix(dut).filter(|rest| rest.is_empty() || rest.starts_with('.')) else {
            continue;
        };
        let (own, Some(module)) = (own.trim_start_matches('.'), modules.get(module)) else { continue };
        let block = own.replace('.', SEPARATOR);
        let stage = stage(&block);
        let mut scan = Scan::default();
        scan.scan_module(*module, own);
        for ((scope, signal), kind) in &scan.declared {
            let listed = memories.iter().any(|memory| memory.block == block && memory.array == *signal);
            let class = match (listed, scan.assigned.contains(&(scope.clone(), signal.clone()))) {
                (true, false) => StorageClass::Rom,
                (true, true) => StorageClass::Ram,
                (false, true) => StorageClass::Register,
                (false, false) => continue,
            };
            let [words, bits] = widths.of(kind).ok_or_else(|| anyhow!("no width of {scope}.{signal}"))?;
            let (stage, scope, signal) = (stage.to_owned(), scope.clone(), signal.clone());
            all.push(StateElement { class, stage, scope, signal, words, bits });
        }
    }
    let found = all.iter().filter(|element| element.class != StorageClass::Register).count();
    match found == memories.len() {
        true => Ok(all),
        false => Err(anyhow!("{found} of {} memories are in Verilator's listing", memories.len())),
    }
}

/// Variables of a module, and those written by non-blocking assignments; both by scope and name.
#[derive(Default)]
struct Scan {
    declared: BTreeMap<(String, String), String>,
    assigned: BTreeSet<(String, String)>,
}

impl Scan {
    fn scan_module(&mut self, node: Node, scope: &str) {
        for child in node.children().filter(Node::is_element) {
            let name = child.attribute("name").unwrap_or_default();
            match child.tag_name().name() {
                "var" => {
                    let kind = child.attribute("dtype_id").unwrap_or_default().to_owned();
                    self.declared.insert((scope.to_owned(), name.to_owned()), kind);
                }
                // Unrolled generate loops are named blocks.
                "begin" if !name.is_empty() => self.scan_module(
                    child,
                    &[scope, name].into_iter().filter(|s| !s.is_empty()).collect::<Vec<_>>().join("."),
                ),
                "assigndly" => {
                    child.children().rfind(Node::is_element).iter().for_each(|to| self.add_target(*to, scope))
                }
                _ => self.scan_module(child, scope),
            }
        }
    }

    /// Adds the target of an assignment: a variable, a selection of one, or a concatenation.
    fn add_target(&mut self, target: Node, scope: &str) {
        let mut parts = target.children().filter(Node::is_element);
        match target.tag_name().name() {
            "varref" => {
                let name = target.attribute("name").unwrap_or_default().to_owned();
                // Declared in this scope or an enclosing one.
                let mut scopes = std::iter::successors(Some(scope), |s| s.rsplit_once('.').map(|(outer, _)| outer));
                let own = scopes.find(|s| self.declared.contains_key(&((*s).to_owned(), name.clone())));
                self.assigned.insert((own.unwrap_or_default().to_owned(), name));
            }
            "concat" => parts.for_each(|part| self.add_target(part, scope)),
            // The first child of a selection is the variable, the others are indices.
            _ => parts.next().iter().for_each(|part| self.add_target(*part, scope)),
        }
    }
}

/// Words and bits of the types in the listing, by their id.
struct Widths<'a>(BTreeMap<&'a str, Node<'a, 'a>>);

impl<'a> Widths<'a> {
    fn new(document: &'a Document) -> Self {
        let table = document.descendants().filter(|node| node.has_tag_name("typetable"));
        let types = table.flat_map(|table| table.children()).filter(Node::is_element);
        Widths(types.filter_map(|node| Some((node.attribute("id")?, node))).collect())
    }

    fn of(&self, id: &str) -> Option<[usize; 2]> {
        let node = self.0.get(id)?;
        let length = |[a, b]: [usize; 2]| a.abs_diff(b) + 1;
        match node.tag_name().name() {
            "basicdtype" => {
                let end = |name| node.attribute(name).unwrap_or("0").parse().ok();
                Some([1, length([end("left")?, end("right")?])])
            }
            "unpackarraydtype" => {
                let ends = node.descendants().filter(|node| node.has_tag_name("const"));
                let ends: Vec<usize> = ends.filter_map(|end| number(end.attribute("name")?)).collect();
                let [words, bits] = self.of(node.attribute("sub_dtype_id")?)?;
                Some([words * length(ends.try_into().ok()?), bits])
            }
            _ => self.of(node.attribute("sub_dtype_id")?),
        }
    }
}

/// Parses a Verilog number as in Verilator's listing: `32'sh1f`.
fn number(text: &str) -> Option<usize> {
    usize::from_str_radix(text.rsplit_once('h')?.1, 16).ok()
}
