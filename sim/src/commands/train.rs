//! `dermis train`: a network for the estimators that have one, trained on frames drawn from the scene's own physics.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use anyhow::{bail, Result};
use clap::Args;
use dermis_flow::say;
use dermis_golden::data::generator::slip::Slip;
use dermis_golden::estimate::learned::{Learned, Stage, Trained, Training, MEASURED_NOISE};
use dermis_golden::spec::scene::{EstimatorKind, Scene};
use dermis_golden::write::write;
use dermis_study::noise::{misfit_limit, shape_study, Candidate, ShapeStudy};

use super::inputs::beside;
use dermis_flow::jobs::Interrupt;
use dermis_flow::progress::Progress;
use dermis_report as report;

/// Noise levels of the table that follows a training.
const LEVELS: [f64; 4] = [0.0, 5e-4, 2e-3, 1e-2];
/// Added to the seed of the training for the frames of the table.
const FRESH: u64 = 1_000_003;
/// Added to the seed of the training for the frames on which the limit of the misfit is measured.
const MEASURED: u64 = 2_000_003;
/// Largest number of them.
const MOST_MEASURED: usize = 4096;

/// Sensors of a range on whose frames the limit of the misfit is measured.
const RANGE_SENSORS: usize = 16;

/// Arguments of `dermis train`.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  dermis train sensor-1 --steps 200 --contacts 500 --draws 10 --out quick.network     seconds: to see it work
  dermis train my-scene.toml                         my-scene.network beside it, some three minutes for 10 × 10 taxels on two cores
  dermis train my-scene.toml --minutes 15            longer, for a little more accuracy
  dermis train my-scene.toml --poisson-tolerance 0.02 --thickness-tolerance 0.05     a cover that is not known exactly
  dermis train my-scene.toml --hidden 96,48 --steps 10000 --out small.network
  dermis train my-scene.toml --pitch-over-thickness 0.5:2 --least-side 6 --steps 120000     one network for many sensors
  dermis train my-scene.toml --limit-of my-scene.network     a network of an older version: how unlike a frame may be

Then, in the scene: [search] with network = \"my-scene.network\", [hardware] with estimator = \"network\".
Interrupted (Ctrl-C), it keeps the best network so far; a second time, it ends at once and writes nothing.
Prints the errors on frames that were not in the training; exit code 1 if they are not better than no shear.")]
pub struct Arguments {
    /// Built-in name or path of a scene.
    scene: String,
    /// Steps of the training.
    #[arg(long, default_value_t = Training::default().steps)]
    steps: usize,
    /// Train for so many minutes in place of a number of steps; such a file cannot be made again to the bit.
    #[arg(long, conflicts_with = "steps")]
    minutes: Option<f64>,
    /// Frames per step.
    #[arg(long, default_value_t = Training::default().batch)]
    batch: usize,
    /// Contacts that are drawn while the steps go on; shear, noise and gains are drawn anew in every step.
    #[arg(long, default_value_t = Training::default().contacts)]
    contacts: usize,
    /// Widths of the hidden layers.
    #[arg(long, value_delimiter = ',', default_values_t = Training::default().hidden)]
    hidden: Vec<usize>,
    /// Largest rate of a step.
    #[arg(long, default_value_t = Training::default().rate)]
    rate: f64,
    /// How the shear is spread over the contacts: full (slip), mixed, held (in partial slip, most
    /// of them), even, or its share of the friction limit.
    #[arg(long, default_value_t = Training::default().slip)]
    slip: Slip,
    /// How far the Poisson ratio of a bonded cover may be from the scene's.
    #[arg(long, default_value_t = 0.0)]
    poisson_tolerance: f64,
    /// How far the thickness of the cover may be from the scene's, as a share of it.
    #[arg(long, default_value_t = 0.0)]
    thickness_tolerance: f64,
    /// Train for every sensor of as many taxels whose pitches over the thickness are in this range, on
    /// a bonded cover with any Poisson ratio from 0.3 to 0.499.
    #[arg(long, value_name = "LEAST:LARGEST", value_parser = range)]
    pitch_over_thickness: Option<Range>,
    /// With --pitch-over-thickness: also for smaller arrays, whose rows and columns are fewer by even numbers, down to this one.
    #[arg(long, value_name = "N", requires = "pitch_over_thickness")]
    least_side: Option<usize>,
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
    #[arg(long, value_name = "FILE", conflicts_with_all = ["steps", "minutes", "batch", "hidden", "rate", "draws", "out"])]
    limit_of: Option<PathBuf>,
}

/// Two numbers, the least and the largest; a name of its own, because a list would be taken for several values.
type Range = [f64; 2];

