//! `dermis reconstruct --stream`: frames as lines, results as lines of JSON, and as a recording.

use std::io::{Error, Read};
use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{anyhow, bail, Result};
use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{value_parser, Args, ValueEnum};
use dermis_golden::engine::{CheckPace, Engine};
use dermis_golden::spec::scene::Scene;

use super::inputs::note_hardware;
use crate::engine::EngineName;
use crate::jobs::{Interrupt, Interrupted};
use crate::recording::Recorder;
use crate::stream::{as_lines, require_blocks, run_until, Outcome, Policy, Source, Stop, StreamOptions};

/// Lines that wait with `--all`: a hundredth of a second at several kilohertz.
const QUEUE_OF_ALL: u32 = 64;
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
    /// Answer every line; reading waits while the queue is full. The default.
    #[arg(long, requires = "stream")]
    all: bool,
    /// Drop the oldest waiting line while the queue is full, and count it.
    #[arg(long, requires = "stream", conflicts_with = "all")]
    latest: bool,
    /// Lines that may wait; default: 64, with --latest 1.
    #[arg(long, value_name = "N", requires = "stream", value_parser = value_parser!(u32).range(1..=4096))]
    queue: Option<u32>,
    /// Cross-check every N-th result with the estimator evidence, before it is written, where the engine has another
    /// estimator; 0: none. Default: every one; with --latest the newest ones, as often as there is time.
    #[arg(long, value_name = "N", requires = "stream")]
    check_every: Option<u64>,
    /// Leave out the forces of the taxels.
    #[arg(long, requires = "stream")]
    brief: bool,
    /// Bit rate of a serial port; default: that of the scene's board.
    #[arg(long, value_name = "BIT/S", requires = "stream")]
    baud: Option<u32>,
    /// Write frames and results into a new MCAP file too, with the message types of ROS 2; the first interruption
    /// completes it.
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
    pub(super) fn run(&self, scene: &Scene, name: EngineName) -> Result<String> {
        let Some(source) = &self.stream else { return Ok(String::new()) };
        let engine = stream_engine(scene, name)?;
        let policy = if self.latest { Policy::Latest } else { Policy::All };
        let queue = self.queue.unwrap_or(if self.latest { QUEUE_OF_LATEST } else { QUEUE_OF_ALL });
        let (input, name) = open(source, scene, self.baud)?;
        let pace = match (self.check_every, self.latest) {
            (Some(period), _) => CheckPace::Every(period),
            (None, true) => CheckPace::Beside,
            (None, false) => CheckPace::Every(1),
        };
        let options = StreamOptions { queue: queue as usize, policy, pace };
        let mut recorder = self.record.as_deref().map(|path| Recorder::create(path, &scene.sensor)).transpose()?;
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
            if let Some(recorder) = &mut recorder {
                recorder.outcome(outcome).map_err(|error| Error::other(error.to_string()))?;
            }
            lines(outcome)
        };
        let counts = run_until(&stop, &*engine, (input, &name), options, &mut output);
        // Completed whatever ended the stream.
        if let (Some(recorder), Some(path)) = (recorder, &self.record) {
            let results = recorder.finish()?;
            eprintln!("{}: {results} results recorded", path.display());
        }
        let counts = counts?;
        let rate = counts.answered as f64 / begun.elapsed().as_secs_f64();
        let (answered, refused, dropped) = (counts.answered, counts.refused, counts.dropped);
        eprintln!(
            "{}: {answered} results, {rate:.1} per second; {refused} lines refused, {dropped} dropped",
            scene.name
        );
        interrupted.check().map_err(|_| Interrupted("the recording is complete"))?;
        if refused > 0 {
            bail!("{name}: {refused} of {} lines were refused", refused + answered);
        }
        Ok(String::new())
    }
}

/// The software engine of a stream.
///
/// # Errors
/// Another engine, a sliding mean, a scene that the engine refuses.
pub(super) fn stream_engine(scene: &Scene, name: EngineName) -> Result<Box<dyn Engine>> {
    if !EngineName::SOFTWARE.contains(&name) {
        bail!("--engine rtl: a stream takes golden or fixed");
    }
    require_blocks(scene)?;
    if name != EngineName::Golden {
        note_hardware(scene)?;
    }
    name.engine(scene, None, Path::new(""))
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
        None => dermis_golden::spec::board::Board::load(&scene.hardware.board)?.uart_baud,
    };
    let (input, address) = source.open(baud).map_err(|error| anyhow!("--stream: {error}"))?;
    if let Some(address) = address {
        eprintln!("{}: listening on udp:{address}", scene.name);
    }
    Ok((input, source.name().to_owned()))
}
