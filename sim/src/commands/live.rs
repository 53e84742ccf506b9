//! `dermis live`: a local page with the newest forces of a stream, of a recording, or of a finger that the mouse moves.

use std::net::{SocketAddr, TcpListener};
use std::ops::RangeInclusive;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use anyhow::{anyhow, bail, Result};
use clap::Args;
use dermis_flow::say;
use dermis_golden::data::recording::FrameOptions;
use dermis_golden::engine::{CheckPace, Engine};
use dermis_golden::fixed::Model;
use dermis_golden::spec::scene::Scene;

use super::inputs::{note_hardware, BoardOverride};
use super::layout::LayoutArguments;
use super::reconstruct_stream::{open, rate_Hz, software_engine, stream_engine};
use crate::live::server::open_to_others;
use crate::live::{Hand, Newest, Server, Show};
use dermis_host::engine::EngineName;
use dermis_host::link::{open_board, BoardEngine, Session};
use dermis_host::recording::{Pace, Paced};
use dermis_host::stream::{
    run as run_stream, Clock, Estimators, Faster, Input, Outcome, Policy, Source, StreamOptions,
};

/// Arguments of `dermis live`.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  dermis live sensor-1                                     the mouse is the finger: press on the map and drag
  dermis live pad.toml --noise 0.002 --engine fixed
  sensor-program | dermis live pad.toml --stream           one frame per line, as dermis reconstruct --stream takes them
  dermis live pad.toml --stream=udp:127.0.0.1:9000
  dermis live pad.toml --stream=/dev/ttyUSB0 --baud 115200
  dermis live sensor-1 --recording press.mcap --loop       recorded frames, as far apart as they were acquired
  dermis live sensor-1 --board /dev/ttyUSB0                the finger's frames, the board's forces
  dermis live sensor-1 --listen 192.168.1.7:8317           for a phone in the same network, without any password

The address is printed on standard output; the program runs until it is interrupted. Only the newest frame is
reconstructed and drawn; older ones that wait are dropped and counted.")]
pub struct Arguments {
    /// Built-in name or path of a scene.
    scene: String,
    /// Show frames from standard input, or from =udp:HOST:PORT, a serial port, or a file that grows; default: frames of
    /// a finger that the mouse on the page moves.
    #[arg(long, value_name = "SOURCE", num_args = 0..=1, require_equals = true, default_missing_value = "-")]
    stream: Option<Source>,
    /// Bit rate of the stream's serial port; default: that of the scene's board.
    #[arg(long, value_name = "BIT/S", requires = "stream")]
    baud: Option<u32>,
    #[command(flatten)]
    layout: LayoutArguments,
    /// Show the frames of a recording, as far apart as they were acquired.
    #[arg(long, value_name = "FILE.mcap", conflicts_with = "stream")]
    recording: Option<PathBuf>,
    /// Begin the recording again at its end.
    #[arg(long = "loop", requires = "recording")]
    repeat: bool,
    /// Model that computes the forces.
    #[arg(long, value_parser = software_engine(), default_value = "golden", conflicts_with = "board")]
    engine: EngineName,
    /// Serial port of a board that computes the forces in place of a model, at the bit rate of the scene's board; or udp:HOST or
    /// udp:HOST:PORT of a core behind Ethernet.
    #[arg(long, value_name = "PATH|udp:HOST")]
    board: Option<String>,
    /// Standard deviation of the noise on the finger's frames over the largest |b|.
    #[arg(long, value_name = "SHARE", default_value_t = 0.0005, conflicts_with_all = ["stream", "recording"])]
    noise: f64,
    /// Frames per second that the estimator has to hold, of the finger 1 to 1000; the best one that does is taken. Default: of a stream as many as
    /// arrive, unless the scene states search.estimator; of the finger at most 60, by the scene's estimator.
    #[arg(long, value_name = "HZ", value_parser = rate_Hz)]
    rate: Option<f64>,
    /// Address and port of the page; port 0 takes a free one.
    #[arg(long, value_name = "ADDRESS:PORT", default_value = "127.0.0.1:8317")]
    listen: SocketAddr,
    #[command(flatten)]
    target: BoardOverride,
}

/// Frames of the finger per second without `--rate`.
const DEFAULT_FINGER_HZ: f64 = 60.0;
/// Values of `--rate`.
const FINGER_HZ: RangeInclusive<f64> = 1.0..=1000.0;
/// Time without a board's answer after which a request is sent again.
const BOARD_TIMEOUT: Duration = Duration::from_secs(1);

impl Arguments {
    /// Whether the mouse on the page is the source of frames.
    fn finger(&self) -> bool {
        self.stream.is_none() && self.recording.is_none()
    }

