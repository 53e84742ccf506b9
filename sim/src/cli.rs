//! The `dermis` command: arguments, commands, exit codes.
//!
//! | exit code | when |
//! |---|---|
//! | 0 | done, and equal where something was compared |
//! | 1 | hardware and model differ, or a tool failed on generated files |
//! | 2 | the input or the call is wrong, or a needed program is not installed |

use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{anyhow, Result};
use clap::{Parser, Subcommand, ValueEnum};
use dermis_golden::fixed::Model;
use dermis_golden::frame::Frame;
use dermis_golden::quantise::full_scale;
use dermis_golden::reconstruct::{Golden, Reconstruction};
use dermis_golden::scene::Scene;
use dermis_hdl::generate;

use crate::compare::difference;
use crate::hardware::{Hardware, Simulator};
use crate::inputs::resolve;
use crate::report::{self, CosimReport};
use crate::verify::{verify, Verified};
use crate::verilator::VerilatorError;

/// Normal stress under a tactile array in, a force vector per taxel out, in hardware within 1 ms.
#[derive(Parser, Debug)]
#[command(name = "dermis", version, arg_required_else_help = true, after_help = EXAMPLES)]
struct Arguments {
    /// Folder for everything built on the way.
    #[arg(long, global = true, value_name = "DIR", default_value = "build")]
    build_dir: PathBuf,
    #[command(subcommand)]
    command: Command,
}

const EXAMPLES: &str = "Examples:
  dermis reconstruct sensor-1                        the scene's first shipped frame, golden model
  dermis reconstruct --frame press.json --json       scene from the sensor in the frame file
  dermis reconstruct sensor-1 --engine rtl           the same in the Verilated hardware
  dermis build eight-by-eight --out rtl              Verilog, memory files, manifest.json
  dermis cosim sensor-1                              all shipped frames, model against hardware
  dermis table sensor-1 eight-by-eight               one line per scene
  dermis generate sensor-3 --random 2 --out two.json a frame with known forces";

#[derive(Subcommand, Debug)]
enum Command {
    /// Reconstruct the forces of one frame.
    #[command(after_help = "Examples:
  dermis reconstruct sensor-1
  dermis reconstruct sensor-1 --frame press.csv --engine fixed
  dermis reconstruct my-scene.toml --frame eq2 --json")]
    Reconstruct {
        /// Built-in name or path of a scene; may be left out when the frame holds its sensor.
        scene: Option<String>,
        /// Frame file (.json, .csv) or `eq2`; without it the scene's first shipped frame.
        #[arg(long, value_name = "FILE")]
        frame: Option<String>,
        /// What computes.
        #[arg(long, value_enum, default_value = "golden")]
        engine: Engine,
        /// Print the result as JSON and nothing else.
        #[arg(long)]
        json: bool,
    },
    /// Generate the hardware of a scene.
    #[command(after_help = "Example:
  dermis build sensor-1 --out rtl")]
    Build {
        /// Built-in name or path of a scene.
        scene: String,
        /// Folder for the files; without it <build-dir>/<scene>/rtl.
        #[arg(long, value_name = "DIR")]
        out: Option<PathBuf>,
    },
    /// Compare simulated hardware with the bit-true model, stage by stage and cycle by cycle.
    #[command(after_help = "Examples:
  dermis cosim sensor-1
  dermis cosim sensor-1 --frame a.json --frame b.csv --json
  dermis cosim eight-by-eight --device rust-hdl")]
    Cosim {
        /// Built-in name or path of a scene; may be left out when the first frame holds its sensor.
        scene: Option<String>,
        /// Frame file (.json, .csv) or `eq2`, repeatable; without it all shipped frames of the scene.
        #[arg(long = "frame", value_name = "FILE")]
        frames: Vec<String>,
        /// Print the report as JSON and nothing else.
        #[arg(long)]
        json: bool,
        /// What simulates the hardware.
        #[arg(long, value_enum, default_value = "both")]
        device: DeviceChoice,
    },
    /// Make a frame with known forces from described contacts.
    Generate(crate::generate::Arguments),
    /// Co-simulate scenes on their shipped frames and print one line for each.
    Table {
        /// Built-in names or paths of scenes.
        #[arg(required = true)]
        scenes: Vec<String>,
    },
}

#[derive(ValueEnum, Clone, Copy, Debug)]
enum Engine {
    /// Floating point.
    Golden,
    /// The bit-true integer model.
    Fixed,
    /// The generated Verilog under Verilator.
    Rtl,
}

#[derive(ValueEnum, Clone, Copy, Debug)]
enum DeviceChoice {
    /// The generated Verilog.
    Verilator,
    /// rust-hdl's own simulation.
    RustHdl,
    /// One after the other.
    Both,
}

