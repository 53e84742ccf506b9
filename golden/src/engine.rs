//! What reconstructs frames, whichever it is: a model or a device.
//!
//! ```text
//! frames ─┬─ Engine ────── result ──┬─ result with all figures and flags
//!         └─ cross-check, history ──┘
//! ```
//!
//! [`CheckedEngine`] gives the result of a frame, [`StreamChecks`] checks those of a stream: the programs and the interfaces to
//! other languages have one of the two.

mod checked_engine;
mod cross_check;
mod stream_checks;
#[cfg(test)]
mod tests;
mod tracks;

pub use checked_engine::CheckedEngine;
pub use cross_check::{CrossCheck, Finding};
pub use stream_checks::{CheckPace, StreamChecks};

use crate::data::frame::Frame;
use crate::data::input::Input;
use crate::estimate::float::{Golden, GoldenError, Past};
use crate::fixed::stages::prepare::Prepared;
use crate::fixed::{FixedError, Model};
use crate::result::reconstruct::Reconstruction;
use crate::spec::scene::{EstimatorKind, Scene};
use std::error::Error;
use thiserror::Error;

/// An engine cannot reconstruct frames.
#[derive(Debug, Error)]
pub enum EngineError {
    /// The floating-point model refuses the frames.
    #[error(transparent)]
    Golden(#[from] GoldenError),
    /// The bit-true model refuses the frames, or the words of a device are not complete.
    #[error(transparent)]
    Fixed(#[from] FixedError),
    /// A simulation or a board fails.
    #[error(transparent)]
    Device(Box<dyn Error + Send + Sync>),
}

/// What an engine has of the frames of a stream so far; the default is that after a reset.
#[derive(Clone, Debug, Default)]
pub struct State {
    /// What they leave to the floating-point model.
    past: Past,
    /// The state of the hardware, for its bit-true model.
    prepared: Option<Prepared>,
    /// Whether there were frames.
    begun: bool,
}

impl State {
    /// Whether there were frames since the reset.
    pub fn has_begun(&self) -> bool {
        self.begun
    }
}

/// Reconstructs frames of one scene.
pub trait Engine {
    /// The scene, what was filled in included: the estimator, the full scale of the frames.
    fn scene(&self) -> &Scene;

    /// The scene's input options with their files.
    fn input(&self) -> &Input;

    /// The estimator that the engine computes.
    fn estimator(&self) -> EstimatorKind;

    /// The forces of the mean of 2^k frames, k the scene's `input.average`; with a mean that slides of all frames so far. Where
    /// zeros run, the frames are all since a reset, and the mean is of the last 2^k.
    ///
    /// # Errors
    /// [`EngineError`]: a number of frames other than 2^k, frames of another sensor, a device that fails.
    fn reconstruct(&self, frames: &[Frame]) -> Result<Reconstruction, EngineError> {
        self.reconstruct_after(&mut State::default(), frames)
    }

    /// The same where frames came before, of which `state` is; it is then that after these frames.
    ///
    /// # Errors
    /// As [`Engine::reconstruct`]; a device that begins with a reset.
    fn reconstruct_after(&self, state: &mut State, frames: &[Frame]) -> Result<Reconstruction, EngineError>;

    /// The stress in MPa of which [`Engine::reconstruct`] gives the forces: the calibrated mean of the frames.
    ///
    /// # Errors
    /// [`EngineError`]: a number of frames other than 2^k, or frames of another sensor.
    fn stress(&self, frames: &[Frame]) -> Result<Frame, EngineError> {
        let mean = self.input().average(self.scene(), frames).map_err(GoldenError::from)?;
        Ok(self.input().calibrate(&mean))
    }
}

impl Engine for Golden {
    fn scene(&self) -> &Scene {
        Golden::scene(self)
    }

    fn input(&self) -> &Input {
        Golden::input(self)
    }

    fn estimator(&self) -> EstimatorKind {
        Golden::estimator(self)
    }

    fn reconstruct_after(&self, state: &mut State, frames: &[Frame]) -> Result<Reconstruction, EngineError> {
        Ok(self.run_after(&mut state.past, frames)?)
    }
}

impl Engine for Model {
    fn scene(&self) -> &Scene {
        &self.scene
    }

    fn input(&self) -> &Input {
        Model::input(self)
    }

    fn estimator(&self) -> EstimatorKind {
        Model::estimator(self)
    }

    fn reconstruct_after(&self, state: &mut State, frames: &[Frame]) -> Result<Reconstruction, EngineError> {
        let prepared = state.prepared.get_or_insert_with(|| self.prepare.empty());
        Ok(Model::reconstruct_after(self, &mut state.past.memory, prepared, frames)?)
    }
}
