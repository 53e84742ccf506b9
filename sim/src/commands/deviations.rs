//! `dermis deviations`: the table of standard deviations of a scene that is searched.

use std::path::PathBuf;

use anyhow::{bail, Result};
use clap::Args;
use dermis_golden::estimate::deviations::Deviations;
use dermis_golden::spec::scene::{EstimatorKind, Scene};
use dermis_golden::write::write;
use dermis_study::noise::{deviations_coverage, measure_deviations};

use super::inputs::beside;
use dermis_flow::progress::Progress;
use dermis_report as report;

/// Noise levels at which the table is tried, between its own.
const LEVELS: [f64; 4] = [2e-6, 5e-5, 6e-4, 2e-2];
/// Added to the seed for the frames of the trial.
const FRESH: u64 = 1_000_003;
/// Shares of forces within one standard deviation with which a table counts as right.
const COVERED: [f64; 2] = [0.55, 0.8];

/// Arguments of `dermis deviations`.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  dermis deviations eight-by-eight --draws 200 --out small.deviations     seconds: to see it work
  dermis deviations my-scene.toml                    my-scene.deviations beside it
  dermis deviations sensor-1 --check                 how often the table of a scene holds on other frames

Then, in the scene: [search] with deviations = \"my-scene.deviations\"; a result whose noise the scene states has the
standard deviations of shear and normal force. The tables of the built-in scenes are part of the program.
Prints how many forces of other frames are within one; exit code 1 if it is not 55 to 80 %.")]
pub struct Arguments {
    /// Built-in name or path of a scene that is searched.
    scene: String,
    /// Frames per noise level.
    #[arg(long, default_value_t = 1000)]
    draws: usize,
    /// Seed of the frames.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// The file; default: the scene's name with .deviations, beside the scene's file.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Measure and write nothing; try the table that the scene has.
    #[arg(long, conflicts_with = "out")]
    check: bool,
}

/// Measures and writes the file, or takes the table there is; returns text for stdout and whether the deviations cover the errors
/// of other frames.
///
/// # Errors
/// An unknown scene, one that is not searched or has no table, too few frames, a file that cannot be written.
pub fn run(arguments: &Arguments) -> Result<(String, bool)> {
    let scene = Scene::load(&arguments.scene)?;
    let out = arguments.out.clone().unwrap_or_else(|| beside(&arguments.scene, &scene, "deviations"));
    if scene.hardware_estimator() == EstimatorKind::Network {
        bail!("scene {}: hardware.estimator: a network gives standard deviations of its own", scene.name);
    }
    let (written, table) = match arguments.check {
        true => {
            let Some(table) = Deviations::of_scene(&scene, EstimatorKind::Search)? else {
                bail!("scene {}: it has no table of standard deviations; leave out --check to make one", scene.name);
            };
            (String::new(), table)
        }
        false => {
            let bar = Progress::steps(&format!("{}: errors of the search", scene.name), 0);
            let progress = |done: usize, total: usize| bar.set_of(done as u64, total as u64);
            let table = measure_deviations(&scene, arguments.draws, arguments.seed, &progress)?;
            write(&out, table.to_text().as_bytes())?;
            (format!("{}\n\n{}\n", out.display(), report::deviations(&table)), table)
        }
    };
    let bar = Progress::steps(&format!("{}: other frames", scene.name), 0);
    let frames = [arguments.draws.div_ceil(2) as u64, arguments.seed.wrapping_add(FRESH)];
    let progress = |done: usize, total: usize| bar.set_of(done as u64, total as u64);
    let covered = deviations_coverage(&scene, &table, &LEVELS, frames, &progress)?;
    drop(bar);
    let good = covered.iter().flatten().all(|share| (COVERED[0]..=COVERED[1]).contains(share));
    Ok((written + &report::deviations_covered(&LEVELS, &covered), good))
}
