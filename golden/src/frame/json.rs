//! Frames in JSON. Only `stress_MPa` must be there; fields this version does not know are passed over.

use super::{Contact, Forces, Frame, FrameError};
use crate::scene::{Medium, Scene};
use crate::sensor::Sensor;
use serde::Deserialize;

/// The file's fields as they come.
#[derive(Deserialize)]
struct Raw {
    id: Option<String>,
    medium: Option<Medium>,
    source: Option<String>,
    sensor: Option<Sensor>,
    contacts: Option<Vec<Contact>>,
    resultant_N: Option<[f64; 3]>,
    cell_forces_N: Option<Forces>,
    stress_MPa: Vec<f64>,
    notes: Option<String>,
}

/// Reads a frame; `stem` is its id when the text has none, the scene's sensor its sensor.
pub(super) fn parse(text: &str, file: &str, stem: &str, scene: Option<&Scene>) -> Result<Frame, FrameError> {
    let raw: Raw = serde_json::from_str(text).map_err(|error| FrameError::Json {
        file: file.to_string(),
        line: error.line(),
        column: error.column(),
        message: error.to_string(),
    })?;
    let sensor = raw.sensor.or_else(|| scene.map(|scene| scene.sensor.clone()));
    let sensor = sensor.ok_or_else(|| FrameError::NoSensor { file: file.to_string() })?;
    sensor.check().map_err(|source| {
        let file = file.to_string();
        FrameError::Sensor { file, source }
    })?;
    let frame = Frame {
        id: raw.id.unwrap_or_else(|| stem.to_string()),
        medium: raw.medium,
        source: raw.source,
        sensor,
        contacts: raw.contacts.unwrap_or_default(),
        resultant_N: raw.resultant_N,
        cell_forces_N: raw.cell_forces_N,
        stress_MPa: raw.stress_MPa,
        notes: raw.notes,
    };
    frame.check_values(file)?;
    Ok(frame)
}
