//! `dermis faults`: flips single bits in the simulated hardware and counts the outcomes.

use std::path::Path;
use std::time::Instant;

use anyhow::Result;
use clap::{value_parser, Args};
use dermis_golden::data::frame::Frame;
use dermis_golden::fixed::Model;
use dermis_golden::spec::scene::Scene;

use dermis_cosim::faults::{inject_faults, BitFlipRow};
use dermis_cosim::hardware::Hardware;
use dermis_hdl::state::{StorageClass, CLASSES};
use dermis_report as report;
use dermis_report::run_log::{RunLog, TargetCounts};

/// Arguments of `dermis faults`.
#[derive(Args, Debug)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    /// Built-in name or path of a scene.
    #[arg(default_value = "sensor-1")]
    scene: String,
    /// Number of faults, one per run.
    #[arg(long, value_name = "N", default_value_t = 1000, value_parser = value_parser!(u32).range(1..))]
    count: u32,
    /// Seed of bits, cycles and frames.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Print the outcomes as JSON and nothing else.
    #[arg(long)]
    json: bool,
}

const EXAMPLES: &str = "Examples:
  dermis faults                                      1000 bit flips in ROM, RAM and registers of sensor-1
  dermis faults eight-by-eight --count 20 --json";

/// The counts of a class for the run log.
fn target_counts(scene: &str, class: StorageClass, rows: &[BitFlipRow], seconds: f64) -> TargetCounts {
    let own = || rows.iter().filter(move |row| row.class == class);
    let sum = |count: fn(&BitFlipRow) -> usize| own().map(count).sum::<usize>() as u64;
    let counts = [
        ("harmless", sum(|row| row.harmless)),
        ("detected", sum(|row| row.detected)),
        ("hang until reset", sum(|row| row.hang)),
        ("silent", sum(|row| row.silent)),
        ("not recovered", sum(|row| row.not_recovered)),
    ];
    let flips = sum(|row| row.flips);
    TargetCounts::new(format!("{scene}, {}", class.name()), "bits flipped", flips, counts, seconds)
}

/// Runs the command: the outcomes as text, and whether the engine recovered after every reset. The counts are saved in
/// the build folder for the report.
///
/// # Errors
/// An unknown scene, one without hardware, no Verilator.
pub fn run(arguments: &Arguments, build: &Path) -> Result<(String, bool)> {
    let scene = Scene::load(&arguments.scene)?;
    let frames = Frame::shipped(&scene);
    let hardware = Hardware::new(Model::for_frames(&scene, &frames)?, build)?;
    let Arguments { scene: name, count, seed, .. } = arguments;
    let begun = Instant::now();
    let rows = inject_faults(&hardware, &frames, *count as usize, *seed)?;
    let mut log = RunLog::new(&format!("dermis faults {name} --count {count} --seed {seed}"));
    // The classes take turns, so each is charged a third of the time.
    let seconds = begun.elapsed().as_secs_f64() / CLASSES.len() as f64;
    log.targets.extend(CLASSES.map(|class| target_counts(&scene.name, class, &rows, seconds)));
    log.save(build, "faults")?;
    let good = rows.iter().all(|row| row.not_recovered == 0);
    let text = if arguments.json { serde_json::to_string(&rows)? + "\n" } else { report::faults(&rows) };
    Ok((text, good))
}
