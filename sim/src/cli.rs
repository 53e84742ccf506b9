//! The `dermis` command line: arguments, commands, exit codes.
//!
//! | exit code | when |
//! |---|---|
//! | 0 | success; every comparison was equal |
//! | 1 | hardware and model differ, a tool failed on generated files, or an internal check failed |
//! | 2 | an argument or input is wrong, a file cannot be used, or a needed program is not installed |
//! | 130 | interrupted by SIGINT or SIGTERM |

use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{anyhow, Result};
use clap::{Parser, Subcommand, ValueEnum};
use dermis_golden::fixed::{FixedError, Model};
use dermis_golden::float::Golden;
use dermis_golden::frame::Frame;
use dermis_golden::matrices::cache;
use dermis_golden::partition::Case;
use dermis_golden::reception::full_scale;
use dermis_golden::reconstruct::Reconstruction;
use dermis_golden::scene::Scene;
use dermis_hdl::explain::explain;
use dermis_hdl::link::generate_board;
use dermis_hdl::{generate, manifest, HdlError};

use crate::bitstream::tools::ToolError;
use crate::compare::{comparable_forces, difference};
use crate::drawn_frames::DrawnFrames;
use crate::hardware::{DeviceTimeout, Hardware, Simulator};
use crate::host::HostError;
use crate::inputs::{resolve, resolve_one, BoardOverride};
use crate::progress::Progress;
use crate::report::{self, CosimReport, Format};
use crate::tabulate::tabulate;
use crate::verify::{verify, Verified};
use crate::verilator::VerilatorError;
use dermis_golden::write::write;

/// Reconstruct a 3-D force per taxel from the normal stress on a tactile array, in generated hardware within 1 ms.
#[derive(Parser, Debug)]
#[command(name = "dermis", version, arg_required_else_help = true, after_help = EXAMPLES)]
struct Arguments {
    /// Folder for build products and caches.
    #[arg(long, global = true, value_name = "DIR", default_value = "build")]
    build_dir: PathBuf,
    #[command(subcommand)]
    command: Command,
}

const EXAMPLES: &str = "Examples:
  dermis reconstruct sensor-1                        the scene's first shipped frame, golden model
  dermis reconstruct --frame press.json --json       scene from the sensor in the frame file
  dermis reconstruct sensor-1 --engine rtl           the same in the generated hardware, under Verilator
  dermis build eight-by-eight --out rtl              Verilog, memory files, manifest.json
  dermis bitstream eight-by-eight                    synthesis, place and route for its board
  dermis host --port /dev/ttyUSB0 press.json         send a frame to a board, print the resultants
  dermis block fold                                  ports of a stage: width, meaning, validity
  dermis cosim sensor-1                              all shipped frames, model against hardware
  dermis table                                       errors of all scenes, next to the paper's
  dermis noise sensor-1                              errors under noise, next to the Cramér–Rao bound
  dermis train sensor-1                              a network for search.estimator = \"learned\"
  dermis report                                      HTML page: recommended cases and formats, error against time
  dermis generate sensor-3 --random 2 --out two.json  a frame with known forces
  dermis import walk.asf                             scene and frames of a recording of a real array
  dermis stability --plot stability.svg              error against the condition number
  dermis stress                                      gaps, wrong tlast and resets on sensor-1
  dermis faults                                      1000 bit flips in ROM, RAM and registers of sensor-1";

