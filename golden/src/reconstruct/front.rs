//! Front: what a user calls. Input options before the engine, output options after it.
//!
//! | option | here |
//! |---|---|
//! | `input.average` | [`Golden::run_averaged`]; [`Golden::run`] takes a frame that is averaged already |
//! | `input.calibration`, `input.tare` | readings to stress |
//! | `input.unipolar` | clipped taxels are estimated, [`crate::input::unipolar`] |
//! | `output.forces` | resultants in the place of forces per taxel |

use super::output::resultants;
use super::{Golden, GoldenError, Reconstruction};
use crate::frame::{Forces, Frame};
use crate::input::unipolar::estimate;
use crate::scene::ForceOutput;

impl Golden {
    /// Reconstructs one frame of readings.
    ///
    /// # Errors
    /// `Frame` when the frame is not the scene's, `TooStrong` when a force overflows.
    pub fn run(&self, frame: &Frame) -> Result<Reconstruction, GoldenError> {
        self.run_with_noise(frame, self.scene.search.noise_floor_MPa * self.scene.input.noise_share())
    }

    /// Reconstructs one frame whose noise the objective is told to have the deviation `noise_MPa`.
    ///
    /// # Errors
    /// As [`Golden::run`].
    pub fn run_with_noise(&self, frame: &Frame, noise_MPa: f64) -> Result<Reconstruction, GoldenError> {
        frame.check(&self.scene)?;
        let frame = self.input.calibrate(frame);
        let mut result = if self.scene.input.unipolar {
            let (mut result, report) =
                estimate(&self.scene, &frame, |frame, unknown| self.masked(unknown)?.engine(frame, noise_MPa))?;
            result.extra.unipolar = Some(report);
            result
        } else {
            self.engine(&frame, noise_MPa)?
        };
        if self.scene.output.forces == ForceOutput::Resultants {
            result.extra.resultants = Some(resultants(&self.scene.sensor, &result));
            result.forces_N = Forces::default();
        }
        Ok(result)
    }

    /// Averages 2^k frames, k the scene's `input.average`, and reconstructs their mean; the first one's truth stays.
    ///
    /// # Errors
    /// As [`Golden::run`]; `Input` when there are not 2^k frames.
    pub fn run_averaged(&self, frames: &[Frame]) -> Result<Reconstruction, GoldenError> {
        self.run(&self.input.average(&self.scene, frames)?)
    }

    /// The stress that [`Golden::run_averaged`] reconstructs: the calibrated mean of 2^k frames.
    ///
    /// # Errors
    /// `Input` when there are not 2^k frames or one is not the scene's.
    pub fn stress(&self, frames: &[Frame]) -> Result<Frame, GoldenError> {
        Ok(self.input.calibrate(&self.input.average(&self.scene, frames)?))
    }
}