    /// The frames and their source's name; `None` with the finger.
    fn input(&self, scene: &Scene) -> Result<Option<(Input, String)>> {
        match (&self.stream, &self.recording) {
            (Some(source), _) => open(source, scene, self.baud).map(|(lines, name)| Some((lines.into(), name))),
            (None, Some(path)) => {
                let (name, shape) = (path.display().to_string(), Some([scene.sensor.rows, scene.sensor.cols]));
                let options = FrameOptions { shape, ..FrameOptions::default() };
                let frames = Paced::open(path.clone(), options, Pace::Recorded, [self.repeat, false]);
                let frames = frames.map_err(|error| anyhow!("--recording {name}: {error}"))?;
                Ok(Some((Input::Frames(Box::new(frames)), name)))
            }
            (None, None) => Ok(None),
        }
    }

    /// What computes the forces.
    fn engine(&self, scene: &Scene) -> Result<Box<dyn Engine>> {
        let Some(port) = &self.board else { return stream_engine(scene, self.engine) };
        note_hardware(scene)?;
        let model = Model::new(scene)?;
        let board = open_board(port, &model, None, BOARD_TIMEOUT, "live --board")?;
        Ok(Box::new(BoardEngine::new(Session::new(board, model, None, None, true, false)?)))
    }
}

/// Runs the command until it is interrupted.
///
/// # Errors
/// A scene without that engine, a source or a board that cannot be used, an address that cannot be used.
pub fn run(arguments: &Arguments, print: fn(&str) -> Result<()>) -> Result<String> {
    let Arguments { scene, board, noise, rate, listen, target, .. } = arguments;
    let mut scene = target.apply(Scene::load(scene)?);
    if arguments.finger() {
        // The finger's frames are stress already.
        let converted = [("calibration", scene.input.calibration.take()), ("tare", scene.input.tare.take())];
        if let (Some(port), Some((field, _))) = (board, converted.iter().find(|(_, value)| value.is_some())) {
            bail!(
                "--board {port}: the board applies input.{field} of scene {}, and the finger's frames are stress \
                   already: take --stream or --recording",
                scene.name
            );
        }
    }
    if let Some(rate) = rate.filter(|rate| arguments.finger() && !FINGER_HZ.contains(rate)) {
        bail!("--rate = {rate} is not allowed: {} to {}", FINGER_HZ.start(), FINGER_HZ.end());
    }
    if let (Some(rate), Some(port)) = (rate.filter(|_| !arguments.finger()), board) {
        bail!("--rate = {rate} is not allowed: the board at {port} computes every frame that arrives");
    }
    if !(0.0..=1.0).contains(noise) {
        bail!("--noise = {noise} is not allowed: 0 to 1");
    }
    let engine = arguments.engine(&scene)?;
    let input = arguments.input(&scene)?;
    let listener = TcpListener::bind(listen).map_err(|error| anyhow!("--listen {listen}: {error}"))?;
    let address = listener.local_addr()?;
    if let Some(address) = open_to_others(address) {
        say!(
            "warning: {address} is open to the network; anyone who reaches it sees the frames and can move the finger"
        );
    }
    let newest = Arc::new(Newest::default());
    let hand = arguments.finger().then(|| Arc::new(Hand::default()));
    let source = match &input {
        Some((_, name)) => format!("frames from {name}"),
        None => format!("finger, noise {noise}"),
    };
    let server = Server::new(&scene, &source, Arc::clone(&newest), hand.clone());
    let serving = std::thread::spawn(move || server.run(&listener, |text| say!("{address}: {text}")));
    print(&format!("http://{address}/\n"))?;
    let mut show = Show::new(&newest);
    let mut output = |outcome: &Outcome| {
        if let Outcome::Note(text) = outcome {
            say!("{}: {text}", scene.name);
        }
        show.outcome(outcome)
    };
    let chosen = board.is_none() && (hand.is_none() || rate.is_some());
    let faster = if chosen { Faster::of_stream(&scene, arguments.engine, *rate) } else { Vec::new() };
    let estimators = Estimators::new(&*engine, faster, CheckPace::Beside, *rate, Clock::default());
    match (hand, input) {
        (Some(hand), _) => {
            let period = Duration::from_secs_f64(1.0 / rate.unwrap_or(DEFAULT_FINGER_HZ));
            hand.run(estimators, *noise, period, &mut output)?;
        }
        (None, Some((input, name))) => {
            let options =
                StreamOptions { queue: 1, policy: Policy::Latest, live: true, layout: arguments.layout.stated() };
            let counts = run_stream(estimators, (input, &name), options, &mut output)?;
            let answered = counts.answered;
            say!("{}: {name} has ended after {answered} results; {counts}; the last one is shown", scene.name);
        }
        (None, None) => (),
    }
    if serving.join().is_err() {
        bail!("{address}: the thread that serves the page has ended");
    }
    Ok(String::new())
}
