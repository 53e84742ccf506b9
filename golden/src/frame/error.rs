//! What can be wrong with a frame, each with file, field and value.

use crate::sensor::{Sensor, SensorError};
use thiserror::Error;

/// A frame that cannot be used.
#[derive(Debug, Error)]
pub enum FrameError {
    /// The file cannot be read as text.
    #[error("{file}: cannot be read: {source}")]
    Unreadable {
        /// Path as given.
        file: String,
        /// The system's reason.
        source: std::io::Error,
    },
    /// More than a frame can have; refused before it is read.
    #[error("{file}: over {limit} bytes, too large for a frame")]
    TooLarge {
        /// Path as given.
        file: String,
        /// Largest size in bytes.
        limit: u64,
    },
    /// Neither `.json` nor `.csv`.
    #[error("{file}: a frame's file name ends in .json or .csv")]
    UnknownKind {
        /// Path as given.
        file: String,
    },
    /// Not JSON, cut short, or a value of the wrong type.
    #[error("{file}, line {line}, column {column}{}: {message}", in_field(field))]
    Json {
        /// Path as given.
        file: String,
        /// Line, from 1.
        line: usize,
        /// Column, from 1.
        column: usize,
        /// Path of the field, where the reader was in one.
        field: Option<String>,
        /// What is wrong there.
        message: String,
    },
    /// A value out of its range.
    #[error("{file}: {field} = {value} is not allowed; it must be {allowed}")]
    WrongValue {
        /// Path as given.
        file: String,
        /// The field.
        field: &'static str,
        /// The value found.
        value: f64,
        /// What the field may hold.
        allowed: &'static str,
    },
    /// The frame does not say which sensor it was read with, and no scene does either.
    #[error("{file}: no sensor in the file; name a scene")]
    NoSensor {
        /// Path as given.
        file: String,
    },
    /// The frame's sensor has a size out of range.
    #[error("{file}: sensor.{source}")]
    Sensor {
        /// Path as given.
        file: String,
        /// Field, value and what is allowed.
        source: SensorError,
    },
    /// More or fewer values than taxels.
    #[error("{file}: {field} has {got} values, wanted {wanted}")]
    WrongCount {
        /// Path as given.
        file: String,
        /// The field.
        field: String,
        /// Values found.
        got: usize,
        /// Values the sensor asks for.
        wanted: usize,
    },
    /// NaN or infinity.
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
    /// A CSV cell that is no finite number.
    #[error("{file}, line {line}, value {column}: {value:?} is not a finite number{hint}")]
    CsvValue {
        /// Path as given.
        file: String,
        /// Line, from 1.
        line: usize,
        /// Position in the line, from 1.
        column: usize,
        /// The text found.
        value: String,
        /// A guess at the reason, or nothing.
        hint: &'static str,
    },
    /// A CSV line with more or fewer values than columns.
    #[error("{file}, line {line}: {got} values, wanted {wanted}{hint}")]
    CsvRagged {
        /// Path as given.
        file: String,
        /// Line, from 1.
        line: usize,
        /// Values found.
        got: usize,
        /// The sensor's columns.
        wanted: usize,
        /// A guess at the reason, or nothing.
        hint: &'static str,
    },
    /// The frame was read with another sensor than the scene's.
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

/// The field's path as it follows a place.
fn in_field(field: &Option<String>) -> String {
    field.as_ref().map_or(String::new(), |field| format!(", {field}"))
}

/// Compares a count with the one wanted.
pub(super) fn check_count(file: &str, field: &str, got: usize, wanted: usize) -> Result<(), FrameError> {
    if got == wanted {
        return Ok(());
    }
    Err(FrameError::WrongCount { file: file.to_string(), field: field.to_string(), got, wanted })
}

/// Finds the first value that is not finite.
pub(super) fn check_finite(file: &str, field: &str, values: &[f64]) -> Result<(), FrameError> {
    match values.iter().position(|value| !value.is_finite()) {
        None => Ok(()),
        Some(index) => {
            Err(FrameError::NotFinite { file: file.to_string(), field: field.to_string(), index, value: values[index] })
        }
    }
}
