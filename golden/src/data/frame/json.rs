//! Frames in JSON. Only `stress_MPa` is required; unknown fields are ignored, at the top level and in every object. `null` is a
//! missing reading.

use super::{Contact, Forces, Frame, FrameError};
use crate::data::text::without_nan;
use crate::plain_words::JsonError;
use crate::spec::plain_text::json_schema;
use crate::spec::scene::{Medium, Scene};
use crate::spec::sensor::Sensor;
use schemars::generate::SchemaSettings;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A frame: the stress on every taxel at one moment.
#[derive(Deserialize, JsonSchema)]
#[schemars(title = "Frame of Dermis")]
struct Raw {
    /// Name in reports; else the file's name.
    id: Option<String>,
    /// The medium for which the stress was computed; that of the scene, if it is stated.
    medium: Option<Medium>,
    /// Origin of the stress.
    source: Option<String>,
    /// The array, which must be the scene's; a frame with it needs no scene.
    sensor: Option<Sensor>,
    /// Contacts as `dermis generate` takes them.
    contacts: Option<Vec<Contact>>,
    /// True force in N, [x, y, normal]: errors are printed.
    resultant_N: Option<[f64; 3]>,
    /// True force on each taxel in N.
    cell_forces_N: Option<Forces>,
    /// Stress in MPa, or readings that a calibration table turns into it, of all taxels, row-major; `null` for a missing reading.
    stress_MPa: Vec<Option<f64>>,
    /// When it was acquired, in ns since 1970, or since any moment.
    time_ns: Option<i64>,
    /// Anything else.
    notes: Option<String>,
}

/// The fields of a file as written.
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
    stress_MPa: Vec<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    time_ns: Option<i64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    notes: Option<&'a str>,
}

impl Frame {
    /// JSON schema of a frame's file; unknown fields are ignored.
    pub fn json_schema() -> serde_json::Value {
        json_schema::<Raw>(SchemaSettings::default().for_deserialize())
    }

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
            // NaN is written as null.
            stress_MPa: self.readings(),
            time_ns: self.time_ns,
            notes: self.notes.as_deref(),
        };
        // Numbers, texts and lists of them can always be written as JSON.
        serde_json::to_string(&written).unwrap_or_default()
    }
}

/// Reads a frame; `stem` is its id if the text has none, and the scene's sensor is taken if the text has none.
pub(super) fn parse(text: &str, file: &str, stem: &str, scene: Option<&Scene>) -> Result<Frame, FrameError> {
    // Python writes NaN for a missing reading.
    let text = without_nan(text);
    let mut reader = serde_json::Deserializer::from_str(&text);
    let raw: Raw = serde_path_to_error::deserialize(&mut reader).map_err(|error| {
        let path = error.path().to_string();
        // The reader calls the top level "."; where it cannot tell an entry's name, it writes "?".
        let field = (path != "." && !path.contains('?')).then_some(path);
        wrong(file, field, error.inner())
    })?;
    reader.end().map_err(|error| wrong(file, None, &error))?;
    if let Some(Medium::BondedLayer { poisson: value }) = raw.medium.filter(|medium| !is_possible(medium)) {
        let (file, allowed) = (file.to_string(), Medium::allowed_poisson());
        return Err(FrameError::WrongValue { file, field: "medium.poisson", value, allowed });
    }
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
        stress_MPa: raw.stress_MPa.into_iter().map(|reading| reading.unwrap_or(f64::NAN)).collect(),
        missing: Vec::new(),
        time_ns: raw.time_ns,
        notes: raw.notes,
    };
    frame.with_missing(file)
}

/// Whether the medium's Poisson ratio is in range.
fn is_possible(medium: &Medium) -> bool {
    match *medium {
        Medium::HalfSpace => true,
        Medium::BondedLayer { poisson } => Medium::allows_poisson(poisson),
    }
}

/// The reader's error, in the terms of JSON.
fn wrong(file: &str, field: Option<String>, error: &serde_json::Error) -> FrameError {
    let JsonError { line, column, message } = JsonError::new(error);
    FrameError::Json { file: file.to_string(), line, column, field, message }
}
