//! Frames in JSON. Read: only `stress_MPa` must be there; fields this version does not know are passed over.

use super::{Contact, Forces, Frame, FrameError};
use crate::scene::{Medium, Scene};
use crate::sensor::Sensor;
use serde::{Deserialize, Serialize};

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

/// The file's fields as they are written.
#[derive(Serialize)]
struct Written<'a> {
    id: &'a str,
    #[serde(skip_serializing_if = "Option::is_none")]
    medium: Option<Medium>,
    #[serde(skip_serializing_if = "Option::is_none")]
    source: Option<&'a str>,
    sensor: &'a Sensor,
    contacts: &'a [Contact],
    #[serde(skip_serializing_if = "Option::is_none")]
    resultant_N: Option<[f64; 3]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    cell_forces_N: Option<&'a Forces>,
    stress_MPa: &'a [f64],
    #[serde(skip_serializing_if = "Option::is_none")]
    notes: Option<&'a str>,
}

impl Frame {
    /// The frame as JSON that [`Frame::load`] reads back unchanged, on one line.
    pub fn to_json(&self) -> String {
        let written = Written {
            id: &self.id,
            medium: self.medium,
            source: self.source.as_deref(),
            sensor: &self.sensor,
            contacts: &self.contacts,
            resultant_N: self.resultant_N,
            cell_forces_N: self.cell_forces_N.as_ref(),
            stress_MPa: &self.stress_MPa,
            notes: self.notes.as_deref(),
        };
        // Numbers, texts and lists of them always have a JSON form.
        serde_json::to_string(&written).unwrap_or_default()
    }
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
