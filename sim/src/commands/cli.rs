//! The `dermis` command line: arguments, commands, exit codes.
//!
//! | exit code | when |
//! |---|---|
//! | 0 | success; every comparison was equal |
//! | 1 | hardware and model differ, a tool failed on generated files, or an internal check failed |
//! | 2 | an argument or input is wrong, a file cannot be used, or a needed program is not installed |
//! | 130 | interrupted by SIGINT or SIGTERM |

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{anyhow, Result};
use clap::{CommandFactory, Parser, Subcommand};
use dermis_flow::say;
use dermis_golden::fixed::{FixedError, Model};
use dermis_golden::physics::matrices::cache;
use dermis_golden::spec::scene::Scene;
use dermis_golden::write::FileError;
use dermis_hdl::HdlError;

use super::inputs::BoardOverride;
use dermis_cosim::hardware::{DeviceTimeout, Hardware};
use dermis_cosim::verilator::VerilatorError;
use dermis_flow::jobs::Interrupted;
use dermis_flow::output::write;
use dermis_flow::tools::ToolError;
use dermis_host::link::{HostError, IdentityError, NetworkCore, PseudoTerminal};
use dermis_report as report;

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
  dermis new pad.toml --rows 12 --cols 10 --pitch 3 --thickness 2.5   a scene for your sensor
  dermis check sensor-1                              degree, expected errors, whether the board holds it
  dermis reconstruct sensor-1                        the scene's first shipped frame, golden model
  dermis reconstruct --frame press.json --json       scene from the sensor in the frame file
  dermis reconstruct sensor-1 --engine rtl           the same in the generated hardware, under Verilator
  dermis replay press.mcap                           the frames of a recording, one per line
  dermis live sensor-1                               page in the browser: press and drag, forces at once
  dermis build eight-by-eight --out rtl              Verilog, memory files, manifest.json
  dermis bitstream eight-by-eight                    synthesis, place and route for its board
  dermis boards                                      built-in boards and known devices
  dermis host --port /dev/ttyUSB0 press.json         send a frame to a board, print the resultants
  dermis block fold                                  ports of a stage: width, meaning, validity
  dermis cosim sensor-1                              all shipped frames, model against hardware
  dermis table                                       errors of all scenes, next to the paper's
  dermis noise sensor-1                              errors under noise, next to the Cramér–Rao bound
  dermis train sensor-1                              a network for search.estimator = \"evidence+network\"
  dermis export onnx sensor-1 sensor-1.onnx          its network, for ONNX Runtime and other programs
  dermis deviations my-scene.toml                    how far shear and normal force of a search may be off
  dermis report                                      HTML page: recommended cases and formats, error against time
  dermis generate sensor-3 --random 2 --out two.json  a frame with known forces
  dermis import walk.asf                             scene and frames of a recording of a real array
  dermis stability --group thickness --plot out.svg  error against the condition number
  dermis stress                                      gaps, wrong tlast and resets on sensor-1
  dermis power sensor-1                              the engine's power, estimated from simulated register bits
  dermis faults                                      1000 bit flips in ROM, RAM and registers of sensor-1";

