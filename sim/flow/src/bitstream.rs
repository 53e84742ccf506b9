//! Makes a bitstream.

use std::path::{Path, PathBuf};

use anyhow::{anyhow, bail, Result};
use dermis_golden::fixed::plan::resources::count_bits;
use dermis_golden::fixed::Model;
use dermis_golden::spec::board::Board;
use dermis_golden::spec::scene::Scene;
use dermis_golden::write::write;
use dermis_hdl::link::generate_board;

use super::baseline::{self, Baseline, Baselines};
use super::family::{flow, Routing, YOSYS};
use super::floor_plan;
use super::pins::check_pins;
use super::register_packing::PackedRegisters;
use super::synthesis::{self, NETLIST};
use super::timing::{Fmax, Placed};
use super::tools::ToolError;
use crate::jobs::{parallel, Interrupt};
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
    /// The link's own clock with its pin, if the link has one.
    pub link_clock: Option<(&'static str, Fmax)>,
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

/// A design on its way to a bitstream.
struct Design<'a> {
    model: &'a Model,
    routing: &'a Routing,
    /// Folder of all files.
    folder: &'a Path,
    /// Name of the pin file.
    pins: &'a str,
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
    let packed = synthesise(model, &folder)?;
    let seeds = effort.seeds.unwrap_or(board.seeds);
    let design = Design { model, routing, folder: &folder, pins: &pins };
    let placed = place(&design, seeds, effort.jobs)?;
    let better =
        |a: &Placed, b: &Placed| a.is_met().cmp(&b.is_met()).then(a.engine.achieved.total_cmp(&b.engine.achieved));
    let (best_seed, best) = placed.iter().max_by(|(_, a), (_, b)| better(a, b)).ok_or_else(|| {
        anyhow!("{}: none of {seeds} seeds could be placed and routed; logs in {}", scene.name, folder.display())
    })?;
    check_constraints(board, best)?;
    let product = format!("{}.{}", scene.name, routing.bitstream);
    let achieved = summarise_seeds(routing, &placed, best);
    let of = |(name, clock): (&str, Fmax)| format!("{name} {:.1} MHz of {} MHz", clock.achieved, clock.constraint);
    let mut failures: Vec<String> = best.clocks().filter(|(_, clock)| !clock.is_met()).map(of).collect();
    let met = failures.is_empty();
    if met {
        let arguments = routing.pack_arguments(&format!("{}.config", seed_prefix(*best_seed)), &product);
        routing.pack.run(&folder, &arguments, "pack.log", synthesis::MINUTES)?;
    }
    failures.extend(compare_or_update_baselines(effort.update_baselines && met, board, scene, &achieved)?);
    Ok(Made { achieved, packed, link_clock: best.link, bitstream: met.then(|| folder.join(product)), failures })
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
fn check_constraints(board: &Board, placed: &Placed) -> Result<()> {
    let differs = |has: f64, wants: f64| (has / wants - 1.0).abs() > 1e-3;
    let (has, wants) = (placed.engine.constraint, board.clock_MHz);
    if differs(has, wants) {
        let reason = format!("clock_MHz = {wants}, but the PLL of its Verilog gives {has} MHz");
        return Err(board.invalid("clock_MHz", reason).into());
    }
    if let (Some((pin, clock)), Some(wants)) = (placed.link, board.spi_MHz) {
        let (pins, has) = (board.path_of(board.pins.as_deref().unwrap_or_default()), clock.constraint);
        if differs(has, wants) {
            let reason = format!("spi_MHz = {wants}, but {pins} constrains {pin} to {has} MHz");
            return Err(board.invalid("spi_MHz", reason).into());
        }
    }
    Ok(())
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

/// Places and routes with seeds 1 … `seeds`, `jobs` at a time; returns the seeds that completed.
fn place(design: &Design, seeds: u32, jobs: u32) -> Result<Vec<(u32, Placed)>> {
    let what = format!("{}: place and route", design.model.board.name);
    let place = |seed| match place_seed(design, seed) {
        // A seed that does not converge is skipped as long as there are others.
        Err(ToolError::Late { .. } | ToolError::Stuck { .. } | ToolError::Failed { .. }) if seeds > 1 => Ok(None),
        placed => Ok(Some((seed, placed?))),
    };
    let placed = parallel(&what, (1..=seeds).collect(), jobs as usize, &Interrupt::default(), place)?;
    Ok(placed.into_iter().flatten().collect())
}

/// Prefix of a seed's files.
fn seed_prefix(seed: u32) -> String {
    format!("seed{seed}")
}

/// Iterations of nextpnr's static placer after which it does not converge: where it does, it takes a third of them.
const MOST_ITERATIONS: u32 = 1500;

/// Whether the end of nextpnr's log says that its placer does not converge.
fn is_stuck(log: &str) -> bool {
    let iteration = log.rsplit_once("iter=").and_then(|(_, rest)| rest.split_whitespace().next()?.parse::<u32>().ok());
    iteration.is_some_and(|iteration| iteration > MOST_ITERATIONS)
}

/// Places and routes one seed with the first of the board's placers that converges.
fn place_seed(design: &Design, seed: u32) -> Result<Placed, ToolError> {
    let Design { model, routing, folder, pins } = design;
    let board = &model.board;
    let name = seed_prefix(seed);
    let mut last = Err(ToolError::Missing { tool: routing.place.name });
    for placer in &board.placers {
        let arguments = routing.place_arguments(board, [NETLIST, pins], seed, placer, &name);
        let log = format!("{name}.{placer}.log");
        last = routing.place.run_unless(folder, &arguments, &log, board.place_minutes, is_stuck);
        if last.is_ok() {
            break;
        }
    }
    last?;
    let report = folder.join(format!("{name}.report.json"));
    Placed::read(&report, synthesis::cells(folder, TOP)?, model.scene.hardware.link.clock())
}

/// Clock figures over all seeds, and the cells of the `best`.
fn summarise_seeds(routing: &Routing, placed: &[(u32, Placed)], best: &Placed) -> Baseline {
    // The median is taken of periods: of an even number of seeds it is then the slower of the two middle ones.
    let periods = || placed.iter().map(|(_, placed)| 1.0 / placed.engine.achieved);
    let rounded = |clock: f64| (clock * 10.0).round() / 10.0;
    Baseline {
        luts: best.count(routing.lut),
        flip_flops: best.count(routing.flip_flop),
        multipliers: best.count(routing.multiplier),
        block_rams: best.count(routing.block_ram),
        best_MHz: rounded(best.engine.achieved),
        median_MHz: rounded(median(periods().collect()).map_or(best.engine.achieved, |period| 1.0 / period)),
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
    use std::collections::BTreeMap;

    fn placed(achieved: f64) -> Placed {
        Placed { engine: Fmax { achieved, constraint: 100.0 }, link: None, cells: BTreeMap::new() }
    }

    #[test]
    fn the_median_of_two_seeds_is_the_slower_one() {
        let seeds = [(1, placed(94.52)), (2, placed(107.2)), (3, placed(101.0))];
        let routing = flow(dermis_golden::spec::board::Family::Ecp5).routing.unwrap();
        let clocks = |seeds: &[(u32, Placed)]| {
            let achieved = summarise_seeds(&routing, seeds, &seeds[1].1);
            [achieved.best_MHz, achieved.median_MHz, achieved.worst_MHz]
        };
        assert_eq!(clocks(&seeds), [107.2, 101.0, 94.5]);
        assert_eq!(clocks(&seeds[..2]), [107.2, 94.5, 94.5]);
    }

    #[test]
    fn a_placer_is_stuck_after_many_iterations() {
        let log =
            |iteration: u32| format!("Info: iter={iteration} steplen=1.9 a=1.0\nInfo: overlap: COMB=4.7%, RAM=24.8%\n");
        assert!([log(1500), String::new(), "iter=".into()].iter().all(|log| !is_stuck(log)));
        assert!(is_stuck(&(log(1500) + &log(1501))));
    }

    #[test]
    fn a_clock_constraint_that_differs_from_the_board_file_is_an_error() {
        let board = Board::load("icebreaker").unwrap();
        let check = |engine: f64, link: f64| {
            let clock = |constraint| Fmax { achieved: 99.0, constraint };
            let link = Some(("spi_sclk", clock(link)));
            let placed = Placed { engine: clock(engine), link, cells: BTreeMap::new() };
            check_constraints(&board, &placed).map_err(|error| error.to_string())
        };
        assert_eq!(check(25.505, 25.0), Ok(()));
        let wanted = "constraints/icebreaker.toml, line 14: clock_MHz = 25.5, but the PLL of its Verilog gives 12 MHz";
        assert_eq!(check(12.0, 25.0), Err(wanted.to_string()));
        let wanted = "constraints/icebreaker.toml, line 19: spi_MHz = 25, but constraints/icebreaker.pcf constrains \
                      spi_sclk to 12 MHz";
        assert_eq!(check(25.5, 12.0), Err(wanted.to_string()));
    }
}
