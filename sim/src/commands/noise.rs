//! `dermis noise`: errors under noise beside the Cramér–Rao bound.
//!
//! | option | prints |
//! |---|---|
//! | none | objectives on elliptic Hertz contacts, beside the bounds with 6 and 9 unknowns |
//! | `--shapes` | estimators on drawn contacts of any shape, beside two baselines and the bound of a known support |
//! | `--shapes --slips` | errors and bias of the shear in full slip, at shares of the friction limit, and spread evenly |
//! | `--shapes --sensitivity` | errors if the scene states something wrongly, or the gains differ |
//! | `--time` | errors and lag over whole presses, with each kind of mean |
//! | `--unlike` | how many frames like and unlike a network's training are flagged |

use anyhow::Result;
use clap::Args;
use dermis_golden::data::generator::converter::Converter;
use dermis_golden::data::generator::draws::{ContactShape, DrawOptions};
use dermis_golden::data::generator::presses::{Motion, Press};
use dermis_golden::data::generator::slip::Slip;
use dermis_golden::spec::scene::{EstimatorKind, ObjectiveKind, Scene};
use dermis_study::noise::{by_name, press_study, sensitivities, shape_study, slip_study, study, unlike_study};
use dermis_study::noise::{shapes_named, Candidate, PressEngine, PressStudy, ShapeStudy, Study, AVERAGED};

use dermis_flow::progress::Progress;
use dermis_report::{self as report, Format};

/// Noise level of the table of sensitivities.
const SENSITIVITY_LEVEL: f64 = 1e-3;

/// Arguments of `dermis noise`.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  dermis noise sensor-1
  dermis noise sensor-1 --frames 1 --medians
  dermis noise sensor-2 --objective patch --objective auto --draws 1000 --format csv
  dermis noise sensor-1 --shapes all --draws 20 --level 0.0005      any shape, with baselines and bound
  dermis noise sensor-1 --shapes tilted,ring --unipolar --unstated --objective sparse --draws 20 --json
  dermis noise sensor-1 --shapes table --level 0.01 --gain-spread 0.01 --frames 64 --coverage
  dermis noise sensor-3 --shapes table --contacts 3 --level 0.0005
  dermis noise sensor-1 --shapes table --slip mixed --level 0.002
  dermis noise sensor-1 --shapes table --slips --estimator evidence --level 0.0005
  dermis noise sensor-1 --shapes table --sensitivity
  dermis noise sensor-1-noisy --unlike --estimator network --hardware --draws 10
  dermis noise sensor-1-noisy --time --estimator network --motion hold --presses 1 --seconds 0.3 --level 0.01")]
pub struct Arguments {
    /// Built-in name or path of a scene.
    scene: String,
    /// Standard deviation of the noise over max |b|, repeatable; default: 0, 0.0001, 0.0005, 0.002, 0.01.
    #[arg(long = "level", value_name = "SHARE")]
    levels: Vec<f64>,
    /// Number of random frames.
    #[arg(long, default_value_t = 200)]
    draws: usize,
    /// Seed of contacts and noise.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Frames averaged: in the second half of the table, 1 omits that half, default 64; with --shapes in every reading,
    /// default 1.
    #[arg(long)]
    frames: Option<usize>,
    /// Objective of the search, repeatable; default: all; with --shapes: what the scene names.
    #[arg(long = "objective", value_name = "NAME", value_parser = objective)]
    objectives: Vec<ObjectiveKind>,
    /// Only the median errors: a line per level, a column per objective.
    #[arg(long, conflicts_with = "format")]
    medians: bool,
    /// Output format.
    #[arg(long, value_enum, default_value = "markdown")]
    format: Format,
    /// The same as --format json.
    #[arg(long, conflicts_with_all = ["format", "medians"])]
    json: bool,
    /// Of frames like and unlike the training of the scene's network, count those that are flagged.
    #[arg(long, group = "drawn", conflicts_with_all = ["medians", "levels", "frames", "objectives"])]
    unlike: bool,
    #[command(flatten)]
    shapes: ShapeArguments,
    #[command(flatten)]
    time: TimeArguments,
}

/// Options of the study over presses.
#[derive(Args, Debug)]
struct TimeArguments {
    /// Reconstruct presses frame by frame: each alone, with a sliding and with an adaptive mean. The noise is not stated.
    #[arg(long, group = "drawn", conflicts_with_all = ["medians", "frames", "draws", "objectives", "unlike", "shapes"])]
    time: bool,
    /// What the contact does, repeatable; default: hold, ramp, slide, roll, turn, step, oscillation.
    #[arg(long = "motion", value_name = "MOTION", value_parser = motion, requires = "time")]
    motions: Vec<Motion>,
    /// Presses of each motion.
    #[arg(long, value_name = "N", default_value_t = 3, requires = "time", value_parser = clap::value_parser!(u64).range(1..=1000))]
    presses: u64,
    /// Frames per second.
    #[arg(long, value_name = "HZ", default_value_t = 1000.0, requires = "time")]
    rate: f64,
    /// Seconds of a press; those after the first tenth of a second count.
    #[arg(long, value_name = "S", default_value_t = 0.8, requires = "time")]
    seconds: f64,
    /// Standard deviation of the taxels' gains.
    #[arg(long, value_name = "SHARE", default_value_t = 0.01, requires = "time")]
    gains: f64,
    /// Width of the codes in bits.
    #[arg(long, value_name = "BITS", default_value_t = 10, requires = "time")]
    bits: u32,
}

