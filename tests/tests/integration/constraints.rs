//! The timing constraints of a generated top module, as an interpreter of Tcl with stand-ins for the commands of SDC reads them, against
//! its registers as Yosys reads the Verilog: each clock has its period, no two clocks are timed against each other, and no reset is
//! asynchronous but the chip select of an SPI.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use dermis_golden::fixed::Model;
use dermis_golden::spec::link_kind::LinkKind;
use dermis_golden::spec::scene::Scene;
use dermis_hdl::bus::{generate_core, Bus, CoreShape};
use dermis_hdl::link::generate_board;
use dermis_hdl::scan::generate_scan;
use dermis_hdl::{generate, Generated};
use dermis_tests::tools::{folder_of, yosys};
use serde_json::Value;

/// Ports of a design by what they are for its registers and memories.
#[derive(Debug, PartialEq)]
struct Registers {
    clocks: BTreeSet<String>,
    /// Asynchronous resets.
    resets: BTreeSet<String>,
}

/// Those of the design in `folder`, once it is one module.
fn registers(folder: &Path, top: &str) -> Registers {
    let others = "t:$aldff t:$aldffe t:$dffsr t:$dffsre t:$dlatch t:$adlatch t:$dlatchsr t:$sr";
    let script = format!(
        "read_verilog {top}.v; hierarchy -check -top {top}; proc; flatten; opt_clean; select -assert-none {others}; \
         write_json registers.json"
    );
    yosys(folder, &script).unwrap();
    let netlist: Value = serde_json::from_slice(&fs::read(folder.join("registers.json")).unwrap()).unwrap();
    let module = &netlist["modules"][top];
    let cells = module["cells"].as_object().unwrap();
    let port = |net: u64| {
        let is_own = |(_, port): &(&String, &Value)| port["bits"] == serde_json::json!([net]);
        let found = module["ports"].as_object().unwrap().iter().find(is_own);
        found.unwrap_or_else(|| panic!("{net} is no port")).0.clone()
    };
    // A memory that is read without a clock has a constant in its place.
    let nets =
        |pin: &str| cells.values().filter_map(|cell| cell["connections"][pin][0].as_u64()).collect::<BTreeSet<_>>();
    let [clocks, resets] = ["CLK", "ARST"].map(|pin| nets(pin).into_iter().map(port).collect());
    Registers { clocks, resets }
}

/// Period in ns by port, and the groups of clocks that are not timed against each other, as written down by stand-ins.
#[derive(Debug, Default, PartialEq)]
struct Constraints {
    periods: BTreeMap<String, String>,
    asynchronous: Vec<String>,
}

