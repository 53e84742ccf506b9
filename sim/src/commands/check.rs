//! `dermis check`: what is wrong with a scene and what to expect of it, or whether a generated folder is intact.
//!
//! | target | checked as |
//! |---|---|
//! | a built-in name, a file | a scene: the floating-point model, the hardware on its board, errors on drawn frames |
//! | a folder | a build: its files against manifest.json, manifest.json against its checksum |

use std::path::Path;

use anyhow::{anyhow, bail, Result};
use clap::{value_parser, Args};
use dermis_golden::estimate::float::Golden;
use dermis_golden::estimate::learned::{Cover, Learned};
use dermis_golden::fixed::{FixedError, Model};
use dermis_golden::physics::matrices::Matrices;
use dermis_golden::result::checks::pull::tare_load;
use dermis_golden::spec::scene::{Scene, MAX_FLOAT_DEGREE};
use dermis_hdl::{explain::explain, generate, manifest};
use dermis_study::noise::expected::{expected, of_other_medium, Expectation, StatedNoise};

use super::check_noise::NoiseArguments;
use super::check_rate::rates;
use super::inputs::{beside, estimator_instead, noise_not_stated, BoardOverride};
use dermis_flow::microcontroller;
use dermis_flow::progress::Progress;
use dermis_report::{self as report, BuildCheck, HardwareCheck, SceneCheck};

/// Arguments of `dermis check`.
#[derive(Args, Debug)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    /// Built-in name or file of a scene, or a folder written by `dermis build`.
    target: String,
    /// Largest stress of a press in MPa, for the noise as a share of it; default: the scene's full scale.
    #[arg(long, value_name = "MPA")]
    peak: Option<f64>,
    /// Drawn frames for the expected errors.
    #[arg(long, default_value_t = 20, value_parser = value_parser!(u32).range(1..=100_000))]
    draws: u32,
    /// Seed of the drawn frames and their noise.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Measure the frames per second that this machine holds with each estimator of the scene, 0.3 s each, on one core.
    #[arg(long)]
    rate: bool,
    /// Print JSON and nothing else.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    noise: NoiseArguments,
    #[command(flatten)]
    board: BoardOverride,
}

const EXAMPLES: &str = "Examples:
  dermis check my-scene.toml                         degree, expected errors, whether the board holds it
  dermis check my-scene.toml --peak 0.1 --draws 10   presses of 0.1 MPa
  dermis check eight-by-eight --target-board icebreaker --json
  dermis check my-scene.toml --rate --draws 1        frames per second of each estimator on this machine
  dermis check my-scene.toml --stream=/dev/ttyUSB0   measures the noise while nothing presses, and writes it into the scene
  dermis check build/sensor-1/rtl                    the files of a build against manifest.json

A built-in name or a file is checked as a scene, a folder as a build. A scene that only the floating-point model takes is
no error: the reason is printed. The expected errors are those of drawn contacts of any shape, at the noise that the scene
states or its tare frames show, else at several levels; with shear in proportion to search.mu_max. The last table has the errors
if the cover is held otherwise than the scene's medium says, at the first level.";

/// Runs the command.
///
/// # Errors
/// A scene that cannot be loaded or that the floating-point model refuses, a damaged build; the message says as what the
/// target was checked.
pub fn run(arguments: &Arguments) -> Result<String> {
    let target = &arguments.target;
    let builtin = Scene::builtin_names().contains(&target.as_str());
    if !builtin && Path::new(target).is_dir() {
        let files = manifest::check(Path::new(target)).map_err(|e| anyhow!("checked as a build (a folder): {e}"))?;
        let build = BuildCheck { target: target.clone(), checked_as: "build", files };
        return text(arguments, &build, report::build_check);
    }
    if let Some(peak) = arguments.peak.filter(|peak| !(peak.is_finite() && *peak > 0.0)) {
        bail!("--peak {peak}: must be a finite stress above 0 MPa");
    }
    text(arguments, &check_scene(arguments)?, report::scene_check)
}

fn text<T: serde::Serialize>(arguments: &Arguments, checked: &T, print: fn(&T) -> String) -> Result<String> {
    match arguments.json {
        true => Ok(serde_json::to_string(checked)? + "\n"),
        false => Ok(print(checked)),
    }
}

