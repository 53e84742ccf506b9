//! Pins: every port of a board's Verilog has its site in the pin file. Place and route would find out after synthesis, or
//! choose a site.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use anyhow::{anyhow, Result};
use dermis_golden::spec::board::{Board, Family};
use serde_json::Value;

use super::synthesis::run;
use super::tools::ToolError;

/// The file in which Yosys writes the ports.
const PORTS: &str = "ports.json";

/// Checks the board's Verilog in `folder` against the text of its pin file; `read` are the arguments of Yosys's
/// `read_verilog` for the board's own files, whose outermost module is `top`.
///
/// # Errors
/// [`BoardError`](dermis_golden::spec::board::BoardError) with the ports without a site, or without an outermost module; Verilog
/// that Yosys refuses.
pub fn check_pins(board: &Board, folder: &Path, read: &str, top: &str, pins: &str) -> Result<()> {
    match run(folder, format!("read_verilog {read}; proc; write_json {PORTS}"), "ports.log") {
        Err(ToolError::Failed { end, .. }) => Err(board.invalid("verilog", format!("verilog: {end}")))?,
        done => done?,
    }
    let path = folder.join(PORTS);
    let text = fs::read(&path).map_err(ToolError::io(&path))?;
    let modules: Value = serde_json::from_slice(&text).map_err(|error| anyhow!("{}: {error}", path.display()))?;
    let Some(module) = modules["modules"].get(top) else {
        let reason = format!("verilog: none of the files has the module {top}, with the board's pins as its ports");
        return Err(board.invalid("verilog", reason).into());
    };
    let sites = sites(board.family, pins);
    let without: Vec<String> = ports(module).into_iter().filter(|port| !sites.contains(port.as_str())).collect();
    if without.is_empty() {
        return Ok(());
    }
    let (path, without) = (board.path_of(board.pins.as_deref().unwrap_or_default()), without.join(", "));
    let reason = format!("pins: {path}: no site for {without}; every port of the module {top} must have one");
    Err(board.invalid("pins", reason).into())
}

/// Names of a module's ports in the JSON of Yosys, of a vector one for each bit, as pin files write them.
fn ports(module: &Value) -> Vec<String> {
    let ports = module["ports"].as_object().into_iter().flatten();
    let names = ports.flat_map(|(name, port)| {
        let bits = port["bits"].as_array().map_or(0, Vec::len) as u64;
        let first = port["offset"].as_u64().unwrap_or(0);
        (first..first + bits).map(move |bit| if bits == 1 { name.clone() } else { format!("{name}[{bit}]") })
    });
    names.collect()
}

/// Names that a pin file gives a site.
fn sites(family: Family, pins: &str) -> BTreeSet<&str> {
    let lines = pins.lines().map(|line| line.split('#').next().unwrap_or_default());
    let lines = lines.map(|line| line.split("//").next().unwrap_or_default());
    match family {
        Family::Ice40 => lines.filter_map(set_io).collect(),
        // Of an Artix-7 there is no pin file.
        Family::Ecp5 | Family::Artix7 => lines.flat_map(|line| line.split(';')).filter_map(locate).collect(),
    }
}

/// The name in `set_io [options] name site` of a .pcf file.
fn set_io(statement: &str) -> Option<&str> {
    let words: Vec<&str> = statement.split_whitespace().collect();
    match words[..] {
        ["set_io", .., name, _] => Some(name),
        _ => None,
    }
}

/// The name in `LOCATE COMP "name" SITE "site"` of a .lpf file.
fn locate(statement: &str) -> Option<&str> {
    let words: Vec<&str> = statement.split_whitespace().collect();
    match words[..] {
        [first, second, name, ..] if first.eq_ignore_ascii_case("LOCATE") && second.eq_ignore_ascii_case("COMP") => {
            Some(name.trim_matches('"'))
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_with_a_site_are_those_of_the_statements() {
        let lpf =
            "# LOCATE COMP \"no\" SITE \"A1\";\nlocate comp \"a\" SITE \"A2\"; LOCATE COMP \"b[0]\" SITE \"A3\";\n\
                   IOBUF PORT \"c\" IO_TYPE=LVCMOS33; // LOCATE COMP \"d\" SITE \"A4\";\n";
        assert_eq!(sites(Family::Ecp5, lpf), BTreeSet::from(["a", "b[0]"]));
        let pcf = "set_io clk 35 # set_io no 1\nset_io -nowarn -pullup yes b[1] 6\nset_frequency clk 12\nset_io x\n";
        assert_eq!(sites(Family::Ice40, pcf), BTreeSet::from(["clk", "b[1]"]));
    }

    #[test]
    fn a_vector_has_a_name_for_each_bit() {
        let module = serde_json::json!({"ports": {
            "clk": {"bits": [2]}, "led": {"bits": [3, 4], "offset": 1}, "x": {"bits": [5, 6]},
        }});
        assert_eq!(ports(&module), ["clk", "led[1]", "led[2]", "x[0]", "x[1]"]);
    }
}