/// Reads `text`; any other command, and another form of one, is an error.
fn read(folder: &Path, text: &str) -> Result<Constraints, String> {
    fs::write(folder.join("own.sdc"), text).unwrap();
    let stand_ins = "\
set calls [open calls.txt w]
proc get_ports {name} { return $name }
proc get_clocks {name} { return $name }
proc create_clock {n name p period port} {
  if {\"$n $p\" ne {-name -period}} { error \"create_clock $n $p\" }
  if {$name ne $port} { error \"$port is called $name\" }
  puts $::calls \"period $port $period\"
}
proc set_clock_groups {how args} {
  if {$how ne {-asynchronous}} { error \"set_clock_groups $how\" }
  foreach {g clocks} $args { puts $::calls \"group $clocks\" }
}
source own.sdc
close $calls
";
    fs::write(folder.join("read.tcl"), stand_ins).unwrap();
    yosys(folder, "tcl read.tcl")?;
    let mut read = Constraints::default();
    for line in fs::read_to_string(folder.join("calls.txt")).unwrap().lines() {
        match *line.split(' ').collect::<Vec<_>>() {
            ["period", port, ns] => drop(read.periods.insert(port.to_owned(), ns.to_owned())),
            ["group", clock] => read.asynchronous.push(clock.to_owned()),
            _ => return Err(format!("unknown: {line}")),
        }
    }
    Ok(read)
}

/// The file of a generated top module, which has one.
fn text(generated: &Generated) -> &str {
    let name = format!("{}.sdc", generated.top);
    let all: Vec<_> = generated.files.iter().filter(|file| file.name.ends_with(".sdc")).collect();
    assert!(all.len() == 1 && all[0].name == name, "{name}");
    &all[0].text
}

/// That `wanted` clocks, by port and period in ns, are those of the registers and of the constraints.
fn check(generated: &Generated, wanted: &[(&str, &str)]) {
    let folder = folder_of(generated);
    let read = read(folder.path(), text(generated)).unwrap();
    let ports: BTreeSet<String> = read.periods.keys().cloned().collect();
    let registers = registers(folder.path(), &generated.top);
    assert_eq!(registers.clocks, ports, "{}", generated.top);
    let resets: &[&str] = if wanted.len() > 1 { &["spi_cs_n"] } else { &[] };
    assert!(registers.resets.iter().eq(resets), "{}: {:?}", generated.top, registers.resets);
    let owned = |text: &str| text.to_owned();
    assert_eq!(read.periods, wanted.iter().map(|(port, ns)| (owned(port), owned(ns))).collect(), "{}", generated.top);
    let apart: Vec<String> = wanted.iter().map(|(port, _)| owned(port)).collect();
    assert_eq!(read.asynchronous, if wanted.len() > 1 { apart } else { Vec::new() }, "{}", generated.top);
}

/// A scene whose hardware takes little time.
const STILL: &str = include_str!("../../soc/still.toml");
/// What it has besides where the hardware scans the array.
const SCAN: &str = "[input]\nfull_scale_MPa = 0.5\n[hardware]\nsource = \"adc-scan\"\n[hardware.adc_scan]\n\
                    converter = \"max11125\"\nsclk_MHz = 12.5\nperiod_us = 1000\n";

fn still() -> Scene {
    Scene::parse(STILL, "still.toml").unwrap()
}

/// A scene for the serial engine on a board of 25.5 MHz, whose SPI has up to 25 MHz.
fn serial(link: LinkKind) -> Model {
    let mut scene = Scene::builtin("eight-by-eight").unwrap();
    scene.hardware.board = Some("icebreaker".into());
    scene.hardware.link = link;
    Model::new(&scene).unwrap()
}

#[test]
fn each_clock_of_a_register_has_its_period() {
    let model = Model::new(&still()).unwrap();
    check(&generate(&model).unwrap(), &[("clk", "10.000")]);
    for bus in [Bus::AxiLite, Bus::Wishbone] {
        check(&generate_core(&model, CoreShape { bus, words: 1 }).unwrap(), &[("aclk", "10.000")]);
    }
    let scanned = Scene::parse(&format!("{STILL}{SCAN}"), "scanned").unwrap();
    check(&generate_scan(&Model::new(&scanned).unwrap()).unwrap(), &[("clk", "10.000")]);
    // The clock is that of the board.
    let model = serial(LinkKind::Uart);
    check(&generate(&model).unwrap(), &[("clk", "39.215")]);
    check(&generate_board(&model).unwrap(), &[("clk", "39.215")]);
    let spi = generate_board(&serial(LinkKind::Spi)).unwrap();
    check(&spi, &[("clk", "39.215"), ("spi_sclk", "40.000")]);
}

#[test]
fn the_same_design_has_the_same_bytes() {
    let text = |name: &str| {
        let mut scene = still();
        scene.name = name.into();
        text(&generate(&Model::new(&scene).unwrap()).unwrap()).to_owned()
    };
    assert_eq!(text("still"), text("still"));
    assert_ne!(text("still"), text("other"));
}

#[test]
fn a_clock_that_is_left_out_and_a_command_that_is_unknown_are_found() {
    let board = generate_board(&serial(LinkKind::Spi)).unwrap();
    let folder = folder_of(&board);
    let lines = text(&board).lines().filter(|line| !line.starts_with("create_clock -name spi_sclk"));
    let without: String = lines.map(|line| format!("{line}\n")).collect();
    let ports: BTreeSet<String> = read(folder.path(), &without).unwrap().periods.into_keys().collect();
    assert_ne!(registers(folder.path(), &board.top).clocks, ports);
    for (right, wrong) in [("create_clock -name", "create_clock -period"), ("set_clock_groups", "set_clocks_apart")] {
        assert!(read(folder.path(), &text(&board).replace(right, wrong)).is_err(), "{wrong}");
    }
}
