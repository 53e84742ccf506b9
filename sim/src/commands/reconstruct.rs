//! `dermis reconstruct`: the forces of one frame, by a model or the hardware.

use std::path::Path;

use anyhow::{anyhow, bail, Result};
use clap::{Args, ValueEnum};
use dermis_golden::data::frame::Frame;
use dermis_golden::data::reception::full_scale;
use dermis_golden::estimate::float::Golden;
use dermis_golden::fixed::Model;
use dermis_golden::result::reconstruct::Reconstruction;
use dermis_golden::spec::scene::Scene;

use super::inputs::{note_estimator, resolve_one, BoardOverride};
use super::reconstruct_stream::StreamArguments;
use crate::compare::{comparable_forces, difference};
use crate::cosim::hardware::Hardware;
use crate::progress::Progress;
use crate::report;

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
its number and the error. A recording has both, for dermis replay, dermis live and programs that read ROS 2 messages. The noise must be stated: it is not found from a stream's frames where the search finds the
shear.")]
pub struct Arguments {
    /// Built-in name or path of a scene; optional if the frame file contains its sensor.
    scene: Option<String>,
    /// Frame file (.json, .csv) or `eq2`; default: the scene's first shipped frame. Repeat it 2^k times if the
    /// scene has input.average = k, any number of times with input.mean = "sliding".
    #[arg(long = "frame", value_name = "FILE")]
    frames: Vec<String>,
    /// Model or hardware that computes the forces.
    #[arg(long, value_enum, default_value = "golden")]
    engine: Engine,
    /// Print the result as JSON and nothing else.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    stream: StreamArguments,
    #[command(flatten)]
    target: BoardOverride,
}

#[derive(ValueEnum, Clone, Copy, Debug)]
enum Engine {
    /// The floating-point model.
    Golden,
    /// The bit-true integer model.
    Fixed,
    /// The generated Verilog, under Verilator.
    Rtl,
}

/// Runs the command: the result as text.
///
/// # Errors
/// Wrong input, a scene without hardware where that is asked for, no Verilator.
pub fn run(arguments: &Arguments, build_dir: &Path) -> Result<String> {
    let Arguments { scene, frames, engine, json, stream, target } = arguments;
    if stream.wanted() {
        let fixed = match engine {
            Engine::Golden => false,
            Engine::Fixed => true,
            Engine::Rtl => bail!("--engine rtl: a stream takes golden or fixed"),
        };
        let named = scene.as_deref().ok_or_else(|| anyhow!("--stream: name the scene"))?;
        return stream.run(&target.apply(Scene::load(named)?), fixed);
    }
    let (scene, frames) = resolve_one(scene.as_deref(), frames)?;
    let scene = target.apply(scene);
    // Large matrices take seconds.
    let _progress = Progress::start(&format!("{}: reconstruction", scene.name));
    let (result, full_scale_MPa) = reconstruct(&scene, &frames, *engine, build_dir)?;
    if *json {
        return Ok(serde_json::to_string(&result)? + "\n");
    }
    let mut text = report::reconstruction(&result, &scene.sensor, full_scale_MPa);
    if !matches!(engine, Engine::Golden) {
        text.push_str(&against_golden(&scene, &frames, &result)?);
    }
    Ok(text)
}

/// The result of one engine, and the stress in MPa of the largest code.
fn reconstruct(scene: &Scene, frames: &[Frame], engine: Engine, build_dir: &Path) -> Result<(Reconstruction, f64)> {
    if matches!(engine, Engine::Golden) {
        let golden = Golden::new(scene)?;
        return with_found_noise(scene, golden.run_averaged(frames)?, &golden.stress(frames)?);
    }
    note_estimator(scene);
    let model = Model::for_frames(scene, frames)?;
    let (scene, stress) = (model.scene.clone(), model.stress(frames)?);
    let result = match engine {
        Engine::Rtl => Hardware::new(model, build_dir)?.reconstruct(frames)?,
        _ => model.reconstruct_averaged(frames)?,
    };
    with_found_noise(&scene, result, &stress)
}

/// The result with the noise found from its calibrated frame, and the stress in MPa of the largest code.
fn with_found_noise(scene: &Scene, mut result: Reconstruction, stress: &Frame) -> Result<(Reconstruction, f64)> {
    result.find_noise(scene, stress)?;
    Ok((result, full_scale(scene, stress)))
}

/// One line: the difference between a result and the floating-point model's.
fn against_golden(scene: &Scene, frames: &[Frame], result: &Reconstruction) -> Result<String> {
    // Compared with the same estimator.
    let golden = Golden::new(&scene.for_hardware())?.run_averaged(frames)?;
    let model = Model::for_frames(scene, frames)?;
    let lsb_N = model.force_lsb_N(full_scale(&model.scene, &model.stress(frames)?));
    Ok(report::difference(&difference(&comparable_forces(&golden), &comparable_forces(result), lsb_N)))
}
