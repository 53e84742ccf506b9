//! `dermis study blind-gains`: what gains found from presses of unknown load are worth.

use anyhow::Result;
use clap::{value_parser, Args};
use dermis_study::noise::{BlindStudy, Candidate};

use dermis_report::study::blind_gains;

/// Arguments of `dermis study blind-gains`.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  dermis study blind-gains                           sensor-1-noisy, gains with 5 %, 300 presses: a minute
  dermis study blind-gains my-scene.toml --spread 0.03 --spread 0.1 --presses 600
  dermis study blind-gains eight-by-eight --model --draws 20 --presses 200 --json

Presses of the shapes of the tables are drawn all over an array whose gains differ, dermis calibrate --blind finds the gains, and the
scene's hardware, or with --model the estimator of its floating-point model, reads other frames with them.")]
pub struct Arguments {
    /// Built-in name or path of the scene.
    #[arg(default_value = "sensor-1-noisy")]
    scene: String,
    /// Standard deviation of the gains, from 0 to 0.2; repeatable, default: 0.05.
    #[arg(long = "spread", value_name = "SHARE")]
    spreads: Vec<f64>,
    /// Number of presses.
    #[arg(long, default_value_t = 300, value_parser = value_parser!(u32).range(1..=100_000))]
    presses: u32,
    /// Standard deviation of the noise of a press over its largest stress, from 0 to 1.
    #[arg(long, value_name = "SHARE", default_value_t = 0.005)]
    noise: f64,
    /// Number of frames that are read with the gains; their noise is 0.2 % of the largest stress.
    #[arg(long, default_value_t = 250, value_parser = value_parser!(u32).range(1..=100_000))]
    draws: u32,
    /// Seed of presses, gains, noise and frames.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Read them by the floating-point model.
    #[arg(long)]
    model: bool,
    /// Print JSON and nothing else.
    #[arg(long)]
    json: bool,
}

/// The study's table, or JSON.
///
/// # Errors
/// A scene that cannot be loaded or is refused, a number out of range.
pub fn run(arguments: &Arguments) -> Result<String> {
    let Arguments { scene, spreads, presses, noise, draws, seed, model, json } = arguments;
    let defaults = BlindStudy::default();
    let study = BlindStudy {
        spreads: if spreads.is_empty() { defaults.spreads.clone() } else { spreads.clone() },
        presses: *presses as usize,
        noise: *noise,
        draws: *draws as usize,
        seed: *seed,
        candidate: if *model { Candidate::Scene } else { Candidate::Hardware },
        ..defaults
    };
    blind_gains::run(scene, &study, *json)
}
