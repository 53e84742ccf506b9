//! `dermis check --stream`: the noise of a device from frames without load, written into the scene's file.

use std::io::BufReader;
use std::path::Path;

use anyhow::{anyhow, bail, ensure, Context, Result};
use clap::{value_parser, Args};
use dermis_flow::say;
use dermis_golden::data::input::unloaded::noise_MPa;
use dermis_golden::data::input::Input;
use dermis_golden::data::text::Decoded;
use dermis_golden::spec::scene::{Scene, SearchSpec};

use super::layout::LayoutArguments;
use super::reconstruct_stream::open;
use super::scene_file::{has_file, state, Measured};
use dermis_flow::progress::Progress;
use dermis_host::stream::line::{self, Piece};
use dermis_host::stream::Source;

/// Digits of the noise that is written.
const DIGITS: i32 = 3;

/// Options of the measurement.
#[derive(Args, Debug)]
pub(super) struct NoiseArguments {
    /// Measure the noise from frames of the device while nothing presses, and write it into the scene's file: from standard
    /// input, or from =udp:HOST:PORT, a serial port, or a file.
    #[arg(long, value_name = "SOURCE", num_args = 0..=1, require_equals = true, default_missing_value = "-")]
    stream: Option<Source>,
    /// Frames to measure.
    #[arg(long, value_name = "N", default_value_t = 200, requires = "stream", value_parser = value_parser!(u32).range(8..=100_000))]
    frames: u32,
    /// Bit rate of a serial port; default: that of the scene's board.
    #[arg(long, value_name = "BIT/S", requires = "stream")]
    baud: Option<u32>,
    #[command(flatten)]
    layout: LayoutArguments,
}

impl NoiseArguments {
    /// Measures the noise where a stream is named, and writes it into the file of the scene, which is `target`; a built-in
    /// scene stays as it is. Says what it did on standard error.
    ///
    /// # Errors
    /// A source that fails or ends too early, a line without a frame, frames in which something presses, a file that cannot be
    /// written.
    pub(super) fn measure(&self, target: &str, scene: Scene) -> Result<Scene> {
        let Some(source) = &self.stream else { return Ok(scene) };
        let (input, name) = open(source, &scene, self.baud)?;
        let bar = Progress::steps(&format!("{}: frames without load", scene.name), u64::from(self.frames));
        let (mut input, mut bytes) = (BufReader::new(Decoded::new(input)), Vec::new());
        let (mut frames, wanted) = (Vec::new(), self.frames as usize);
        let mut lines = line::Frames::new(&scene.sensor, self.layout.stated());
        for number in 1.. {
            if frames.len() >= wanted {
                break;
            }
            let piece = line::read(&mut input, &mut bytes).with_context(|| name.clone())?;
            let brought = match piece {
                None => lines.finish(),
                Some(Piece::Line) if bytes.iter().all(u8::is_ascii_whitespace) => continue,
                Some(Piece::Line) => lines.push(&bytes, number),
                // What waits comes with the end.
                Some(Piece::Open) => continue,
                Some(piece) => bail!("{name}: line {number}: {}", piece.refusal().unwrap_or_default()),
            };
            if let Some(note) = lines.note() {
                bar.say(&format!("{name}: {note}"));
            }
            for (number, read) in brought {
                frames.push(read.map_err(|none| anyhow!("{name}: line {number}: {}", none.reason))?.frame);
            }
            bar.set(frames.len().min(wanted) as u64);
            let ended = piece.is_none() && frames.len() < wanted;
            ensure!(!ended, "{name}: ends after {} of {wanted} frames (--frames)", frames.len());
        }
        frames.truncate(wanted);
        drop(bar);
        let found = noise_MPa(&scene, &Input::new(&scene)?, &frames).map_err(|error| anyhow!("{name}: {error}"))?;
        let noise_MPa = rounded(found);
        let stated = format!("noise_floor_MPa = {noise_MPa:?}");
        let measured = format!("measured from {} frames without load", frames.len());
        if has_file(target) {
            state(Path::new(target), &[Measured::new("search", "noise_floor_MPa", noise_MPa, &measured)])?;
            say!("{target}: {stated}, {measured}, is written");
        } else {
            say!("{target}: {measured}: [search] {stated}; a built-in scene has no file to write it into");
        }
        Ok(Scene { search: SearchSpec { noise_floor_MPa: Some(noise_MPa), ..scene.search.clone() }, ..scene })
    }
}

/// With the digits that are written.
fn rounded(noise_MPa: f64) -> f64 {
    let unit = 10f64.powi(noise_MPa.log10().floor() as i32 + 1 - DIGITS);
    let text = format!("{:e}", (noise_MPa / unit).round() * unit);
    // Without the digits that binary rounding adds.
    format!("{:.*e}", DIGITS as usize - 1, text.parse().unwrap_or(noise_MPa)).parse().unwrap_or(noise_MPa)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_is_rounded_to_the_digits_that_are_written() {
        assert_eq!([1.23456e-4, 9.996e-4, 0.5].map(rounded), [1.23e-4, 1e-3, 0.5]);
    }
}