/// Options of the study over shapes.
#[derive(Args, Debug)]
struct ShapeArguments {
    /// Draw these shapes in turn, those of a frame's contacts differ: mixed or all, table (all but asymmetric), or of hertz,
    /// punch, ring, rectangle, tilted, asymmetric, separated by commas.
    #[arg(long, value_name = "SHAPES", value_parser = shapes, group = "drawn")]
    shapes: Option<Shapes>,
    /// Estimator, repeatable; default: what the scene names.
    #[arg(long = "estimator", value_name = "NAME", value_parser = estimator, requires = "drawn")]
    estimators: Vec<EstimatorKind>,
    /// Also the scene's hardware, by its bit-true model.
    #[arg(long, requires = "drawn", conflicts_with = "sensitivity")]
    hardware: bool,
    /// How the shear is spread over the contacts: full (slip), even, mixed, or its share of the friction limit.
    #[arg(long, value_name = "SLIP", default_value_t = Slip::Full, requires = "shapes")]
    slip: Slip,
    /// Print errors and bias of the shear in full slip, in partial slip, and spread evenly.
    #[arg(long, requires = "shapes", conflicts_with_all = ["slip", "sensitivity", "coverage", "medians"])]
    slips: bool,
    /// Number of contacts of a frame.
    #[arg(long, value_name = "N", default_value_t = 1, requires = "shapes")]
    contacts: usize,
    /// Standard deviation of the taxels' gains.
    #[arg(long, value_name = "SHARE", default_value_t = 0.0, requires = "shapes")]
    gain_spread: f64,
    /// Standard deviation of the taxels' zeros since the tare over max |b|.
    #[arg(long, value_name = "SHARE", default_value_t = 0.0, requires = "shapes")]
    drift: f64,
    /// Frames without contact whose noisy mean is subtracted; 0: none.
    #[arg(long, value_name = "N", default_value_t = 0, requires = "shapes")]
    tare_frames: usize,
    /// The sensor reads tension as zero; default: what the scene says.
    #[arg(long, requires = "shapes")]
    unipolar: bool,
    /// The scene does not state noise and gain spread.
    #[arg(long, requires = "shapes")]
    unstated: bool,
    /// Print how often the forces are within their standard deviations, also for each shape.
    #[arg(long, requires = "shapes", conflicts_with_all = ["sensitivity", "medians"])]
    coverage: bool,
    /// Print the errors if the scene states something wrongly, or the gains differ; at the first level, default 0.001.
    #[arg(long, requires = "shapes", conflicts_with = "medians")]
    sensitivity: bool,
}

/// A list of shapes.
#[derive(Clone, Debug)]
struct Shapes(Vec<ContactShape>);

/// Runs the study: the table as text.
///
/// # Errors
/// An unknown scene, one that the golden model refuses, contacts that do not fit, a parameter out of range.
pub fn run(arguments: &Arguments) -> Result<String> {
    let scene = Scene::load(&arguments.scene)?;
    let format = if arguments.json { Format::Json } else { arguments.format };
    if arguments.time.time {
        return over_time(arguments, &scene, format);
    }
    if let Some(Shapes(shapes)) = &arguments.shapes.shapes {
        return over_shapes(arguments, &scene, shapes, format);
    }
    if arguments.unlike {
        let bar = Progress::steps(&format!("{}: frames unlike the training", scene.name), 0);
        let progress = |done: usize, total: usize| bar.set_of(done as u64, total as u64);
        let rows = unlike_study(&scene, arguments.draws, arguments.seed, &candidates(arguments), &progress)?;
        return report::unlike(&rows, format);
    }
    let mut wanted = Study {
        draws: arguments.draws,
        seed: arguments.seed,
        frames: arguments.frames.unwrap_or(AVERAGED),
        ..Study::default()
    };
    if !arguments.levels.is_empty() {
        wanted.levels = arguments.levels.clone();
    }
    if !arguments.objectives.is_empty() {
        wanted.objectives = arguments.objectives.clone();
    }
    let bar = Progress::steps(&format!("{}: noise", scene.name), 0);
    let rows = study(&scene, &wanted, &mut |done, total| bar.set_of(done as u64, total as u64))?;
    match arguments.medians {
        true => Ok(report::noise_medians(&rows)),
        false => report::noise(&rows, format),
    }
}

