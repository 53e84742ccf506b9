//! The scene and the frames of a recording.
//!
//! Without a stated cover the scene has no search (`mu_max = 0`): films have no elastic cover of known thickness, so no
//! shear can be known. Its taxels lie [`BARE_DEPTH`] of the smaller pitch deep, where a force is stress times area.
//! On dead taxels it is what the neighbours' forces suggest, see `matrices::masked`. With a stated thickness the search is left at its default, and an array that reads no tension
//! is `unipolar`.

use super::crop::Window;
use super::error::{ImportError, Source};
use super::measure::Codes;
use super::recording::{RawFrame, Recording};
use super::summary::{FrameRecord, Summary};
use crate::data::frame::{frame_name, Frame, FrameError};
use crate::data::input::missing::complete;
use crate::spec::scene::Scene;
use crate::spec::sensor::Sensor;
use std::fmt::Write as _;

/// Depth of the taxels of a film without cover, over the smaller pitch.
pub const BARE_DEPTH: f64 = 0.1;

/// What the scene's text needs besides the summary.
pub(super) struct Facts<'a> {
    pub sensor: &'a Sensor,
    /// Whether the user stated the thickness of a cover.
    pub covered: bool,
    /// Whether no reading is negative.
    pub unipolar: bool,
    /// Dead taxels in the window, row-major; empty if there are none.
    pub dead: &'a [bool],
}

/// The scene's TOML text and the scene that it parses to.
pub(super) fn scene(summary: &Summary, facts: &Facts) -> Result<(String, Scene), ImportError> {
    let mut text = String::new();
    // Writing to a String cannot fail.
    let _ = write_scene(&mut text, summary, facts);
    let scene = Scene::parse(&text, &format!("{}.toml", summary.name))?;
    Ok((text, scene))
}

fn write_scene(text: &mut String, summary: &Summary, facts: &Facts) -> std::fmt::Result {
    let (sensor, window) = (facts.sensor, &summary.window);
    let name = toml::Value::String(summary.name.clone());
    writeln!(
        text,
        "# Written by dermis import: rows {} to {}, columns {} to {} of the recording, stress in MPa.",
        window.row0,
        window.row0 + window.rows - 1,
        window.col0,
        window.col0 + window.cols - 1
    )?;
    writeln!(text, "name = {name}\n\n[sensor]\nrows = {}\ncols = {}", sensor.rows, sensor.cols)?;
    writeln!(text, "pitch_x_mm = {}\npitch_y_mm = {}", sensor.pitch_x_mm, sensor.pitch_y_mm)?;
    let remark = if facts.covered { "" } else { "       # no cover is known: a tenth of the pitch" };
    writeln!(text, "thickness_mm = {}{remark}\n\n[search]", sensor.thickness_mm)?;
    if !facts.covered {
        writeln!(text, "mu_max = 0               # without a cover of known thickness no shear can be found")?;
    }
    let floor = noise_floor(summary);
    writeln!(text, "noise_floor_MPa = {floor:.2e}\n\n[input]\nfull_scale_MPa = {}", summary.full_scale_MPa)?;
    if facts.covered && facts.unipolar {
        writeln!(text, "unipolar = true")?;
    }
    let dead = facts.dead.iter().enumerate().filter(|(_, dead)| **dead);
    let dead: Vec<String> = dead.map(|(k, _)| format!("[{}, {}]", k / sensor.cols, k % sensor.cols)).collect();
    if !dead.is_empty() {
        writeln!(text, "dead = [")?;
        for line in dead.chunks(12) {
            writeln!(text, "  {},", line.join(", "))?;
        }
        writeln!(text, "]")?;
    }
    Ok(())
}

/// Standard deviation of a reading: the measured noise, at least that of rounding to the step.
fn noise_floor(summary: &Summary) -> f64 {
    let Codes { step_MPa, .. } = summary.codes;
    let rounding = step_MPa.unwrap_or(0.0) / 12f64.sqrt();
    let measured = summary.noise.loaded_MPa.or(summary.noise.empty_MPa).unwrap_or(0.0);
    measured.max(rounding)
}

/// Leaves out the frames that lack more readings in the window than `scene` allows; returns their numbers.
///
/// # Errors
/// That of the first where none is left.
pub(super) fn leave_out(
    recording: &mut Recording,
    window: Window,
    scene: &Scene,
    source: &Source,
) -> Result<Vec<usize>, ImportError> {
    let (missing, cols) = (&recording.missing, recording.cols);
    let live = || window.indices(cols).filter(|k| !missing[*k]);
    let lacking = |raw: &RawFrame| live().filter(|k| raw.values[*k].is_nan()).count();
    let most = scene.input.most_missing(&scene.sensor);
    let all = std::mem::take(&mut recording.frames);
    let (whole, left_out): (Vec<RawFrame>, Vec<RawFrame>) = all.into_iter().partition(|raw| lacking(raw) <= most);
    if let Some(first) = left_out.first().filter(|_| whole.is_empty()) {
        let (file, count, taxels) =
            (format!("{}, frame {}", source.file, first.number), lacking(first), live().count());
        return Err(FrameError::TooManyMissing { file, count, taxels, share: scene.input.missing_share, most }.into());
    }
    recording.frames = whole;
    Ok(left_out.iter().map(|raw| raw.number).collect())
}

/// The readings of a window, 0 where none exists in any frame.
fn readings<'a>(recording: &'a Recording, window: Window, raw: &'a RawFrame) -> impl Iterator<Item = f64> + 'a {
    window.indices(recording.cols).map(|k| if recording.missing[k] { 0.0 } else { raw.values[k] })
}

/// The frames of a window in MPa with their records; `scene` has the sensor and its dead taxels.
pub(super) fn frames(
    recording: &Recording,
    window: Window,
    scene: &Scene,
    per_MPa: f64,
) -> Result<(Vec<Frame>, Vec<FrameRecord>), ImportError> {
    let (sensor, name) = (&scene.sensor, &scene.name);
    let area_mm2 = sensor.pitch_x_mm * sensor.pitch_y_mm;
    let sum = |values: &mut dyn Iterator<Item = f64>| values.filter(|value| !value.is_nan()).sum::<f64>();
    let frame = |(index, raw): (usize, &RawFrame)| {
        let id = frame_name(name, index + 1);
        let stress: Vec<f64> = readings(recording, window, raw).map(|reading| reading / per_MPa).collect();
        let inside_N = area_mm2 * sum(&mut stress.iter().copied());
        let outside_N = area_mm2 / per_MPa * sum(&mut raw.values.iter().copied()) - inside_N;
        let mut frame = Frame::from_stress(&id, sensor, stress)?;
        let normal_N = sensor.sum_of_stress_N(&complete(&scene.input, frame.clone()).stress_MPa);
        let record = FrameRecord {
            number: raw.number,
            time_s: raw.time_s,
            normal_N,
            // Differences of sums as small as their rounding are none.
            outside_N: if outside_N.abs() <= 1e-9 * normal_N.abs() { 0.0 } else { outside_N },
            device_N: raw.device.map(|figure| figure.force_N(area_mm2 / per_MPa)),
        };
        frame.source = Some(record.source());
        // As the stamps of the recording, of which 0 states no time.
        frame.time_ns = raw.time_s.map(|time_s| (time_s * 1e9).round() as i64).filter(|ns| *ns > 0);
        Ok((frame, record))
    };
    let all = recording.frames.iter().enumerate().map(frame).collect::<Result<Vec<_>, ImportError>>()?;
    Ok(all.into_iter().unzip())
}
