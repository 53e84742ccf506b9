//! Input: from the readings of a real sensor to the stress a frame stands for.
//!
//! ```text
//! 2^k frames ── average ── calibrate ── (unipolar: tension for clipped readings) ── stress ── engine ── forces
//!                          b = gain · (reading − zero),  zero = the tare frame, else the table's offset
//! ```
//!
//! | `[input]` | meaning |
//! |---|---|
//! | `average = k` | 2^k frames are averaged into one; the extra bits stay |
//! | `calibration = "table.csv"` | offset and gain of each taxel, [`calibration`] |
//! | `tare = "zero.json"` | a frame read without contact, in the readings' unit |
//! | `dead = [[row, col], …]` | taxels left out of the inverse, [`crate::matrices::Matrices::without`], whatever they read |
//! | `unipolar = true` | a reading of zero or less says only that the stress is not above it, [`unipolar`] |
//!
//! Files are found beside the scene's. The truth of a frame is carried along unchanged.

pub mod calibration;
#[cfg(test)]
mod tests;
pub mod unipolar;

use crate::frame::{Frame, FrameError};
use crate::scene::{InputSpec, Scene};
use calibration::{Calibration, CalibrationError};
use thiserror::Error;

/// A scene's input options, ready for frames.
#[derive(Clone, Debug, PartialEq)]
pub struct Input {
    frames: usize,
    /// Zero and gain of each taxel, where the scene has a table or a tare frame.
    scale: Option<(Vec<f64>, Vec<f64>)>,
    spec: InputSpec,
}

/// Input options or frames that cannot be used.
#[derive(Debug, Error)]
pub enum InputError {
    /// The calibration table.
    #[error(transparent)]
    Calibration(#[from] CalibrationError),
    /// The tare frame, or a frame to average.
    #[error(transparent)]
    Frame(#[from] FrameError),
    /// Not as many frames as are averaged.
    #[error("scene {scene}: input.average = {average} takes {wanted} frames at a time, got {got}")]
    Count {
        /// The scene's name.
        scene: String,
        /// k.
        average: u32,
        /// 2^k.
        wanted: usize,
        /// Frames given.
        got: usize,
    },
}

impl Input {
    /// Reads the files the scene names.
    ///
    /// # Errors
    /// A table or tare frame that cannot be read or does not fit the sensor.
    pub fn new(scene: &Scene) -> Result<Input, InputError> {
        let spec = &scene.input;
        let (frames, spec) = (1 << spec.average, spec.clone());
        let table = spec.calibration.as_ref().map(|path| Calibration::load(path, &scene.sensor)).transpose()?;
        let tare = match &spec.tare {
            None => None,
            Some(path) => {
                let frame = Frame::load(path, Some(scene))?;
                frame.check(scene)?;
                Some(frame.stress_MPa)
            }
        };
        if table.is_none() && tare.is_none() {
            return Ok(Input { frames, scale: None, spec });
        }
        let Calibration { offset, gain } = table.unwrap_or_else(|| Calibration::identity(scene.sensor.taxels()));
        Ok(Input { frames, scale: Some((tare.unwrap_or(offset), gain)), spec })
    }

    /// Frames that make one, 2^k.
    pub fn frames(&self) -> usize {
        self.frames
    }

    /// The mean of frames, each checked against the scene; the first one's id and truth stay.
    ///
    /// # Errors
    /// [`InputError::Count`] unless there are 2^k of them, `Frame` when one is not the scene's.
    pub fn average(&self, scene: &Scene, frames: &[Frame]) -> Result<Frame, InputError> {
        let [first, ..] = frames else { return Err(self.miscounted(scene, 0)) };
        if frames.len() != self.frames {
            return Err(self.miscounted(scene, frames.len()));
        }
        frames.iter().try_for_each(|frame| frame.check(scene))?;
        let mut mean = first.clone();
        for (index, b) in mean.stress_MPa.iter_mut().enumerate() {
            // Divided first, so that the sum stays in range.
            *b = frames.iter().map(|frame| frame.stress_MPa[index] / frames.len() as f64).sum();
        }
        Ok(mean)
    }

    fn miscounted(&self, scene: &Scene, got: usize) -> InputError {
        let average = self.frames.trailing_zeros();
        InputError::Count { scene: scene.name.clone(), average, wanted: self.frames, got }
    }

    /// Readings to stress; without table and tare frame they are the same. Dead taxels read 0.
    pub fn calibrate(&self, frame: &Frame) -> Frame {
        let mut frame = frame.clone();
        if let Some((zero, gain)) = &self.scale {
            for (b, (zero, gain)) in frame.stress_MPa.iter_mut().zip(zero.iter().zip(gain)) {
                *b = gain * (*b - zero);
            }
        }
        self.spec.mask_dead(frame)
    }
}
