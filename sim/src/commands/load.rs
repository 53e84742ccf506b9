//! `dermis load`: an image of tables of a specimen, for hardware with writable tables.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::{Context, Result};
use clap::Args;
use dermis_golden::fixed::Model;
use dermis_golden::spec::scene::Scene;
use dermis_golden::write::write;

use super::inputs::BoardOverride;
use dermis_host::link::{open_board, Session};
use dermis_report::{self as report, LoadReport};

/// Arguments of `dermis load`.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  dermis load hand.toml left-hand.toml                tables of the specimen that left-hand.toml describes
  dermis load hand.toml left-hand.toml --tables-version 7 --out left-hand.tables --json
  dermis load hand.toml left-hand.toml --port /dev/ttyUSB0

The hardware is built from hand.toml with hardware.tables = \"writable\". A specimen's scene differs from it in input.calibration,
input.tare, search.noise_floor_MPa and threshold.min_force_N, and in sensor.thickness_mm and input.dead within
hardware.table_range; anything else is refused by its field. A driver writes the bytes
one after the other to register `tables` of a core (`dermis registers`); `dermis cosim hand.toml --tables left-hand.toml` does
so in simulation and compares the forces. With --port they are sent to a board (`dermis host --tables` does so too).")]
pub struct Arguments {
    /// Built-in name or path of the scene of the hardware.
    hardware: String,
    /// Path of the scene of the specimen.
    specimen: String,
    /// Version that frames report, 1 to 32767.
    #[arg(long, value_name = "N", default_value_t = 1)]
    tables_version: u16,
    /// File to write [default: <build-dir>/<specimen>/tables.bin].
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Serial port of a board, which is to hold the tables, or udp:HOST or udp:HOST:PORT of a core behind Ethernet.
    #[arg(long, value_name = "PATH|udp:HOST")]
    port: Option<String>,
    /// Bit rate of the port; default: that of the hardware's board.
    #[arg(long, value_name = "BIT/S", requires = "port")]
    baud: Option<u32>,
    #[command(flatten)]
    target: BoardOverride,
    /// Print the result as JSON and nothing else.
    #[arg(long)]
    json: bool,
}

/// Time without an answer of a board, after which an image is sent again.
const TIMEOUT: Duration = Duration::from_secs(1);

/// Runs the command: writes the image to a file, and to a board.
///
/// # Errors
/// A scene that cannot be used, tables that the hardware does not take, a file that cannot be written, a board of another scene
/// or without answer.
pub fn run(arguments: &Arguments, build_dir: &Path) -> Result<String> {
    let Arguments { hardware, specimen, tables_version, out, port, baud, target, json } = arguments;
    let hardware = Model::new(&target.apply(Scene::load(hardware)?))?;
    let specimen = Scene::load(specimen)?;
    let model = hardware.with_tables(&specimen, *tables_version)?;
    let path = out.clone().unwrap_or_else(|| build_dir.join(&specimen.name).join("tables.bin"));
    let image = model.image();
    if let Some(folder) = path.parent() {
        fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    }
    write(&path, &image)?;
    let report = LoadReport::new(&model, &image, &path, port.as_deref());
    if let Some(port) = port {
        let board = open_board(port, &hardware, *baud, TIMEOUT, "load --port")?;
        Session::new(board, hardware, Some(model), None, false, false)?;
    }
    Ok(if *json { serde_json::to_string(&report)? + "\n" } else { report::load(&report) })
}
