//! What computes the forces of each patch: an engine that patches have in common, or a board.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use anyhow::{Context, Result};
use dermis_golden::engine::CheckedEngine;
use dermis_golden::fixed::Model;
use dermis_golden::spec::scene::Scene;
use dermis_host::engine::{EngineName, SharedEngine};
use dermis_host::link::{open_board, BoardEngine, Session};

use crate::patches::PatchFile;

/// Time without a board's answer after which a request is sent again.
const BOARD_TIMEOUT: Duration = Duration::from_millis(200);

/// An engine that several patches may have.
pub type PatchEngine = Arc<CheckedEngine<SharedEngine>>;

/// The engines of the patches; patches with the same scene and estimator have one.
pub struct Engines(Vec<PatchEngine>);

impl Engines {
    /// Builds them, one for each patch.
    ///
    /// # Errors
    /// A scene that its engine refuses, with the patch.
    pub fn build(file: &PatchFile) -> Result<Engines> {
        let mut built: BTreeMap<(String, Option<String>, EngineName), PatchEngine> = BTreeMap::new();
        let mut all = Vec::new();
        for (index, patch) in file.patches.iter().enumerate() {
            if let Some(port) = &patch.fields.board {
                let board = board(port, &patch.scene).with_context(|| format!("patch[{index}].board"))?;
                all.push(Arc::new(CheckedEngine::new(Box::new(board) as Box<SharedEngine>)));
                continue;
            }
            let key = (patch.path.clone(), patch.fields.estimator.clone(), patch.engine);
            let engine = match built.get(&key) {
                Some(engine) => Arc::clone(engine),
                None => dermis_host::engine::Engines::default()
                    .of_stream(patch.engine, &patch.scene)
                    .with_context(|| format!("patch[{index}].scene"))?,
            };
            all.push(Arc::clone(built.entry(key).or_insert(engine)));
        }
        Ok(Engines(all))
    }

    /// That of each patch, in the order of the file.
    pub fn each(&self) -> &[PatchEngine] {
        &self.0
    }
}

/// The board at a port, which was built for a scene.
fn board(port: &str, scene: &Scene) -> Result<BoardEngine> {
    let model = Model::new(scene)?;
    let board = open_board(port, &model, None, BOARD_TIMEOUT, "host")?;
    Ok(BoardEngine::new(Session::new(board, model, None, None, true, false)?))
}
