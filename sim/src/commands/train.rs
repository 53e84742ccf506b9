//! `dermis train`: a network for the estimators that have one, trained on frames drawn from the scene's own physics.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

use anyhow::{bail, Result};
use clap::Args;
use dermis_golden::data::generator::slip::Slip;
use dermis_golden::estimate::learned::{Learned, Stage, Training};
use dermis_golden::spec::scene::{EstimatorKind, Scene};
use dermis_golden::study::noise::{misfit_limit, shape_study, Candidate, ShapeStudy};
use dermis_golden::write::write;

use super::inputs::beside;
use crate::progress::Progress;
use crate::report;

/// Noise levels of the table that follows a training.
const LEVELS: [f64; 4] = [0.0, 5e-4, 2e-3, 1e-2];
/// Added to the seed of the training for the frames of the table.
const FRESH: u64 = 1_000_003;
/// Added to the seed of the training for the frames on which the limit of the misfit is measured.
const MEASURED: u64 = 2_000_003;
/// Largest number of them.
const MOST_MEASURED: usize = 4096;

/// Arguments of `dermis train`.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  dermis train sensor-1 --steps 200 --contacts 500 --draws 10 --out quick.network     seconds: to see it work
  dermis train my-scene.toml                         my-scene.network beside it, a quarter of an hour
  dermis train my-scene.toml --hidden 96,48 --steps 10000 --out small.network
  dermis train my-scene.toml --limit-of my-scene.network     a network of an older version: how unlike a frame may be

Then, in the scene: [search] with estimator = \"evidence+network\" and network = \"my-scene.network\",
[hardware] with estimator = \"network\".
Prints the errors on frames that were not in the training; exit code 1 if they are not better than no shear.")]
pub struct Arguments {
    /// Built-in name or path of a scene.
    scene: String,
    /// Steps of the training.
    #[arg(long, default_value_t = Training::default().steps)]
    steps: usize,
    /// Frames per step.
    #[arg(long, default_value_t = Training::default().batch)]
    batch: usize,
    /// Frames whose contacts are drawn; shear, noise and gains are drawn anew in every step.
    #[arg(long, default_value_t = Training::default().contacts)]
    contacts: usize,
    /// Widths of the hidden layers.
    #[arg(long, value_delimiter = ',', default_values_t = Training::default().hidden)]
    hidden: Vec<usize>,
    /// Largest rate of a step.
    #[arg(long, default_value_t = Training::default().rate)]
    rate: f64,
    /// How the shear is spread over the contacts: full (slip), mixed, even, or its share of the friction limit. The shipped
    /// networks are of full slip.
    #[arg(long, default_value_t = Training::default().slip)]
    slip: Slip,
    /// Seed of weights and frames; equal seeds give equal files on one machine.
    #[arg(long, default_value_t = Training::default().seed)]
    seed: u64,
    /// Frames per noise level of the table of errors.
    #[arg(long, default_value_t = 100)]
    draws: usize,
    /// The file; default: the scene's name with .network, beside the scene's file.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Train nothing; measure the limit of the misfit for this network of the scene and write it into the file.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["steps", "batch", "hidden", "rate", "draws", "out"])]
    limit_of: Option<PathBuf>,
}

