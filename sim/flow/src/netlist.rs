//! The netlist after synthesis, simulated: the same vectors must give the same bits in the same cycles.
//!
//! ```text
//! Verilog --yosys--> cells of the family --register packing--> netlist.v + models of the cells --> Verilator
//! ```
//! This finds what a simulation of the Verilog cannot: constructs that simulator and synthesiser interpret differently,
//! and errors of the flow's own netlist edits. A netlist has no taps, so that only beats and cycle counts are compared.

use std::fs;
use std::path::Path;

use dermis_golden::spec::board::Family;
use dermis_golden::write::write;
use dermis_hdl::{Generated, GeneratedFile};

use super::family::YOSYS;
use super::synthesis::{run, synthesise, NETLIST};
use super::tools::ToolError;
use crate::artifact_cache::{self, fingerprint};
use crate::progress::Progress;

/// Models of the ECP5 cells for which Yosys has none.
const ECP5_CELLS: &str = include_str!("../cells/ecp5.v");
/// Yosys's models of iCE40 cells use default values for unconnected inputs, which Verilator does not support; this
/// turns them off.
const ICE40_DEFINES: &str = "`define NO_ICE40_DEFAULT_ASSIGNMENTS\n";
/// File name of the netlist as Verilog.
const VERILOG: &str = "netlist.v";
/// Verilator warnings waived for the tools' files: widths, loops through carry chains, memories with two clocks, cell
/// models with a time scale next to a netlist without one.
const WAIVED: [&str; 9] = [
    "CASEINCOMPLETE",
    "COMBDLY",
    "INITIALDLY",
    "MULTIDRIVEN",
    "PINMISSING",
    "TIMESCALEMOD",
    "UNOPTFLAT",
    "UNUSED",
    "WIDTH",
];

/// Synthesises `generated` for `family`, or takes the netlist from `cache`. The result's files are the netlist, the
/// models of its cells and waivers, instead of the Verilog.
///
/// # Errors
/// [`ToolError`]: no Yosys, a Yosys without its cell models, or a design that it refuses.
pub fn netlist(generated: &Generated, family: Family, cache: &Path) -> Result<Generated, ToolError> {
    let cells = cells(family)?;
    // Only what Yosys reads is part of the cache key.
    let read: Vec<&GeneratedFile> = generated.files.iter().filter(|file| is_read(&file.name)).collect();
    let texts: Vec<(&str, &str)> = read.iter().map(|file| (file.name.as_str(), file.text.as_str())).collect();
    let version = format!("{family:?} {}", YOSYS.version()?);
    let folder = cache.join(format!("netlist-{}", fingerprint(&texts, &version)));
    let path = folder.join(VERILOG);
    let _lock = artifact_cache::lock(&folder)?;
    if !artifact_cache::is_intact(&folder, VERILOG) {
        make(&read, &generated.top, family, &folder)?;
    }
    let text = fs::read_to_string(&path).map_err(ToolError::io(&path))?;
    let waivers = WAIVED.map(|rule| format!("lint_off -rule {rule} -file \"*\"\n")).concat();
    let file = |name: &str, text: String| GeneratedFile { name: name.to_owned(), text };
    let waivers = format!("`verilator_config\n{waivers}");
    Ok(Generated {
        files: vec![file(VERILOG, text), file("cells.v", cells), file("netlist.vlt", waivers)],
        taps: Vec::new(),
        ..generated.clone()
    })
}

/// Whether Yosys reads a file of that name: Verilog and memory files.
fn is_read(name: &str) -> bool {
    name.ends_with(".v") || name.ends_with(".hex")
}

/// Synthesises `files` and publishes the netlist as `folder`.
fn make(files: &[&GeneratedFile], top: &str, family: Family, folder: &Path) -> Result<(), ToolError> {
    let work = artifact_cache::staging_folder(folder)?;
    for file in files {
        write(&work.path().join(&file.name), file.text.as_bytes())?;
    }
    let _progress = Progress::start(&format!("{top}: netlist"));
    synthesise(work.path(), family, &format!("{top}.v"), top)?;
    // Writes the top module alone: Yosys has the cells as empty modules.
    let script = format!("read_json {NETLIST}; select {top}; write_verilog -noattr -selected {VERILOG}");
    run(work.path(), script, "verilog.log")?;
    Ok(artifact_cache::publish(work, folder, VERILOG)?)
}

/// Simulation models of the family's cells: Yosys's, or this program's where Yosys has only a black box. Those of
/// Artix-7 were not tried.
fn cells(family: Family) -> Result<String, ToolError> {
    let (folder, own) = match family {
        Family::Ecp5 => ("ecp5", ECP5_CELLS),
        Family::Ice40 => ("ice40", ICE40_DEFINES),
        Family::Artix7 => return Err(ToolError::NoModels { family: family.name() }),
    };
    let share = YOSYS.share()?.join(folder);
    let path = share.join("cells_sim.v");
    let text = fs::read_to_string(&path).map_err(ToolError::io(&path))?;
    let mut models = own.to_owned();
    let mut replaced = false;
    for line in text.lines() {
        let name = line.strip_prefix("module ").and_then(|rest| rest.split('(').next()).map(str::trim);
        // Skips Yosys's black box of a cell that has a model here.
        replaced |= name.is_some_and(|name| own.contains(&format!("\nmodule {name} (")));
        // Included files are inlined, as the compiled design consists of the given texts only.
        match line.trim().strip_prefix("`include \"").and_then(|name| name.strip_suffix('"')) {
            _ if replaced => {}
            Some(name) => {
                let path = share.join(name);
                models.push_str(&fs::read_to_string(&path).map_err(ToolError::io(&path))?);
            }
            None => models.push_str(line),
        }
        models.push('\n');
        replaced &= line.trim() != "endmodule";
    }
    Ok(models)
}
