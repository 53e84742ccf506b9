//! `dermis host`: sends frames to a board over a serial port and reads back forces.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use anyhow::{bail, Context, Result};
use clap::Args;
use dermis_flow::say;
use dermis_golden::data::frame::Frame;
use dermis_golden::data::reception::full_scale;
use dermis_golden::engine::CrossCheck;
use dermis_golden::fixed::Model;
use dermis_golden::result::reconstruct::Diagnostics;
use dermis_golden::spec::scene::Scene;
use dermis_golden::wire::link::{Identity, Kind};
use dermis_golden::write::write;

use super::inputs::{frames_of, resolve, BoardOverride};
use super::layout::LayoutArguments;
use dermis_flow::progress::Progress;
use dermis_host::link::stream::{self, FramesSent};
use dermis_host::link::{open_board, BoardAnswer, LinkErrors, PhysicalAnswer, Session};
use dermis_report as report;

/// Arguments of `dermis host`.
#[derive(Args, Debug)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    /// Frame files (.json, .csv); default: all shipped frames of the scene.
    #[arg(value_name = "FILE", conflicts_with = "stream")]
    frames: Vec<String>,
    #[command(flatten)]
    layout: LayoutArguments,
    /// Serial port of the board, or udp:HOST or udp:HOST:PORT of a core behind Ethernet; udp:HOST#3 is array 3
    /// of several.
    #[arg(long, value_name = "PATH|udp:HOST", required_unless_present = "udp")]
    port: Option<String>,
    /// Address of a core behind Ethernet, as --port udp:HOST; HOST#3 is array 3 of several.
    #[arg(long, value_name = "HOST[:PORT][#ARRAY]", conflicts_with_all = ["port", "baud", "scans", "save"])]
    udp: Option<String>,
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
    /// Read frames from standard input and write answers to standard output, one JSON object per line. Of a board that scans its
    /// array, nothing is read, and a line has the readings too.
    #[arg(long)]
    stream: bool,
    /// Of a board that scans its array: number of scans to ask for [default: 1].
    #[arg(long, value_name = "N", conflicts_with = "frames", value_parser = clap::value_parser!(u64).range(1..))]
    scans: Option<u64>,
    /// Of a board that scans its array: folder for the readings of each scan, as `scan-1.json` and so on, frames for
    /// `dermis calibrate` and `input.tare`.
    #[arg(long, value_name = "FOLDER", conflicts_with = "frames")]
    save: Option<PathBuf>,
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
  dermis host --udp 192.168.1.50 --scene sensor-1 --check                 a core behind Ethernet
  dermis host --udp 192.168.1.50#3 --scene hand.toml --forces             array 3 of those that it serves
  dermis host --port /dev/ttyUSB0 --scene sensor-1 --tare zero.json --stream <frames >answers
  dermis host --port /dev/ttyUSB0 --scene hand.toml --tables left-hand.toml press.json
  dermis host --port /dev/ttyUSB0 --scene mat.toml --scans 10 --save readings     a board that scans its array
  dermis host --port /dev/ttyUSB0 --scene mat.toml --scans 1000 --stream >answers

