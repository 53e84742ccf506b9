//! `dermis stress`: tests the AXI streams of scenes, and saves the counts for the report.

use std::path::Path;
use std::time::Instant;

use anyhow::Result;
use clap::Args;
use dermis_golden::data::frame::Frame;
use dermis_golden::fixed::Model;
use dermis_golden::spec::scene::{Scene, TableStorage};

use dermis_cosim::hardware::Hardware;
use dermis_cosim::stress::{stress, Outcome};
use dermis_flow::progress::Progress;
use dermis_report as report;
use dermis_report::run_log::{RunLog, TargetCounts};

/// Arguments of `dermis stress`.
#[derive(Args, Debug)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    /// Built-in names or paths of scenes.
    #[arg(default_value = "sensor-1")]
    scenes: Vec<String>,
    /// Cycles of each experiment.
    #[arg(long, value_name = "N", default_value_t = 1_000_000)]
    cycles: u64,
    /// With `hardware.tables = "writable"` in every scene: images of tables are sent too.
    #[arg(long)]
    tables: bool,
    /// Seed of rates, codes, wrong tlast and resets.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Print the outcomes as JSON and nothing else.
    #[arg(long)]
    json: bool,
}

const EXAMPLES: &str = "Examples:
  dermis stress                                      gaps, wrong tlast and resets on sensor-1
  dermis stress eight-by-eight --cycles 50000 --seed 7 --json
  dermis stress eight-by-eight --cycles 50000 --tables     and images of tables, right and wrong ones";

/// The counts of an experiment for the run log.
fn target_counts(outcome: &Outcome, seconds: f64) -> TargetCounts {
    let counts = [
        ("frames out", outcome.frames_out),
        ("wrong tlast", outcome.wrong_tlast),
        ("frames cut short", outcome.cut),
        ("frames flagged", outcome.flagged),
        ("images taken", outcome.images),
        ("images refused or broken", outcome.images_refused + outcome.images_broken),
        ("resets", outcome.resets),
        ("violations", outcome.violations),
    ];
    TargetCounts::new(format!("{}, {}", outcome.scene, outcome.experiment), "cycles", outcome.cycles, counts, seconds)
}

/// Runs the command: the outcomes as text, and whether there was no violation. The counts are saved in the build folder
/// for the report.
///
/// # Errors
/// An unknown scene, one without hardware, no Verilator.
pub fn run(arguments: &Arguments, build: &Path) -> Result<(String, bool)> {
    let mut outcomes = Vec::new();
    let Arguments { scenes, cycles, seed, tables, .. } = arguments;
    let also = if *tables { " --tables" } else { "" };
    let mut log = RunLog::new(&format!("dermis stress {} --cycles {cycles} --seed {seed}{also}", scenes.join(" ")));
    for name in scenes {
        let mut scene = Scene::load(name)?;
        if *tables {
            scene.hardware.tables = TableStorage::Writable;
        }
        let frames = Frame::shipped(&scene);
        let hardware = Hardware::new(Model::for_frames(&scene, &frames)?, build)?;
        let _progress = Progress::start(&format!("{}: stress", scene.name));
        let begun = Instant::now();
        let own = stress(&hardware, &frames, *cycles, *seed)?;
        let cycles: u64 = own.iter().map(|outcome| outcome.cycles).sum();
        // Each experiment's share of the time is proportional to its cycles.
        let per_cycle = begun.elapsed().as_secs_f64() / cycles.max(1) as f64;
        log.targets.extend(own.iter().map(|outcome| target_counts(outcome, per_cycle * outcome.cycles as f64)));
        outcomes.extend(own);
    }
    log.save(build, "stress")?;
    let good = outcomes.iter().all(|outcome| outcome.violations == 0);
    let text = if arguments.json { serde_json::to_string(&outcomes)? + "\n" } else { report::stress(&outcomes) };
    Ok((text, good))
}
