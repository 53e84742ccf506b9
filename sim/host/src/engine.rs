//! Engines by name, built for a scene, and the one way to their results.
//!
//! | name | engine |
//! |---|---|
//! | `golden` | floating point |
//! | `fixed` | the integers of the hardware |
//! | `rtl` | the generated Verilog, under Verilator |

use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};

use anyhow::{anyhow, bail, Error, Result};
use clap::ValueEnum;
use dermis_golden::data::frame::Frame;
use dermis_golden::engine::{CheckedEngine, Engine, EngineError};
use dermis_golden::estimate::float::Golden;
use dermis_golden::fixed::Model;
use dermis_golden::result::reconstruct::Reconstruction;
use dermis_golden::spec::scene::Scene;

use dermis_cosim::device_error::DeviceError;
use dermis_cosim::hardware::Hardware;

/// Name of an engine.
#[derive(ValueEnum, Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum EngineName {
    /// The floating-point model.
    Golden,
    /// The bit-true integer model.
    Fixed,
    /// The generated Verilog, under Verilator.
    Rtl,
}

/// An engine that several threads may use.
pub type SharedEngine = dyn Engine + Send + Sync;

impl EngineName {
    /// The engines that are software.
    pub const SOFTWARE: [EngineName; 2] = [EngineName::Golden, EngineName::Fixed];

    /// The software engine of this name.
    ///
    /// # Errors
    /// Another name.
    pub fn software(name: &str) -> Result<EngineName> {
        match EngineName::from_str(name, false) {
            Ok(engine) if EngineName::SOFTWARE.contains(&engine) => Ok(engine),
            _ => bail!("engine = {name:?} is not allowed; it must be \"golden\" or \"fixed\""),
        }
    }

    /// The engine of a scene for any frames, or for `frames`, whose largest stress is then the full scale of integers if the
    /// scene needs one and states none. Simulations are built in the folder `build`.
    ///
    /// # Errors
    /// A scene that the engine refuses, no Verilator.
    pub fn engine(self, scene: &Scene, frames: Option<&[Frame]>, build: &Path) -> Result<Box<dyn Engine>> {
        let model = || frames.map_or_else(|| Model::new(scene), |frames| Model::for_frames(scene, frames));
        Ok(match self {
            EngineName::Golden => Box::new(Golden::new(scene)?),
            EngineName::Fixed => Box::new(model()?),
            EngineName::Rtl => Box::new(Hardware::new(model()?, build)?),
        })
    }
}

/// The result of the frames of one reconstruction: [`CheckedEngine::result`], with errors by their own types.
///
/// # Errors
/// As [`Engine::reconstruct`].
pub fn result<E: Engine + ?Sized>(
    engine: &CheckedEngine<E>,
    frames: &[Frame],
    cross_check: bool,
) -> Result<Reconstruction> {
    engine.result(frames, cross_check).map_err(typed)
}

/// An engine's error by its own type, from which exit codes and exceptions follow.
pub fn typed(error: EngineError) -> Error {
    match error {
        EngineError::Golden(error) => error.into(),
        EngineError::Fixed(error) => error.into(),
        EngineError::Device(error) => match error.downcast::<DeviceError>() {
            Ok(error) => error.into_inner(),
            Err(error) => anyhow!(error),
        },
    }
}

/// The software engines of a scene for calls from other languages, each built when it is first needed.
#[derive(Default)]
pub struct Engines {
    golden: Cache,
    fixed: Cache,
}

/// An engine that serves later calls too.
type Cache = Mutex<Option<Arc<CheckedEngine<SharedEngine>>>>;

/// The engine there is, or a new one; `build` says whether the new one serves later calls too.
fn cached(
    cache: &Cache,
    build: impl FnOnce() -> Result<(Box<SharedEngine>, bool)>,
) -> Result<Arc<CheckedEngine<SharedEngine>>> {
    let mut cache = cache.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(engine) = cache.as_ref() {
        return Ok(Arc::clone(engine));
    }
    let (engine, serves_all) = build()?;
    let engine = Arc::new(CheckedEngine::new(engine));
    *cache = serves_all.then(|| Arc::clone(&engine));
    Ok(engine)
}

impl Engines {
    /// A software engine of a scene for `frames`. The bit-true model is built for each call unless the scene states the full
    /// scale, or needs none.
    ///
    /// # Errors
    /// A scene that the engine refuses, an engine that is not software.
    pub fn engine(
        &self,
        name: EngineName,
        scene: &Scene,
        frames: &[Frame],
    ) -> Result<Arc<CheckedEngine<SharedEngine>>> {
        match name {
            EngineName::Golden => cached(&self.golden, || Ok((Box::new(Golden::new(scene)?), true))),
            EngineName::Fixed => cached(&self.fixed, || {
                let model = Model::for_frames(scene, frames)?;
                let of_scene = model.scene.input.full_scale_MPa == scene.input.full_scale_MPa;
                Ok((Box::new(model), of_scene))
            }),
            EngineName::Rtl => bail!("engine = \"rtl\" is not allowed; it must be \"golden\" or \"fixed\""),
        }
    }

    /// A software engine of a scene for frames that are not known yet.
    ///
    /// # Errors
    /// As [`Engines::engine`]; the bit-true model of a scene that needs a full scale and states none.
    pub fn of_stream(&self, name: EngineName, scene: &Scene) -> Result<Arc<CheckedEngine<SharedEngine>>> {
        match name {
            EngineName::Fixed => cached(&self.fixed, || Ok((Box::new(Model::new(scene)?), true))),
            _ => self.engine(name, scene, &[]),
        }
    }
}