/// The estimators to compare.
fn candidates(arguments: &Arguments) -> Vec<Candidate> {
    let own = &arguments.shapes;
    let estimators = own.estimators.iter().copied().map(Candidate::Estimator);
    let mut candidates: Vec<Candidate> =
        estimators.chain(arguments.objectives.iter().copied().map(Candidate::Objective)).collect();
    if candidates.is_empty() {
        candidates.push(Candidate::Scene);
    }
    if own.hardware {
        candidates.push(Candidate::Hardware);
    }
    candidates
}

/// The study over presses.
fn over_time(arguments: &Arguments, scene: &Scene, format: Format) -> Result<String> {
    let press_arguments = &arguments.time;
    let estimators = match arguments.shapes.estimators.as_slice() {
        [] => &[scene.model_estimator()],
        stated => stated,
    };
    let mut engines: Vec<PressEngine> = estimators.iter().copied().map(PressEngine::Golden).collect();
    engines.extend(arguments.shapes.hardware.then_some(PressEngine::Fixed));
    let default = PressStudy::default();
    let converter =
        Converter { gain_spread: press_arguments.gains, bits: Some(press_arguments.bits), ..Converter::default() };
    let draw = DrawOptions { converter, seed: arguments.seed, ..default.press.draw };
    let frames = (press_arguments.rate * press_arguments.seconds).round() as usize + 1;
    let press = Press { rate_Hz: press_arguments.rate, frames, draw, ..default.press };
    let mut wanted = PressStudy { engines, presses: press_arguments.presses, press, ..default };
    if !press_arguments.motions.is_empty() {
        wanted.motions = press_arguments.motions.clone();
    }
    if !arguments.levels.is_empty() {
        wanted.levels = arguments.levels.clone();
    }
    let bar = Progress::steps(&format!("{}: presses", scene.name), 0);
    let rows = press_study(scene, &wanted, &|done, total| bar.set_of(done as u64, total as u64))?;
    report::presses(&rows, format)
}

fn over_shapes(arguments: &Arguments, scene: &Scene, shapes: &[ContactShape], format: Format) -> Result<String> {
    let shape_arguments = &arguments.shapes;
    let converter = Converter {
        gain_spread: shape_arguments.gain_spread,
        drift: shape_arguments.drift,
        tare_frames: shape_arguments.tare_frames,
        frames: arguments.frames.unwrap_or(1),
        unipolar: shape_arguments.unipolar || scene.input.unipolar,
        ..Default::default()
    };
    let options = DrawOptions {
        shapes: shapes.to_vec(),
        contacts: shape_arguments.contacts,
        slip: shape_arguments.slip,
        seed: arguments.seed,
        converter,
        ..Default::default()
    };
    let (draws, noise_stated, by_shape) = (arguments.draws, !shape_arguments.unstated, shape_arguments.coverage);
    let candidates = candidates(arguments);
    let mut wanted = ShapeStudy { draws, options, noise_stated, candidates, by_shape, ..Default::default() };
    if !arguments.levels.is_empty() {
        wanted.levels = arguments.levels.clone();
    }
    let bar = Progress::steps(&format!("{}: noise, any shape", scene.name), 0);
    let progress = |done: usize, total: usize| bar.set_of(done as u64, total as u64);
    if shape_arguments.sensitivity {
        let level = arguments.levels.first().copied().unwrap_or(SENSITIVITY_LEVEL);
        let wanted = ShapeStudy { levels: vec![level], ..wanted };
        return report::sensitivity(&sensitivities(scene, &wanted, &progress)?, level, format);
    }
    if shape_arguments.slips {
        return report::slips(&slip_study(scene, &wanted, &progress)?, format);
    }
    let rows = shape_study(scene, &wanted, &progress)?;
    match (arguments.medians, shape_arguments.coverage, format) {
        (true, _, _) => Ok(report::shape_medians(&rows)),
        (false, true, Format::Markdown) => Ok(report::coverage(&rows)),
        _ => report::shapes(&rows, format),
    }
}

/// Parses a motion by its name.
pub(super) fn motion(name: &str) -> Result<Motion, String> {
    named(name, &Motion::NAMES)
}

/// Parses an objective by its name in scene files.
fn objective(name: &str) -> Result<ObjectiveKind, String> {
    named(name, &ObjectiveKind::NAMES)
}

/// Parses an estimator by its name in scene files.
fn estimator(name: &str) -> Result<EstimatorKind, String> {
    named(name, &EstimatorKind::NAMES)
}

fn named<T: Copy>(name: &str, names: &[(&str, T)]) -> Result<T, String> {
    by_name(name, names).map_err(|known| format!("one of {known}"))
}

/// Parses a list of shapes.
fn shapes(text: &str) -> Result<Shapes, String> {
    shapes_named(text).map(Shapes)
}
