//! Scene and frames from the command line's SCENE and `--frame` arguments.
//!
//! | SCENE | `--frame` | gives |
//! |---|---|---|
//! | given | files, recordings, `eq2` | the scene, those frames |
//! | given | none | the scene, its shipped frames |
//! | none | files | the built-in scene with the first file's sensor, else the default scene of that sensor |
//!
//! One reconstruction takes 2^k frames, where k is the scene's `input.average`; with a sliding mean or a running zero all since a reset.

use std::path::{Path, PathBuf};

use anyhow::{bail, Result};
use clap::Args;
use dermis_flow::say;
use dermis_golden::data::frame::Frame;
use dermis_golden::data::input::Input;
use dermis_golden::result::flags;
use dermis_golden::spec::scene::Scene;

use super::layout::LayoutArguments;
use dermis_report as report;

/// `--frame` value for the stress of the paper's Eq. 2.
pub const EQ2: &str = "eq2";

/// The option `--target-board`, which replaces a scene's board.
#[derive(Args, Clone, Debug, Default)]
pub struct BoardOverride {
    /// Board to use instead of the scene's: a name that `dermis boards` lists, or the path of a file that ends with .toml.
    #[arg(long, value_name = "BOARD")]
    target_board: Option<String>,
}

impl BoardOverride {
    /// The scene with that board; unchanged where the option is absent.
    pub fn apply(&self, mut scene: Scene) -> Scene {
        scene.hardware.board = self.target_board.clone().or(scene.hardware.board);
        scene
    }
}

/// The file of `extension` beside that of a scene, whose argument is `named`, or in the working folder for a built-in one.
pub(super) fn beside(named: &str, scene: &Scene, extension: &str) -> PathBuf {
    Path::new(named).with_file_name(format!("{}.{extension}", scene.name))
}

/// The hardware's estimator where it is not that of the floating-point model.
pub(super) fn estimator_instead(scene: &Scene) -> Option<&'static str> {
    let hardware = scene.hardware_estimator();
    (hardware != scene.model_estimator()).then(|| hardware.name())
}

/// Whether every result of the scene's hardware carries `noise-not-stated`.
///
/// # Errors
/// Files of the input options that cannot be read.
pub(super) fn noise_not_stated(scene: &Scene) -> Result<bool> {
    Ok(flags::noise_not_stated(scene, scene.hardware_estimator(), Input::new(scene)?.noise_MPa()))
}

/// What a user of the hardware must know of the scene, a line each on standard error: where it computes another estimator than
/// the floating-point model and the scene does not state it; where the noise is not stated.
///
/// # Errors
/// As [`noise_not_stated`].
pub(super) fn note_hardware(scene: &Scene) -> Result<()> {
    if let (Some(hardware), None) = (estimator_instead(scene), scene.hardware.estimator) {
        let (model, (_, reason)) = (scene.model_estimator().name(), scene.choose_for_hardware());
        say!("{}: estimator {hardware} in hardware, {model} in floating point: {reason}", scene.name);
    }
    if noise_not_stated(scene)? {
        say!("{}: {}", scene.name, report::NOISE_NOT_STATED);
    }
    Ok(())
}

/// Loads the scene and its frames, at least one.
///
/// # Errors
/// Unknown scene, unreadable frame, a frame of another sensor, neither scene nor sensor given, no frames.
pub fn resolve(scene: Option<&str>, frames: &[String], layout: &LayoutArguments) -> Result<(Scene, Vec<Frame>)> {
    let scene = match (scene, frames.first().map(String::as_str)) {
        (Some(scene), _) => Scene::load(scene)?,
        (None, Some(first)) if first != EQ2 => scene_of_frame(first)?,
        (None, Some(_)) => bail!("--frame {EQ2} defines no sensor: name a scene"),
        (None, None) => bail!(
            "name a scene ({}, or a file), or a frame file that contains its sensor",
            Scene::builtin_names().join(", ")
        ),
    };
    let frames = frames_of(&scene, frames, layout)?;
    Ok((scene, frames))
}

