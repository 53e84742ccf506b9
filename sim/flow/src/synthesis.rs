//! Synthesis: Verilog in a folder to a netlist, for place and route and for the netlist co-simulation.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use dermis_golden::plain_words::JsonError;
use dermis_golden::spec::board::Family;
use dermis_golden::write::write;
use serde_json::Value;

use super::family::{flow, YOSYS};
use super::register_packing::{pack_registers, PackedRegisters};
use super::timing::Used;
use super::tools::ToolError;

/// File name of the netlist, in Yosys's JSON format.
pub const NETLIST: &str = "netlist.json";
/// Time limit of Yosys and of the bitstream packer, min.
pub const MINUTES: u32 = 60;

/// Synthesises the module `top` to [`NETLIST`] in `folder`; `read` are the arguments of Yosys's `read_verilog`.
///
/// # Errors
/// [`ToolError`]: no Yosys, a design that it refuses, files that cannot be used.
pub fn synthesise(folder: &Path, family: Family, read: &str, top: &str) -> Result<PackedRegisters, ToolError> {
    let commands = commands(family, top);
    run(folder, format!("read_verilog {read}; {commands}"), "synthesis.log")?;
    match family {
        Family::Ecp5 => edit(folder, |netlist| pack_registers(netlist, top)),
        // Yosys already moves registers into SB_MAC16 and DSP48E1.
        Family::Ice40 | Family::Artix7 => Ok(PackedRegisters::default()),
    }
}

/// Yosys commands that synthesise the module `top`, once it is read, to [`NETLIST`].
pub fn commands(family: Family, top: &str) -> String {
    flow(family).synthesis.replace("{top}", top).replace("{netlist}", NETLIST)
}

/// Runs a Yosys script in `folder`; its output goes to the file `log`.
///
/// # Errors
/// As [`super::tools::Tool::run`].
pub fn run(folder: &Path, script: String, log: &str) -> Result<(), ToolError> {
    YOSYS.run(folder, &["-q".to_owned(), "-p".to_owned(), script], log, MINUTES)
}

/// Number of cells of each type in the outermost module of a netlist.
///
/// # Errors
/// [`ToolError`]: a file that cannot be read or parsed.
pub fn cells(path: &Path) -> Result<BTreeMap<String, Used>, ToolError> {
    let netlist = read(path)?;
    let mut modules = netlist["modules"].as_object().into_iter().flat_map(|modules| modules.values());
    let top = modules.find(|module| module["attributes"].get("top").is_some());
    let mut counts = BTreeMap::<String, Used>::new();
    for cell in top.and_then(|top| top["cells"].as_object()).into_iter().flat_map(|cells| cells.values()) {
        counts.entry(cell["type"].as_str().unwrap_or_default().to_owned()).or_default().used += 1;
    }
    Ok(counts)
}

fn read(path: &Path) -> Result<Value, ToolError> {
    let wrong = |error| ToolError::Output { path: path.to_owned(), reason: JsonError::new(&error).to_string() };
    serde_json::from_slice(&fs::read(path).map_err(ToolError::io(path))?).map_err(wrong)
}

/// Applies `edit` to the netlist in `folder` and returns its result.
///
/// # Errors
/// [`ToolError`]: a file that cannot be read, parsed or written.
pub fn edit<T>(folder: &Path, edit: impl FnOnce(&mut Value) -> T) -> Result<T, ToolError> {
    let path = folder.join(NETLIST);
    let wrong = |error: serde_json::Error| ToolError::Output { path: path.clone(), reason: error.to_string() };
    let mut netlist = read(&path)?;
    let done = edit(&mut netlist);
    write(&path, &serde_json::to_vec(&netlist).map_err(wrong)?)?;
    Ok(done)
}
