//! `dermis generate --press`: the frames of a press with their times and known forces.
//!
//! | file | holds |
//! |---|---|
//! | lines | JSON as `dermis reconstruct --stream` takes it: `id`, `time_ns`, `resultant_N`, `stress_MPa` |
//! | `.mcap` | the frames as `--record` writes them, and the known force on [`KNOWN_FORCE`] |

use std::path::Path;

use anyhow::{anyhow, Result};
use clap::Args;
use dermis_golden::data::frame::Frame;
use dermis_golden::data::generator::draws::DrawOptions;
use dermis_golden::data::generator::presses::{Motion, Press};
use dermis_golden::data::recording::message::{Image, Message, Wrench, WrenchStamped};
use dermis_golden::data::recording::{frame_messages, Kind, RecordingError, RecordingFile, Stamp};
use dermis_golden::spec::scene::Scene;
use dermis_golden::write::write;
use serde_json::json;

use super::noise::motion;
use dermis_flow::progress::Progress;
use dermis_host::recording::{header, FRAME_ID};

/// Channel of the known force.
const KNOWN_FORCE: &str = "/dermis/known_force";
/// Nanoseconds of a second.
const SECOND_NS: f64 = 1e9;

/// Options of a press.
#[derive(Args, Clone, Debug)]
pub struct PressArguments {
    /// Draw one contact that does this: hold, ramp, slide, roll, turn, step, oscillation, jump, second or release; write a frame for
    /// each moment.
    #[arg(long, value_name = "MOTION", value_parser = motion)]
    press: Option<Motion>,
    /// Frames per second of a press.
    #[arg(long, value_name = "HZ", default_value_t = 1000.0, requires = "press")]
    rate: f64,
    /// Seconds of a press.
    #[arg(long, value_name = "S", default_value_t = 0.8, requires = "press")]
    duration: f64,
    /// Speed of a slide in mm/s; a roll has a quarter of it.
    #[arg(long, value_name = "MM_S", default_value_t = 20.0, requires = "press")]
    speed: f64,
}

impl PressArguments {
    /// What the contact does, if a press is wanted.
    pub(super) fn motion(&self) -> Option<Motion> {
        self.press
    }

    /// The press with this motion.
    ///
    /// # Errors
    /// A rate or duration that gives no number of frames.
    pub(super) fn press(&self, motion: Motion, draw: DrawOptions) -> Result<Press> {
        let frames = (self.rate * self.duration).round();
        if !(1.0..=1e6).contains(&frames) {
            let Self { rate, duration, .. } = self;
            return Err(anyhow!("--rate {rate} --duration {duration}: their product must be from 1 to 1000000 frames"));
        }
        // Both ends are frames.
        Ok(Press { motion, frames: frames as usize + 1, rate_Hz: self.rate, speed_mm_s: self.speed, draw })
    }
}

/// Writes press number `number` to a file, a recording if its name ends in `.mcap`; returns the lines without one.
///
/// # Errors
/// A press that cannot be drawn, a file that cannot be written.
pub(super) fn run(scene: &Scene, press: &Press, number: u64, out: Option<&Path>) -> Result<String> {
    let _progress = Progress::start(&format!("{}: {} frames", scene.name, press.frames));
    let frames = press.frames(scene, number)?;
    let time_ns = |k: usize| (SECOND_NS * k as f64 / press.rate_Hz).round() as i64;
    let line = |(k, frame): (usize, &Frame)| {
        let Frame { id, resultant_N, stress_MPa, .. } = frame;
        json!({"id": id, "time_ns": time_ns(k), "resultant_N": resultant_N, "stress_MPa": stress_MPa}).to_string()
            + "\n"
    };
    let Some(path) = out else { return Ok(frames.iter().enumerate().map(line).collect()) };
    match path.extension().is_some_and(|own| own.eq_ignore_ascii_case("mcap")) {
        true => record(path, scene, &frames, time_ns).map_err(|error| anyhow!("{}: {error}", path.display()))?,
        false => write(path, frames.iter().enumerate().map(line).collect::<String>().as_bytes())?,
    }
    Ok(format!("{} ({} frames at {} Hz)\n", path.display(), frames.len(), press.rate_Hz))
}

/// Writes a recording.
fn record(path: &Path, scene: &Scene, frames: &[Frame], time_ns: impl Fn(usize) -> i64) -> Result<(), RecordingError> {
    let mut file = RecordingFile::create(path)?;
    for (k, frame) in frames.iter().enumerate() {
        let ns = time_ns(k);
        let stamp = Stamp { sequence: k as u64, logged: ns as u64 };
        let header = header(FRAME_ID, ns);
        for (topic, bytes) in frame_messages([scene.sensor.rows, scene.sensor.cols], &header, &frame.stress_MPa)? {
            file.message(topic, Kind::of::<Image>(), stamp, &bytes)?;
        }
        let wrench = Wrench { force: frame.resultant_N.unwrap_or_default(), torque: [0.0; 3] };
        let bytes = WrenchStamped { header, wrench }.to_cdr().map_err(RecordingError::new)?;
        file.message(KNOWN_FORCE, Kind::of::<WrenchStamped>(), stamp, &bytes)?;
    }
    file.finish()
}
