//! The `dermis` command: arguments, commands, exit codes.
//!
//! | exit code | when |
//! |---|---|
//! | 0 | done, and equal where something was compared |
//! | 1 | hardware and model differ, a tool failed on generated files, or this program contradicts itself |
//! | 2 | the input or the call is wrong, a file cannot be used, or a needed program is not installed |
//! | 130 | interrupted |

use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{anyhow, Result};
use clap::{Parser, Subcommand, ValueEnum};
use dermis_golden::fixed::{FixedError, Model};
use dermis_golden::frame::Frame;
use dermis_golden::matrices::store;
use dermis_golden::noise::{study, Study};
use dermis_golden::partition::Case;
use dermis_golden::quantise::full_scale;
use dermis_golden::reconstruct::{Golden, Reconstruction};
use dermis_golden::scene::{ObjectiveKind, Scene};
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
  dermis bitstream eight-by-eight                    the same placed and routed for its board
  dermis host --port /dev/ttyUSB0 press.json         a frame to a board, its resultants back
  dermis cosim sensor-1                              all shipped frames, model against hardware
  dermis table                                       errors of all scenes, beside the paper's
  dermis noise sensor-1                              errors under noise, beside the Cramér–Rao bound
  dermis report                                      a page: which case and format to take, errors against time
  dermis generate sensor-3 --random 2 --out two.json  a frame with known forces
  dermis stability --plot stability.svg              errors against a scene's condition
  dermis stress                                      gaps, wrong tlast and resets, sensor-1
  dermis faults                                      1000 flipped bits in ROM, RAM and registers, sensor-1";

