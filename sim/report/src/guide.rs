//! The pictures of README.md and of the guide.
//!
//! | file | shows | |
//! |---|---|---|
//! | `data-flow.svg` | stages of the hardware and the words between them | always the same |
//! | `feet.svg` | forces of two feet, bit-true model | always the same |
//! | `timing-STAGE.svg` | the ports of a stage during a frame, kernel simulation | always the same |
//! | `time-sensor-1-shear.svg` | shear error against the time of a frame | measured anew |
//! | `devices.svg` | time of a frame by estimator and device | by `dermis study devices --picture` |

use std::collections::BTreeSet;
use std::path::Path;

use anyhow::{anyhow, Result};
use dermis_golden::data::frame::Frame;
use dermis_golden::fixed::Model;
use dermis_golden::spec::partition::Case;
use dermis_golden::spec::scene::{Condition, Scene};
use dermis_hdl::describe::Trace;
use dermis_hdl::language::SEPARATOR;

use super::document::Picture;
use super::measure::{measure, Options};
use super::pictures::{data_flow, force_field, waveform, Outline, FLOW_SCENE};
use super::sections::time_pictures;
use super::style::standalone;
use dermis_cosim::block_timing::{timing, traces, SCENE};
use dermis_flow::jobs::Interrupt;
use dermis_flow::progress::Progress;

/// A scene with the stages for options of input and output.
const SUMS: &str = include_str!("../../../golden/data/scenes/sensor-1-sums.toml");
/// The frame with two feet, and the scene of its sensor.
const FEET: (&str, &str) = ("s4-plantar-two-feet", "sensor-4");

/// A picture as a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PictureFile {
    /// Its name.
    pub name: String,
    /// SVG, legible on light and on dark pages.
    pub text: String,
}

impl PictureFile {
    fn new(name: &str, svg: &str, title: &str, description: &str) -> PictureFile {
        PictureFile { name: format!("{name}.svg"), text: standalone(svg, title, description) }
    }
}

/// The pictures that only a change of the program changes.
///
/// # Errors
/// A picture that cannot be written.
pub fn fixed_pictures(build: &Path) -> Result<Vec<PictureFile>> {
    let mut files = vec![flow()?, feet()?];
    let mut drawn = BTreeSet::new();
    for scene in scenes()? {
        for trace in traces(&scene, build)? {
            let block = &trace.block;
            let is_drawn = !block.instance.contains(SEPARATOR) || block.name == "choose";
            if is_drawn && drawn.insert(block.name) {
                files.push(timing_picture(&scene.name, &trace)?);
            }
        }
    }
    Ok(files)
}

/// Scenes whose hardware has all stages between them; a stage is drawn for the first that has it.
fn scenes() -> Result<Vec<Scene>> {
    let base = Scene::builtin(SCENE)?;
    let mut choosing = base.clone();
    choosing.partition.case = Case::Adaptive;
    let others = [Scene::builtin("sensor-1-noisy")?, Scene::builtin("eight-by-eight-contacts")?];
    let sums = Scene::parse(SUMS, "sensor-1-sums.toml")?;
    Ok([base].into_iter().chain(others).chain([choosing, sums]).collect())
}

/// The picture of a block's ports during a frame.
///
/// # Errors
/// A picture that cannot be written.
pub fn timing_picture(scene: &str, trace: &Trace) -> Result<PictureFile> {
    let block = &trace.block;
    let title = format!("Timing of {} for {scene}", block.name);
    let description = format!("{} Its ports in the cycles of one frame in which a handshake changes.", block.purpose);
    Ok(PictureFile::new(&format!("timing-{}", block.name), &waveform(&timing(trace))?, &title, &description))
}

fn flow() -> Result<PictureFile> {
    let scene = Scene::builtin(FLOW_SCENE)?;
    let sensor = scene.sensor.clone();
    let title = format!("Data flow of the hardware for {} × {} taxels", sensor.rows, sensor.cols);
    let description =
        "From a frame of normal stress to forces: receive, normalise, fold, pass, rescale, unfold, search, \
                       force, send, with the width in bits of the words between the stages.";
    Ok(PictureFile::new("data-flow", &data_flow(&Model::new(&scene)?)?, &title, description))
}

fn feet() -> Result<PictureFile> {
    let (name, scene) = FEET;
    let _progress = Progress::start("feet.svg");
    let scene = Scene::builtin(scene)?;
    let shipped = Frame::shipped(&scene);
    let frame = shipped.iter().find(|frame| frame.id == name);
    let frame = frame.ok_or_else(|| anyhow!("{}: no frame {name} is shipped", scene.name))?;
    let result = Model::for_frames(&scene, std::slice::from_ref(frame))?.reconstruct(frame)?;
    let forces = &result.forces_N;
    let largest = |values: &mut dyn Iterator<Item = f64>| values.fold(0.0, f64::max);
    let peaks = [
        largest(&mut forces.fz.iter().map(|f| f.abs())),
        largest(&mut forces.fx.iter().zip(&forces.fy).map(|(x, y)| x.hypot(*y))),
    ];
    let svg = force_field(
        &scene.sensor,
        forces,
        peaks,
        Outline { subarrays: &result.subarrays, centroids: false, contacts: &[] },
    )?;
    let (rows, cols, parts) = (scene.sensor.rows, scene.sensor.cols, result.subarrays.len());
    let title = format!("Forces of two feet on {rows} × {cols} taxels");
    let description = format!(
        "Reconstructed by the bit-true model in {parts} subarrays: normal force by colour, tangential force by arrows."
    );
    Ok(PictureFile::new("feet", &svg, &title, &description))
}

/// The picture of error against time, measured on this machine; the hardware's cycles are the bit-true model's.
///
/// # Errors
/// A measurement that fails, an interruption.
pub fn time_picture(build: &Path) -> Result<PictureFile> {
    let options = Options {
        quick: false,
        jobs: 1,
        build: build.to_owned(),
        condition: Condition::default(),
        simulate: false,
        interrupt: Interrupt::on_signals()?,
    };
    let cases: Vec<Case> = (0..4).filter_map(Case::numbered).collect();
    let measured = measure(&[Scene::builtin(FLOW_SCENE)?], &cases, &options)?;
    let picture = time_pictures(FLOW_SCENE, &measured)?.into_iter().next();
    let Picture { id, caption, svg } = picture.ok_or_else(|| anyhow!("{FLOW_SCENE}: nothing was measured"))?;
    let description =
        "Both axes are logarithmic. Marks are named by their case: 0 the whole array, 1 to 3 subarrays. The \
                       hardware stands left of the 1 ms line, at the errors of the bit-true model.";
    Ok(PictureFile::new(&id, &svg, &caption, description))
}
