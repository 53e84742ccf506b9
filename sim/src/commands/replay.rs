//! `dermis replay`: the frames or the results of a recording, line by line.

use std::io::{copy, ErrorKind, Write};
use std::path::PathBuf;

use anyhow::{anyhow, bail, Result};
use clap::Args;

use crate::recording::{Lines, Messages, Pace, RESULT};

/// Arguments of `dermis replay`.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  dermis replay press.mcap | dermis reconstruct sensor-1 --stream >again.ndjson
  dermis replay press.mcap --real-time
  dermis replay press.mcap --rate 100 | dermis live sensor-1 --stream
  dermis replay press.mcap --results

Frames are read from the channel /dermis/stress, a sensor_msgs/msg/Image of 64FC1 or 32FC1, and written as lines
{\"stress_MPa\": [0.1, ...]}. dermis reconstruct --stream --record makes such a file.")]
pub struct Arguments {
    /// MCAP file without compression.
    #[arg(value_name = "FILE.mcap")]
    file: PathBuf,
    /// Write the recorded lines of results instead, as they were written.
    #[arg(long, conflicts_with_all = ["rate", "real_time"])]
    results: bool,
    /// Write so many frames per second; default: as fast as they are read.
    #[arg(long, value_name = "N", conflicts_with = "real_time")]
    rate: Option<f64>,
    /// Write frames as far apart as they were received.
    #[arg(long)]
    real_time: bool,
}

/// Runs the command; the text is empty.
///
/// # Errors
/// A file that is no recording or ends early, with its name; what stands before that is written.
pub fn run(arguments: &Arguments) -> Result<String> {
    let Arguments { file, results, rate, real_time } = arguments;
    let pace = match rate {
        Some(rate) if rate.is_finite() && *rate > 0.0 => Pace::Rate(*rate),
        Some(rate) => bail!("--rate = {rate} is not allowed: above 0"),
        None if *real_time => Pace::Recorded,
        None => Pace::Unbounded,
    };
    let named = |error: anyhow::Error| anyhow!("{}: {error}", file.display());
    let mut output = std::io::stdout().lock();
    let written = match results {
        true => write_results(Messages::open(file).map_err(named)?, &mut output),
        false => {
            let mut lines = Lines::open(file.clone(), None, pace, false).map_err(named)?;
            copy(&mut lines, &mut output).map(drop).map_err(anyhow::Error::from)
        }
    };
    let closed = |error: &anyhow::Error| {
        error.downcast_ref::<std::io::Error>().is_some_and(|error| error.kind() == ErrorKind::BrokenPipe)
    };
    if let Err(error) = written {
        if !closed(&error) {
            return Err(named(error));
        }
    }
    Ok(String::new())
}

fn write_results(mut messages: Messages, output: &mut dyn Write) -> Result<()> {
    let mut found = false;
    while let Some(message) = messages.next_message()? {
        if message.topic == RESULT {
            found = true;
            output.write_all(&message.data)?;
            output.write_all(b"\n")?;
        }
    }
    if !found {
        bail!("has no message of channel {RESULT}; its channels: {}", messages.channels());
    }
    Ok(())
}