fn check_scene(arguments: &Arguments) -> Result<SceneCheck> {
    let refused = |error: anyhow::Error| anyhow!("checked as a scene: {error}");
    let scene = arguments.board.apply(Scene::load(&arguments.target).map_err(|error| refused(error.into()))?);
    let scene = arguments.noise.measure(&arguments.target, scene)?;
    let bar = Progress::steps(&format!("{}: drawn frames", scene.name), 0);
    let golden = Golden::new(&scene).map_err(|error| refused(error.into()))?;
    let noise = StatedNoise::of(&scene, arguments.peak)?;
    let tare_load = tare_load(&scene)?;
    let (hardware, hardware_refused, in_c) = match Model::new(&scene) {
        Ok(model) => (Some(hardware(&scene, &model)?), None, Some(microcontroller::needs(&model))),
        Err(defect @ (FixedError::Internal(_) | FixedError::Beats { .. })) => return Err(defect.into()),
        Err(reason) => (None, Some(reason.to_string()), None),
    };
    let (microcontroller, microcontroller_refused) = match in_c {
        Some(Ok(needs)) => (Some(needs), None),
        Some(Err(reason)) => (None, Some(reason.to_string())),
        None => (None, None),
    };
    let noise_not_stated = noise_not_stated(&scene)?;
    let (peak_MPa, with_hardware) = (arguments.peak, hardware.is_some());
    let expectation = Expectation { peak_MPa, draws: arguments.draws as usize, seed: arguments.seed, with_hardware };
    let progress = |done: usize, total: usize| bar.set_of(done as u64, total as u64);
    let errors = expected(&scene, &expectation, &noise, &progress)
        .and_then(|errors| Ok((errors, of_other_medium(&scene, &expectation, &noise, &progress)?)));
    // A tiny array has no room for the contacts; the rest of the check still stands.
    let ((errors, other_medium), not_drawn) = match errors {
        Ok(errors) => (errors, None),
        Err(reason) => (Default::default(), Some(reason.to_string())),
    };
    // An estimator with evidence has none.
    let matrices =
        golden.matrices().is_none().then(|| Matrices::of(&scene, &scene.sensor, MAX_FLOAT_DEGREE).ok()).flatten();
    let matrices = golden.matrices().or(matrices.as_ref());
    // No contact fits a tiny array.
    let rates = arguments.rate.then(|| rates(&scene)).transpose();
    let (rates, not_measured) = rates.map_or_else(|reason| (None, Some(reason.to_string())), |rates| (rates, None));
    Ok(SceneCheck {
        target: arguments.target.clone(),
        checked_as: "scene",
        medium: scene.medium.to_string(),
        estimator: golden.estimator().name(),
        degree: matrices.map(|matrices| matrices.degree),
        spectral_radius: matrices.map(|matrices| matrices.spectral_radius),
        mu_max: scene.search.mu_max,
        dead: scene.input.dead.clone(),
        board: scene.hardware.board_name().to_owned(),
        scene: scene.name.clone(),
        sensor: scene.sensor.clone(),
        hardware,
        hardware_refused,
        microcontroller,
        microcontroller_refused,
        noise,
        noise_not_stated,
        network: network(&scene, &arguments.target),
        rates,
        not_measured,
        tare_load,
        errors,
        other_medium,
        not_drawn,
    })
}

/// Which network the hardware of a scene may have in place of the one that it has, or of none; `None` for frames without noise, and
/// where there is no better one.
fn network(scene: &Scene, target: &str) -> Option<String> {
    let file = beside(target, scene, "network");
    let file = file.file_name().unwrap_or_default().to_string_lossy();
    let train = format!("dermis train {target} (minutes), then [search] network = \"{file}\"");
    let in_hardware = "[hardware] estimator = \"network\"";
    let none = "none, and noise misleads the search";
    if scene.search.noise_floor_MPa == Some(0.0) || scene.require_network().is_err() {
        return None;
    }
    let Some(own) = &scene.search.network else {
        return Some(match Learned::serving(scene) {
            Some(name) => format!("{none}: [search] network = \"{name}\", {in_hardware}; for smaller errors {train}"),
            None => format!("{none}: {train}, {in_hardware}"),
        });
    };
    let of_range = Learned::signature_of(scene).is_ok_and(|own| matches!(own.cover, Cover::Range(_)));
    let own = own.file_name().unwrap_or_default().to_string_lossy();
    of_range.then(|| format!("{own} serves many sensors; one for this sensor alone has smaller errors: {train}"))
}

/// The hardware of a scene on its board; the model's own scene has the estimator of the hardware already.
fn hardware(scene: &Scene, model: &Model) -> Result<HardwareCheck> {
    let features = explain(model)?;
    let left_out = features.iter().filter(|feature| !feature.present).map(|feature| feature.feature).collect();
    Ok(HardwareCheck::new(model, &generate(model)?.usage, estimator_instead(scene), left_out))
}