#[derive(Subcommand, Debug)]
enum Command {
    /// Reconstruct the forces of one frame.
    Reconstruct(super::reconstruct::Arguments),
    /// Write the frames or the results of a recording, line by line.
    Replay(super::replay::Arguments),
    /// Show the newest forces of a stream, of a recording, or of a finger that the mouse moves, on a local page.
    Live(super::live::Arguments),
    /// Generate the Verilog of a scene.
    Build(super::build::Arguments),
    /// Make the bitstream of a scene for its board with open tools.
    Bitstream(super::bitstream::Arguments),
    /// Place and route a netlist of another design, and make its bitstream.
    Place(super::place::Arguments),
    /// Check a scene: model, board, expected errors; or a generated folder against its manifest.json.
    Check(super::check::Arguments),
    /// Write a scene for a new sensor, with comments; asks for what is missing.
    New(super::new::Arguments),
    /// Make the calibration table of a sensor from recordings under known stresses.
    Calibrate(super::calibrate::Arguments),
    /// Send frames to a board and receive forces.
    Host(super::host::Arguments),
    /// Simulate a board on a pseudo-terminal, or a core behind Ethernet, to run `dermis host` without hardware.
    #[command(after_help = "Examples:
  dermis board eight-by-eight                         prints the port for `dermis host --port`, and runs until interrupted
  dermis board eight-by-eight --udp 127.0.0.1:56850   a core behind Ethernet, in software: the bit-true model answers")]
    Board {
        /// Built-in name or path of a scene.
        scene: String,
        /// Answer the UDP packets of a core behind Ethernet at this address, in place of a simulated board; port 0 takes a free one.
        #[arg(long, value_name = "ADDRESS:PORT")]
        udp: Option<std::net::SocketAddr>,
        #[command(flatten)]
        target: BoardOverride,
    },
    /// List the built-in boards and the known devices, or print every field of one board.
    Boards(super::boards::Arguments),
    /// Print the ports of a block, its Verilog, or draw its timing.
    Block(super::block::Arguments),
    /// Print the register map of a core, as `dermis build --bus` generates one.
    Registers(super::registers::Arguments),
    /// Print the flags of a result, what to do about each, and the fields of the hardware's status.
    #[command(after_help = "Example:
  dermis flags                      a row per flag, then a row per field")]
    Flags,
    /// Print the fields of scenes, frames and results: a JSON schema, or a table.
    Schema(super::schema::Arguments),
    /// Print the converters that a scene can scan its array with.
    Converters(super::converters::Arguments),
    /// Make the image of a specimen's tables for hardware with writable tables.
    Load(super::load::Arguments),
    /// Compare simulated hardware with the bit-true model, stage by stage and cycle by cycle.
    Cosim(super::cosim::Arguments),
    /// Measure errors and times of all engines and write an HTML page with tables and pictures.
    Report(super::report::Arguments),
    /// Generate a frame with known forces from contact descriptions.
    Generate(super::generate::Arguments),
    /// Make a scene and frames from a recording of a real pressure array.
    Import(super::import::Arguments),
    /// Measure errors of double, single and fixed point against the condition number, or on extreme frames.
    Stability(super::stability::Arguments),
    /// Test the simulated hardware's AXI streams with gaps, back-pressure, wrong tlast and resets.
    Stress(super::stress::Arguments),
    /// Estimate the engine's power from the register bits that change in the simulated hardware.
    Power(super::power::Arguments),
    /// Flip single bits of the simulated hardware and count harmless, detected, hanging and silent faults.
    Faults(super::faults::Arguments),
    /// Print a comparison of the guide: input bits, dead taxels, several contacts, links.
    Study(super::study::Arguments),
    /// Write the tables and pictures of README.md and the guide with the commands named there, or report stale ones.
    Guide(super::guide_pages::Arguments),
    /// Print the completions of a shell for this command line.
    #[command(after_help = "Examples:
  dermis completions bash >dermis.bash   sourced by ~/.bashrc, or in ~/.local/share/bash-completion/completions as dermis
  dermis completions fish >dermis.fish   in ~/.config/fish/completions
  dermis completions zsh >_dermis        in a folder of fpath")]
    Completions {
        /// The shell.
        shell: clap_complete::Shell,
    },
    /// Write manual pages, one for the program and one for each command.
    #[command(after_help = "Example:
  dermis man ~/.local/share/man/man1                 then `man dermis`, `man dermis-reconstruct`")]
    Man {
        /// Folder to write to; it is made.
        folder: PathBuf,
    },
    /// Print the errors of scenes in the paper's cases on their shipped frames, next to the paper's.
    Table(super::table::Arguments),
    /// Write the network of a scene into a file that other programs read.
    Export(super::export::Arguments),
    /// Train a network for the estimators that have one on frames drawn from the scene's own physics.
    Train(super::train::Arguments),
    /// Measure the standard deviations of a search on frames drawn from the scene's own physics.
    Deviations(super::deviations::Arguments),
    /// Measure the errors under noise, next to the Cramér–Rao bound; any shape, several contacts, wrong scenes.
    Noise(super::noise::Arguments),
}