#[derive(Subcommand, Debug)]
enum Command {
    /// Reconstruct the forces of one frame.
    #[command(after_help = "Examples:
  dermis reconstruct sensor-1
  dermis reconstruct sensor-1 --frame press.csv --engine fixed
  dermis reconstruct my-scene.toml --frame eq2 --json
  dermis reconstruct averaging.toml --frame 1.csv --frame 2.csv     the mean of 2 frames, input.average = 1")]
    Reconstruct {
        /// Built-in name or path of a scene; may be left out when the frame holds its sensor.
        scene: Option<String>,
        /// Frame file (.json, .csv) or `eq2`; without it the scene's first shipped frame. Repeat it 2^k times where the
        /// scene has input.average = k.
        #[arg(long = "frame", value_name = "FILE")]
        frames: Vec<String>,
        /// What computes.
        #[arg(long, value_enum, default_value = "golden")]
        engine: Engine,
        /// Print the result as JSON and nothing else.
        #[arg(long)]
        json: bool,
        #[command(flatten)]
        target: BoardOverride,
    },
    /// Generate the hardware of a scene.
    #[command(after_help = "Examples:
  dermis build sensor-1 --out rtl
  dermis build sensor-4 --explain
  dermis build sensor-1 --board                      with its link and packets, ready for place and route
  dermis build eight-by-eight --target-board icebreaker     the serial engine of a small device")]
    Build {
        /// Built-in name or path of a scene.
        scene: String,
        /// Folder for the files; without it <build-dir>/<scene>/rtl.
        #[arg(long, value_name = "DIR")]
        out: Option<PathBuf>,
        /// Print what the scene needs, what is left out, and what that saves.
        #[arg(long)]
        explain: bool,
        /// The whole board, the engine behind its link, in place of the engine alone.
        #[arg(long)]
        board: bool,
        #[command(flatten)]
        target: BoardOverride,
    },
    /// Make the bitstream of a scene for its board, with open tools.
    Bitstream(crate::bitstream::Arguments),
    /// Check that a generated folder is whole: every file against manifest.json, and that against its checksum.
    #[command(after_help = "Example:
  dermis check build/sensor-1/rtl")]
    Check {
        /// Folder that `dermis build` wrote.
        folder: PathBuf,
    },
    /// Send frames to a board and receive forces.
    Host(crate::host::Arguments),
    /// Simulate a board on a pseudo-terminal, for a host that has none.
    #[command(after_help = "Example:
  dermis board eight-by-eight       prints the port for `dermis host --port`, and runs until interrupted")]
    Board {
        /// Built-in name or path of a scene.
        scene: String,
        #[command(flatten)]
        target: BoardOverride,
    },
    /// Compare simulated hardware with the bit-true model, stage by stage and cycle by cycle.
    #[command(after_help = "Examples:
  dermis cosim sensor-1
  dermis cosim sensor-1 --frame a.json --frame b.csv --json
  dermis cosim eight-by-eight --device rust-hdl
  dermis cosim eight-by-eight --device netlist       what synthesis makes of it, minutes
  dermis cosim eight-by-eight --target-board icebreaker     the serial engine of a small device
  dermis cosim sensor-1 --device verilator --waves   and prints the GTKWave command")]
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
        /// Write the pins and stages of the run at full speed to <build-dir>/<scene>/waves, with a list for GTKWave.
        #[arg(long, conflicts_with = "json")]
        waves: bool,
        #[command(flatten)]
        target: BoardOverride,
    },
    /// Measure errors and times of all engines, and write them as a page with pictures.
    Report(report::Arguments),
    /// Make a frame with known forces from described contacts.
    Generate(crate::generate::Arguments),
    /// Measure errors of double, single and fixed point against a scene's condition, or on extreme frames.
    Stability(crate::stability::Arguments),
    /// Try the simulated hardware's streams under gaps, back-pressure, wrong tlast and resets.
    Stress(crate::stress::Arguments),
    /// Flip single bits of the simulated hardware and tell what is detected, harmless or silent.
    Faults(crate::faults::Arguments),
    /// Print the errors of scenes in the paper's cases on their shipped frames, beside the paper's.
    #[command(after_help = "Examples:
  dermis table                                       every built-in scene, cases 0 to 3
  dermis table sensor-1 --case 0 --format csv
  dermis table sensor-3 --case adaptive --case contacts --case 4x2
  dermis table sensor-3 --case contacts --fresh 40 --contacts 2 --contacts 3 --shapes other
  dermis table sensor-1 eight-by-eight --cosim       co-simulate, one line per scene")]
    Table {
        /// Built-in names or paths of scenes; without any all built-in ones.
        #[arg(required_if_eq("cosim", "true"))]
        scenes: Vec<String>,
        /// Case, repeatable: 0 to 3, ROWSxCOLS, adaptive, contacts; without it 0 to 3.
        #[arg(long = "case", value_name = "CASE")]
        cases: Vec<Case>,
        #[command(flatten)]
        drawn: DrawnFrames,
        /// Form of the table.
        #[arg(long, value_enum, default_value = "markdown", conflicts_with = "cosim")]
        format: Format,
        /// Co-simulate the hardware in place of the errors: one line per scene.
        #[arg(long, conflicts_with_all = ["cases", "frames"])]
        cosim: bool,
    },
    /// Measure the shear's error under noise, beside the Cramér–Rao bound.
    #[command(after_help = "Examples:
  dermis noise sensor-1
  dermis noise sensor-2 --objective patch --objective auto --draws 1000 --format csv")]
    Noise {
        /// Built-in name or path of a scene.
        scene: String,
        /// Noise as a share of max |b|, repeatable; without it 0, 0.0001, 0.0005, 0.002 and 0.01.
        #[arg(long = "level", value_name = "SHARE")]
        levels: Vec<f64>,
        /// Random contacts.
        #[arg(long, default_value_t = 200)]
        draws: usize,
        /// Of contacts and noise.
        #[arg(long, default_value_t = 1)]
        seed: u64,
        /// Frames averaged in the table's second half; 1 leaves it out.
        #[arg(long, default_value_t = 64)]
        frames: usize,
        /// Objective, repeatable; without it all.
        #[arg(long = "objective", value_name = "NAME", value_parser = objective)]
        objectives: Vec<ObjectiveKind>,
        /// Form of the table.
        #[arg(long, value_enum, default_value = "markdown")]
        format: Format,
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
    /// Verilog and rust-hdl, one after the other.
    Both,
    /// What synthesis for the board makes of the Verilog: beats and cycles, no stages. Minutes.
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

/// 1 for what is this program's own fault, a tool that failed on generated files among it; 2 for what the caller can
/// mend; 130, as shells have it, where they interrupted.
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

/// The text for stdout, and whether all that was compared is equal.
fn run(arguments: &Arguments) -> Result<(String, bool)> {
    let build_dir = &arguments.build_dir;
    store::keep_in(Some(&build_dir.join("matrices")));
    match &arguments.command {
        Command::Reconstruct { scene, frames, engine, json, target } => {
            let (scene, frames) = resolve_one(scene.as_deref(), frames)?;
            let scene = target.apply(scene);
            // Seconds where the matrices are large.
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
            Ok((format!("{}: {files} files, whole\n", folder.display()), true))
        }
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
        Command::Stability(arguments) => Ok((crate::stability::run(arguments)?, true)),
        Command::Faults(arguments) => crate::faults::run(arguments, build_dir),
        Command::Stress(arguments) => crate::stress::run(arguments, build_dir),
        Command::Table { scenes, cases, drawn, format, cosim: false } => {
            Ok((table(scenes, cases, drawn, *format)?, true))
        }
        Command::Noise { scene, levels, draws, seed, frames, objectives, format } => {
            let mut wanted = Study { draws: *draws, seed: *seed, frames: *frames, ..Study::default() };
            if !levels.is_empty() {
                wanted.levels = levels.clone();
            }
            if !objectives.is_empty() {
                wanted.objectives = objectives.clone();
            }
            let scene = Scene::load(scene)?;
            let bar = Progress::steps(&format!("{}: noise", scene.name), 0);
            let rows = study(&scene, &wanted, &mut |done, total| bar.set_of(done as u64, total as u64))?;
            Ok((report::noise(&rows, *format)?, true))
        }
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

/// The error table of scenes, all built-in ones when none is named.
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

/// An objective by its name in scenes.
fn objective(name: &str) -> Result<ObjectiveKind, String> {
    let names = ObjectiveKind::NAMES;
    let known = || names.map(|(name, _)| name).join(", ");
    names.iter().find(|(known, _)| *known == name).map(|(_, kind)| *kind).ok_or_else(|| format!("one of {}", known()))
}

/// The result and the stress in MPa of the largest code.
fn reconstruct(scene: &Scene, frames: &[Frame], engine: Engine, build_dir: &Path) -> Result<(Reconstruction, f64)> {
    let model = || Model::for_frames(scene, frames);
    let stress = |model: &Model| Ok::<_, anyhow::Error>(full_scale(&model.scene, &model.stress(frames)?));
    let result = match engine {
        Engine::Golden => {
            let golden = Golden::new(scene)?;
            return Ok((golden.run_averaged(frames)?, full_scale(scene, &golden.stress(frames)?)));
        }
        Engine::Fixed => {
            let model = model()?;
            (model.reconstruct_averaged(frames)?, stress(&model)?)
        }
        Engine::Rtl => {
            let hardware = Hardware::new(model()?, build_dir)?;
            (hardware.reconstruct(frames)?, stress(&hardware.model)?)
        }
    };
    Ok(result)
}

/// One line: how far a result is from the floating-point model's.
fn against_golden(scene: &Scene, frames: &[Frame], result: &Reconstruction) -> Result<String> {
    let golden = Golden::new(scene)?.run_averaged(frames)?;
    let model = Model::for_frames(scene, frames)?;
    let lsb_N = model.force_lsb_N(full_scale(&model.scene, &model.stress(frames)?));
    Ok(report::difference(&difference(&comparable_forces(&golden), &comparable_forces(result), lsb_N)))
}

/// Writes the generated files, each complete or not at all, and lists them.
fn build(scene: &Scene, out: &Path, board: bool, with_features: bool) -> Result<String> {
    // Seconds where the matrices are large, more where remedies are tried.
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

/// Writes to stdout; a reader that has gone away is no error.
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
    fn own_faults_exit_with_1_and_what_the_caller_can_mend_with_2() {
        let io = |kind| VerilatorError::File(FileError { path: "build".into(), source: ErrorKind::into(kind) });
        let stuck = DeviceTimeout { frame: "press".into(), cycle: 7, rule: "nothing moved".into() };
        let answer = HostError::Answer { port: "p".into(), what: "forces", bytes: 7 };
        let own: [anyhow::Error; 7] = [
            VerilatorError::Build { design: "d".into(), folder: "f".into(), log: "l".into() }.into(),
            VerilatorError::Library { path: "l".into(), reason: "r".into() }.into(),
            HdlError::Check("loop".into()).into(),
            FixedError::Internal("limbs").into(),
            FixedError::Beats { what: "forces", got: 1, expected: 2 }.into(),
            stuck.into(),
            answer.into(),
        ];
        let version = HostError::Version { port: "p".into(), has: 2, wants: 1 };
        let callers: [anyhow::Error; 7] = [
            VerilatorError::Missing.into(),
            VerilatorError::MissingTool { program: "make" }.into(),
            io(ErrorKind::PermissionDenied).into(),
            FixedError::Board(Board::load("none").unwrap_err()).into(),
            FixedError::NoFullScale { field: "threshold.min_force_N", value: "1".into() }.into(),
            version.into(),
            anyhow!("rtl: File exists"),
        ];
        for (errors, code) in [(own, 1), (callers, 2)] {
            for error in errors {
                assert_eq!(exit_code(&error), code, "{error}");
            }
        }
    }
}
