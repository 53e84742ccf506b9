//! What reconstructs frames, whichever it is: a model or a device.
//!
//! ```text
//! frames ── Engine ── (noise of a search, where it is not stated) ── result
//! ```
//!
//! [`result`] is the one way by which the programs and the interfaces to other languages get a result.

use crate::data::frame::Frame;
use crate::data::input::Input;
use crate::estimate::float::{Golden, GoldenError};
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

/// Reconstructs frames of one scene.
pub trait Engine {
    /// The scene, what was filled in included: the estimator, the full scale of the frames.
    fn scene(&self) -> &Scene;

    /// The scene's input options with their files.
    fn input(&self) -> &Input;

    /// The estimator that the engine computes.
    fn estimator(&self) -> EstimatorKind;

    /// The forces of the mean of 2^k frames, k the scene's `input.average`; with a sliding mean of all frames so far.
    ///
    /// # Errors
    /// [`EngineError`]: a number of frames other than 2^k, frames of another sensor, a device that fails.
    fn reconstruct(&self, frames: &[Frame]) -> Result<Reconstruction, EngineError>;

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

    fn reconstruct(&self, frames: &[Frame]) -> Result<Reconstruction, EngineError> {
        Ok(self.run_averaged(frames)?)
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

    fn reconstruct(&self, frames: &[Frame]) -> Result<Reconstruction, EngineError> {
        Ok(self.reconstruct_averaged(frames)?)
    }
}

/// Whether the noise of a frame is found where neither scene nor tare frames state it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FindNoise {
    /// As [`Reconstruction::find_noise`] does, which takes longer than a search.
    Yes,
    /// The result stays as the engine gives it.
    No,
}

impl From<bool> for FindNoise {
    fn from(find: bool) -> FindNoise {
        if find {
            FindNoise::Yes
        } else {
            FindNoise::No
        }
    }
}

/// The result of the frames of one reconstruction.
///
/// ```
/// use dermis_golden::engine::{result, Engine, FindNoise};
/// use dermis_golden::{fixed::Model, estimate::float::Golden, data::frame::Frame, spec::scene::Scene};
///
/// let scene = Scene::builtin("eight-by-eight")?;
/// let frames = &Frame::shipped(&scene)[..1];
/// let engines: [Box<dyn Engine>; 2] = [Box::new(Golden::reference(&scene)?), Box::new(Model::new(&scene)?)];
/// let [golden, fixed] = engines.map(|engine| result(&*engine, frames, FindNoise::No));
/// // The normal force differs by less than 0.1 %.
/// assert!((fixed?.resultant_N[2] / golden?.resultant_N[2] - 1.0).abs() < 1e-3);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// As [`Engine::reconstruct`].
pub fn result(engine: &dyn Engine, frames: &[Frame], find_noise: FindNoise) -> Result<Reconstruction, EngineError> {
    let mut result = engine.reconstruct(frames)?;
    if find_noise == FindNoise::Yes {
        result.find_noise(engine.scene(), engine.estimator(), engine.input(), &engine.stress(frames)?);
    }
    Ok(result)
}