/// Parses the process's arguments and runs the command.
pub fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let outcome = run(&arguments).and_then(|(text, good)| print(&text).map(|()| good));
    match outcome {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::from(1),
        Err(error) => {
            say!("error: {}", with_causes(&error));
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

/// An error and what caused it, each said once.
fn with_causes(error: &anyhow::Error) -> String {
    error
        .chain()
        .map(ToString::to_string)
        .reduce(|text, cause| match text.contains(&cause) {
            true => text,
            false => format!("{text}: {cause}"),
        })
        .unwrap_or_default()
}

/// The exit code of an error: 1 for internal errors and for tools that fail on generated files, 2 for wrong input,
/// unusable files and missing programs, 130 for an interruption.
fn exit_code(error: &anyhow::Error) -> u8 {
    if error.is::<Interrupted>() {
        return 130;
    }
    let tool = matches!(
        error.downcast_ref::<VerilatorError>(),
        Some(VerilatorError::Build { .. } | VerilatorError::Library { .. })
    );
    let hardware = error.is::<DeviceTimeout>() || matches!(error.downcast_ref::<HdlError>(), Some(HdlError::Check(_)));
    let model = matches!(error.downcast_ref::<FixedError>(), Some(FixedError::Internal(_) | FixedError::Beats { .. }));
    let board = matches!(
        error.downcast_ref::<HostError>(),
        Some(HostError::Answer { .. } | HostError::Identity { reason: IdentityError::Length { .. }, .. })
    );
    let flow = matches!(
        error.downcast_ref::<ToolError>(),
        Some(ToolError::Failed { .. } | ToolError::Late { .. } | ToolError::Stuck { .. } | ToolError::Output { .. })
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
        Command::Reconstruct(arguments) => Ok((super::reconstruct::run(arguments, build_dir)?, true)),
        Command::Replay(arguments) => Ok((super::replay::run(arguments)?, true)),
        Command::Live(arguments) => Ok((super::live::run(arguments, print)?, true)),
        Command::Build(arguments) => Ok((super::build::run(arguments, build_dir)?, true)),
        Command::Cosim(arguments) => super::cosim::run(arguments, build_dir),
        Command::Load(arguments) => Ok((super::load::run(arguments, build_dir)?, true)),
        Command::Bitstream(arguments) => super::bitstream::run(arguments, build_dir),
        Command::Place(arguments) => super::place::run(arguments),
        Command::Check(arguments) => Ok((super::check::run(arguments)?, true)),
        Command::New(arguments) => Ok((super::new::run(arguments)?, true)),
        Command::Calibrate(arguments) => Ok((super::calibrate::run(arguments)?, true)),
        Command::Block(arguments) => Ok((super::block::run(arguments, build_dir)?, true)),
        Command::Boards(arguments) => Ok((super::boards::run(arguments)?, true)),
        Command::Host(arguments) => super::host::run(arguments),
        Command::Board { scene, udp: Some(address), target } => {
            let scene = target.apply(Scene::load(scene)?);
            let core = NetworkCore::start(&Model::new(&scene)?, &address.to_string())
                .map_err(|error| anyhow!("--udp {address}: {error}"))?;
            print(&format!("udp:{}\n", core.address()))?;
            say!("{}: the bit-true model answers, with the clock of the hardware", scene.name);
            core.wait()?;
            Ok((String::new(), true))
        }
        Command::Board { scene, udp: None, target } => {
            let scene = target.apply(Scene::load(scene)?);
            let terminal = PseudoTerminal::of(&Hardware::new(Model::new(&scene)?, build_dir)?)?;
            print(&format!("{}\n", terminal.path().display()))?;
            say!("{}: simulated; rates and times at the port are the simulation's", scene.name);
            terminal.wait()?;
            Ok((String::new(), true))
        }
        Command::Report(arguments) => super::report::run(arguments, build_dir),
        Command::Generate(arguments) => Ok((super::generate::run(arguments)?, true)),
        Command::Import(arguments) => Ok((super::import::run(arguments, build_dir)?, true)),
        Command::Stability(arguments) => Ok((super::stability::run(arguments)?, true)),
        Command::Registers(arguments) => Ok((super::registers::run(arguments)?, true)),
        Command::Flags => Ok((report::flags(), true)),
        Command::Schema(arguments) => Ok((super::schema::run(arguments)?, true)),
        Command::Converters(arguments) => Ok((super::converters::run(arguments)?, true)),
        Command::Power(arguments) => Ok((super::power::run(arguments, build_dir)?, true)),
        Command::Faults(arguments) => super::faults::run(arguments, build_dir),
        Command::Stress(arguments) => super::stress::run(arguments, build_dir),
        Command::Study(arguments) => Ok((super::study::run(arguments, build_dir)?, true)),
        Command::Guide(arguments) => super::guide_pages::run(arguments, build_dir),
        Command::Completions { shell } => {
            let mut text = Vec::new();
            clap_complete::generate(*shell, &mut Arguments::command(), "dermis", &mut text);
            Ok((String::from_utf8(text)?, true))
        }
        Command::Man { folder } => {
            std::fs::create_dir_all(folder).map_err(FileError::at(folder))?;
            let mut command = Arguments::command().disable_help_subcommand(true);
            command.build();
            write_manual(&command, folder)?;
            Ok((format!("{}\n", folder.display()), true))
        }
        Command::Table(arguments) => super::table::run(arguments, build_dir),
        Command::Train(arguments) => super::train::run(arguments),
        Command::Export(arguments) => Ok((super::export::run(arguments)?, true)),
        Command::Deviations(arguments) => super::deviations::run(arguments),
        Command::Noise(arguments) => Ok((super::noise::run(arguments)?, true)),
    }
}

/// Writes the manual pages of a command and of those below it.
fn write_manual(command: &clap::Command, folder: &Path) -> Result<()> {
    let page = clap_mangen::Man::new(command.clone());
    let (name, mut text) = (page.get_filename(), Vec::new());
    page.render(&mut text)?;
    dermis_golden::write::write(&folder.join(name), &text)?;
    command.get_subcommands().try_for_each(|command| write_manual(command, folder))
}

/// Writes to stdout; a closed pipe is not an error.
fn print(text: &str) -> Result<()> {
    write(&mut std::io::stdout().lock(), text.as_bytes()).map(drop)
}

#[cfg(test)]
mod tests {
    use super::*;
    use dermis_golden::spec::board::Board;
    use std::io::ErrorKind;

    #[test]
    fn causes_are_said_once() {
        let cause = || std::io::Error::from(ErrorKind::NotFound);
        let file: anyhow::Error = FileError { path: "a".into(), source: cause() }.into();
        assert_eq!(with_causes(&file), format!("a: {}", cause()));
        assert_eq!(with_causes(&anyhow::Error::from(cause()).context("a")), format!("a: {}", cause()));
    }

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
        let reason = IdentityError::Version { has: 2, wants: 1 };
        let version = HostError::Identity { port: "p".into(), reason };
        let input: [anyhow::Error; 7] = [
            VerilatorError::Missing.into(),
            VerilatorError::MissingCompiler.into(),
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
