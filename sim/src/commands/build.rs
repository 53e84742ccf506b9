//! `dermis build`: generates the Verilog of a scene.

use std::path::{Path, PathBuf};

use anyhow::{anyhow, Result};
use clap::{Args, ValueEnum};
use dermis_golden::fixed::Model;
use dermis_golden::spec::scene::Scene;
use dermis_golden::write::write;
use dermis_hdl::bus::{generate_core, Bus, CoreShape, WIDTHS};
use dermis_hdl::explain::explain;
use dermis_hdl::generate;
use dermis_hdl::link::generate_board;
use dermis_hdl::scan::generate_scan;

use super::inputs::{note_hardware, BoardOverride};
use crate::progress::Progress;
use crate::report;

/// Arguments of `dermis build`.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  dermis build sensor-1 --out rtl
  dermis build sensor-4 --explain
  dermis build sensor-1 --bus axi --stream-bits 64   a core for a SoC: registers on AXI4-Lite, streams of whole words
  dermis build sensor-1 --board                      engine, link and packets, ready for place and route
  dermis build eight-by-eight --target-board icebreaker     the serial engine, for small devices
  dermis build eight-by-eight --target-board ./my-board.toml      a board of your own")]
pub struct Arguments {
    /// Built-in name or path of a scene.
    scene: String,
    /// Folder for the files; default: `<build-dir>/<scene>/rtl`.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print which optional features the scene uses, which are left out, and what that saves.
    #[arg(long)]
    explain: bool,
    /// Generate the board top (engine, link and packets) instead of the engine alone.
    #[arg(long, conflicts_with = "bus")]
    board: bool,
    /// Generate the engine as a core for a SoC, with its registers on this bus and streams of whole words.
    #[arg(long, value_enum)]
    bus: Option<BusChoice>,
    /// Width of the core's output stream.
    #[arg(long, value_name = "BITS", default_value_t = 32, requires = "bus", value_parser = stream_bits)]
    stream_bits: usize,
    #[command(flatten)]
    target: BoardOverride,
}

#[derive(ValueEnum, Clone, Copy, Debug)]
enum BusChoice {
    /// AXI4-Lite.
    Axi,
    /// Wishbone B4, classic, with addresses of words.
    Wishbone,
}

/// A width of the output stream that there is.
fn stream_bits(text: &str) -> Result<usize, String> {
    let words = text.parse().ok().filter(|bits| WIDTHS.iter().any(|words| 32 * words == *bits));
    words.ok_or_else(|| format!("there are {}", WIDTHS.map(|words| (32 * words).to_string()).join(", ")))
}

/// What is generated.
#[derive(Clone, Copy, Debug)]
enum What {
    Engine,
    Board,
    Core(CoreShape),
}

/// Runs the command: the list of the files and the resource tables.
///
/// # Errors
/// A scene that cannot be loaded or has no hardware, files that cannot be written.
pub fn run(arguments: &Arguments, build_dir: &Path) -> Result<String> {
    let Arguments { scene, out, explain, board, bus, stream_bits, target } = arguments;
    let scene = target.apply(Scene::load(scene)?);
    let (what, folder) = match bus {
        None if *board => (What::Board, "board"),
        None => (What::Engine, "rtl"),
        Some(bus) => {
            let bus = match bus {
                BusChoice::Axi => Bus::AxiLite,
                BusChoice::Wishbone => Bus::Wishbone,
            };
            (What::Core(CoreShape { bus, words: stream_bits / 32 }), "core")
        }
    };
    let out = out.clone().unwrap_or_else(|| build_dir.join(&scene.name).join(folder));
    build(&scene, &out, what, *explain)
}

/// Writes the generated files, each completely or not at all; returns their list and the resource tables.
fn build(scene: &Scene, out: &Path, what: What, with_features: bool) -> Result<String> {
    // Large matrices take seconds; a design that does not fit takes longer, while other settings are tried.
    note_hardware(scene)?;
    let progress = Progress::start(&format!("{}: model and Verilog", scene.name));
    let model = Model::new(scene)?;
    let mut generated = match what {
        What::Engine if model.scan_timing().is_some() => generate_scan(&model)?,
        What::Engine => generate(&model)?,
        What::Board => generate_board(&model)?,
        What::Core(shape) => generate_core(&model, shape)?,
    };
    if let (What::Engine, None) = (what, model.scan_timing()) {
        generated.add_integration(&model);
    }
    let explained = explain(&model)?;
    generated.add_explained(&model, &explained);
    drop(progress);
    std::fs::create_dir_all(out).map_err(|e| anyhow!("{}: {e}", out.display()))?;
    let mut text = String::new();
    for file in &generated.files {
        let path = out.join(&file.name);
        write(&path, file.text.as_bytes())?;
        text.push_str(&format!("{} ({} bytes)\n", path.display(), file.text.len()));
    }
    text.push_str(&report::resources(&model, &generated.usage));
    text.push_str(&report::cases(&model, &generated.dropped));
    if let What::Board = what {
        text.push_str(&report::wire_times(&model));
    }
    if with_features {
        text.push_str(&report::features(&explained));
        text.push_str(&report::program(&model));
    }
    Ok(text)
}
