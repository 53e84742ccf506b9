//! `dermis block`: ports, source, Verilog and drawn timing of the blocks that the guide describes.
//!
//! Ports and their meaning are those of [`dermis_hdl::describe`].

use std::path::{Path, PathBuf};

use anyhow::{anyhow, Result};
use clap::Args;
use dermis_golden::fixed::Model;
use dermis_golden::spec::partition::Case;
use dermis_golden::spec::scene::Scene;
use dermis_golden::write::write;
use dermis_hdl::describe::{block, block_source, block_verilog, blocks};

use super::inputs::BoardOverride;
use dermis_cosim::block_timing::{traces, SCENE};
use dermis_report as report;

/// What `dermis block` is asked for.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  dermis block                                       the blocks of sensor-1
  dermis block fold                                  its ports: width, meaning, when they are valid
  dermis block search --scene eight-by-eight --json
  dermis block choose --case adaptive                a stage of scenes that choose the case per frame
  dermis block normalise --verilog                   ports with comments, and the body of the module
  dermis block fold --timing fold.svg                its ports during a frame, drawn")]
pub struct Arguments {
    /// The block; without it all blocks are listed.
    name: Option<String>,
    /// Built-in name or path of a scene, which decides the widths.
    #[arg(long, default_value = SCENE)]
    scene: String,
    /// Partition case in place of the scene's: 0 to 3, ROWSxCOLS, adaptive.
    #[arg(long)]
    case: Option<Case>,
    /// Print the table of the ports, as without any option.
    #[arg(long, requires = "name")]
    ports: bool,
    /// Print the block as a module; only for blocks with a kernel of their own.
    #[arg(long, requires = "name", conflicts_with_all = ["ports", "json", "timing"])]
    verilog: bool,
    /// Print the Rust source of the block, its test included.
    #[arg(long, requires = "name", conflicts_with_all = ["ports", "json", "timing", "verilog"])]
    source: bool,
    /// Simulate the scene's first shipped frame and draw the block's ports into this SVG file.
    #[arg(long, value_name = "SVG", requires = "name", conflicts_with_all = ["ports", "json"])]
    timing: Option<PathBuf>,
    /// Print JSON and nothing else.
    #[arg(long, conflicts_with = "ports")]
    json: bool,
    #[command(flatten)]
    target: BoardOverride,
}

/// What is to be printed.
///
/// # Errors
/// A scene that cannot be loaded or has the serial engine, a block that it does not have, a file that cannot be written.
pub fn run(arguments: &Arguments, build: &Path) -> Result<String> {
    let mut scene = arguments.target.apply(Scene::load(&arguments.scene)?);
    scene.partition.case = arguments.case.unwrap_or(scene.partition.case);
    let model = Model::new(&scene)?;
    let Some(name) = &arguments.name else {
        let all = blocks(&model)?;
        return match arguments.json {
            true => Ok(serde_json::to_string(&all)? + "\n"),
            false => Ok(report::blocks(&all)),
        };
    };
    let described = block(&model, name)?;
    if arguments.source {
        return Ok(block_source(&model, name)?.to_owned());
    }
    if arguments.verilog {
        return Ok(block_verilog(&model, name)?);
    }
    if let Some(path) = &arguments.timing {
        let traces = traces(&scene, build)?;
        let trace = traces.iter().find(|trace| trace.block.name == name);
        let trace = trace.ok_or_else(|| anyhow!("{name}: not recorded"))?;
        write(path, report::timing_picture(&scene.name, trace)?.text.as_bytes())?;
        return Ok(format!("{}\n", path.display()));
    }
    match arguments.json {
        true => Ok(serde_json::to_string(&described)? + "\n"),
        false => Ok(report::ports(&described)),
    }
}
