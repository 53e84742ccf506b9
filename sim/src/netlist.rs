//! The netlist after synthesis as a simulated device: the same vectors, the same bits, the same cycles.
//!
//! ```text
//! Verilog --yosys--> cells of the family --absorb--> netlist.v + models of the cells --> Verilator
//! ```
//! It finds what a simulation of the Verilog cannot: constructs that the simulator reads differently from the
//! synthesiser, and cells or registers that the flow itself has put wrong. The stages' streams are gone in a netlist; beats
//! and cycle counts are what is compared.

use std::fs;
use std::path::Path;

use dermis_golden::board::Family;
use dermis_golden::write::write;
use dermis_hdl::{Generated, GeneratedFile};

use crate::artifact_cache;
use crate::bitstream::family::YOSYS;
use crate::bitstream::synthesis::{run, synthesise, NETLIST};
use crate::bitstream::tools::ToolError;
use crate::progress::Progress;
use crate::verilator::fingerprint;

/// Our models of ECP5 cells that Yosys has none for.
const ECP5_CELLS: &str = include_str!("../cells/ecp5.v");
/// Yosys's models of iCE40 cells give unconnected inputs their values by defaults, which Verilator has not.
const ICE40_DEFINES: &str = "`define NO_ICE40_DEFAULT_ASSIGNMENTS\n";
/// The netlist as Verilog.
const VERILOG: &str = "netlist.v";
/// What Verilator says of files that tools have written: widths, loops through carry chains, memories of two clocks, models
/// with a time scale beside a netlist without.
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

/// Synthesises `generated` for `family`, or takes the netlist from below `cache`; it comes with its cells' models, in the
/// place of the Verilog.
///
/// # Errors
/// [`ToolError`]: no Yosys or none that has its models beside it, or a design that it refuses.
pub fn netlist(generated: &Generated, family: Family, cache: &Path) -> Result<Generated, ToolError> {
    // What Yosys reads; the other files may change without a change of the netlist.
    let read: Vec<&GeneratedFile> = generated.files.iter().filter(|file| is_read(&file.name)).collect();
    let texts: Vec<(&str, &str)> = read.iter().map(|file| (file.name.as_str(), file.text.as_str())).collect();
    let version = format!("{family:?} {}", YOSYS.version()?);
    let folder = cache.join(format!("netlist-{}", fingerprint(&texts, &version)));
    let path = folder.join(VERILOG);
    if !artifact_cache::is_intact(&folder, VERILOG) {
        make(&read, &generated.top, family, &folder)?;
    }
    let text = fs::read_to_string(&path).map_err(ToolError::io(&path))?;
    let waivers = WAIVED.map(|rule| format!("lint_off -rule {rule} -file \"*\"\n")).concat();
    let file = |name: &str, text: String| GeneratedFile { name: name.to_owned(), text };
    let waivers = format!("`verilator_config\n{waivers}");
    Ok(Generated {
        files: vec![file(VERILOG, text), file("cells.v", cells(family)?), file("netlist.vlt", waivers)],
        taps: Vec::new(),
        ..generated.clone()
    })
}

/// Whether Yosys reads a file of that name: Verilog, and the memories it names.
fn is_read(name: &str) -> bool {
    name.ends_with(".v") || name.ends_with(".hex")
}

/// Makes the netlist of `files` that `folder` is to hold.
fn make(files: &[&GeneratedFile], top: &str, family: Family, folder: &Path) -> Result<(), ToolError> {
    let work = artifact_cache::staging_folder(folder)?;
    for file in files {
        write(&work.path().join(&file.name), file.text.as_bytes())?;
    }
    let _progress = Progress::start(&format!("{top}: netlist"));
    synthesise(work.path(), family, &format!("{top}.v"), top)?;
    // Without the cells, which Yosys has as empty modules.
    let script = format!("read_json {NETLIST}; select {top}; write_verilog -noattr -selected {VERILOG}");
    run(work.path(), script, "verilog.log")?;
    Ok(artifact_cache::publish(work, folder, VERILOG)?)
}

/// Models of the family's cells: Yosys's, and ours where it has none.
fn cells(family: Family) -> Result<String, ToolError> {
    let (folder, own) = match family {
        Family::Ecp5 => ("ecp5", ECP5_CELLS),
        Family::Ice40 => ("ice40", ICE40_DEFINES),
    };
    let share = YOSYS.share()?.join(folder);
    let path = share.join("cells_sim.v");
    let text = fs::read_to_string(&path).map_err(ToolError::io(&path))?;
    let mut models = own.to_owned();
    let mut replaced = false;
    for line in text.lines() {
        let name = line.strip_prefix("module ").and_then(|rest| rest.split('(').next()).map(str::trim);
        // Yosys has an empty module where ours is the model.
        replaced |= name.is_some_and(|name| own.contains(&format!("\nmodule {name} (")));
        // Files that it includes are pasted in: the compiled design is one set of texts.
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
