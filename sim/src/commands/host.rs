//! `dermis host`: sends frames to a board over a serial port and reads back forces.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use anyhow::{bail, Result};
use clap::Args;
use dermis_golden::fixed::Model;
use dermis_golden::frame::Frame;
use dermis_golden::link::{Counters, Identity, Kind};
use dermis_golden::reception::full_scale;
use dermis_golden::scene::Scene;

use super::inputs::{resolve_specimen, BoardOverride};
use crate::link::stream::{self, FramesSent};
use crate::link::{open_board, LinkErrors, PhysicalAnswer, Session};
use crate::progress::Progress;
use crate::report;

/// Arguments of `dermis host`.
#[derive(Args, Debug)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    /// Frame files (.json, .csv); default: all shipped frames of the scene.
    #[arg(value_name = "FILE", conflicts_with = "stream")]
    frames: Vec<String>,
    /// Serial port of the board.
    #[arg(long, value_name = "PATH")]
    port: String,
    /// Built-in name or path of a scene; optional if the first frame file contains its sensor.
    #[arg(long, required_if_eq("stream", "true"))]
    scene: Option<String>,
    /// Scene of a specimen: its tables are loaded first, as `dermis load` does; frames are the specimen's.
    #[arg(long, value_name = "SPECIMEN", requires = "scene")]
    tables: Option<String>,
    /// Version of these tables, 1 to 32767.
    #[arg(long, value_name = "N", default_value_t = 1, requires = "tables")]
    tables_version: u16,
    /// Bit rate; default: that of the scene's board.
    #[arg(long, value_name = "BIT/S")]
    baud: Option<u32>,
    /// Read the force on every taxel instead of the resultants. Resultants take a fraction of the transfer time if the
    /// board sums the forces.
    #[arg(long)]
    forces: bool,
    /// Compare every answer with the bit-true model.
    #[arg(long)]
    check: bool,
    /// Frame recorded without contact; it takes the place of the scene's tare frame or offsets.
    #[arg(long, value_name = "FILE")]
    tare: Option<PathBuf>,
    /// Read frames from standard input and write answers to standard output, one JSON object per line.
    #[arg(long)]
    stream: bool,
    /// Time without an answer, in ms, after which a request is sent again.
    #[arg(long, value_name = "MS", default_value_t = 1000)]
    timeout: u64,
    #[command(flatten)]
    target: BoardOverride,
}

const EXAMPLES: &str = "Examples:
  dermis host --port /dev/ttyUSB0 --scene sensor-1            all shipped frames, resultants
  dermis host --port /dev/ttyUSB0 --forces --check press.json
  dermis host --port /dev/ttyUSB1 --scene eight-by-eight --target-board icebreaker
  dermis host --port /dev/ttyUSB0 --scene sensor-1 --tare zero.json --stream <frames >answers
  dermis host --port /dev/ttyUSB0 --scene hand.toml --tables left-hand.toml press.json

