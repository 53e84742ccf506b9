//! Errors of a network and its training.

use crate::data::generator::GeneratorError;
use crate::write::FileError;
use thiserror::Error;

/// A network cannot be trained, read or used.
#[derive(Debug, Error)]
pub enum LearnedError {
    /// The scene names no network.
    #[error("scene {scene}: search.network is missing; an estimator with a network needs a file made by dermis train")]
    NoNetwork {
        /// The scene's name.
        scene: String,
    },
    /// The file cannot be read.
    #[error("{file}: search.network cannot be read: {source}; dermis train makes it")]
    Unreadable {
        /// Its path.
        file: String,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// The file is no network, or damaged.
    #[error("{file}: not a network of this version: {reason}")]
    Damaged {
        /// Its path.
        file: String,
        /// What is wrong.
        reason: String,
    },
    /// The network was trained for something else.
    #[error("{file}: trained for {field} = {trained}, the scene has {scene}; train it anew with dermis train")]
    Mismatch {
        /// Its path.
        file: String,
        /// The scene's field.
        field: &'static str,
        /// The value it was trained for.
        trained: String,
        /// The scene's value.
        scene: String,
    },
    /// An option of the training is out of range.
    #[error("training: {field} = {value} is not allowed; it must be {allowed}")]
    Option {
        /// Name of the option.
        field: &'static str,
        /// Its value.
        value: f64,
        /// The allowed values, in words.
        allowed: &'static str,
    },
    /// No frames can be drawn for the scene.
    #[error(transparent)]
    Frames(#[from] GeneratorError),
    /// Cz has no singular value decomposition.
    #[error("{sensor}: the singular value decomposition of Cz did not converge")]
    NotConverged {
        /// The window.
        sensor: String,
    },
    /// Weights or loss are not finite.
    #[error("training diverged at a rate of {rate}; take a smaller one")]
    Diverged {
        /// The rate.
        rate: f64,
    },
    /// The signature cannot be written.
    #[error("network file: {0}")]
    Encode(String),
    /// The file cannot be written.
    #[error(transparent)]
    File(#[from] FileError),
}
