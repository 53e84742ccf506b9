//! `dermis bitstream`: a scene as a bitstream for its board, by open tools.
//!
//! ```text
//! scene -> board top (Verilog) --yosys--> netlist --absorb--> netlist --nextpnr, several seeds--> best --pack--> bitstream
//!          pins, PLL of constraints ---^                                                          |
//!                                                                   cells, clocks -> table, baselines
//! ```
//! Everything stands in `<build-dir>/<scene>/<board>/`, with a log per tool.

pub mod absorb;
pub mod baseline;
pub mod family;
pub mod synthesis;
pub mod timing;
pub mod tools;

use std::path::Path;

use anyhow::{anyhow, Result};
use clap::Args;
use dermis_golden::board::Board;
use dermis_golden::fixed::Model;
use dermis_golden::scene::Scene;
use dermis_golden::write::write;
use dermis_hdl::link::generate_board;

use crate::compare::median;
use crate::jobs::{parallel, Interrupt};
use crate::progress::Progress;
use crate::report::{self, Implemented};
use absorb::Absorbed;
use baseline::{Baseline, Baselines, FILE};
use family::{flow, pack_arguments, place_arguments, Flow, YOSYS};
use synthesis::NETLIST;
use timing::Placed;
use tools::ToolError;

/// Name of the board's own module, around the board top.
const TOP: &str = "board";

/// What `dermis bitstream` is asked for.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  dermis bitstream eight-by-eight
  dermis bitstream eight-by-eight --board icebreaker
  dermis bitstream sensor-1 --seeds 5 --jobs 2 --update-baselines")]
pub struct Arguments {
    /// Built-in name or path of a scene.
    scene: String,
    /// Board in place of the scene's own, a file's name in constraints.
    #[arg(long, value_name = "NAME")]
    board: Option<String>,
    /// Seeds of place and route; without it as many as the board's file says.
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..))]
    seeds: Option<u32>,
    /// Tries at a time; each takes a core and about a gigabyte.
    #[arg(long, default_value_t = 2, value_parser = clap::value_parser!(u32).range(1..))]
    jobs: u32,
    /// Write what was reached into constraints/baselines.json in place of comparing with it.
    #[arg(long)]
    update_baselines: bool,
    /// Print the result as JSON and nothing else.
    #[arg(long)]
    json: bool,
}

/// Makes the bitstream; the text for stdout, and whether the clock is met and nothing got worse.
///
/// # Errors
/// The scene's and the board's; [`ToolError`] for what a tool did not do.
pub fn run(arguments: &Arguments, build_dir: &Path) -> Result<(String, bool)> {
    let mut scene = Scene::load(&arguments.scene)?;
    if let Some(board) = &arguments.board {
        scene.hardware.board.clone_from(board);
    }
    let model = Model::new(&scene)?;
    let board = &model.board;
    let flow = flow(board.family);
    for tool in [YOSYS, flow.place, flow.pack] {
        tool.version()?;
    }
    let folder = build_dir.join(&scene.name).join(&board.name);
    let absorbed = synthesise(&model, &folder)?;
    let seeds = arguments.seeds.unwrap_or(board.seeds);
    let placed = place(board, &flow, &folder, seeds, arguments.jobs)?;
    let (best_seed, best) =
        placed.iter().max_by(|(_, a), (_, b)| a.fmax_MHz.total_cmp(&b.fmax_MHz)).ok_or_else(|| {
            anyhow!("{}: no seed of {seeds} could be placed and routed; logs in {}", scene.name, folder.display())
        })?;
    if (best.clock_MHz / board.clock_MHz - 1.0).abs() > 1e-3 {
        let (file, has, wants) = (&board.name, best.clock_MHz, board.clock_MHz);
        return Err(anyhow!("constraints/{file}.v: its PLL gives {has} MHz, {file}.toml says clock_MHz = {wants}"));
    }
    let product = format!("{}.{}", scene.name, flow.bitstream);
    let reached = reached(&flow, &placed, best);
    let mut lost = Vec::new();
    if best.is_met() {
        let arguments = pack_arguments(board.family, &format!("{}.config", try_name(*best_seed)), &product);
        flow.pack.run(&folder, &arguments, "pack.log", synthesis::MINUTES)?;
    } else {
        lost.push(format!("{:.1} MHz, the board's clock is {} MHz", best.fmax_MHz, best.clock_MHz));
    }
    lost.extend(baselines(arguments.update_baselines, board, &scene, &reached)?);
    let implemented = Implemented::new(&model, reached, absorbed, best.is_met().then(|| folder.join(product)), lost);
    let good = implemented.is_good();
    Ok((
        if arguments.json { serde_json::to_string(&implemented)? + "\n" } else { report::implemented(&implemented) },
        good,
    ))
}