impl DeviceChoice {
    fn simulators(self) -> &'static [Simulator] {
        match self {
            DeviceChoice::Verilator => &[Simulator::Verilator],
            DeviceChoice::RustHdl => &[Simulator::RustHdl],
            DeviceChoice::Both => &[Simulator::Verilator, Simulator::RustHdl],
        }
    }
}

/// Runs the command of this process's arguments.
pub fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let outcome = run(&arguments).and_then(|(text, good)| print(&text).map(|()| good));
    match outcome {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::from(1),
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(exit_code(&error))
        }
    }
}

/// 1 for a tool that failed on generated files, 2 for what the caller can mend.
fn exit_code(error: &anyhow::Error) -> u8 {
    match error.downcast_ref::<VerilatorError>() {
        None | Some(VerilatorError::Missing) => 2,
        Some(_) => 1,
    }
}

/// The text for stdout, and whether all that was compared is equal.
fn run(arguments: &Arguments) -> Result<(String, bool)> {
    let build_dir = &arguments.build_dir;
    match &arguments.command {
        Command::Reconstruct { scene, frame, engine, json } => {
            let (scene, frames) = resolve(scene.as_deref(), frame.as_slice())?;
            let frame = &frames[0];
            let result = reconstruct(&scene, frame, *engine, build_dir)?;
            if *json {
                return Ok((serde_json::to_string(&result)? + "\n", true));
            }
            let mut text = report::reconstruction(&result, &scene.sensor, full_scale(&scene, frame));
            if !matches!(engine, Engine::Golden) {
                text.push_str(&against_golden(&scene, frame, &result)?);
            }
            Ok((text, true))
        }
        Command::Build { scene, out } => {
            let scene = Scene::load(scene)?;
            let out = out.clone().unwrap_or_else(|| build_dir.join(&scene.name).join("rtl"));
            Ok((build(&scene, &out)?, true))
        }
        Command::Cosim { scene, frames, json, device } => {
            let (scene, frames) = resolve(scene.as_deref(), frames)?;
            let verified = verify(&scene, &frames, device.simulators(), build_dir)?;
            let text = if *json {
                serde_json::to_string(&CosimReport::new(&verified))? + "\n"
            } else {
                report::cosim(&verified)
            };
            Ok((text, verified.findings.is_equal()))
        }
        Command::Generate(arguments) => Ok((crate::generate::run(arguments)?, true)),
        Command::Table { scenes } => {
            let verify = |name: &String| -> Result<Verified> {
                let (scene, frames) = resolve(Some(name), &[])?;
                verify(&scene, &frames, DeviceChoice::Both.simulators(), build_dir)
            };
            let all = scenes.iter().map(verify).collect::<Result<Vec<_>>>()?;
            let equal = all.iter().all(|v| v.findings.is_equal());
            Ok((report::scenes(&all), equal))
        }
    }
}

fn reconstruct(scene: &Scene, frame: &Frame, engine: Engine, build_dir: &Path) -> Result<Reconstruction> {
    let model = || Model::for_frames(scene, std::slice::from_ref(frame));
    Ok(match engine {
        Engine::Golden => Golden::new(scene)?.run(frame)?,
        Engine::Fixed => model()?.reconstruct(frame)?,
        Engine::Rtl => Hardware::new(model()?, build_dir)?.reconstruct(frame)?,
    })
}

/// One line: how far a result is from the floating-point model's.
fn against_golden(scene: &Scene, frame: &Frame, result: &Reconstruction) -> Result<String> {
    let golden = Golden::new(scene)?.run(frame)?;
    let model = Model::for_frames(scene, std::slice::from_ref(frame))?;
    let lsb_N = model.force_lsb_N(full_scale(scene, frame));
    Ok(report::difference(&difference(&golden.forces_N, &result.forces_N, lsb_N)))
}

/// Writes the generated files, each complete or not at all, and lists them.
fn build(scene: &Scene, out: &Path) -> Result<String> {
    let generated = generate(&Model::new(scene)?)?;
    std::fs::create_dir_all(out).map_err(|e| anyhow!("{}: {e}", out.display()))?;
    let mut text = String::new();
    for file in &generated.files {
        let path = out.join(&file.name);
        let part = out.join(format!(".{}.part", file.name));
        std::fs::write(&part, &file.text)
            .and_then(|()| std::fs::rename(&part, &path))
            .map_err(|e| anyhow!("{}: {e}", path.display()))?;
        text.push_str(&format!("{} ({} bytes)\n", path.display(), file.text.len()));
    }
    Ok(text)
}

/// Writes to stdout; a reader that has gone away is no error.
fn print(text: &str) -> Result<()> {
    match std::io::stdout().lock().write_all(text.as_bytes()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => Err(anyhow!("standard output: {error}")),
        _ => Ok(()),
    }
}
