//! `dermis export`: what a scene has, in a file that other programs read.

use std::path::PathBuf;

use anyhow::Result;
use clap::{Args, ValueEnum};
use dermis_golden::estimate::learned::Learned;
use dermis_golden::spec::scene::{EstimatorKind, Scene};
use dermis_golden::write::write;

/// Arguments of `dermis export`.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  dermis export onnx sensor-1 sensor-1.onnx          its network, for ONNX Runtime and other programs
  dermis export onnx my-scene.toml my-scene.onnx     of a scene with search.network, which dermis train writes

Inputs of the network: stress (batch, rows, cols) in MPa; mask, of the same shape, 1 on taxels that are dead or beyond the
array, else 0. Outputs: mu, the ratio of shear to normal force, and sigma, its standard deviation, both (batch, 2): x, y.
A network that reads a window around a contact takes the readings of the window, the contact in its middle.")]
pub struct Arguments {
    /// What is written.
    #[arg(value_enum)]
    format: ExportFormat,
    /// Built-in name or path of a scene.
    scene: String,
    /// The file.
    out: PathBuf,
}

/// A kind of file.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum ExportFormat {
    /// The network of search.network, from the stress to mu.
    Onnx,
}

/// Writes the file and returns text for stdout.
///
/// # Errors
/// An unknown scene, one without a network, a network of another scene, a file that cannot be written.
pub fn run(arguments: &Arguments) -> Result<String> {
    let scene = Scene::load(&arguments.scene)?;
    let (bytes, content) = match arguments.format {
        ExportFormat::Onnx => {
            let learned = Learned::of_scene(&scene, EstimatorKind::EvidenceNetwork)?;
            let content = format!("{} weights, {}", learned.weights(), learned.signature().window);
            (learned.to_onnx(&scene.name), content)
        }
    };
    write(&arguments.out, &bytes)?;
    Ok(format!("{}: {content}, {} bytes\n", arguments.out.display(), bytes.len()))
}
