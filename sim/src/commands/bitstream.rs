//! `dermis bitstream`: makes the bitstream of a scene for its board with open tools.

use std::path::Path;

use anyhow::{ensure, Result};
use clap::Args;
use dermis_golden::fixed::Model;
use dermis_golden::spec::board::SEARCH_WIDTHS;
use dermis_golden::spec::scene::Scene;

use super::inputs::note_hardware;
use dermis_flow::baseline::{with_search_width, Baselines};
use dermis_flow::bitstream::{make, Effort};
use dermis_flow::progress::Progress;
use dermis_report::{self as report, BitstreamReport, Summary};

/// Arguments of `dermis bitstream`.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  dermis bitstream eight-by-eight
  dermis bitstream eight-by-eight --board icebreaker
  dermis bitstream eight-by-eight --board ./my-board.toml      a board of your own
  dermis bitstream sensor-1 --search-width 2         a variant with half the search, with baselines of its own
  dermis bitstream sensor-1 --seeds 5 --jobs 2 --update-baselines
  dermis bitstream --committed --board ulx3s-85f")]
pub struct Arguments {
    /// Built-in name or path of a scene.
    #[arg(required_unless_present = "committed")]
    scene: Option<String>,
    /// Board to use instead of the scene's: a name that `dermis boards` lists, or the path of a file that ends with .toml.
    #[arg(long, visible_alias = "target-board", value_name = "BOARD")]
    board: Option<String>,
    /// Taxels per cycle of the search, in the place of the scene's or the board's; SCENE-width-N is the variant's name.
    #[arg(long, value_name = "N", value_parser = search_width)]
    search_width: Option<usize>,
    /// Number of place-and-route seeds; default: from the board's file.
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..))]
    seeds: Option<u32>,
    /// Number of seeds to run in parallel; each takes a core and about 1 GB of memory.
    #[arg(long, default_value_t = 2, value_parser = clap::value_parser!(u32).range(1..))]
    jobs: u32,
    /// If the clock is met, write the results into baselines.json beside the board's file instead of comparing with it.
    #[arg(long)]
    update_baselines: bool,
    /// Print the result as JSON and nothing else.
    #[arg(long)]
    json: bool,
    /// Print the table of constraints/baselines.json, of SCENE or all built-in ones, and run no tool.
    #[arg(long, conflicts_with_all = ["search_width", "seeds", "jobs", "update_baselines", "json"])]
    committed: bool,
}

fn search_width(text: &str) -> Result<usize, String> {
    let width = text.parse().ok().filter(|width| SEARCH_WIDTHS.contains(width));
    width.ok_or_else(|| format!("must be one of {}", SEARCH_WIDTHS.map(|width| width.to_string()).join(", ")))
}

/// Makes the bitstream: the text for stdout, and whether the clock is met without a regression against the baseline.
///
/// # Errors
/// An invalid scene or board; a tool that is missing or failed.
pub fn run(arguments: &Arguments, build_dir: &Path) -> Result<(String, bool)> {
    let Some(scene) = arguments.scene.as_ref().filter(|_| !arguments.committed) else {
        return Ok((committed(arguments.scene.as_deref(), arguments.board.as_deref())?, true));
    };
    let mut scene = Scene::load(scene)?;
    scene.hardware.board = arguments.board.clone().or(scene.hardware.board);
    let scene = match arguments.search_width {
        Some(width) => with_search_width(scene, width),
        None => scene,
    };
    note_hardware(&scene)?;
    let model = Model::new(&scene)?;
    let Arguments { seeds, jobs, update_baselines, .. } = *arguments;
    let made = make(&model, build_dir, Effort { seeds, jobs, update_baselines })?;
    let report = BitstreamReport::new(&model, made);
    let good = report.is_good();
    Ok((if arguments.json { serde_json::to_string(&report)? + "\n" } else { report::bitstream(&report) }, good))
}

/// The table of the committed baselines of built-in scenes, of one scene or board where that is named; the tests' own
/// scenes are left out.
fn committed(scene: Option<&str>, board: Option<&str>) -> Result<String> {
    let _progress = Progress::start("models of the baselines");
    let mut all = Vec::new();
    for (of, baseline) in Baselines::committed().built_in() {
        let named =
            scene.is_none_or(|scene| scene == of.name) && board.is_none_or(|board| board == of.hardware.board_name());
        if named {
            all.push(Summary::new(&Model::new(&of)?, baseline.clone()));
        }
    }
    ensure!(!all.is_empty(), "no committed baseline of scene {scene:?} on board {board:?}");
    Ok(report::summaries(&all))
}
