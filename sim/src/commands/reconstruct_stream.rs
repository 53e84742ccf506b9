//! `dermis reconstruct --stream`: frames as lines, results as lines of JSON, and as a recording.

use std::io::{Error, Read};
use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{anyhow, bail, Result};
use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{value_parser, Args, ValueEnum};
use dermis_flow::say;
use dermis_golden::engine::{CheckPace, Engine};
use dermis_golden::spec::scene::Scene;

use super::inputs::note_hardware;
use super::layout::LayoutArguments;
use dermis_flow::jobs::{Interrupt, Interrupted};
use dermis_host::engine::EngineName;
use dermis_host::recording::Recorder;
use dermis_host::stream::{
    as_lines, run_until, Clock, Estimators, Faster, Outcome, Policy, Source, Stop, StreamOptions,
};

/// Lines that wait with `--all` while the source waits too: a hundredth of a second at several kilohertz.
const QUEUE_OF_ALL: u32 = 64;
/// Lines that wait with `--all` of a source that does not wait.
const LONGEST_QUEUE: u32 = 4096;
/// Lines that wait with `--latest`.
const QUEUE_OF_LATEST: u32 = 1;

/// Options of a stream.
#[derive(Args, Debug)]
pub(super) struct StreamArguments {
    /// Reconstruct frames line by line: from standard input, or from =udp:HOST:PORT, a serial port, or a file that grows,
    /// which is followed until the program is interrupted.
    #[arg(long, value_name = "SOURCE", num_args = 0..=1, require_equals = true, default_missing_value = "-",
          conflicts_with_all = ["frames", "json"])]
    stream: Option<Source>,
    /// Answer every line, in order, by the scene's estimator. While the queue is full, reading waits; of a serial port and UDP, which
    /// do not wait, the oldest line is dropped and counted. The default of standard input, pipes and files.
    #[arg(long, requires = "stream")]
    all: bool,
    /// Answer the newest line: the oldest one that waits is dropped while the queue is full, and counted. The best estimator is
    /// taken that keeps up with the lines. The default of a serial port and UDP.
    #[arg(long, requires = "stream", conflicts_with = "all")]
    latest: bool,
    /// Frames per second that the estimator has to hold; the best one that does is taken. Default: with --latest as many as
    /// arrive, unless the scene states search.estimator; with --all the scene's estimator whatever its rate.
    #[arg(long, value_name = "HZ", requires = "stream", value_parser = rate_Hz)]
    rate: Option<f64>,
    /// Lines that may wait; default: with --latest 1; with --all 64, of a serial port and UDP 4096.
    #[arg(long, value_name = "N", requires = "stream", value_parser = value_parser!(u32).range(1..=i64::from(LONGEST_QUEUE)))]
    queue: Option<u32>,
    /// Cross-check every N-th result with the estimator evidence, before it is written, where the engine has another
    /// estimator; 0: none. Default: every one; with --latest or --rate the newest ones, as often as there is time.
    #[arg(long, value_name = "N", requires = "stream")]
    check_every: Option<u64>,
    /// Leave out the forces of the taxels.
    #[arg(long, requires = "stream")]
    brief: bool,
    /// Bit rate of a serial port; default: that of the scene's board.
    #[arg(long, value_name = "BIT/S", requires = "stream")]
    baud: Option<u32>,
    /// Write frames and results into a new MCAP file too, with the message types of ROS 2; the first interruption
    /// completes it. Whatever ends the program, what is older than a second is in the file.
    #[arg(long, value_name = "FILE.mcap", requires = "stream")]
    record: Option<PathBuf>,
}

impl StreamArguments {
    /// Whether a stream is to be reconstructed.
    pub(super) fn wanted(&self) -> bool {
        self.stream.is_some()
    }