/// Trains, writes the file, and returns text for stdout and whether the errors are below those of no shear.
///
/// # Errors
/// An unknown scene, one that the estimator refuses, an option out of range, a file that cannot be written.
pub fn run(arguments: &Arguments) -> Result<(String, bool)> {
    let mut scene = Scene::load(&arguments.scene)?;
    scene.search.estimator = Some(EstimatorKind::EvidenceNetwork);
    scene.require_golden()?;
    if arguments.draws == 0 {
        bail!("--draws 0 is not allowed; it must be at least 1");
    }
    let training = Training {
        steps: arguments.steps,
        batch: arguments.batch,
        contacts: arguments.contacts,
        hidden: arguments.hidden.clone(),
        rate: arguments.rate,
        slip: arguments.slip,
        seed: arguments.seed,
    };
    let frames = training.contacts.min(MOST_MEASURED);
    if let Some(file) = &arguments.limit_of {
        return Ok((measured(&mut scene, file, frames, training.seed)?, true));
    }
    let out = arguments.out.clone().unwrap_or_else(|| beside(&arguments.scene, &scene, "network"));
    let bar = Progress::steps(&format!("{}: contacts, then training", scene.name), 0);
    let loss = std::sync::Mutex::new(Vec::new());
    let (contacts, every) = (AtomicUsize::new(0), (training.steps / 10).max(1));
    let trained = Learned::train(&scene, &training, &|stage| match stage {
        Stage::Contacts(_) => {
            let done = contacts.fetch_add(1, Ordering::Relaxed) + 1;
            bar.set_of(done as u64, (training.contacts + training.steps) as u64);
        }
        Stage::Steps(steps, mean) => {
            bar.set((training.contacts + steps) as u64);
            if steps % every < 20 {
                loss.lock().unwrap_or_else(|poisoned| poisoned.into_inner()).push((steps, mean));
            }
        }
    })?;
    drop(bar);
    write(&out, &trained.bytes)?;
    let limit = measured(&mut scene, &out, frames, training.seed)?;
    let mut text = format!(
        "{}: {} weights, {} bytes\ntraining        {} steps of {} frames, {} contacts drawn, slip {}, seed {}\n",
        out.display(),
        trained.learned.weights(),
        trained.bytes.len(),
        training.steps,
        training.batch,
        training.contacts,
        training.slip,
        training.seed
    );
    text.push_str(&format!("trained for     {}\n{limit}", describe(&trained.learned)));
    for (steps, mean) in loss.into_inner().unwrap_or_else(|poisoned| poisoned.into_inner()) {
        text.push_str(&format!("loss            {mean:8.4} at step {steps}\n"));
    }
    text.push_str(&format!("loss            {:8.4} at first, {:.4} at last\n\n", trained.loss[0], trained.loss[1]));
    let mut study = ShapeStudy {
        levels: LEVELS.to_vec(),
        draws: arguments.draws,
        candidates: vec![Candidate::Estimator(EstimatorKind::EvidenceNetwork)],
        ..Default::default()
    };
    study.options.seed = arguments.seed.wrapping_add(FRESH);
    study.options.converter.unipolar = scene.input.unipolar;
    let bar = Progress::steps(&format!("{}: errors on fresh frames", scene.name), 0);
    let rows = shape_study(&scene, &study, &|done, total| bar.set_of(done as u64, total as u64))?;
    text.push_str(&report::shapes(&rows, report::Format::Markdown)?);
    let better = |row: &dermis_golden::study::noise::ShapeRow| {
        row.estimator == "none" || row.summary.tangential.median.value < 1.0
    };
    Ok((text, rows.iter().all(better)))
}

/// Measures the limit of the misfit for the network in `file`, which the scene then names, and writes it into the file.
fn measured(scene: &mut Scene, file: &Path, frames: usize, seed: u64) -> Result<String> {
    scene.search.network = Some(file.to_owned());
    let bar = Progress::steps(&format!("{}: limit of the misfit", scene.name), 0);
    let progress = |done: usize, total: usize| bar.set_of(done as u64, total as u64);
    let limit = misfit_limit(scene, frames, seed.wrapping_add(MEASURED), &progress)?;
    let Some(limit) = limit else { bail!("{}: no frame of {frames} has a contact", file.display()) };
    write(file, &Learned::with_misfit_limit(scene, limit)?)?;
    Ok(format!("misfit limit    {limit:.4}, on {frames} frames\n"))
}

/// What a network was trained for.
fn describe(learned: &Learned) -> String {
    let signature = learned.signature();
    format!(
        "pitch {} × {} mm, thickness {} mm, {}, {}, {}, mu_max {}",
        signature.pitch_x_mm,
        signature.pitch_y_mm,
        signature.thickness_mm,
        signature.medium,
        signature.window,
        if signature.unipolar { "unipolar" } else { "bipolar" },
        signature.mu_max
    )
}
