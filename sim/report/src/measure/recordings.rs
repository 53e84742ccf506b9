//! Recordings: both models on the frames of imported recordings.
//!
//! All frames are reconstructed up to [`MOST_FRAMES`], beyond that as many at even distances. Times are the median over
//! these frames.

use std::time::Instant;

use anyhow::Result;
use dermis_golden::data::frame::Frame;
use dermis_golden::data::import::Imported;
use dermis_golden::data::reception::full_scale;
use dermis_golden::estimate::float::Golden;
use dermis_golden::fixed::{FixedError, Model};
use dermis_golden::result::reconstruct::Reconstruction;

use super::clock::clock;
use dermis_cosim::compare::{comparable_forces, difference, Difference};
use dermis_flow::jobs::Interrupt;
use dermis_golden::quantile::median;

/// Largest number of frames that are reconstructed.
pub const MOST_FRAMES: usize = 200;

/// The bit-true model on a recording.
pub struct RecordedFixed {
    /// Its result for every frame reconstructed.
    pub results: Vec<Reconstruction>,
    /// Difference from the golden model, for every frame.
    pub differences: Vec<Difference>,
    /// Name of its estimator.
    pub estimator: &'static str,
    /// Time of a frame on the CPU in s.
    pub seconds: f64,
    /// Cycles of the slowest frame.
    pub cycles: u64,
    /// Time of these cycles in s.
    pub hardware_seconds: f64,
}

/// A recording with the results of both models.
pub struct Recorded {
    /// The imported recording.
    pub imported: Imported,
    /// Indices of the frames reconstructed.
    pub chosen: Vec<usize>,
    /// The golden model's result for each of them.
    pub golden: Vec<Reconstruction>,
    /// Name of its estimator.
    pub estimator: &'static str,
    /// Time of a frame in s.
    pub seconds: f64,
    /// The bit-true model, or the reason why there is no hardware.
    pub fixed: Result<RecordedFixed, String>,
}

/// Runs both models on a recording.
///
/// # Errors
/// A scene or frame that a model refuses for another reason than hardware that is not available; an interruption.
pub fn recorded(imported: Imported, interrupt: &Interrupt) -> Result<Recorded> {
    let count = imported.frames.len();
    let chosen: Vec<usize> = match count {
        0..=MOST_FRAMES => (0..count).collect(),
        _ => (0..MOST_FRAMES).map(|k| k * (count - 1) / (MOST_FRAMES - 1)).collect(),
    };
    let frames: Vec<&Frame> = chosen.iter().map(|k| &imported.frames[*k]).collect();
    let engine = Golden::new(&imported.scene)?;
    let (golden, seconds) = timed(&frames, interrupt, |frame| Ok(engine.run(frame)?))?;
    let fixed = match Model::new(&imported.scene) {
        Ok(model) => Ok(fixed(&model, &frames, &golden, interrupt)?),
        Err(error @ (FixedError::DoesNotFit(_) | FixedError::Scene(_) | FixedError::Format { .. })) => {
            // The first line without the list of changes that it announces.
            let text = error.to_string();
            let line = text.lines().next().unwrap_or_default();
            Err(line.rsplit_once("; ").filter(|_| line.ends_with(':')).map_or(line, |(reason, _)| reason).to_owned())
        }
        Err(error) => return Err(error.into()),
    };
    let estimator = engine.estimator().name();
    Ok(Recorded { chosen, golden, estimator, seconds, fixed, imported })
}

fn fixed(model: &Model, frames: &[&Frame], golden: &[Reconstruction], interrupt: &Interrupt) -> Result<RecordedFixed> {
    let mut cycles = 0;
    let (results, seconds) = timed(frames, interrupt, |frame| {
        let trace = model.run(&model.readings(std::slice::from_ref(frame))?);
        cycles = cycles.max(trace.cycles.total);
        Ok(model.decode(std::slice::from_ref(frame), "fixed", &trace.beats, &trace.status)?)
    })?;
    let compared = golden.iter().zip(&results).zip(frames).map(|((golden, fixed), frame)| {
        let lsb_N = model.force_lsb_N(full_scale(&model.scene, frame));
        difference(&comparable_forces(golden), &comparable_forces(fixed), lsb_N)
    });
    let hardware_seconds = clock(&model.board, &model.scene).seconds(cycles);
    let (differences, estimator) = (compared.collect(), model.estimator().name());
    Ok(RecordedFixed { differences, results, estimator, seconds, cycles, hardware_seconds })
}

/// Runs a model on all frames: the results and the median time of a frame in s.
fn timed<R>(
    frames: &[&Frame],
    interrupt: &Interrupt,
    mut run: impl FnMut(&Frame) -> Result<R>,
) -> Result<(Vec<R>, f64)> {
    let (mut results, mut times) = (Vec::with_capacity(frames.len()), Vec::with_capacity(frames.len()));
    for frame in frames {
        interrupt.check()?;
        let start = Instant::now();
        results.push(run(frame)?);
        times.push(start.elapsed().as_secs_f64());
    }
    Ok((results, median(times).unwrap_or(f64::NAN)))
}
