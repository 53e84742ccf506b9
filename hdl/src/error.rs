//! Why a scene has no hardware.

use dermis_golden::wire::link::LinkError;
use thiserror::Error;

use crate::language::KernelError;

/// Why no hardware can be generated from a model.
#[derive(Debug, Error)]
pub enum HdlError {
    /// There is no hardware of this kind for the scene.
    #[error("{field} = {value}: {what} is not available yet")]
    Unsupported {
        /// Field of the scene.
        field: &'static str,
        /// Its value.
        value: String,
        /// The hardware that would be needed.
        what: &'static str,
    },
    /// The scene's link cannot be built.
    #[error(transparent)]
    Link(#[from] LinkError),
    /// A block's kernel is not sound; a defect of this crate.
    #[error("internal: {0}")]
    Kernel(#[from] KernelError),
    /// The description is not consistent; a defect of this crate.
    #[error("internal: the hardware description does not pass its checks: {0}")]
    Check(String),
}