Input line: {\"id\": 7, \"stress_MPa\": [0.1, ...]}, row-major
Output line: {\"id\": 7, \"sent_s\": ..., \"answered_s\": ..., \"resultant_N\": [x, y, normal], \"centre_mm\": [x, y], ...}";

/// Runs the command: the text for standard output, and whether every comparison was equal.
///
/// # Errors
/// Wrong input, a port that cannot be opened, a board of another scene, no answer.
pub fn run(arguments: &Arguments) -> Result<(String, bool)> {
    let (hardware, tables) = (arguments.scene.as_deref(), arguments.tables.as_deref());
    let named = hardware.map(Scene::load).transpose()?;
    let scans = named.as_ref().is_some_and(|scene| scene.hardware.adc_scan.is_some());
    refuse(arguments, named.as_ref(), scans)?;
    let specimen = tables.map(Scene::load).transpose()?;
    let (scene, frames) = match named {
        Some(scene) if arguments.stream || scans => (scene, Vec::new()),
        Some(scene) => {
            let frames = frames_of(specimen.as_ref().unwrap_or(&scene), &arguments.frames, &arguments.layout)?;
            (scene, frames)
        }
        None => resolve(None, &arguments.frames, &arguments.layout)?,
    };
    let scene = arguments.target.apply(scene);
    let model = Model::new(&scene)?;
    let version = arguments.tables_version;
    let specimen = specimen.map(|specimen| model.with_tables(&specimen, version)).transpose()?;
    let tare = arguments.tare.as_ref().map(|path| Frame::load(path, Some(&scene))).transpose()?;
    tare.as_ref().map_or(Ok(()), |tare| tare.check(&scene))?;
    let port = match &arguments.udp {
        Some(address) => format!("udp:{address}"),
        None => arguments.port.clone().unwrap_or_default(),
    };
    let simulated = is_pseudo_terminal(&port);
    if simulated && arguments.baud.is_some() {
        say!("{port}: a pseudo-terminal has no bit rate: --baud has no effect");
    }
    let timeout = Duration::from_millis(arguments.timeout);
    let board = open_board(&port, &model, arguments.baud, timeout, "host")?;
    let mut session = Session::new(board, model, specimen, tare.as_ref(), arguments.forces, arguments.check)?;
    let before = session.board.counters()?;
    let begun = Instant::now();
    let ids = (1..=arguments.scans.unwrap_or(1)).map(|number| format!("scan-{number}"));
    let sent = match (arguments.stream, scans) {
        (true, false) => stream::run(
            &mut session,
            arguments.layout.stated(),
            &mut std::io::stdin().lock(),
            &mut std::io::stdout().lock(),
        )?,
        (true, true) => stream::run_scans(&mut session, ids, &mut std::io::stdout().lock())?,
        (false, false) => send(&mut session, &frames, |session, frame| session.request(frame))?,
        (false, true) => {
            let ids: Vec<String> = ids.collect();
            let save = arguments.save.as_deref();
            save.map_or(Ok(()), |folder| fs::create_dir_all(folder).with_context(|| folder.display().to_string()))?;
            send(&mut session, &ids, |session, id| scanned(session, id, save))?
        }
    };
    let rate = sent.answered as f64 / begun.elapsed().as_secs_f64();
    let after = session.board.counters()?;
    let rate = Rate { rate, simulated };
    let errors = session.board.link_errors();
    let summary = summary(&session.identity, sent.answered, &rate, errors, &after.since(&before));
    if arguments.stream {
        say!("{}", summary.trim_end());
    }
    match (arguments.stream, sent.refused) {
        (true, 0) => Ok((String::new(), sent.equal)),
        (true, refused) => bail!("standard input: {refused} of {} lines were refused", refused + sent.answered),
        (false, _) => Ok((sent.text + &summary, sent.equal)),
    }
}

/// Refuses options of the other kind of board.
///
/// # Errors
/// The option, and the scene's source of codes.
fn refuse(arguments: &Arguments, scene: Option<&Scene>, scans: bool) -> Result<()> {
    let Arguments { frames, tare, save, stream, .. } = arguments;
    let name = scene.map_or_else(String::new, |scene| format!("{}: ", scene.name));
    let (unfit, why) = match scans {
        true => (
            vec![
                ("a frame", !frames.is_empty()),
                ("--tare", tare.is_some()),
                ("--save with --stream", *stream && save.is_some()),
            ],
            "adc-scan: the board scans its array; its zero is a table (--tables), its readings are in the lines of --stream",
        ),
        false => (
            vec![("--scans", arguments.scans.is_some()), ("--save", save.is_some())],
            "stream: the board takes frames and scans no array",
        ),
    };
    match unfit.iter().find(|(_, unfit)| *unfit) {
        Some((what, _)) => bail!("{name}{what} is not possible with hardware.source = {why}"),
        None => Ok(()),
    }
}

/// Asks for a scan and saves its readings.
fn scanned(session: &mut Session, id: &str, save: Option<&Path>) -> Result<(Frame, BoardAnswer)> {
    let (readings, answer) = session.scan(id)?;
    if let Some(folder) = save {
        write(&folder.join(format!("{id}.json")), readings.to_json().as_bytes())?;
    }
    Ok((readings, answer))
}

/// Asks for one result after the other.
fn send<R>(
    session: &mut Session,
    requests: &[R],
    mut exchange: impl FnMut(&mut Session, &R) -> Result<(Frame, BoardAnswer)>,
) -> Result<FramesSent> {
    let bar = Progress::steps(&format!("{}: frames", session.model.scene.name), requests.len() as u64);
    let (mut text, mut equal) = (String::new(), true);
    let check = CrossCheck::of(&session.model);
    for (index, request) in requests.iter().enumerate() {
        let (readings, answer) = exchange(session, request)?;
        let checked = |resultant_N: [f64; 3], diagnostics: &mut Diagnostics| {
            check.iter().for_each(|check| check.check(std::slice::from_ref(&readings), resultant_N, diagnostics));
        };
        if let Some(mut result) = answer.decode(&session.model, &readings)? {
            checked(result.resultant_N, &mut result.diagnostics());
            let sensor = &session.model.scene.sensor;
            let stress = session.model.stress(std::slice::from_ref(&readings))?;
            let full_scale_MPa = full_scale(&session.model.scene, &stress);
            text.push_str(&report::reconstruction(&result, sensor, full_scale_MPa));
            text.push_str(&report::equality(&answer));
        } else {
            let mut physical = PhysicalAnswer::new(&session.model, &readings, &answer)?;
            checked(physical.resultant_N, &mut physical.diagnostics());
            text.push_str(&report::resultants(&readings.id, &physical, &answer));
        }
        equal &= !matches!(answer.difference, Some(Some(_)));
        bar.set(index as u64 + 1);
    }
    Ok(FramesSent { text, equal, answered: requests.len(), refused: 0 })
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
    dropped: &[(&'static str, u32)],
) -> String {
    let dropped: Vec<String> = dropped.iter().map(|(name, count)| format!("{count} {name}")).collect();
    format!(
        "board           {}×{} taxels, {} bit codes, {} MHz, scene {:08x}{}\n\
         frames          {count}, {rate}\n\
         host            {} requests sent again, {} answers damaged\n\
         board dropped   {}\n",
        identity.rows,
        identity.cols,
        identity.input_bits,
        f64::from(identity.clock_hz) / 1e6,
        identity.scene,
        if identity.supports(Kind::FrameForResultants) { "" } else { ", sends forces, which the host sums" },
        errors.repeated,
        errors.damaged,
        dropped.join(", "),
    )
}