#[derive(Subcommand, Debug)]
enum Command {
    /// Reconstruct the forces of one frame.
    #[command(after_help = "Examples:
  dermis reconstruct sensor-1
  dermis reconstruct sensor-1 --frame press.csv --engine fixed
  dermis reconstruct my-scene.toml --frame eq2 --json
  dermis reconstruct averaging.toml --frame 1.csv --frame 2.csv     the mean of 2 frames, input.average = 1")]
    Reconstruct {
        /// Built-in name or path of a scene; optional if the frame file contains its sensor.
        scene: Option<String>,
        /// Frame file (.json, .csv) or `eq2`; default: the scene's first shipped frame. Repeat it 2^k times if the
        /// scene has input.average = k.
        #[arg(long = "frame", value_name = "FILE")]
        frames: Vec<String>,
        /// Model or hardware that computes the forces.
        #[arg(long, value_enum, default_value = "golden")]
        engine: Engine,
        /// Print the result as JSON and nothing else.
        #[arg(long)]
        json: bool,
        #[command(flatten)]
        target: BoardOverride,
    },
    /// Generate the Verilog of a scene.
    #[command(after_help = "Examples:
  dermis build sensor-1 --out rtl
  dermis build sensor-4 --explain
  dermis build sensor-1 --board                      engine, link and packets, ready for place and route
  dermis build eight-by-eight --target-board icebreaker     the serial engine, for small devices")]
    Build {
        /// Built-in name or path of a scene.
        scene: String,
        /// Folder for the files; default: <build-dir>/<scene>/rtl.
        #[arg(long, value_name = "DIR")]
        out: Option<PathBuf>,
        /// Print which optional features the scene uses, which are left out, and what that saves.
        #[arg(long)]
        explain: bool,
        /// Generate the board top (engine, link and packets) instead of the engine alone.
        #[arg(long)]
        board: bool,
        #[command(flatten)]
        target: BoardOverride,
    },
    /// Make the bitstream of a scene for its board with open tools.
    Bitstream(crate::bitstream::Arguments),
    /// Check the files of a generated folder against manifest.json, and manifest.json against its checksum.
    #[command(after_help = "Example:
  dermis check build/sensor-1/rtl")]
    Check {
        /// Folder written by `dermis build`.
        folder: PathBuf,
    },
    /// Send frames to a board and receive forces.
    Host(crate::host::Arguments),
    /// Simulate a board on a pseudo-terminal, to run `dermis host` without hardware.
    #[command(after_help = "Example:
  dermis board eight-by-eight       prints the port for `dermis host --port`, and runs until interrupted")]
    Board {
        /// Built-in name or path of a scene.
        scene: String,
        #[command(flatten)]
        target: BoardOverride,
    },
    /// Print the ports of a block, its Verilog, or draw its timing.
    Block(crate::block::Arguments),
    /// Compare simulated hardware with the bit-true model, stage by stage and cycle by cycle.
    #[command(after_help = "Examples:
  dermis cosim sensor-1
  dermis cosim sensor-1 --frame a.json --frame b.csv --json
  dermis cosim eight-by-eight --device rust-hdl
  dermis cosim eight-by-eight --device netlist       the netlist after synthesis (minutes)
  dermis cosim eight-by-eight --target-board icebreaker     the serial engine, for small devices
  dermis cosim sensor-1 --device verilator --waves   with a VCD file, prints the GTKWave command")]
    Cosim {
        /// Built-in name or path of a scene; optional if the first frame file contains its sensor.
        scene: Option<String>,
        /// Frame file (.json, .csv) or `eq2`, repeatable; default: all shipped frames of the scene.
        #[arg(long = "frame", value_name = "FILE")]
        frames: Vec<String>,
        /// Print the report as JSON and nothing else.
        #[arg(long)]
        json: bool,
        /// Simulator of the hardware.
        #[arg(long, value_enum, default_value = "both")]
        device: DeviceChoice,
        /// Write pins and stages of the full-speed run to <build-dir>/<scene>/waves as VCD, with a GTKWave signal list.
        #[arg(long, conflicts_with = "json")]
        waves: bool,
        #[command(flatten)]
        target: BoardOverride,
    },
    /// Measure errors and times of all engines and write an HTML page with tables and pictures.
    Report(report::Arguments),
    /// Generate a frame with known forces from contact descriptions.
    Generate(crate::generate::Arguments),
    /// Make a scene and frames from a recording of a real pressure array.
    Import(crate::import::Arguments),
    /// Measure errors of double, single and fixed point against the condition number, or on extreme frames.
    Stability(crate::stability::Arguments),
    /// Test the simulated hardware's AXI streams with gaps, back-pressure, wrong tlast and resets.
    Stress(crate::stress::Arguments),
    /// Flip single bits of the simulated hardware and count harmless, detected, hanging and silent faults.
    Faults(crate::faults::Arguments),
    /// Print a comparison of the guide: input bits, dead taxels, several contacts, links.
    Study(crate::study::Arguments),
    /// Write the tables and pictures of README.md and the guide with the commands named there, or report stale ones.
    Guide(crate::guide_pages::Arguments),
    /// Print the errors of scenes in the paper's cases on their shipped frames, next to the paper's.
    #[command(after_help = "Examples:
  dermis table                                       every built-in scene, cases 0 to 3
  dermis table sensor-1 --case 0 --format csv
  dermis table sensor-3 --case adaptive --case contacts --case 4x2
  dermis table sensor-3 --case contacts --fresh 40 --contacts 2 --contacts 3 --shapes other
  dermis table sensor-1 eight-by-eight --cosim       co-simulate, one line per scene")]
    Table {
        /// Built-in names or paths of scenes; default: all built-in ones.
        #[arg(required_if_eq("cosim", "true"))]
        scenes: Vec<String>,
        /// Case, repeatable: 0 to 3, ROWSxCOLS, adaptive, contacts; default: 0 to 3.
        #[arg(long = "case", value_name = "CASE")]
        cases: Vec<Case>,
        #[command(flatten)]
        drawn: DrawnFrames,
        /// Output format.
        #[arg(long, value_enum, default_value = "markdown", conflicts_with = "cosim")]
        format: Format,
        /// Co-simulate the hardware and print one line per scene instead of the errors.
        #[arg(long, conflicts_with_all = ["cases", "frames"])]
        cosim: bool,
    },
    /// Train a network for search.estimator = "learned" on frames drawn from the scene's own physics.
    Train(crate::train::Arguments),
    /// Measure the errors under noise, next to the Cramér–Rao bound; any shape, several contacts, wrong scenes.
    Noise(crate::noise::Arguments),
}

