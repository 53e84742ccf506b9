//! `dermis replay`: the frames or the results of a recording, line by line.

use std::io::{ErrorKind, Read};
use std::path::{Path, PathBuf};

use anyhow::{anyhow, bail, Result};
use clap::Args;
use dermis_flow::say;
use dermis_golden::data::recording::message::Text;
use dermis_golden::data::recording::{End, FrameOptions, Messages};

use dermis_flow::output::write;
use dermis_host::recording::{Lines, Pace, Paced, RESULT};

/// Bytes that are read at once.
const BUFFER: usize = 1 << 16;

/// Arguments of `dermis replay`.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  dermis replay press.mcap | dermis reconstruct sensor-1 --stream >again.ndjson
  dermis replay press.mcap --real-time
  dermis replay press.mcap --rate 100 | dermis live sensor-1 --stream
  dermis replay press.mcap --results
  dermis replay glove.mcap --topic /tactile/left --mpa-per-count 0.0001

Frames are read from the channel /dermis/stress_exact, else /dermis/stress, and written as lines
{\"stress_MPa\": [0.1, ...]}, null where a pixel is NaN. dermis reconstruct --stream --record and other recorders of ROS 2
make such files; compressed by zstd or lz4, or not. Of a file whose recorder was ended every frame is read that it had
written, a second before its end at the latest; what is missing is said on standard error.")]
pub struct Arguments {
    /// MCAP file.
    #[arg(value_name = "FILE.mcap")]
    file: PathBuf,
    /// Write the recorded lines of results instead, as they were written.
    #[arg(long, conflicts_with_all = ["rate", "real_time", "topic", "mpa_per_count"])]
    results: bool,
    /// Read the images of this channel: a sensor_msgs/msg/Image of 64FC1, 32FC1 or integers of 8, 16 or 32 bits.
    #[arg(long, value_name = "NAME")]
    topic: Option<String>,
    /// Stress of one count in MPa, for images of integers; 1 hands on the counts, to a scene with a calibration table.
    #[arg(long, value_name = "MPA", value_parser = stress_MPa)]
    mpa_per_count: Option<f64>,
    /// Write so many frames per second; default: as fast as they are read.
    #[arg(long, value_name = "N", conflicts_with = "real_time")]
    rate: Option<f64>,
    /// Write frames as far apart as they were acquired.
    #[arg(long)]
    real_time: bool,
    /// Exit with 0 although the file is cut within a record.
    #[arg(long)]
    partial: bool,
}

/// Runs the command; the text is empty.
///
/// # Errors
/// A file that is no recording, with its name; one that is cut, unless that is allowed: what stands before is written.
pub fn run(arguments: &Arguments) -> Result<String> {
    let Arguments { file, results, topic, mpa_per_count, rate, real_time, partial } = arguments;
    let pace = match rate {
        Some(rate) if rate.is_finite() && *rate > 0.0 => Pace::Rate(*rate),
        Some(rate) => bail!("--rate = {rate} is not allowed: above 0"),
        None if *real_time => Pace::Recorded,
        None => Pace::Unbounded,
    };
    let named = |error: &dyn std::fmt::Display| anyhow!("{}: {error}", file.display());
    let mut output = std::io::stdout().lock();
    let mut write = |bytes: &[u8]| write(&mut output, bytes);
    let end = match results {
        true => write_results(file, &mut write)?,
        false => {
            let options = FrameOptions { shape: None, topic: topic.clone(), MPa_per_count: *mpa_per_count };
            let frames = Paced::open(file.clone(), options, pace, [false, true]).map_err(|error| named(&error))?;
            write_frames(Lines::of(frames), file, &mut write)?
        }
    };
    match end.words() {
        Some(words) if end == End::Cut && !partial => return Err(named(&format!("{words}; --partial allows it"))),
        Some(words) => say!("{}: {words}", file.display()),
        None => (),
    }
    Ok(String::new())
}

/// Writes bytes; whether anything reads them.
type Write<'a> = dyn FnMut(&[u8]) -> Result<bool> + 'a;

fn write_frames(mut lines: Lines, file: &Path, write: &mut Write) -> Result<End> {
    let mut buffer = vec![0; BUFFER];
    loop {
        match lines.read(&mut buffer) {
            Err(error) if error.kind() == ErrorKind::Interrupted => (),
            Err(error) => bail!("{}: {error}", file.display()),
            Ok(0) => return Ok(lines.end()),
            Ok(bytes) if write(&buffer[..bytes])? => (),
            Ok(_) => return Ok(End::Complete),
        }
    }
}

fn write_results(file: &Path, write: &mut Write) -> Result<End> {
    let named = |error: &dyn std::fmt::Display| anyhow!("{}: {error}", file.display());
    let mut messages = Messages::open(file).map_err(|error| named(&error))?;
    let mut found = false;
    while let Some(message) = messages.next_message().map_err(|error| named(&error))? {
        if message.topic == RESULT {
            let text: Text = message.decoded().map_err(|error| named(&format!("{RESULT}: {error}")))?;
            found = true;
            if !write((text.data + "\n").as_bytes())? {
                return Ok(End::Complete);
            }
        }
    }
    match found || messages.end() == End::Cut {
        true => Ok(messages.end()),
        false => Err(named(&messages.without(RESULT))),
    }
}

/// Parses the stress of a count.
fn stress_MPa(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(MPa) if MPa != 0.0 && MPa.is_finite() => Ok(MPa),
        _ => Err("wanted a finite number of MPa other than 0".into()),
    }
}