/// The frames of the files, without any those shipped for the sensor of `scene`: at least one.
///
/// # Errors
/// Unreadable frame, a frame of another sensor, no frames.
pub(super) fn frames_of(scene: &Scene, files: &[String], layout: &LayoutArguments) -> Result<Vec<Frame>> {
    if !files.is_empty() {
        return files.iter().map(|path| load(path, scene, layout)).collect::<Result<Vec<_>>>().map(|all| all.concat());
    }
    let shipped = Frame::shipped(scene);
    if shipped.is_empty() {
        bail!("scene {}: no frame is shipped for {}: give one with --frame", scene.name, scene.sensor);
    }
    Ok(shipped)
}

/// The scene of the hardware, that of the specimen whose tables are loaded into it, if `tables` names one, and frames for what is
/// there then.
///
/// # Errors
/// As [`resolve`]; a specimen without hardware.
pub(super) fn resolve_specimen(
    hardware: Option<&str>,
    tables: Option<&str>,
    frames: &[String],
    layout: &LayoutArguments,
) -> Result<(Scene, Option<Scene>, Vec<Frame>)> {
    let (scene, frames) = resolve(tables.or(hardware), frames, layout)?;
    match (tables, hardware) {
        (None, _) => Ok((scene, None, frames)),
        (Some(_), Some(hardware)) => Ok((Scene::load(hardware)?, Some(scene), frames)),
        (Some(tables), None) => bail!("--tables {tables}: name the scene of the hardware as well"),
    }
}

/// Loads the scene and the frames of one reconstruction, 2^k or all of a sliding mean or a running zero; without `--frame`, where one frame
/// gives a result, the first shipped frame.
///
/// # Errors
/// As [`resolve`]; a number of frames other than 2^k.
pub fn resolve_one(scene: Option<&str>, files: &[String], layout: &LayoutArguments) -> Result<(Scene, Vec<Frame>)> {
    let named = scene;
    let (scene, mut frames) = resolve(named, files, layout)?;
    let (average, wanted) = (scene.input.average, scene.input.frames_per_result());
    if files.is_empty() && wanted == 1 {
        frames.truncate(1);
    } else if !scene.input.has_memory() && frames.len() != wanted {
        let (origin, got) = (named.unwrap_or(&scene.name), frames.len());
        let hint =
            if got > files.len() { "; FILE.mcap:N is frame N of a recording, --stream takes every line" } else { "" };
        bail!(
            "{origin}: input.average = {average}: the number of frames must be 2^{average} = {wanted}, got {got}{hint}"
        );
    }
    Ok((scene, frames))
}

/// The frames of a file.
fn load(path: &str, scene: &Scene, layout: &LayoutArguments) -> Result<Vec<Frame>> {
    if path == EQ2 {
        return Ok(vec![Frame::eq2(&scene.sensor)]);
    }
    let frames = Frame::load_all_as(path, Some(scene), &layout.stated())?;
    frames.iter().try_for_each(|frame| frame.check(scene))?;
    Ok(frames)
}

/// Names of scenes: `scenes`, or if there is none those of `default`.
pub fn scenes_or(scenes: &[String], default: impl IntoIterator<Item = &'static str>) -> Vec<String> {
    match scenes {
        [] => default.into_iter().map(str::to_owned).collect(),
        named => named.to_vec(),
    }
}

/// The built-in scene with the sensor and medium in a frame file, else the default scene of both; where the file names no medium,
/// the first with the sensor.
fn scene_of_frame(path: &str) -> Result<Scene> {
    let Frame { sensor, medium, .. } = Frame::load(path, None)?;
    for name in Scene::builtin_names() {
        let scene = Scene::builtin(name)?;
        if scene.sensor == sensor && medium.is_none_or(|medium| medium == scene.medium) {
            return Ok(scene);
        }
    }
    Ok(Scene { medium: medium.unwrap_or_default(), ..Scene::of_sensor(&sensor, "frame") })
}