#[derive(ValueEnum, Clone, Copy, Debug)]
enum Engine {
    /// The floating-point model.
    Golden,
    /// The bit-true integer model.
    Fixed,
    /// The generated Verilog, under Verilator.
    Rtl,
}

#[derive(ValueEnum, Clone, Copy, Debug)]
enum DeviceChoice {
    /// The generated Verilog, under Verilator.
    Verilator,
    /// The same design in rust-hdl's own simulator.
    RustHdl,
    /// Verilator, then rust-hdl.
    Both,
    /// The netlist synthesised for the board, under Verilator: compares beats and cycles, not stages; takes minutes.
    Netlist,
}

impl DeviceChoice {
    fn simulators(self) -> &'static [Simulator] {
        match self {
            DeviceChoice::Verilator => &[Simulator::Verilator],
            DeviceChoice::RustHdl => &[Simulator::RustHdl],
            DeviceChoice::Both => &[Simulator::Verilator, Simulator::RustHdl],
            DeviceChoice::Netlist => &[Simulator::Netlist],
        }
    }
}

/// Parses the process's arguments and runs the command.
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

/// Checks that the program takes these arguments, without running anything; the first one is the program's name.
///
/// # Errors
/// What the program would print: an unknown command or option, a value or argument that is missing or wrong.
pub fn check_arguments<'a>(words: impl IntoIterator<Item = &'a str>) -> Result<(), clap::Error> {
    Arguments::try_parse_from(words).map(drop)
}

/// The exit code of an error: 1 for internal errors and for tools that fail on generated files, 2 for wrong input,
/// unusable files and missing programs, 130 for an interruption.
fn exit_code(error: &anyhow::Error) -> u8 {
    if error.is::<report::Interrupted>() {
        return 130;
    }
    let tool = matches!(
        error.downcast_ref::<VerilatorError>(),
        Some(VerilatorError::Build { .. } | VerilatorError::Library { .. })
    );
    let hardware = error.is::<DeviceTimeout>() || matches!(error.downcast_ref::<HdlError>(), Some(HdlError::Check(_)));
    let model = matches!(error.downcast_ref::<FixedError>(), Some(FixedError::Internal(_) | FixedError::Beats { .. }));
    let board = matches!(error.downcast_ref::<HostError>(), Some(HostError::Answer { .. }));
    let flow = matches!(
        error.downcast_ref::<ToolError>(),
        Some(ToolError::Failed { .. } | ToolError::Late { .. } | ToolError::Output { .. })
    );
    if tool || hardware || model || board || flow {
        1
    } else {
        2
    }
}

