//! Frames in text: lines of numbers in MPa, as [`crate::data::text`] reads them.

use super::{Frame, FrameError};
use crate::data::text::{frames, NoReadings, Stated};
use crate::spec::scene::Scene;

/// Reads a frame of the scene's sensor.
pub(super) fn parse(text: &str, file: &str, stem: &str, scene: Option<&Scene>) -> Result<Frame, FrameError> {
    let mut frames = parse_all(text, file, stem, scene, &Stated::default())?;
    match (frames.pop(), frames.len()) {
        (Some(frame), 0) => Ok(frame),
        (_, others) => {
            let reason = format!("has {} frames, wanted one", others + 1);
            Err(FrameError::Text { file: file.to_string(), reason: NoReadings::of_text(reason) })
        }
    }
}

/// Reads one or more frames of the scene's sensor; a line that holds none is an error.
pub(super) fn parse_all(
    text: &str,
    file: &str,
    stem: &str,
    scene: Option<&Scene>,
    stated: &Stated,
) -> Result<Vec<Frame>, FrameError> {
    let sensor = match scene {
        Some(scene) => &scene.sensor,
        None => return Err(FrameError::NoSensor { file: file.to_string() }),
    };
    let wrong = |reason: NoReadings| FrameError::Text { file: file.to_string(), reason };
    let read = frames(text, [sensor.rows, sensor.cols], stated).map_err(wrong)?;
    if let Some(left_out) = read.left_out.into_iter().next() {
        return Err(wrong(left_out.reason));
    }
    let several = read.frames.len() > 1;
    let one = |own: crate::data::text::TextFrame| {
        let frame = Frame { time_ns: own.time_ns, ..Frame::from_stress(stem, sensor, own.readings)? };
        let of = if several { format!("{file}, line {}", own.first_line) } else { file.to_string() };
        frame.check_missing(&of, scene)?;
        Ok(frame)
    };
    read.frames.into_iter().map(one).collect()
}
