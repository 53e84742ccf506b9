//! Errors of simulations and boards on their way through an [`EngineError`], which keeps their types.

use anyhow::Error;
use dermis_golden::engine::EngineError;

/// An error of a simulation or a board.
#[derive(Debug, thiserror::Error)]
#[error(transparent)]
pub struct DeviceError(#[from] Error);

impl DeviceError {
    /// The error itself.
    pub fn into_inner(self) -> Error {
        self.0
    }
}

/// The error of a simulation or a board as one of its engine.
pub fn device_error(error: Error) -> EngineError {
    EngineError::Device(Box::new(DeviceError(error)))
}
