//! `dermis place`: places and routes a netlist that is not of a scene and a board, as the gateware of `dermis_litex`.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use anyhow::{bail, Result};
use clap::Args;
use dermis_flow::family::{flow, Part, Routing, YOSYS};
use dermis_flow::place::{Design, Seeds};
use dermis_flow::progress::Progress;
use dermis_flow::timing::{Clock, LongestPath, Placed, Used, WantedClock};
use dermis_flow::tools::ToolError;
use dermis_golden::spec::board::{Family, Tries};
use serde::{Serialize, Serializer};

/// Arguments of `dermis place`.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  dermis place top.json --family ecp5 --size 25k --package CABGA256 --speed-grade 6 --clock clk=pll_clkout:50
  dermis place board.ys --family ecp5 --size 45k --package CABGA381 --speed-grade 6 --clock core=pll:62.5 --clock rx=eth_rx:125
  dermis place top.json --family ice40 --size up5k --package sg48 --clock clk=clk12:12 --seeds 10")]
pub struct Arguments {
    /// A netlist of Yosys, NAME.json, or a script of Yosys that writes it, NAME.ys; the pins are in NAME.lpf or NAME.pcf beside it.
    design: PathBuf,
    /// Family of the device.
    #[arg(long, value_parser = family)]
    family: Family,
    /// Size of the device, as nextpnr names it.
    #[arg(long)]
    size: String,
    /// Its package, as nextpnr names it.
    #[arg(long)]
    package: String,
    /// Its speed grade, in families that have several.
    #[arg(long, value_name = "N")]
    speed_grade: Option<u32>,
    /// A clock, a part of the name that its net alone has, and the frequency that it must reach; every clock must be named.
    #[arg(long = "clock", value_name = "NAME=NET:MHZ", value_parser = clock, required = true)]
    clocks: Vec<WantedClock>,
    /// Most seeds to try until one reaches all clocks; default: the family's.
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..))]
    seeds: Option<u32>,
    /// Time limit of each run of a tool, min; default: the family's.
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..))]
    minutes: Option<u32>,
}

fn family(text: &str) -> Result<Family, String> {
    let routed: Vec<_> = Family::NAMES.into_iter().filter(|(_, family)| flow(*family).routing.is_some()).collect();
    let names = || routed.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(", ");
    let found = routed.iter().find(|(name, _)| *name == text).map(|(_, family)| *family);
    found.ok_or_else(|| format!("must be one of {}", names()))
}

fn clock(text: &str) -> Result<WantedClock, String> {
    let parts = text.split_once('=').and_then(|(name, rest)| Some((name, rest.rsplit_once(':')?)));
    let clock = parts.and_then(|(name, (net, MHz))| {
        let MHz = MHz.parse().ok().filter(|MHz: &f64| MHz.is_finite() && *MHz > 0.0)?;
        let named = !name.is_empty() && !net.is_empty();
        named.then(|| WantedClock { name: name.to_owned(), net: Some(net.to_owned()), MHz })
    });
    clock.ok_or_else(|| "must be as core=pll_clkout:62.5".to_owned())
}

/// What came out: of the best seed cells and clocks, of which those that are missed.
#[derive(Debug, Serialize)]
struct Figures<'a> {
    cells: Cells,
    #[serde(serialize_with = "by_name")]
    clocks: &'a [Clock],
    seed: u32,
    placer: &'a str,
    is_met: bool,
    missed: Vec<String>,
    bitstream: Option<&'a str>,
    tools: BTreeMap<&'static str, String>,
}

#[derive(Debug, Serialize)]
struct Cells {
    luts: Used,
    flip_flops: Used,
    block_rams: Used,
    multipliers: Used,
}

#[derive(Debug, Serialize)]
struct ClockFigures<'a> {
    net: Option<&'a str>,
    wanted_MHz: f64,
    reached_MHz: f64,
    longest_path: Option<&'a LongestPath>,
}

/// A map in the order of the command line.
fn by_name<S: Serializer>(clocks: &[Clock], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_map(clocks.iter().map(|clock| {
        let Clock { wanted: WantedClock { name, net, MHz }, longest_path, .. } = clock;
        let (reached_MHz, longest_path) = (clock.reached_MHz(), longest_path.as_ref());
        (name, ClockFigures { net: net.as_deref(), wanted_MHz: *MHz, reached_MHz, longest_path })
    }))
}

/// Places and routes: the figures as JSON, and whether all clocks are reached; only then there is a bitstream.
///
/// # Errors
/// A file with another ending; a tool that is missing or failed; clocks of nextpnr that are not those of the command line, by name or
/// frequency.
pub fn run(arguments: &Arguments) -> Result<(String, bool)> {
    let Arguments { design: path, family, size, package, speed_grade, clocks, seeds, minutes } = arguments;
    let [name, ending] = [path.file_stem(), path.extension()].map(|part| part.and_then(|part| part.to_str()));
    let (Some(name), Some(ending @ ("json" | "ys"))) = (name, ending) else {
        bail!("{}: must be a netlist, NAME.json, or a script of Yosys that writes it, NAME.ys", path.display())
    };
    let (Some(routing), Some(pins)) = (flow(*family).routing, family.pin_file_extension()) else {
        bail!("no place and route of {}", family.name())
    };
    let file = |ending: &str| format!("{name}.{ending}");
    let yosys = (ending == "ys").then_some(YOSYS);
    let tools = [routing.place, routing.pack].into_iter().chain(yosys).map(|tool| Ok((tool.name, tool.version()?)));
    let tools = tools.collect::<Result<_, ToolError>>()?;
    let tries = family.tries()?;
    let design = Design {
        name,
        routing: &routing,
        part: Part { size: size.clone(), package: package.clone(), speed_grade: *speed_grade },
        folder: path.parent().filter(|folder| *folder != Path::new("")).unwrap_or(Path::new(".")),
        netlist: &file("json"),
        pins: &file(pins),
        bitstream: &file(routing.bitstream),
        clocks: clocks.clone(),
        tries: Tries { seeds: seeds.unwrap_or(tries.seeds), minutes: minutes.unwrap_or(tries.minutes), ..tries },
    };
    design.remove_bitstream()?;
    if let Some(yosys) = yosys {
        let _progress = Progress::start(&format!("{name}: synthesis"));
        let script = ["-q", "-l", &file("rpt"), &file("ys")].map(str::to_owned);
        yosys.run(design.folder, &script, "synthesis.log", design.tries.minutes)?;
    }
    let placed = design.place(Seeds::UntilMet)?;
    let best = &placed[0];
    if let Some(Clock { wanted, fmax, .. }) = best.clocks.iter().find(|clock| !clock.is_constrained()) {
        bail!("clock {}: nextpnr was told {:.3} MHz, not {}", wanted.name, fmax.constraint, wanted.MHz);
    }
    let is_met = best.is_met();
    if is_met {
        design.pack(best)?;
    }
    let figures = Figures {
        cells: cells(&routing, best),
        clocks: &best.clocks,
        seed: best.seed,
        placer: &best.placer,
        is_met,
        missed: best.missed(),
        bitstream: is_met.then_some(design.bitstream),
        tools,
    };
    Ok((serde_json::to_string_pretty(&figures)? + "\n", is_met))
}

fn cells(routing: &Routing, placed: &Placed) -> Cells {
    Cells {
        luts: placed.count(routing.lut),
        flip_flops: placed.count(routing.flip_flop),
        block_rams: placed.count(routing.block_ram),
        multipliers: placed.count(routing.multiplier),
    }
}
