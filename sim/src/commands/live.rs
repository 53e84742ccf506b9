//! `dermis live`: a local page with the newest forces of a stream, or of a finger that the mouse moves.

use std::net::{SocketAddr, TcpListener};
use std::sync::Arc;
use std::time::Duration;

use anyhow::{anyhow, bail, Result};
use clap::{value_parser, Args};
use dermis_golden::scene::Scene;

use super::inputs::{note_estimator, BoardOverride};
use super::reconstruct_stream::{open, SoftwareEngine};
use crate::live::server::open_to_others;
use crate::live::{Hand, Newest, Server, Show};
use crate::stream::{run as run_stream, Engine, Outcome, Policy, Source, StreamOptions};

/// Arguments of `dermis live`.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  dermis live sensor-1                                     the mouse is the finger: press on the map and drag
  dermis live pad.toml --noise 0.002 --engine fixed
  sensor-program | dermis live pad.toml --stream           one frame per line, as dermis reconstruct --stream takes them
  dermis live pad.toml --stream=udp:127.0.0.1:9000
  dermis live pad.toml --stream=/dev/ttyUSB0 --baud 115200
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
    /// Bit rate of a serial port; default: that of the scene's board.
    #[arg(long, value_name = "BIT/S", requires = "stream")]
    baud: Option<u32>,
    /// Model that computes the forces.
    #[arg(long, value_enum, default_value = "golden")]
    engine: SoftwareEngine,
    /// Standard deviation of the noise on the finger's frames over the largest |b|.
    #[arg(long, value_name = "SHARE", default_value_t = 0.0005, conflicts_with = "stream")]
    noise: f64,
    /// Largest number of the finger's frames per second.
    #[arg(long, value_name = "N", default_value_t = 60, conflicts_with = "stream", value_parser = value_parser!(u32).range(1..=1000))]
    rate: u32,
    /// Address and port of the page; port 0 takes a free one.
    #[arg(long, value_name = "ADDRESS:PORT", default_value = "127.0.0.1:8317")]
    listen: SocketAddr,
    #[command(flatten)]
    target: BoardOverride,
}

/// Runs the command until it is interrupted.
///
/// # Errors
/// A scene without that engine, a source that cannot be read, an address that cannot be used.
pub fn run(arguments: &Arguments, print: fn(&str) -> Result<()>) -> Result<String> {
    let Arguments { scene, stream, baud, engine, noise, rate, listen, target } = arguments;
    let mut scene = target.apply(Scene::load(scene)?);
    if stream.is_none() {
        // The finger's frames are stress already.
        (scene.input.calibration, scene.input.tare) = (None, None);
    }
    if !(0.0..=1.0).contains(noise) {
        bail!("--noise = {noise} is not allowed: 0 to 1");
    }
    let fixed = matches!(engine, SoftwareEngine::Fixed);
    if fixed {
        note_estimator(&scene);
    }
    let engine = Engine::new(&scene, fixed)?;
    let input = stream.as_ref().map(|source| open(source, &scene, *baud)).transpose()?;
    let listener = TcpListener::bind(listen).map_err(|error| anyhow!("--listen {listen}: {error}"))?;
    let address = listener.local_addr()?;
    if let Some(address) = open_to_others(address) {
        eprintln!("warning: {address} is open to the network; whoever reaches it sees the frames and moves the finger");
    }
    let newest = Arc::new(Newest::default());
    let hand = stream.is_none().then(|| Arc::new(Hand::default()));
    let source = match stream {
        Some(source) => format!("frames from {}", source.name()),
        None => format!("finger, noise {noise}"),
    };
    let server = Server::new(&scene, &source, Arc::clone(&newest), hand.clone());
    let serving = std::thread::spawn(move || server.run(&listener));
    print(&format!("http://{address}/\n"))?;
    let mut show = Show::new(&newest);
    let mut output = |outcome: &Outcome| show.outcome(outcome);
    match (hand, input) {
        (Some(hand), _) => {
            hand.run(&scene, &engine, *noise, Duration::from_secs(1) / *rate, &mut output)?;
        }
        (None, Some((input, name))) => {
            let options = StreamOptions { queue: 1, policy: Policy::Latest };
            let counts = run_stream(&scene, &engine, (input, &name), options, &mut output)?;
            eprintln!("{}: {name} has ended after {} results; the last one is shown", scene.name, counts.answered);
        }
        (None, None) => (),
    }
    match serving.join() {
        Ok(outcome) => outcome.map_err(|error| anyhow!("{address}: {error}"))?,
        Err(_) => bail!("{address}: the thread that serves the page has ended"),
    }
    Ok(String::new())
}
