//! Time and energy of a frame by estimator, on CPU, microcontroller and FPGA.

use std::path::Path;

use anyhow::Result;
use dermis_golden::spec::scene::Scene;

use super::super::document::Picture;
use super::super::measure::{self, machine, DeviceOptions};
use super::super::sections::{device_picture, device_table, device_text, DEVICE_SCENES};
use super::super::style::standalone;
use super::super::table::aligned;
use dermis_golden::write::write;

/// Columns of words: scene, estimator, device.
const WORDS: usize = 3;

/// Measures the scenes, those of the guide where there are none: a table, or JSON; and the picture of it, an SVG file.
///
/// # Errors
/// A scene that cannot be loaded, drawn on or generated; an interpreter or a simulation that fails; a file that cannot be written.
pub fn run(scenes: &[String], options: &DeviceOptions, picture: Option<&Path>, json: bool) -> Result<String> {
    let names: Vec<&str> = match scenes {
        [] => DEVICE_SCENES.to_vec(),
        names => names.iter().map(String::as_str).collect(),
    };
    let scenes = names.into_iter().map(Scene::load).collect::<Result<Vec<_>, _>>()?;
    let devices = measure::devices(&scenes, options)?;
    if let Some(path) = picture {
        let Picture { svg, caption, .. } = device_picture(&devices)?;
        write(path, standalone(&svg, "Where a frame is computed", &caption).as_bytes())?;
    }
    if json {
        return Ok(serde_json::to_string(&devices)? + "\n");
    }
    let table = device_table(&devices);
    let rows = table.rows.into_iter().map(|row| row.into_iter().map(|cell| cell.shown).collect());
    let text = aligned(WORDS, &table.head, rows.collect());
    let notes: String = devices.notes.iter().map(|note| format!("{note}\n")).collect();
    Ok(format!("{text}\n{}\n{}\n{notes}", device_text(), machine()))
}
