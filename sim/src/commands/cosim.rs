//! `dermis cosim`: compares simulated hardware with the bit-true model.

use std::path::Path;

use anyhow::{bail, Result};
use clap::{Args, ValueEnum};

use super::inputs::{resolve_specimen, BoardOverride};
use super::layout::LayoutArguments;
use dermis_cosim::scan::{verify_scan, Fault};
use dermis_cosim::simulator::Simulator;
use dermis_cosim::verify::verify_specimen;
use dermis_cosim::waves::waves;
use dermis_report::{self as report, CosimReport, ScanReport};

/// Arguments of `dermis cosim`.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  dermis cosim sensor-1
  dermis cosim sensor-1 --frame a.json --frame b.csv --json
  dermis cosim eight-by-eight --device kernel
  dermis cosim eight-by-eight --device netlist       the netlist after synthesis (minutes)
  dermis cosim hand.toml --tables left-hand.toml     hardware of hand.toml that takes the tables of a specimen
  dermis cosim mat.toml                              a scene with an adc-scan: its converters too
  dermis cosim mat.toml --wire stuck-high:0          with a fault of the wires
  dermis cosim eight-by-eight --target-board icebreaker     the serial engine, for small devices
  dermis cosim sensor-1 --device verilator --waves   with a VCD file, prints the GTKWave command")]
pub struct Arguments {
    /// Built-in name or path of a scene; optional if the first frame file contains its sensor.
    scene: Option<String>,
    /// Frame file (.json, .csv; .mcap: all frames, .mcap:N: frame N from 1) or `eq2`, repeatable; default: all shipped frames of the scene.
    #[arg(long = "frame", value_name = "FILE")]
    frames: Vec<String>,
    #[command(flatten)]
    layout: LayoutArguments,
    /// Print the report as JSON and nothing else.
    #[arg(long)]
    json: bool,
    /// Scene of a specimen: its tables are loaded first, with version 1 (`dermis load`); frames are the specimen's.
    #[arg(long, value_name = "SCENE", conflicts_with = "waves")]
    tables: Option<String>,
    /// Simulator of the hardware.
    #[arg(long, value_enum, default_value = "both")]
    device: DeviceChoice,
    /// Write pins and stages of the full-speed run to `<build-dir>/<scene>/waves` as VCD, with a GTKWave signal list.
    #[arg(long, conflicts_with = "json")]
    waves: bool,
    /// Fault of a scan's wires: stuck-low:CONVERTER, stuck-high:CONVERTER, next-channel:CONVERTER, row:ROW, or
    /// flip:CONVERTER:FRAME:BIT with the number of a frame on the bus.
    #[arg(long, value_name = "FAULT", value_parser = wire_fault, conflicts_with_all = ["tables", "waves"])]
    wire: Option<Fault>,
    #[command(flatten)]
    target: BoardOverride,
}

/// A fault of a scan's wires.
fn wire_fault(text: &str) -> Result<Fault, String> {
    let (kind, rest) = text.split_once(':').unwrap_or((text, ""));
    let numbers: Option<Vec<usize>> = rest.split(':').map(|number| number.parse().ok()).collect();
    match (kind, numbers.as_deref()) {
        ("stuck-low", Some(&[converter])) => Ok(Fault::Stuck { converter, level: false }),
        ("stuck-high", Some(&[converter])) => Ok(Fault::Stuck { converter, level: true }),
        ("next-channel", Some(&[converter])) => Ok(Fault::NextChannel { converter }),
        ("row", Some(&[row])) => Ok(Fault::Row { row }),
        ("flip", Some(&[converter, frame, bit])) => Ok(Fault::Flip { converter, frame, bit }),
        _ => Err("there are stuck-low:N, stuck-high:N, next-channel:N, row:N, flip:N:FRAME:BIT".to_owned()),
    }
}

#[derive(ValueEnum, Clone, Copy, Debug)]
enum DeviceChoice {
    /// The generated Verilog, under Verilator.
    Verilator,
    /// The same design in kernel simulation.
    Kernel,
    /// Verilator, then the kernel simulation.
    Both,
    /// The netlist synthesised for the board, under Verilator: compares beats and cycles, not stages; takes minutes.
    Netlist,
}

impl DeviceChoice {
    fn simulators(self) -> &'static [Simulator] {
        match self {
            DeviceChoice::Verilator => &[Simulator::Verilator],
            DeviceChoice::Kernel => &[Simulator::Kernel],
            DeviceChoice::Both => &[Simulator::Verilator, Simulator::Kernel],
            DeviceChoice::Netlist => &[Simulator::Netlist],
        }
    }
}

/// Runs the command: the report, and whether every comparison was equal.
///
/// # Errors
/// Wrong input, a scene without hardware, no Verilator.
pub fn run(arguments: &Arguments, build_dir: &Path) -> Result<(String, bool)> {
    let Arguments { scene, frames, layout, json, tables, device, waves: with_waves, wire, target } = arguments;
    let (scene, specimen, frames) = resolve_specimen(scene.as_deref(), tables.as_deref(), frames, layout)?;
    let scene = target.apply(scene);
    if scene.hardware.adc_scan.is_some() && !with_waves {
        let verified = verify_scan(&scene, specimen.as_ref(), &frames, device.simulators(), *wire, build_dir)?;
        let text = match json {
            true => serde_json::to_string(&ScanReport::new(&verified))? + "\n",
            false => report::scan(&verified),
        };
        return Ok((text, verified.findings.is_equal()));
    }
    if wire.is_some() {
        bail!("--wire: {}: hardware.source = stream; expected adc-scan, which has wires to converters", scene.name);
    }
    let verified = verify_specimen(&scene, specimen.as_ref(), &frames, device.simulators(), build_dir)?;
    let mut text =
        if *json { serde_json::to_string(&CosimReport::new(&verified))? + "\n" } else { report::cosim(&verified) };
    if *with_waves {
        let folder = build_dir.join(&scene.name).join("waves");
        let command = waves(&scene, &frames, device.simulators()[0], build_dir, &folder)?;
        text.push_str(&format!("waveforms: {command}\n"));
    }
    Ok((text, verified.findings.is_equal()))
}