/// Verilog to the netlist that is placed.
fn synthesise(model: &Model, folder: &Path) -> Result<Absorbed> {
    let _progress = Progress::start(&format!("{}: synthesis", model.scene.name));
    let generated = generate_board(model)?;
    let board_files = model.board.files()?;
    std::fs::create_dir_all(folder).map_err(ToolError::io(folder))?;
    let own = generated.files.iter().map(|file| (&file.name, file.text.as_str()));
    for (name, text) in own.chain(board_files.iter().map(|(name, text)| (name, *text))) {
        let path = folder.join(name);
        write(&path, text.as_bytes())?;
    }
    let read = format!("-D DERMIS_TOP={top} {board}.v {top}.v", top = generated.top, board = model.board.name);
    Ok(synthesis::synthesise(folder, model.board.family, &read, TOP)?)
}

/// Places and routes with seeds 1 … `seeds`, `jobs` at a time; those that came to an end.
fn place(board: &Board, flow: &Flow, folder: &Path, seeds: u32, jobs: u32) -> Result<Vec<(u32, Placed)>> {
    let what = format!("{}: place and route", board.name);
    let place = |seed| match place_seed(board, flow, folder, seed) {
        // What a seed does not converge to is no error of the call.
        Err(ToolError::Late { .. } | ToolError::Failed { .. }) if seeds > 1 => Ok(None),
        placed => Ok(Some((seed, placed?))),
    };
    let placed = parallel(&what, (1..=seeds).collect(), jobs as usize, &Interrupt::default(), place)?;
    Ok(placed.into_iter().flatten().collect())
}

/// What a seed's files begin with.
fn try_name(seed: u32) -> String {
    format!("seed{seed}")
}

/// One seed, by the first placer that converges.
fn place_seed(board: &Board, flow: &Flow, folder: &Path, seed: u32) -> Result<Placed, ToolError> {
    let name = try_name(seed);
    let mut last = Err(ToolError::Missing { tool: flow.place.name });
    for placer in &board.placers {
        let arguments = place_arguments(board, NETLIST, seed, placer, &name);
        last = flow.place.run(folder, &arguments, &format!("{name}.{placer}.log"), board.place_minutes);
        if last.is_ok() {
            break;
        }
    }
    last?;
    Placed::read(&folder.join(format!("{name}.report.json")), synthesis::cells(folder, TOP)?)
}

/// The figures of all seeds; cells of the `best`.
fn reached(flow: &Flow, placed: &[(u32, Placed)], best: &Placed) -> Baseline {
    let clocks = || placed.iter().map(|(_, placed)| placed.fmax_MHz);
    let rounded = |clock: f64| (clock * 10.0).round() / 10.0;
    Baseline {
        luts: best.count(flow.lut),
        flip_flops: best.count(flow.flip_flop),
        multipliers: best.count(flow.multiplier),
        block_rams: best.count(flow.block_ram),
        best_MHz: rounded(best.fmax_MHz),
        median_MHz: rounded(median(clocks().collect()).unwrap_or(best.fmax_MHz)),
        worst_MHz: rounded(clocks().fold(best.fmax_MHz, f64::min)),
        seeds: placed.len() as u32,
    }
}

/// Writes the baseline, or says in what the scene has become worse than its one.
fn baselines(update: bool, board: &Board, scene: &Scene, reached: &Baseline) -> Result<Vec<String>> {
    let path = Path::new(FILE);
    let mut all = Baselines::read(path)?;
    if update {
        all.0.entry(board.name.clone()).or_default().insert(scene.name.clone(), reached.clone());
        all.write(path)?;
        return Ok(Vec::new());
    }
    Ok(all.get(&board.name, &scene.name).map_or_else(Vec::new, |was| was.losses(reached)))
}
