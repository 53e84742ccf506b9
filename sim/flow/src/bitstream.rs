//! Makes a bitstream.

use std::path::{Path, PathBuf};

use anyhow::{bail, Result};
use dermis_golden::fixed::plan::resources::count_bits;
use dermis_golden::fixed::Model;
use dermis_golden::spec::board::{Board, Tries};
use dermis_golden::spec::scene::Scene;
use dermis_golden::write::write;
use dermis_hdl::link::generate_board;

use super::baseline::{self, Baseline, Baselines};
use super::family::{flow, Part, Routing, YOSYS};
use super::floor_plan;
use super::pins::check_pins;
use super::place::{Design, Seeds};
use super::register_packing::PackedRegisters;
use super::synthesis::{self, NETLIST};
use super::timing::{Clock, Placed, WantedClock};
use super::tools::ToolError;
use crate::progress::Progress;
use dermis_golden::quantile::median;

/// Name of the outermost module, in the board's Verilog, which instantiates the board top.
const TOP: &str = "board";

/// A scene placed and routed for its board.
#[derive(Clone, Debug, PartialEq)]
pub struct Made {
    /// Cells of the best seed and clocks of all seeds.
    pub achieved: Baseline,
    /// Registers that were moved into multipliers.
    pub packed: PackedRegisters,
    /// The link's own clock, which has its pin's name, if the link has one.
    pub link_clock: Option<Clock>,
    /// Path of the bitstream; none if a clock is missed.
    pub bitstream: Option<PathBuf>,
    /// Missed clocks and regressions against the baseline.
    pub failures: Vec<String>,
}

/// How to place and route.
#[derive(Clone, Copy, Debug)]
pub struct Effort {
    /// Number of seeds; `None`: from the board's file.
    pub seeds: Option<u32>,
    /// Number of seeds in parallel.
    pub jobs: u32,
    /// If the clock is met, write the results into the baselines instead of comparing with them.
    pub update_baselines: bool,
}

/// Makes the bitstream of `model` in the folder `<build_dir>/<scene>/<board>`.
///
/// # Errors
/// [`BoardError`](dermis_golden::spec::board::BoardError): a board without pins or with files that do not suit it.
/// [`ToolError`]: a tool is missing or failed; no seed that could be routed, a clock that differs from the board's file.
pub fn make(model: &Model, build_dir: &Path, effort: Effort) -> Result<Made> {
    let (scene, board) = (&model.scene, &model.board);
    let (pins, _) = board.pin_file()?;
    require_converters(model)?;
    let Some(routing) = &flow(board.family).routing else {
        bail!("{}: no place and route of {}", board.file(), board.family.name())
    };
    for tool in [YOSYS, routing.place, routing.pack] {
        tool.version()?;
    }
    let folder = build_dir.join(&scene.name).join(&board.name);
    let product = format!("{}.{}", scene.name, routing.bitstream);
    let seeds = effort.seeds.unwrap_or(board.seeds);
    let design = Design {
        name: &board.name,
        routing,
        part: part(board),
        folder: &folder,
        netlist: NETLIST,
        pins: &pins,
        bitstream: &product,
        clocks: clocks(model),
        tries: Tries { seeds, ..board.tries() },
    };
    design.remove_bitstream()?;
    let packed = synthesise(model, &folder)?;
    let placed = design.place(Seeds::All { jobs: effort.jobs })?;
    let best = &placed[0];
    check_constraints(board, &best.clocks)?;
    let achieved = summarise_seeds(routing, &placed);
    let mut failures = best.missed();
    let met = failures.is_empty();
    if met {
        design.pack(best)?;
    }
    failures.extend(compare_or_update_baselines(effort.update_baselines && met, board, scene, &achieved)?);
    let link_clock = best.clocks.get(1).cloned();
    Ok(Made { achieved, packed, link_clock, bitstream: met.then(|| folder.join(product)), failures })
}

