//! `dermis schema`: what the files of Dermis hold, for editors and for other programs.

use anyhow::{bail, Result};
use clap::{Args, ValueEnum};
use dermis_golden::data::frame::Frame;
use dermis_golden::result::reconstruct::Reconstruction;
use dermis_golden::spec::scene::Scene;

use dermis_report as report;

/// Arguments of `dermis schema`.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  dermis schema scene >scene.schema.json             editors complete a scene that begins with the line
                                                     #:schema scene.schema.json
  dermis schema scene --format markdown              a row per field: values, default, meaning
  dermis schema result >result.schema.json           of `dermis reconstruct --json`")]
pub struct Arguments {
    /// What is described.
    #[arg(value_enum)]
    what: What,
    /// JSON schema (draft 2020-12), or of scenes a table.
    #[arg(long, value_enum, default_value = "json")]
    format: Format,
}

#[derive(ValueEnum, Clone, Copy, Debug)]
enum What {
    /// A scene, in TOML.
    Scene,
    /// A frame, in JSON.
    Frame,
    /// A result, in JSON.
    Result,
}

#[derive(ValueEnum, Clone, Copy, Debug)]
enum Format {
    /// JSON schema.
    Json,
    /// Aligned Markdown table.
    Markdown,
}

/// Runs the command.
///
/// # Errors
/// A table of anything but scenes.
pub fn run(arguments: &Arguments) -> Result<String> {
    let schema = match (arguments.what, arguments.format) {
        (What::Scene, Format::Markdown) => return Ok(report::scene_fields()),
        (What::Frame | What::Result, Format::Markdown) => bail!("--format markdown: only of scenes; json is of all"),
        (What::Scene, Format::Json) => Scene::json_schema(),
        (What::Frame, Format::Json) => Frame::json_schema(),
        (What::Result, Format::Json) => Reconstruction::json_schema(),
    };
    Ok(serde_json::to_string_pretty(&schema)? + "\n")
}
