//! Checked engine: an engine whose results are cross-checked where that is wanted.

use super::cross_check::CrossCheck;
use super::{Engine, EngineError};
use crate::data::frame::Frame;
use crate::result::reconstruct::Reconstruction;
use std::sync::OnceLock;

/// An engine with the cross-check of its results, which is prepared when it is first wanted.
pub struct CheckedEngine<E: ?Sized> {
    engine: Box<E>,
    check: OnceLock<Option<CrossCheck>>,
}

impl<E: Engine + ?Sized> CheckedEngine<E> {
    /// The engine, its cross-check not yet prepared.
    pub fn new(engine: Box<E>) -> Self {
        CheckedEngine { engine, check: OnceLock::new() }
    }

    /// The engine.
    pub fn engine(&self) -> &E {
        &self.engine
    }

    /// The result of the frames of one reconstruction; with `cross_check` with what the estimator `evidence` says of the same
    /// frames, where the engine has another one. That takes longer than a search.
    ///
    /// ```
    /// use dermis_golden::engine::{CheckedEngine, Engine};
    /// use dermis_golden::{fixed::Model, estimate::float::Golden, data::frame::Frame, spec::scene::Scene};
    ///
    /// let scene = Scene::builtin("eight-by-eight")?;
    /// let frames = &Frame::shipped(&scene)[2..3];
    /// let engines: [Box<dyn Engine>; 2] = [Box::new(Golden::new(&scene)?), Box::new(Model::new(&scene)?)];
    /// let [golden, fixed] = engines.map(|engine| CheckedEngine::new(engine).result(frames, true));
    /// // The shear of the search differs from that of evidence by less than 10 %.
    /// let (golden, fixed) = (golden?, fixed?);
    /// assert!(golden.checks.tangential_difference.is_none() && fixed.checks.tangential_difference < Some(0.1));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// As [`Engine::reconstruct`].
    pub fn result(&self, frames: &[Frame], cross_check: bool) -> Result<Reconstruction, EngineError> {
        let mut result = self.engine.reconstruct(frames)?;
        if cross_check && let Some(check) = self.check.get_or_init(|| CrossCheck::of(&*self.engine)) {
            check.check(frames, result.resultant_N, &mut result.diagnostics());
        }
        Ok(result)
    }
}
