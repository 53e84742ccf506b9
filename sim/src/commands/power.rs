//! `dermis power`: estimates the power of an engine from the simulated hardware.

use std::path::Path;

use anyhow::Result;
use clap::Args;
use dermis_golden::fixed::Model;

use super::inputs::{note_hardware, resolve, BoardOverride};
use super::layout::LayoutArguments;
use dermis_cosim::hardware::Hardware;
use dermis_cosim::power::{energies, estimate_power};
use dermis_report as report;

/// Arguments of `dermis power`.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  dermis power sensor-1
  dermis power eight-by-eight --target-board icebreaker --json
  dermis power sensor-1 --frame a.json --frame b.csv        of these frames

The Verilog is simulated on the frames, back to back, and the register bits that change are counted. Their energies come from
the file of the device family. An estimate: each figure is a range, calibrated against no board.")]
pub struct Arguments {
    /// Built-in name or path of a scene; optional if the first frame file contains its sensor.
    scene: Option<String>,
    /// Frame file (.json, .csv; .mcap: all frames, .mcap:N: frame N from 1) or `eq2`, repeatable; default: all shipped frames of the scene.
    #[arg(long = "frame", value_name = "FILE")]
    frames: Vec<String>,
    #[command(flatten)]
    layout: LayoutArguments,
    /// Print the estimate as JSON and nothing else.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    target: BoardOverride,
}

/// Runs the command.
///
/// # Errors
/// Wrong input, a scene without hardware, a board whose device has no energies, no Verilator.
pub fn run(arguments: &Arguments, build: &Path) -> Result<String> {
    let (scene, frames) = resolve(arguments.scene.as_deref(), &arguments.frames, &arguments.layout)?;
    let scene = arguments.target.apply(scene);
    let model = Model::for_frames(&scene, &frames)?;
    energies(&model.board)?;
    note_hardware(&scene)?;
    let estimate = estimate_power(&Hardware::new(model, build)?, &frames)?;
    Ok(if arguments.json { serde_json::to_string(&estimate)? + "\n" } else { report::power(&estimate) })
}
