//! `dermis table`: errors of scenes in the paper's cases, or a co-simulation with one line per scene.

use std::path::Path;

use anyhow::{bail, Result};
use clap::Args;
use dermis_golden::data::frame::Frame;
use dermis_golden::spec::partition::Case;
use dermis_golden::spec::scene::Scene;

use super::inputs::scenes_or;
use dermis_cosim::simulator::Simulator;
use dermis_cosim::verify::{verify, Verified};
use dermis_cosim::QUICK_SCENES;
use dermis_flow::progress::Progress;
use dermis_report::drawn_frames::DrawnFrames;
use dermis_report::tabulate::tabulate;
use dermis_report::{self as report, Format};

/// Arguments of `dermis table`.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  dermis table                                       every built-in scene, cases 0 to 3, with a network its own
  dermis table sensor-1 --case 0 --format csv
  dermis table sensor-3 --case adaptive --case contacts --case 4x2
  dermis table sensor-3 --case contacts --fresh 40 --contacts 2 --contacts 3 --shapes other
  dermis table --cosim                               co-simulate the scenes that take seconds, one line each
  dermis table sensor-1 eight-by-eight --cosim")]
pub struct Arguments {
    /// Built-in names or paths of scenes; default: all built-in ones, with --cosim those that take seconds.
    scenes: Vec<String>,
    /// Case, repeatable: 0 to 3, ROWSxCOLS, adaptive, contacts; default: 0 to 3, with a network the scene's own.
    #[arg(long = "case", value_name = "CASE")]
    cases: Vec<Case>,
    #[command(flatten)]
    drawn: DrawnFrames,
    /// Output format.
    #[arg(long, value_enum, default_value = "markdown", conflicts_with = "cosim")]
    format: Format,
    /// Co-simulate the hardware and print one line per scene instead of the errors.
    #[arg(long, conflicts_with_all = ["cases", "frames"])]
    cosim: bool,
}

/// Runs the command: the table, and whether every comparison was equal.
///
/// # Errors
/// A scene that cannot be loaded or is refused; for the co-simulation no Verilator.
pub fn run(arguments: &Arguments, build_dir: &Path) -> Result<(String, bool)> {
    let Arguments { scenes, cases, drawn, format, cosim } = arguments;
    if !cosim {
        return Ok((table(scenes, cases, drawn, *format)?, true));
    }
    let verify = |name: &String| -> Result<Verified> {
        let (scene, frames) = shipped(name, "dermis cosim takes them with --frame")?;
        verify(&scene, &frames, &[Simulator::Verilator, Simulator::Kernel], build_dir)
    };
    let all = scenes_or(scenes, QUICK_SCENES).iter().map(verify).collect::<Result<Vec<_>>>()?;
    let equal = all.iter().all(|v| v.findings.is_equal());
    Ok((report::scenes(&all), equal))
}

/// A scene with its shipped frames; `otherwise` says where others come from.
fn shipped(name: &str, otherwise: &str) -> Result<(Scene, Vec<Frame>)> {
    let scene = Scene::load(name)?;
    match Frame::shipped(&scene) {
        none if none.is_empty() => bail!("scene {}: no frame is shipped for {}: {otherwise}", scene.name, scene.sensor),
        frames => Ok((scene, frames)),
    }
}

/// The error table of the named scenes, or of all built-in ones.
fn table(scenes: &[String], cases: &[Case], drawn: &DrawnFrames, format: Format) -> Result<String> {
    let scenes = scenes_or(scenes, Scene::builtin_names());
    let numbered: Vec<Case> = (0..4).filter_map(Case::numbered).collect();
    let mut rows = Vec::new();
    for name in &scenes {
        let (scene, frames) = if drawn.frames > 0 {
            let scene = Scene::load(name)?;
            let frames = drawn.draw(&scene)?;
            (scene, frames)
        } else {
            shipped(name, "draw some with --fresh")?
        };
        let own = scene.cases_of(&numbered);
        let cases = if cases.is_empty() { &own } else { cases };
        let bar = Progress::steps(&format!("{}: errors", scene.name), (cases.len() * frames.len()) as u64);
        let mut done = 0;
        let mut step = || {
            done += 1;
            bar.set(done);
        };
        rows.extend(tabulate(&scene, cases, &frames, &mut step)?);
    }
    report::errors(&rows, format)
}