/// Runs the command: the text for stdout, and whether every comparison was equal.
fn run(arguments: &Arguments) -> Result<(String, bool)> {
    let build_dir = &arguments.build_dir;
    cache::set_folder(Some(&build_dir.join("matrices")));
    match &arguments.command {
        Command::Reconstruct { scene, frames, engine, json, target } => {
            let (scene, frames) = resolve_one(scene.as_deref(), frames)?;
            let scene = target.apply(scene);
            // Large matrices take seconds.
            let _progress = Progress::start(&format!("{}: reconstruction", scene.name));
            let (result, full_scale_MPa) = reconstruct(&scene, &frames, *engine, build_dir)?;
            if *json {
                return Ok((serde_json::to_string(&result)? + "\n", true));
            }
            let mut text = report::reconstruction(&result, &scene.sensor, full_scale_MPa);
            if !matches!(engine, Engine::Golden) {
                text.push_str(&against_golden(&scene, &frames, &result)?);
            }
            Ok((text, true))
        }
        Command::Build { scene, out, explain, board, target } => {
            let scene = target.apply(Scene::load(scene)?);
            let folder = if *board { "board" } else { "rtl" };
            let out = out.clone().unwrap_or_else(|| build_dir.join(&scene.name).join(folder));
            Ok((build(&scene, &out, *board, *explain)?, true))
        }
        Command::Cosim { scene, frames, json, device, waves, target } => {
            let (scene, frames) = resolve(scene.as_deref(), frames)?;
            let scene = target.apply(scene);
            let verified = verify(&scene, &frames, device.simulators(), build_dir)?;
            let mut text = if *json {
                serde_json::to_string(&CosimReport::new(&verified))? + "\n"
            } else {
                report::cosim(&verified)
            };
            if *waves {
                let folder = build_dir.join(&scene.name).join("waves");
                let command = crate::waves::waves(&scene, &frames, device.simulators()[0], build_dir, &folder)?;
                text.push_str(&format!("waveforms: {command}\n"));
            }
            Ok((text, verified.findings.is_equal()))
        }
        Command::Bitstream(arguments) => crate::bitstream::run(arguments, build_dir),
        Command::Check { folder } => {
            let files = manifest::check(folder)?;
            Ok((format!("{}: {files} files match manifest.json\n", folder.display()), true))
        }
        Command::Block(arguments) => Ok((crate::block::run(arguments, build_dir)?, true)),
        Command::Host(arguments) => crate::host::run(arguments),
        Command::Board { scene, target } => {
            let scene = target.apply(Scene::load(scene)?);
            let terminal = Hardware::new(Model::new(&scene)?, build_dir)?.terminal()?;
            print(&format!("{}\n", terminal.path().display()))?;
            terminal.wait()?;
            Ok((String::new(), true))
        }
        Command::Report(arguments) => report::run(arguments, build_dir),
        Command::Generate(arguments) => Ok((crate::generate::run(arguments)?, true)),
        Command::Import(arguments) => Ok((crate::import::run(arguments, build_dir)?, true)),
        Command::Stability(arguments) => Ok((crate::stability::run(arguments)?, true)),
        Command::Faults(arguments) => crate::faults::run(arguments, build_dir),
        Command::Stress(arguments) => crate::stress::run(arguments, build_dir),
        Command::Study(arguments) => Ok((crate::study::run(arguments)?, true)),
        Command::Guide(arguments) => crate::guide_pages::run(arguments, build_dir),
        Command::Table { scenes, cases, drawn, format, cosim: false } => {
            Ok((table(scenes, cases, drawn, *format)?, true))
        }
        Command::Train(arguments) => crate::train::run(arguments),
        Command::Noise(arguments) => Ok((crate::noise::run(arguments)?, true)),
        Command::Table { scenes, cosim: true, .. } => {
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

/// The error table of the named scenes, or of all built-in ones.
fn table(scenes: &[String], cases: &[Case], drawn: &DrawnFrames, format: Format) -> Result<String> {
    let builtin = || Scene::builtin_names().into_iter().map(str::to_owned).collect();
    let scenes: Vec<String> = if scenes.is_empty() { builtin() } else { scenes.to_vec() };
    let numbered: Vec<Case> = (0..4).filter_map(Case::numbered).collect();
    let cases = if cases.is_empty() { &numbered } else { cases };
    let mut rows = Vec::new();
    for name in &scenes {
        let (scene, frames) = if drawn.frames > 0 {
            let scene = Scene::load(name)?;
            let frames = drawn.draw(&scene)?;
            (scene, frames)
        } else {
            resolve(Some(name), &[])?
        };
        let bar = Progress::steps(&format!("{}: errors", scene.name), (cases.len() * frames.len()) as u64);
        let mut done = 0;
        let mut step = || {
            done += 1;
            bar.set(done);
        };
        rows.extend(tabulate(&scene, cases, &frames, &mut step)?);
    }
    report::errors(&rows, format)
}

/// One line where the hardware takes another estimator than the scene.
fn note_estimator(scene: &Scene) {
    let (golden, hardware) = (scene.estimator(), scene.for_hardware().estimator());
    if golden != hardware {
        let (golden, hardware) = (golden.name(), hardware.name());
        eprintln!("{}: the hardware has no estimator {golden} and takes {hardware} with sparse", scene.name);
    }
}

/// The result of one engine, and the stress in MPa of the largest code.
fn reconstruct(scene: &Scene, frames: &[Frame], engine: Engine, build_dir: &Path) -> Result<(Reconstruction, f64)> {
    if matches!(engine, Engine::Golden) {
        let golden = Golden::new(scene)?;
        return with_found_noise(scene, golden.run_averaged(frames)?, &golden.stress(frames)?);
    }
    note_estimator(scene);
    let model = Model::for_frames(scene, frames)?;
    let (scene, stress) = (model.scene.clone(), model.stress(frames)?);
    let result = match engine {
        Engine::Rtl => Hardware::new(model, build_dir)?.reconstruct(frames)?,
        _ => model.reconstruct_averaged(frames)?,
    };
    with_found_noise(&scene, result, &stress)
}

/// The result with the noise found from its calibrated frame, and the stress in MPa of the largest code.
fn with_found_noise(scene: &Scene, mut result: Reconstruction, stress: &Frame) -> Result<(Reconstruction, f64)> {
    result.find_noise(scene, stress)?;
    Ok((result, full_scale(scene, stress)))
}

/// One line: the difference between a result and the floating-point model's.
fn against_golden(scene: &Scene, frames: &[Frame], result: &Reconstruction) -> Result<String> {
    // Compared with the same estimator.
    let golden = Golden::new(&scene.for_hardware())?.run_averaged(frames)?;
    let model = Model::for_frames(scene, frames)?;
    let lsb_N = model.force_lsb_N(full_scale(&model.scene, &model.stress(frames)?));
    Ok(report::difference(&difference(&comparable_forces(&golden), &comparable_forces(result), lsb_N)))
}

/// Writes the generated files, each completely or not at all; returns their list and the resource tables.
fn build(scene: &Scene, out: &Path, board: bool, with_features: bool) -> Result<String> {
    // Large matrices take seconds; a design that does not fit takes longer, while other settings are tried.
    note_estimator(scene);
    let progress = Progress::start(&format!("{}: model and Verilog", scene.name));
    let model = Model::new(scene)?;
    let mut generated = if board { generate_board(&model)? } else { generate(&model)? };
    let explained = explain(&model)?;
    generated.add_explained(&explained);
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
    if board {
        text.push_str(&report::wire_times(&model));
    }
    if with_features {
        text.push_str(&report::features(&explained));
    }
    Ok(text)
}

/// Writes to stdout; a closed pipe is not an error.
fn print(text: &str) -> Result<()> {
    match std::io::stdout().lock().write_all(text.as_bytes()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => Err(anyhow!("standard output: {error}")),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use dermis_golden::board::Board;
    use dermis_golden::write::FileError;

    #[test]
    fn internal_errors_exit_with_1_and_input_errors_with_2() {
        let io = |kind| VerilatorError::File(FileError { path: "build".into(), source: ErrorKind::into(kind) });
        let stuck = DeviceTimeout { frame: "press".into(), cycle: 7, rule: "no transfer".into() };
        let answer = HostError::Answer { port: "p".into(), what: "forces", bytes: 7 };
        let internal: [anyhow::Error; 7] = [
            VerilatorError::Build { design: "d".into(), folder: "f".into(), log: "l".into() }.into(),
            VerilatorError::Library { path: "l".into(), reason: "r".into() }.into(),
            HdlError::Check("loop".into()).into(),
            FixedError::Internal("limbs").into(),
            FixedError::Beats { what: "forces", got: 1, expected: 2 }.into(),
            stuck.into(),
            answer.into(),
        ];
        let version = HostError::Version { port: "p".into(), has: 2, wants: 1 };
        let input: [anyhow::Error; 7] = [
            VerilatorError::Missing.into(),
            VerilatorError::MissingTool { program: "make" }.into(),
            io(ErrorKind::PermissionDenied).into(),
            FixedError::Board(Board::load("none").unwrap_err()).into(),
            FixedError::NoFullScale { field: "threshold.min_force_N", value: "1".into() }.into(),
            version.into(),
            anyhow!("rtl: File exists"),
        ];
        for (errors, code) in [(internal, 1), (input, 2)] {
            for error in errors {
                assert_eq!(exit_code(&error), code, "{error}");
            }
        }
    }
}
