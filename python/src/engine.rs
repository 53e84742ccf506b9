//! The two models of a scene, built when they are first needed.
//!
//! | engine | model | kept |
//! |---|---|---|
//! | `golden` | floating point | for the scene |
//! | `fixed` | the integers of the hardware | for the scene if its codes do not depend on the frames, else for one call |

use std::str::FromStr;
use std::sync::{Arc, Mutex, PoisonError};

use dermis_golden::fixed::Model;
use dermis_golden::float::Golden;
use dermis_golden::frame::Frame;
use dermis_golden::reconstruct::Reconstruction;
use dermis_golden::scene::Scene;
use pyo3::PyErr;

use crate::exceptions::{fixed, input, not_allowed};

/// Which model computes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Engine {
    /// Floating point.
    Golden,
    /// The integers of the hardware.
    Fixed,
}

impl FromStr for Engine {
    type Err = PyErr;

    fn from_str(name: &str) -> Result<Engine, PyErr> {
        match name {
            "golden" => Ok(Engine::Golden),
            "fixed" => Ok(Engine::Fixed),
            _ => Err(not_allowed("engine", format!("{name:?}"), "\"golden\" or \"fixed\"")),
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
fn kept<T>(place: &Mutex<Option<Arc<T>>>, build: impl FnOnce() -> Result<(T, bool), PyErr>) -> Result<Arc<T>, PyErr> {
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
    /// `InputError` if the model refuses the scene.
    pub fn golden(&self, scene: &Scene) -> Result<Arc<Golden>, PyErr> {
        kept(&self.golden, || Ok((Golden::new(scene).map_err(input)?, true)))
    }

    /// The scene's bit-true model for `frames`.
    ///
    /// # Errors
    /// `InputError` if the model refuses the scene.
    pub fn fixed(&self, scene: &Scene, frames: &[Frame]) -> Result<Arc<Model>, PyErr> {
        kept(&self.fixed, || {
            let model = Model::for_frames(scene, frames).map_err(fixed)?;
            // A scale that the scene does not state is that of these frames.
            let own = model.scene.input.full_scale_MPa == scene.input.full_scale_MPa;
            Ok((model, own))
        })
    }

    /// The model of an engine.
    ///
    /// # Errors
    /// As the model's.
    pub fn ready(&self, engine: Engine, scene: &Scene, frames: &[Frame]) -> Result<Ready, PyErr> {
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
    /// `InputError` for frames that the model refuses.
    pub fn reconstruct(&self, scene: &Scene, frames: &[Frame], find_noise: bool) -> Result<Reconstruction, PyErr> {
        let (mut result, scene) = match self {
            Ready::Golden(golden) => (golden.run_averaged(frames).map_err(input)?, scene),
            Ready::Fixed(model) => (model.reconstruct_averaged(frames).map_err(fixed)?, &model.scene),
        };
        if find_noise {
            let stress = match self {
                Ready::Golden(golden) => golden.stress(frames).map_err(input)?,
                Ready::Fixed(model) => model.stress(frames).map_err(fixed)?,
            };
            result.find_noise(scene, &stress).map_err(input)?;
        }
        Ok(result)
    }
}
