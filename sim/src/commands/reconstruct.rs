//! `dermis reconstruct`: the forces of one frame, by a model or the hardware.

use std::path::Path;

use anyhow::{anyhow, Result};
use clap::Args;
use dermis_golden::data::frame::Frame;
use dermis_golden::data::reception::full_scale;
use dermis_golden::engine::CheckedEngine;
use dermis_golden::fixed::Model;
use dermis_golden::result::reconstruct::Reconstruction;
use dermis_golden::spec::scene::Scene;

use super::inputs::{note_hardware, resolve_one, BoardOverride};
use super::layout::LayoutArguments;
use super::reconstruct_stream::StreamArguments;
use dermis_cosim::compare::{comparable_forces, difference};
use dermis_flow::progress::Progress;
use dermis_host::engine::{self, EngineName};
use dermis_report as report;

/// Arguments of `dermis reconstruct`.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  dermis reconstruct sensor-1
  dermis reconstruct sensor-1 --frame press.csv --engine fixed
  dermis reconstruct my-scene.toml --frame eq2 --json
  dermis reconstruct sensor-1 --stream <frames.csv >forces.ndjson
  dermis reconstruct sensor-1 --stream=udp:127.0.0.1:9000 --latest --brief
  dermis reconstruct sensor-1 --stream --record touch.mcap <frames.csv >forces.ndjson
  dermis reconstruct averaging.toml --frame 1.csv --frame 2.csv     the mean of 2 frames, input.average = 1

A stream has one frame per line: taxels separated by commas, row-major, or {\"id\": 7, \"stress_MPa\": [0.1, ...]}. Every
line is answered by one of JSON: sequence, line, received_s, answered_s, dropped, and the fields of --json; a bad line by
its number and the error. A recording has both, for dermis replay, dermis live and programs that read ROS 2 messages. The
estimator evidence reads the frames of another one too; checks.cross_check_age in a result says how many results ago.")]
pub struct Arguments {
    /// Built-in name or path of a scene; optional if the frame file contains its sensor.
    scene: Option<String>,
    /// Frame file (.json, .csv, .mcap; .mcap:N: frame N from 1) or `eq2`; default: the scene's first shipped frame. Repeat it 2^k times if the
    /// scene has input.average = k, any number of times with input.mean = "sliding".
    #[arg(long = "frame", value_name = "FILE")]
    frames: Vec<String>,
    #[command(flatten)]
    layout: LayoutArguments,
    /// Model or hardware that computes the forces.
    #[arg(long, value_enum, default_value = "golden")]
    engine: EngineName,
    /// Print the result as JSON and nothing else.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    stream: StreamArguments,
    #[command(flatten)]
    target: BoardOverride,
}

/// Runs the command: the result as text.
///
/// # Errors
/// Wrong input, a scene without hardware where that is asked for, no Verilator.
pub fn run(arguments: &Arguments, build_dir: &Path) -> Result<String> {
    let Arguments { scene, frames, layout, engine: name, json, stream, target } = arguments;
    if stream.wanted() {
        let named = scene.as_deref().ok_or_else(|| anyhow!("--stream: name the scene"))?;
        return stream.run(&target.apply(Scene::load(named)?), *name, layout);
    }
    let (scene, frames) = resolve_one(scene.as_deref(), frames, layout)?;
    let scene = target.apply(scene);
    // Large matrices take seconds.
    let _progress = Progress::start(&format!("{}: reconstruction", scene.name));
    if *name != EngineName::Golden {
        note_hardware(&scene)?;
    }
    let checked = CheckedEngine::new(name.engine(&scene, Some(&frames), build_dir)?);
    let (result, engine) = (engine::result(&checked, &frames, true)?, checked.engine());
    if *json {
        return Ok(serde_json::to_string(&result)? + "\n");
    }
    let full_scale_MPa = full_scale(engine.scene(), &engine.stress(&frames)?);
    let mut text = report::reconstruction(&result, &scene.sensor, full_scale_MPa);
    if *name != EngineName::Golden {
        text.push_str(&against_golden(&scene, &frames, &result)?);
    }
    Ok(text)
}

/// One line: the difference between a result and that of the hardware's floating-point reference.
fn against_golden(scene: &Scene, frames: &[Frame], result: &Reconstruction) -> Result<String> {
    let model = Model::for_frames(scene, frames)?;
    let golden = model.reference()?.run_averaged(frames)?;
    let lsb_N = model.force_lsb_N(full_scale(&model.scene, &model.stress(frames)?));
    Ok(report::difference(&difference(&comparable_forces(&golden), &comparable_forces(result), lsb_N)))
}
