//! Errors of frames; each names file, field and value.

use crate::data::recording::RecordingError;
use crate::data::text::NoReadings;
use crate::spec::sensor::{Sensor, SensorError};
use thiserror::Error;

/// A frame cannot be used.
#[derive(Debug, Error)]
pub enum FrameError {
    /// The file cannot be read as text.
    #[error("{file}: cannot be read: {source}")]
    Unreadable {
        /// Path as given.
        file: String,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// The file is larger than a frame may be; it is rejected before it is read.
    #[error("{file}: over {limit} bytes, too large for a frame")]
    TooLarge {
        /// Path as given.
        file: String,
        /// Largest size in bytes.
        limit: u64,
    },
    /// A folder has no frame.
    #[error("{file}: has no frames; their file names end in .csv, .ndjson, .jsonl, .json or .mcap")]
    NoFrames {
        /// Path as given.
        file: String,
    },
    /// The file name ends in none of `.csv`, `.ndjson`, `.jsonl`, `.json` and `.mcap`.
    #[error("{file}: a frame's file name ends in .csv, .ndjson, .jsonl, .json or .mcap")]
    UnknownKind {
        /// Path as given.
        file: String,
    },
    /// A recording cannot be read, or holds no such frame.
    #[error("{file}: {source}")]
    Recording {
        /// Path as given.
        file: String,
        /// What is wrong.
        source: RecordingError,
    },
    /// A recording has several frames where one is wanted.
    #[error("{file}: has {count} frames, wanted one: {file}:1 is the first")]
    SeveralFrames {
        /// Path as given.
        file: String,
        /// Number of frames.
        count: usize,
    },
    /// The text is not valid JSON, is truncated, or a value has the wrong type.
    #[error("{file}, line {line}, column {column}{}: {message}", in_field(field))]
    Json {
        /// Path as given.
        file: String,
        /// Line, from 1.
        line: usize,
        /// Column, from 1.
        column: usize,
        /// Path of the field, if known.
        field: Option<String>,
        /// Error of the JSON reader.
        message: String,
    },
    /// A value is out of range.
    #[error("{file}: {field} = {value} is not allowed; it must be {allowed}")]
    WrongValue {
        /// Path as given.
        file: String,
        /// The field.
        field: &'static str,
        /// The value found.
        value: f64,
        /// The allowed values, in words.
        allowed: String,
    },
    /// The file has no sensor, and no scene was given to take one from.
    #[error("{file}: no sensor in the file; name a scene")]
    NoSensor {
        /// Path as given.
        file: String,
    },
    /// A size of the frame's sensor is out of range.
    #[error("{file}: sensor.{source}")]
    Sensor {
        /// Path as given.
        file: String,
        /// Field, value and what is allowed.
        source: SensorError,
    },
    /// A field has more or fewer values than the sensor has taxels.
    #[error("{file}: {field} has {got} values, wanted {wanted}")]
    WrongCount {
        /// Path as given.
        file: String,
        /// The field.
        field: String,
        /// Number of values found.
        got: usize,
        /// Number of values expected.
        wanted: usize,
    },
    /// A value is infinite, or NaN where no reading can be missing.
    #[error("{file}: {field}[{index}] = {value} is not a finite number")]
    NotFinite {
        /// Path as given.
        file: String,
        /// The field.
        field: String,
        /// Index in the field, from 0.
        index: usize,
        /// The value.
        value: f64,
    },
    /// More readings are missing than the scene allows.
    #[error("{file}: {count} of {taxels} readings are missing, wanted at most {most} (input.missing_share = {share})")]
    TooManyMissing {
        /// Path as given, or the frame's name.
        file: String,
        /// Number of live taxels without a reading.
        count: usize,
        /// Number of live taxels.
        taxels: usize,
        /// The scene's largest share.
        share: f64,
        /// The number of taxels that it allows.
        most: usize,
    },
    /// No frame has the reading of a live taxel.
    #[error("{file}: no frame has a reading of row {row}, column {col}")]
    NeverRead {
        /// Path as given.
        file: String,
        /// Row of the taxel.
        row: usize,
        /// Its column.
        col: usize,
    },
    /// A line of text holds no frame.
    #[error("{}", reason.in_file(file))]
    Text {
        /// Path as given.
        file: String,
        /// Line, cell and what is wrong.
        reason: NoReadings,
    },
    /// The frame's sensor is not the scene's.
    #[error(
        "frame {frame} and scene {scene} disagree: the frame's sensor is {frame_sensor}, the scene's is {scene_sensor}"
    )]
    SensorMismatch {
        /// The frame's id.
        frame: String,
        /// The scene's name.
        scene: String,
        /// Sensor of the frame.
        frame_sensor: Box<Sensor>,
        /// Sensor of the scene.
        scene_sensor: Box<Sensor>,
    },
}

/// The field's path as it follows line and column.
fn in_field(field: &Option<String>) -> String {
    field.as_ref().map_or(String::new(), |field| format!(", {field}"))
}

/// Checks a number of values.
pub(super) fn check_count(file: &str, field: &str, got: usize, wanted: usize) -> Result<(), FrameError> {
    if got == wanted {
        return Ok(());
    }
    Err(FrameError::WrongCount { file: file.to_string(), field: field.to_string(), got, wanted })
}

/// Checks that all values are finite; the error names the first that is not.
pub(super) fn check_finite(file: &str, field: &str, values: &[f64]) -> Result<(), FrameError> {
    match values.iter().position(|value| !value.is_finite()) {
        None => Ok(()),
        Some(index) => {
            Err(FrameError::NotFinite { file: file.to_string(), field: field.to_string(), index, value: values[index] })
        }
    }
}