Input line: {\"id\": 7, \"stress_MPa\": [0.1, ...]}, row-major
Output line: {\"id\": 7, \"sent_s\": ..., \"answered_s\": ..., \"resultant_N\": [x, y, normal], \"centre_mm\": [x, y], ...}";

/// Runs the command: the text for standard output, and whether every comparison was equal.
///
/// # Errors
/// Wrong input, a port that cannot be opened, a board of another scene, no answer.
pub fn run(arguments: &Arguments) -> Result<(String, bool)> {
    let (hardware, tables) = (arguments.scene.as_deref(), arguments.tables.as_deref());
    let (scene, specimen, frames) = match arguments.stream {
        true => {
            let specimen = tables.map(Scene::load).transpose()?;
            (Scene::load(hardware.unwrap_or_default())?, specimen, Vec::new())
        }
        false => resolve_specimen(hardware, tables, &arguments.frames)?,
    };
    let scene = arguments.target.apply(scene);
    let model = Model::new(&scene)?;
    let version = arguments.tables_version;
    let specimen = specimen.map(|specimen| model.with_tables(&specimen, version)).transpose()?;
    let tare = arguments.tare.as_ref().map(|path| Frame::load(path, Some(&scene))).transpose()?;
    tare.as_ref().map_or(Ok(()), |tare| tare.check(&scene))?;
    let simulated = is_pseudo_terminal(&arguments.port);
    if simulated && arguments.baud.is_some() {
        eprintln!("{}: a pseudo-terminal has no bit rate: --baud has no effect", arguments.port);
    }
    let timeout = Duration::from_millis(arguments.timeout);
    let client = open_board(&arguments.port, &model, arguments.baud, timeout, "host")?;
    let mut session = Session::new(client, model, specimen, tare.as_ref(), arguments.forces, arguments.check)?;
    let before = session.client.counters()?;
    let begun = Instant::now();
    let sent = match arguments.stream {
        true => stream::run(&mut session, &mut std::io::stdin().lock(), &mut std::io::stdout().lock())?,
        false => send_frames(&mut session, &frames)?,
    };
    let rate = sent.answered as f64 / begun.elapsed().as_secs_f64();
    let after = session.client.counters()?;
    let rate = Rate { rate, simulated };
    let summary = summary(&session.identity, sent.answered, &rate, session.client.link_errors, &before, &after);
    if arguments.stream {
        eprint!("{summary}");
    }
    match (arguments.stream, sent.refused) {
        (true, 0) => Ok((String::new(), sent.equal)),
        (true, refused) => bail!("standard input: {refused} of {} lines were refused", refused + sent.answered),
        (false, _) => Ok((sent.text + &summary, sent.equal)),
    }
}

/// Sends frames from files one after the other.
fn send_frames<P: std::io::Read + std::io::Write>(session: &mut Session<P>, frames: &[Frame]) -> Result<FramesSent> {
    let bar = Progress::steps(&format!("{}: frames", session.model.scene.name), frames.len() as u64);
    let (mut text, mut equal) = (String::new(), true);
    for (index, frame) in frames.iter().enumerate() {
        let (readings, answer) = session.request(frame)?;
        if let Some(result) = answer.decode(&session.model, &readings)? {
            let sensor = &session.model.scene.sensor;
            let stress = session.model.stress(std::slice::from_ref(&readings))?;
            let full_scale_MPa = full_scale(&session.model.scene, &stress);
            text.push_str(&report::reconstruction(&result, sensor, full_scale_MPa));
            text.push_str(&report::equality(&answer));
        } else {
            text.push_str(&report::resultants(
                &frame.id,
                &PhysicalAnswer::new(&session.model, &readings, &answer)?,
                &answer,
            ));
        }
        equal &= !matches!(answer.difference, Some(Some(_)));
        bar.set(index as u64 + 1);
    }
    Ok(FramesSent { text, equal, answered: frames.len(), refused: 0 })
}

/// Whether a port is a pseudo-terminal, as `dermis board` opens one.
fn is_pseudo_terminal(port: &str) -> bool {
    std::fs::canonicalize(port).is_ok_and(|path| path.starts_with("/dev/pts"))
}

/// Frames per second, of a board or of a simulation.
struct Rate {
    rate: f64,
    simulated: bool,
}

impl std::fmt::Display for Rate {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let of = if self.simulated { " in the simulation, not on a board" } else { "" };
        write!(f, "{:.1} per second{of}", self.rate)
    }
}

fn summary(
    identity: &Identity,
    count: usize,
    rate: &Rate,
    errors: LinkErrors,
    before: &Counters,
    after: &Counters,
) -> String {
    let since = |field: fn(&Counters) -> u16| field(after).wrapping_sub(field(before));
    format!(
        "board           {}×{} taxels, {} bit codes, {} MHz, scene {:08x}{}\n\
         frames          {count}, {rate}\n\
         host            {} requests sent again, {} answers damaged\n\
         board dropped   {} framing, {} CRC, {} unknown type, {} length, {} overrun\n",
        identity.rows,
        identity.cols,
        identity.input_bits,
        f64::from(identity.clock_hz) / 1e6,
        identity.scene,
        if identity.supports(Kind::FrameForResultants) { "" } else { ", sends forces, which the host sums" },
        errors.repeated,
        errors.damaged,
        since(|c| c.framing),
        since(|c| c.crc),
        since(|c| c.unknown_type),
        since(|c| c.length),
        since(|c| c.overrun),
    )
}