    /// Answers every line on standard output; the text is empty.
    ///
    /// # Errors
    /// A scene without that engine, a source that cannot be read, lines that were refused.
    pub(super) fn run(&self, scene: &Scene, name: EngineName, layout: &LayoutArguments) -> Result<String> {
        let Some(source) = &self.stream else { return Ok(String::new()) };
        let engine = stream_engine(scene, name)?;
        let loses = source.loses_lines();
        let latest = self.latest || loses && !self.all;
        let (policy, queue) = match (latest, loses) {
            (true, _) => (Policy::Latest, QUEUE_OF_LATEST),
            // Who does not wait must be read.
            (false, true) => (Policy::Latest, LONGEST_QUEUE),
            (false, false) => (Policy::All, QUEUE_OF_ALL),
        };
        let queue = self.queue.unwrap_or(queue) as usize;
        let options = StreamOptions { queue, policy, live: source.is_live(), layout: layout.stated() };
        let pace = match (self.check_every, latest || self.rate.is_some()) {
            (Some(period), _) => CheckPace::Every(period),
            (None, true) => CheckPace::Beside,
            (None, false) => CheckPace::Every(1),
        };
        let faster = if latest || self.rate.is_some() { Faster::of_stream(scene, name, self.rate) } else { Vec::new() };
        let estimators = Estimators::new(&*engine, faster, pace, self.rate, Clock::default());
        let (input, name) = open(source, scene, self.baud)?;
        let mut recorder = self.record.as_deref().map(|path| Recorder::create(path, scene)).transpose()?;
        let stop = Stop::default();
        // Without a recording there is nothing to complete.
        let interrupted = match &recorder {
            Some(_) => {
                let stop = stop.clone();
                Interrupt::with(move || stop.now())?
            }
            None => Interrupt::default(),
        };
        let begun = Instant::now();
        let mut stdout = std::io::stdout().lock();
        let mut lines = as_lines(&mut stdout, self.brief);
        let mut output = |outcome: &Outcome| {
            if let Outcome::Note(text) = outcome {
                say!("{}: {text}", scene.name);
            }
            if let Some(recorder) = &mut recorder {
                recorder.outcome(outcome).map_err(|error| Error::other(error.to_string()))?;
            }
            lines(outcome)
        };
        let counts = run_until(&stop, estimators, (input, &name), options, &mut output);
        // Completed whatever ended the stream.
        let recorded = recorder.map(Recorder::finish).transpose();
        if let (Ok(Some(results)), Some(path)) = (&recorded, &self.record) {
            say!("{}: {results} results recorded", path.display());
        }
        let counts = counts?;
        let rate = counts.answered as f64 / begun.elapsed().as_secs_f64();
        let (answered, refused) = (counts.answered, counts.refused);
        say!("{}: {answered} results, {rate:.1} per second; {counts}", scene.name);
        recorded?;
        interrupted.check().map_err(|_| Interrupted("the recording is complete"))?;
        if let (0, Some((line, reason))) = (answered, &counts.first_refused) {
            bail!("{name}: {refused} of {refused} lines were refused; line {line}: {reason}");
        }
        if refused > 0 {
            bail!("{name}: {refused} of {} lines were refused", refused + answered);
        }
        Ok(String::new())
    }
}

/// The software engine of a stream.
///
/// # Errors
/// Another engine, a scene that the engine refuses.
pub(super) fn stream_engine(scene: &Scene, name: EngineName) -> Result<Box<dyn Engine>> {
    if !EngineName::SOFTWARE.contains(&name) {
        bail!("--engine rtl: a stream takes golden or fixed");
    }
    if name != EngineName::Golden {
        note_hardware(scene)?;
    }
    name.engine(scene, None, Path::new(""))
}

/// Parses a number of frames per second.
pub(super) fn rate_Hz(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(rate) if rate > 0.0 && rate.is_finite() => Ok(rate),
        _ => Err("wanted a finite number of frames per second above 0".into()),
    }
}

/// Parses the name of a software engine.
pub(super) fn software_engine() -> impl TypedValueParser<Value = EngineName> {
    let names = EngineName::SOFTWARE.iter().filter_map(EngineName::to_possible_value);
    PossibleValuesParser::new(names).try_map(|name| EngineName::software(&name))
}

/// Opens a source of lines; a serial port without `baud` takes the bit rate of the scene's board. Gives its name too.
///
/// # Errors
/// A source that cannot be opened, an unknown board.
pub(super) fn open(source: &Source, scene: &Scene, baud: Option<u32>) -> Result<(Box<dyn Read + Send>, String)> {
    let baud = match baud {
        Some(baud) => Some(baud),
        None => dermis_golden::spec::board::Board::load(scene.hardware.board_name())?.uart_baud,
    };
    let (input, address) = source.open(baud).map_err(|error| anyhow!("--stream: {error}"))?;
    if let Some(address) = address {
        say!("{}: listening on udp:{address}", scene.name);
    }
    Ok((input, source.name().to_owned()))
}
