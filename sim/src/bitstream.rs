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
pub mod timing;
pub mod tools;

use std::path::Path;
use std::sync::Mutex;

use anyhow::{anyhow, Result};
use clap::Args;
use dermis_golden::board::{Board, Family};
use dermis_golden::fixed::Model;
use dermis_golden::scene::Scene;
use dermis_hdl::link::generate_board;
use serde_json::Value;

use crate::progress::Progress;
use crate::report::{self, Implemented};
use absorb::{absorb, Absorbed};
use baseline::{Baseline, Baselines, FILE};
use family::{flow, pack_arguments, place_arguments, Flow, YOSYS};
use timing::Placed;
use tools::ToolError;

/// Name of the board's own module, around the board top.
const TOP: &str = "board";
/// The netlist that is placed.
pub(crate) const NETLIST: &str = "netlist.json";
/// Time after which synthesis is given up, min.
pub(crate) const SYNTHESIS_MINUTES: u32 = 60;

/// What `dermis bitstream` is asked for.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  dermis bitstream eight-by-eight
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
    let absorbed = synthesise(&model, &flow, &folder)?;
    let seeds = arguments.seeds.unwrap_or(board.seeds);
    let placed = place(board, &flow, &folder, seeds, arguments.jobs)?;
    let (name, best) = placed.iter().max_by(|(_, a), (_, b)| a.fmax_MHz.total_cmp(&b.fmax_MHz)).ok_or_else(|| {
        anyhow!("{}: no seed of {seeds} could be placed and routed; logs in {}", scene.name, folder.display())
    })?;
    if (best.clock_MHz / board.clock_MHz - 1.0).abs() > 1e-3 {
        let (file, has, wants) = (&board.name, best.clock_MHz, board.clock_MHz);
        return Err(anyhow!("constraints/{file}.v: its PLL gives {has} MHz, {file}.toml says clock_MHz = {wants}"));
    }
    let bitstream = folder.join(format!("{}.{}", scene.name, flow.bitstream));
    let reached = reached(&flow, &placed, best);
    let mut lost = Vec::new();
    if best.is_met() {
        let packed = format!("{}.{}", scene.name, flow.bitstream);
        let configuration = format!("{name}.config");
        flow.pack.run(
            &folder,
            &pack_arguments(board.family, &configuration, &packed),
            "pack.log",
            SYNTHESIS_MINUTES,
        )?;
    } else {
        lost.push(format!("{:.1} MHz, the board's clock is {} MHz", best.fmax_MHz, best.clock_MHz));
    }
    lost.extend(baselines(arguments.update_baselines, board, &scene, &reached)?);
    let implemented = Implemented::new(&model, reached, absorbed, best.is_met().then_some(bitstream), lost);
    let good = implemented.is_good();
    Ok((
        if arguments.json { serde_json::to_string(&implemented)? + "\n" } else { report::implemented(&implemented) },
        good,
    ))
}

/// Verilog to the netlist that is placed.
fn synthesise(model: &Model, flow: &Flow, folder: &Path) -> Result<Absorbed> {
    let _progress = Progress::start(&format!("{}: synthesis", model.scene.name));
    let generated = generate_board(model)?;
    let board_files = model.board.files()?;
    std::fs::create_dir_all(folder).map_err(ToolError::io(folder))?;
    let own = generated.files.iter().map(|file| (&file.name, file.text.as_str()));
    for (name, text) in own.chain(board_files.iter().map(|(name, text)| (name, *text))) {
        let path = folder.join(name);
        std::fs::write(&path, text).map_err(ToolError::io(&path))?;
    }
    let script = format!(
        "read_verilog -D DERMIS_TOP={top} {board}.v {top}.v; {synthesis} -top {TOP} -json {NETLIST}",
        top = generated.top,
        board = model.board.name,
        synthesis = flow.synthesis,
    );
    YOSYS.run(folder, &["-q".to_owned(), "-p".to_owned(), script], "synthesis.log", SYNTHESIS_MINUTES)?;
    match model.board.family {
        Family::Ecp5 => Ok(absorb_file(&folder.join(NETLIST), TOP)?),
    }
}

