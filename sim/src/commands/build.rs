//! `dermis build`: generates the Verilog of a scene, or its C for a microcontroller.

use std::path::{Path, PathBuf};

use anyhow::{anyhow, bail, Result};
use clap::{Args, ValueEnum};
use dermis_golden::data::frame::Frame;
use dermis_golden::fixed::Model;
use dermis_golden::spec::scene::Scene;
use dermis_golden::write::write;
use dermis_hdl::bus::{generate_core, Bus, CoreShape, WIDTHS};
use dermis_hdl::explain::explain;
use dermis_hdl::generate;
use dermis_hdl::link::generate_board;
use dermis_hdl::scan::generate_scan;
use dermis_hdl::GeneratedFile;

use super::inputs::{note_hardware, BoardOverride};
use dermis_flow::microcontroller::{self, target::measure_all};
use dermis_flow::progress::Progress;
use dermis_report as report;

/// Arguments of `dermis build`.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  dermis build sensor-1 --out rtl
  dermis build sensor-4 --explain
  dermis build sensor-1 --bus axi --stream-bits 64   a core for a SoC: registers on AXI4-Lite, streams of whole words
  dermis build sensor-1 --board                      engine, link and packets, ready for place and route
  dermis build eight-by-eight --target-board icebreaker     the serial engine, for small devices
  dermis build eight-by-eight --target-board ./my-board.toml      a board of your own
  dermis build sensor-1-noisy --target c             the same words in C99, for a microcontroller")]
pub struct Arguments {
    /// Built-in name or path of a scene.
    scene: String,
    /// Folder for the files; default: `<build-dir>/<scene>/rtl`, of C `<build-dir>/<scene>/c`.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Generate hardware, or its arithmetic in C99 for a microcontroller; C is compiled for a Cortex-M and run in QEMU where
    /// arm-none-eabi-gcc and qemu-system-arm are installed, and its words are compared with the bit-true model's.
    #[arg(long, value_enum, default_value_t = Target::Verilog)]
    target: Target,
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
    target_board: BoardOverride,
}

#[derive(ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
enum Target {
    /// Hardware, in Verilog.
    Verilog,
    /// A microcontroller, in C99.
    C,
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
    let Arguments { scene, out, target, explain, board, bus, stream_bits, target_board } = arguments;
    let scene = target_board.apply(Scene::load(scene)?);
    if *target == Target::C {
        let of_hardware = [("--board", *board), ("--bus", bus.is_some()), ("--explain", *explain)];
        if let Some((option, _)) = of_hardware.iter().find(|(_, given)| *given) {
            bail!("{option} is of hardware, not of --target c");
        }
        return build_c(&scene, &out.clone().unwrap_or_else(|| build_dir.join(&scene.name).join("c")));
    }
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
    let mut text = write_files(out, &generated.files)?;
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

/// Writes files, each completely or not at all; returns their list.
fn write_files(out: &Path, files: &[GeneratedFile]) -> Result<String> {
    std::fs::create_dir_all(out).map_err(|e| anyhow!("{}: {e}", out.display()))?;
    let mut text = String::new();
    for file in files {
        let path = out.join(&file.name);
        write(&path, file.text.as_bytes())?;
        text.push_str(&format!("{} ({} bytes)\n", path.display(), file.text.len()));
    }
    Ok(text)
}

/// Frames of the example and of the measurement.
const FRAMES: usize = 2;

/// Writes the C of a scene; returns the list of its files and what it needs on microcontrollers.
fn build_c(scene: &Scene, out: &Path) -> Result<String> {
    note_hardware(scene)?;
    let progress = Progress::start(&format!("{}: model and C", scene.name));
    let model = Model::new(scene)?;
    let mut frames = Frame::shipped(scene);
    frames.truncate(FRAMES);
    if frames.is_empty() {
        frames.push(Frame::eq2(&scene.sensor));
    }
    let source = microcontroller::generate(&model, &frames)?;
    let text = write_files(out, &source.files)?;
    let measured = measure_all(&model, &source)?;
    drop(progress);
    Ok(text + &report::microcontrollers(&source, &measured))
}
