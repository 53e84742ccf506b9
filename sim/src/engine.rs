//! The two models of a scene, built when they are first needed, for calls from other languages.
//!
//! | engine | model | kept |
//! |---|---|---|
//! | `golden` | floating point | for the scene |
//! | `fixed` | the integers of the hardware | for the scene if its codes do not depend on the frames, else for one call |

use std::str::FromStr;
use std::sync::{Arc, Mutex, PoisonError};

use anyhow::{bail, Error, Result};
use dermis_golden::data::frame::Frame;
use dermis_golden::estimate::float::Golden;
use dermis_golden::fixed::Model;
use dermis_golden::result::reconstruct::Reconstruction;
use dermis_golden::spec::scene::Scene;

/// Which model computes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Engine {
    /// Floating point.
    Golden,
    /// The integers of the hardware.
    Fixed,
}

impl FromStr for Engine {
    type Err = Error;

    fn from_str(name: &str) -> Result<Engine> {
        match name {
            "golden" => Ok(Engine::Golden),
            "fixed" => Ok(Engine::Fixed),
            _ => bail!("engine = {name:?} is not allowed; it must be \"golden\" or \"fixed\""),
        }
    }
}

/// The models of a scene, built once.
#[derive(Default)]
pub struct Models {
    golden: Mutex<Option<Arc<Golden>>>,
    fixed: Mutex<Option<Arc<Model>>>,
}

/// What reconstructs the frames of one call.
pub enum Ready {
    /// The floating-point model.
    Golden(Arc<Golden>),
    /// The bit-true model.
    Fixed(Arc<Model>),
}

/// The value kept, or a new one; `build` says whether the new one is to be kept.
fn kept<T>(place: &Mutex<Option<Arc<T>>>, build: impl FnOnce() -> Result<(T, bool)>) -> Result<Arc<T>> {
    let mut place = place.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(value) = place.as_ref() {
        return Ok(Arc::clone(value));
    }
    let (value, keep) = build()?;
    let value = Arc::new(value);
    if keep {
        *place = Some(Arc::clone(&value));
    }
    Ok(value)
}

impl Models {
    /// The scene's floating-point model.
    ///
    /// # Errors
    /// A scene that the model refuses.
    pub fn golden(&self, scene: &Scene) -> Result<Arc<Golden>> {
        kept(&self.golden, || Ok((Golden::new(scene)?, true)))
    }

    /// The scene's bit-true model for `frames`.
    ///
    /// # Errors
    /// A scene that the model refuses.
    pub fn fixed(&self, scene: &Scene, frames: &[Frame]) -> Result<Arc<Model>> {
        kept(&self.fixed, || {
            let model = Model::for_frames(scene, frames)?;
            // A scale that the scene does not state is that of these frames.
            let own = model.scene.input.full_scale_MPa == scene.input.full_scale_MPa;
            Ok((model, own))
        })
    }

    /// The model of an engine.
    ///
    /// # Errors
    /// As the model's.
    pub fn ready(&self, engine: Engine, scene: &Scene, frames: &[Frame]) -> Result<Ready> {
        Ok(match engine {
            Engine::Golden => Ready::Golden(self.golden(scene)?),
            Engine::Fixed => Ready::Fixed(self.fixed(scene, frames)?),
        })
    }
}

impl Ready {
    /// The result of the frames of one reconstruction; with `find_noise` as `dermis reconstruct` has it.
    ///
    /// # Errors
    /// Frames that the model refuses.
    pub fn reconstruct(&self, scene: &Scene, frames: &[Frame], find_noise: bool) -> Result<Reconstruction> {
        let (mut result, scene) = match self {
            Ready::Golden(golden) => (golden.run_averaged(frames)?, scene),
            Ready::Fixed(model) => (model.reconstruct_averaged(frames)?, &model.scene),
        };
        if find_noise {
            let stress = match self {
                Ready::Golden(golden) => golden.stress(frames)?,
                Ready::Fixed(model) => model.stress(frames)?,
            };
            result.find_noise(scene, &stress)?;
        }
        Ok(result)
    }
}
