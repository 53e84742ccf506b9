//! Errors of the golden engine.

use super::orthogonal::OrthogonalError;
use crate::data::frame::FrameError;
use crate::data::input::InputError;
use crate::estimate::deviations::DeviationsError;
use crate::estimate::learned::LearnedError;
use crate::physics::matrices::MatricesError;
use crate::spec::partition::PartitionError;
use crate::spec::scene::SceneError;
use thiserror::Error;

/// A scene or frame cannot be reconstructed.
#[derive(Debug, Error)]
pub enum GoldenError {
    /// The scene asks for something this version does not implement.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The partition does not fit the array.
    #[error(transparent)]
    Partition(#[from] PartitionError),
    /// The matrices of a subarray cannot be computed or used.
    #[error(transparent)]
    Matrices(#[from] MatricesError),
    /// The matrices of Eq. 1 as printed cannot be computed.
    #[error(transparent)]
    Orthogonal(#[from] OrthogonalError),
    /// The frame is not of the scene's sensor, or not finite.
    #[error(transparent)]
    Frame(#[from] FrameError),
    /// A file named by the input options cannot be used, or the frames do not fit them.
    #[error(transparent)]
    Input(#[from] InputError),
    /// The network that the scene names cannot be used.
    #[error(transparent)]
    Learned(#[from] LearnedError),
    /// The table of standard deviations that the scene names cannot be used.
    #[error(transparent)]
    Deviations(#[from] DeviationsError),
    /// The stress is so large that its forces are not finite.
    #[error("frame {frame}: peak stress {peak_MPa:e} MPa gives forces beyond the range of numbers")]
    TooStrong {
        /// The frame's id.
        frame: String,
        /// Its largest |b|.
        peak_MPa: f64,
    },
}