/// LEAST:LARGEST.
fn range(text: &str) -> Result<Range, String> {
    let numbers = text.split_once(':').and_then(|(low, high)| Some([low.parse().ok()?, high.parse().ok()?]));
    numbers.ok_or_else(|| format!("{text:?}: two numbers with a colon between them are wanted, as 0.5:2"))
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
        minutes: arguments.minutes,
        batch: arguments.batch,
        contacts: arguments.contacts,
        hidden: arguments.hidden.clone(),
        rate: arguments.rate,
        slip: arguments.slip,
        poisson_tolerance: arguments.poisson_tolerance,
        thickness_tolerance: arguments.thickness_tolerance,
        pitch_over_thickness: arguments.pitch_over_thickness,
        least_side: arguments.least_side,
        seed: arguments.seed,
    };
    let frames = training.contacts.min(MOST_MEASURED);
    if let Some(file) = &arguments.limit_of {
        return Ok((measured(&mut scene, file, frames, training.seed)?, true));
    }
    let out = arguments.out.clone().unwrap_or_else(|| beside(&arguments.scene, &scene, "network"));
    let (trained, losses) = trained(&scene, &training)?;
    write(&out, &trained.bytes)?;
    let limit = measured(&mut scene, &out, frames, training.seed)?;
    let mut text = format!(
        "{}: {} weights, {} bytes\ntraining        {} steps of {} frames, at most {} contacts drawn, slip {}, seed {}\n\
         tolerances      Poisson ratio ± {}, thickness ± {} %\n",
        out.display(),
        trained.learned.weights(),
        trained.bytes.len(),
        trained.steps,
        training.batch,
        training.contacts,
        training.slip,
        training.seed,
        training.poisson_tolerance,
        100.0 * training.thickness_tolerance
    );
    text.push_str(&format!("trained for     {}\n{limit}{losses}", describe(&trained.learned)));
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
    let better =
        |row: &dermis_study::noise::ShapeRow| row.estimator == "none" || row.summary.tangential.median.value < 1.0;
    Ok((text, rows.iter().all(better)))
}

/// Trains, with a bar and the errors so far on standard error; also the mean losses, a line each. An interruption ends the
/// training, not the command.
fn trained(scene: &Scene, training: &Training) -> Result<(Trained, String)> {
    let interrupt = Interrupt::with(|| {
        say!("interrupted: the best network so far is measured and written; a second signal ends at once");
    })?;
    let bar = Progress::share(&format!("{}: training", scene.name));
    let (mut losses, mut next) = (String::new(), 0.0);
    let trained = Learned::train(scene, training, &mut |stage: &Stage| {
        bar.set_share(stage.done);
        if stage.done >= next {
            next += 0.1;
            losses.push_str(&format!("loss            {:8.4} at step {}\n", stage.loss, stage.steps));
        }
        if let Some(errors) = stage.errors {
            let of = |(noise, error): (f64, f64)| format!("{:.1} % at {:.1} % noise", 100.0 * error, 100.0 * noise);
            let errors: Vec<String> = MEASURED_NOISE.into_iter().zip(errors).map(of).collect();
            bar.say(&format!("{:3.0} % done: median error of the shear {}", 100.0 * stage.done, errors.join(", ")));
        }
        if interrupt.check().is_ok() {
            ControlFlow::Continue(())
        } else {
            ControlFlow::Break(())
        }
    })?;
    Ok((trained, losses))
}

/// Measures the limit of the misfit for the network in `file`, which the scene then names, and writes it into the file.
fn measured(scene: &mut Scene, file: &Path, frames: usize, seed: u64) -> Result<String> {
    scene.search.network = Some(file.to_owned());
    let bar = Progress::steps(&format!("{}: limit of the misfit", scene.name), 0);
    // Of a range the largest of any sensor.
    let scenes = Learned::signature_of(scene)?.cover.scenes(scene, RANGE_SENSORS);
    let of_each = frames.div_ceil(scenes.len());
    let mut limit: Option<f64> = None;
    for (before, scene) in scenes.iter().enumerate() {
        let progress = |done: usize, _: usize| bar.set_of((before * of_each + done) as u64, frames as u64);
        let own = misfit_limit(scene, of_each, seed.wrapping_add(MEASURED), &progress)?;
        limit = own.into_iter().chain(limit).reduce(f64::max);
    }
    let Some(limit) = limit else { bail!("{}: no frame of {frames} has a contact", file.display()) };
    write(file, &Learned::with_misfit_limit(scene, limit)?)?;
    Ok(format!("misfit limit    {limit:.4}, on {} × {of_each} frames\n", scenes.len()))
}

/// What a network was trained for.
fn describe(learned: &Learned) -> String {
    let signature = learned.signature();
    format!(
        "{}, {}, {}, mu_max {}",
        signature.cover,
        signature.window,
        if signature.unipolar { "unipolar" } else { "bipolar" },
        signature.mu_max
    )
}
