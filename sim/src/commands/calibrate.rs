//! `dermis calibrate`: the calibration table of a sensor, from recordings under known uniform stresses.

use std::path::PathBuf;
use std::str::FromStr;

use anyhow::{anyhow, Result};
use clap::Args;
use dermis_golden::data::frame::Frame;
use dermis_golden::data::input::known_loads::{KnownLoad, LoadFit, Residual};
use dermis_golden::spec::scene::Scene;
use dermis_golden::write::write;
use serde::Serialize;

use super::layout::LayoutArguments;
use crate::report;

/// Arguments of `dermis calibrate`.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  dermis calibrate my-scene.toml --load 0=zero.csv --load 0.05=half.csv --load 0.1=full.csv --out table.csv
  dermis calibrate my-scene.toml --load 0=zero.csv --load 0.1=full.csv --json

A recording is a CSV or MCAP file with one frame after the other, a JSON frame, or a folder of such files, in the unit of the
readings. Each must be taken under the same stress on every taxel, as air pressure on a foil applies it. With three loads
or more each is left out once, and the table of the others is compared with it. The table is what `input.calibration`
reads.")]
pub struct Arguments {
    /// Built-in name or path of the scene that defines the sensor.
    scene: String,
    /// Stress in MPa and the recording under it, a file or a folder; repeatable, at least two.
    #[arg(long = "load", value_name = "MPA=FILE", required = true)]
    loads: Vec<LoadFile>,
    #[command(flatten)]
    layout: LayoutArguments,
    /// File for the table.
    #[arg(long, value_name = "FILE", required_unless_present = "json")]
    out: Option<PathBuf>,
    /// Print what is known of the calibration as JSON and nothing else.
    #[arg(long)]
    json: bool,
}

/// A known stress and the recording under it.
#[derive(Clone, Debug)]
struct LoadFile {
    stress_MPa: f64,
    path: PathBuf,
}

impl FromStr for LoadFile {
    type Err = String;

    fn from_str(text: &str) -> Result<LoadFile, String> {
        let wanted = || "a finite stress in MPa and a file, as in 0.05=half.csv".to_owned();
        let (stress, path) = text.split_once('=').ok_or_else(wanted)?;
        let stress_MPa = stress.trim().parse().ok().filter(|stress: &f64| stress.is_finite()).ok_or_else(wanted)?;
        Ok(LoadFile { stress_MPa, path: path.into() })
    }
}

/// The JSON of the command.
#[derive(Serialize)]
struct Answer<'a> {
    scene: &'a str,
    table: Option<String>,
    loads: usize,
    noise_MPa: Option<f64>,
    least_full_scale_MPa: f64,
    saturated_MPa: &'a [f64],
    curved_share: Option<f64>,
    dead: &'a [[usize; 2]],
    offset: &'a [f64],
    gain: &'a [f64],
    residuals: &'a [Residual],
}

/// Runs the command.
///
/// # Errors
/// A scene or recording that cannot be read, loads that give no table, a file that cannot be written.
pub fn run(arguments: &Arguments) -> Result<String> {
    let scene = Scene::load(&arguments.scene)?;
    let load = |LoadFile { stress_MPa, path }: &LoadFile| -> Result<KnownLoad> {
        Ok(KnownLoad {
            stress_MPa: *stress_MPa,
            frames: Frame::load_all_as(path, Some(&scene), &arguments.layout.stated())?,
        })
    };
    let loads = arguments.loads.iter().map(load).collect::<Result<Vec<_>>>()?;
    let fit = LoadFit::new(&scene, &loads).map_err(|error| anyhow!("--load: {error}"))?;
    if let Some(out) = &arguments.out {
        write(out, fit.table.to_csv(&scene.sensor).as_bytes())?;
    }
    let table = arguments.out.as_ref().map(|out| out.display().to_string());
    if !arguments.json {
        return Ok(report::calibration(&fit, &table.unwrap_or_default()));
    }
    let answer = Answer {
        scene: &scene.name,
        table,
        loads: loads.len(),
        noise_MPa: fit.noise_MPa,
        least_full_scale_MPa: fit.full_scale_MPa,
        saturated_MPa: &fit.saturated_MPa,
        curved_share: fit.curved_share(),
        dead: &fit.dead,
        offset: &fit.table.offset,
        gain: &fit.table.gain,
        residuals: &fit.residuals,
    };
    Ok(serde_json::to_string(&answer)? + "\n")
}