/// Absorbs registers in module `top` of the netlist at `path`.
pub(crate) fn absorb_file(path: &Path, top: &str) -> Result<Absorbed, ToolError> {
    let wrong = |error: serde_json::Error| ToolError::Output { path: path.to_owned(), reason: error.to_string() };
    let text = std::fs::read(path).map_err(ToolError::io(path))?;
    let mut netlist: Value = serde_json::from_slice(&text).map_err(wrong)?;
    let absorbed = absorb(&mut netlist, top);
    std::fs::write(path, serde_json::to_vec(&netlist).map_err(wrong)?).map_err(ToolError::io(path))?;
    Ok(absorbed)
}

/// Places and routes with seeds 1 … `seeds`, `jobs` at a time; those that came to an end, by name.
fn place(board: &Board, flow: &Flow, folder: &Path, seeds: u32, jobs: u32) -> Result<Vec<(String, Placed)>> {
    let bar = Progress::steps(&format!("{}: place and route", board.name), u64::from(seeds));
    let (next, done) = (Mutex::new(1..=seeds), Mutex::new(Vec::new()));
    let next_seed = || next.lock().ok().and_then(|mut seeds| seeds.next());
    std::thread::scope(|scope| {
        for _ in 0..jobs.min(seeds) {
            scope.spawn(|| {
                while let Some(seed) = next_seed() {
                    let outcome = place_seed(board, flow, folder, seed);
                    if let Ok(mut done) = done.lock() {
                        done.push((seed, outcome));
                        bar.at(done.len() as u64);
                    }
                }
            });
        }
    });
    let mut done = done.into_inner().map_err(|_| anyhow!("a try of place and route panicked"))?;
    done.sort_by_key(|(seed, _)| *seed);
    let mut placed = Vec::new();
    for (seed, outcome) in done {
        match outcome {
            Ok(one) => placed.push((format!("seed{seed}"), one)),
            // What a seed does not converge to is no error of the call.
            Err(ToolError::Late { .. } | ToolError::Failed { .. }) if seeds > 1 => {}
            Err(error) => return Err(error.into()),
        }
    }
    Ok(placed)
}

/// One seed, by the first placer that converges.
fn place_seed(board: &Board, flow: &Flow, folder: &Path, seed: u32) -> Result<Placed, ToolError> {
    let name = format!("seed{seed}");
    let mut last = Err(ToolError::Missing { tool: flow.place.name });
    for placer in &board.placers {
        let arguments = place_arguments(board, NETLIST, seed, placer, &name);
        last = flow.place.run(folder, &arguments, &format!("{name}.{placer}.log"), board.place_minutes);
        if last.is_ok() {
            break;
        }
    }
    last?;
    Placed::read(&folder.join(format!("{name}.report.json")))
}

/// The figures of all seeds; cells of the `best`.
fn reached(flow: &Flow, placed: &[(String, Placed)], best: &Placed) -> Baseline {
    let mut clocks: Vec<f64> = placed.iter().map(|(_, placed)| placed.fmax_MHz).collect();
    clocks.sort_by(f64::total_cmp);
    let median = (clocks[(clocks.len() - 1) / 2] + clocks[clocks.len() / 2]) / 2.0;
    let rounded = |clock: f64| (clock * 10.0).round() / 10.0;
    Baseline {
        luts: best.count(flow.lut),
        flip_flops: best.count(flow.flip_flop),
        multipliers: best.count(flow.multiplier),
        block_rams: best.count(flow.block_ram),
        best_MHz: rounded(best.fmax_MHz),
        median_MHz: rounded(median),
        worst_MHz: rounded(clocks[0]),
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