/// The board's device.
fn part(board: &Board) -> Part {
    // Present wherever there are pins.
    let named = |name: &Option<String>| name.clone().unwrap_or_default();
    Part { size: named(&board.size), package: named(&board.package), speed_grade: board.speed_grade }
}

/// The engine's clock, which the board's PLL makes, and that of the link where it has its own, by its pin (SPI).
fn clocks(model: &Model) -> Vec<WantedClock> {
    let engine = WantedClock { name: "clk".to_owned(), net: None, MHz: model.board.clock_MHz };
    let link = model.scene.hardware.link.clock().zip(model.board.spi_MHz);
    let link = link.map(|(pin, MHz)| WantedClock { name: pin.to_owned(), net: Some(pin.to_owned()), MHz });
    [engine].into_iter().chain(link).collect()
}

/// Checks that the converters of a scan are on the board.
///
/// # Errors
/// [`BoardError`](dermis_golden::spec::board::BoardError) with those of the board and of the scene.
fn require_converters(model: &Model) -> Result<()> {
    let Some(scan) = model.scene.hardware.adc_scan else { return Ok(()) };
    let wants = vec![scan.converter.name; scan.converters];
    if model.board.converters == wants {
        return Ok(());
    }
    let reason = format!(
        "converters = {has:?}, but hardware.adc_scan of scene {scene} has {wants:?}",
        has = model.board.converters,
        scene = model.scene.name,
    );
    Err(model.board.invalid("converters", reason).into())
}

/// Checks that the clock constraints seen by place and route are those of the board's file.
fn check_constraints(board: &Board, clocks: &[Clock]) -> Result<()> {
    let Some(Clock { wanted, fmax, .. }) = clocks.iter().find(|clock| !clock.is_constrained()) else { return Ok(()) };
    let (wants, has) = (wanted.MHz, fmax.constraint);
    let Some(pin) = &wanted.net else {
        let reason = format!("clock_MHz = {wants}, but the PLL of its Verilog gives {has} MHz");
        return Err(board.invalid("clock_MHz", reason).into());
    };
    let pins = board.path_of(board.pins.as_deref().unwrap_or_default());
    Err(board.invalid("spi_MHz", format!("spi_MHz = {wants}, but {pins} constrains {pin} to {has} MHz")).into())
}

/// Synthesises the board's Verilog to the netlist for place and route.
fn synthesise(model: &Model, folder: &Path) -> Result<PackedRegisters> {
    let _progress = Progress::start(&format!("{}: synthesis", model.scene.name));
    let generated = generate_board(model)?;
    let board = &model.board;
    let (verilog, pins) = (board.verilog_files()?, board.pin_file()?);
    std::fs::create_dir_all(folder).map_err(ToolError::io(folder))?;
    let own = generated.files.iter().map(|file| (&file.name, &file.text));
    let boards = verilog.iter().chain([&pins]).map(|(name, text)| (name, text));
    if let Some((name, _)) = boards.clone().find(|(name, _)| own.clone().any(|(own, _)| own == *name)) {
        let reason = format!("verilog: {name}: a generated file has this name; it must be another one");
        return Err(board.invalid("verilog", reason).into());
    }
    for (name, text) in own.chain(boards) {
        write(&folder.join(name), text.as_bytes())?;
    }
    let link = model.scene.hardware.link.name().to_uppercase();
    let (top, names) = (&generated.top, verilog.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>().join(" "));
    let row_bits = count_bits(model.scene.sensor.rows);
    let scan = model.scene.hardware.adc_scan.map_or(String::new(), |_| format!("-D DERMIS_ROW_BITS={row_bits} "));
    let of_board = format!("-D DERMIS_TOP={top} -D DERMIS_{link} {scan}{names}");
    check_pins(board, folder, &of_board, TOP, &pins.1)?;
    let packed = synthesis::synthesise(folder, board.family, &format!("{of_board} {top}.v"), TOP)?;
    if let Some(blocks) = &board.multiplier_blocks {
        synthesis::edit(folder, |netlist| floor_plan::assign_sites(netlist, TOP, blocks))?;
    }
    Ok(packed)
}

/// The engine's clock over all seeds, and the cells of the best one, the first.
fn summarise_seeds(routing: &Routing, placed: &[Placed]) -> Baseline {
    let engine = |placed: &Placed| placed.clocks[0].fmax.achieved;
    // The median is taken of periods: of an even number of seeds it is then the slower of the two middle ones.
    let periods = || placed.iter().map(|placed| 1.0 / engine(placed));
    let rounded = |clock: f64| (clock * 10.0).round() / 10.0;
    let best = &placed[0];
    let count = |prefix| best.count(prefix).used;
    Baseline {
        luts: count(routing.lut),
        flip_flops: count(routing.flip_flop),
        multipliers: count(routing.multiplier),
        block_rams: count(routing.block_ram),
        best_MHz: rounded(engine(best)),
        median_MHz: rounded(median(periods().collect()).map_or(engine(best), |period| 1.0 / period)),
        worst_MHz: rounded(1.0 / periods().fold(0.0, f64::max)),
        seeds: placed.len() as u32,
    }
}

/// Writes the baseline, or returns the regressions against it.
fn compare_or_update_baselines(update: bool, board: &Board, scene: &Scene, achieved: &Baseline) -> Result<Vec<String>> {
    let path = baseline::path(board);
    let mut all = Baselines::read(&path)?;
    if update {
        all.0.entry(board.name.clone()).or_default().insert(scene.name.clone(), achieved.clone());
        all.write(&path)?;
        return Ok(Vec::new());
    }
    Ok(all.get(&board.name, &scene.name).map_or_else(Vec::new, |was| was.regressions(achieved)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::timing::Fmax;
    use std::collections::BTreeMap;

    fn clock(net: Option<&str>, MHz: f64, achieved: f64, constraint: f64) -> Clock {
        let wanted = WantedClock { name: String::new(), net: net.map(str::to_owned), MHz };
        Clock { wanted, fmax: Fmax { achieved, constraint }, longest_path: None }
    }

    fn placed(achieved: f64) -> Placed {
        let clocks = vec![clock(None, 100.0, achieved, 100.0)];
        Placed { seed: 1, placer: String::new(), clocks, cells: BTreeMap::new() }
    }

    #[test]
    fn the_median_of_two_seeds_is_the_slower_one() {
        let seeds = [107.2, 94.52, 101.0].map(placed);
        let routing = flow(dermis_golden::spec::board::Family::Ecp5).routing.unwrap();
        let clocks = |seeds: &[Placed]| {
            let achieved = summarise_seeds(&routing, seeds);
            [achieved.best_MHz, achieved.median_MHz, achieved.worst_MHz]
        };
        assert_eq!(clocks(&seeds), [107.2, 101.0, 94.5]);
        assert_eq!(clocks(&seeds[..2]), [107.2, 94.5, 94.5]);
    }

    #[test]
    fn a_clock_constraint_that_differs_from_the_board_file_is_an_error() {
        let board = Board::load("icebreaker").unwrap();
        let check = |engine: f64, link: f64| {
            let clocks = [clock(None, 25.5, 99.0, engine), clock(Some("spi_sclk"), 25.0, 99.0, link)];
            check_constraints(&board, &clocks).map_err(|error| error.to_string())
        };
        assert_eq!(check(25.505, 25.0), Ok(()));
        let wanted = "constraints/icebreaker.toml, line 14: clock_MHz = 25.5, but the PLL of its Verilog gives 12 MHz";
        assert_eq!(check(12.0, 25.0), Err(wanted.to_string()));
        let wanted = "constraints/icebreaker.toml, line 19: spi_MHz = 25, but constraints/icebreaker.pcf constrains \
                      spi_sclk to 12 MHz";
        assert_eq!(check(25.5, 12.0), Err(wanted.to_string()));
    }
}
