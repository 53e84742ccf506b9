//! The trait of the estimators of the golden model.
//!
//! | name | file |
//! |---|---|
//! | `search` | `by_subarray` with an objective; with `adaptive` and `contacts` those of `adaptive` and `by_contacts` |
//! | `evidence`, `evidence+network`, `combined` | `by_evidence` |
//! | `network` | `by_network` |
//!
//! A new estimator is a file with an `impl Estimator`, its name in [`EstimatorKind`](crate::spec::scene::EstimatorKind), a row of
//! the table in `golden`, and what refuses it in `Scene::require_golden`.

use super::array::{Array, EngineInput};
use crate::estimate::evidence::LastFit;
use crate::result::reconstruct::Reconstruction;

/// Estimates forces from the stress of one frame.
pub(super) trait Estimator: Send + Sync {
    /// The forces of a frame after the threshold, with subarrays or contacts and their figures. Flags that hold for every
    /// estimator are not among them.
    fn estimate(&self, input: &EngineInput) -> Reconstruction;

    /// The same of a frame of a stream; `last` is what the frame before left, and then what this one leaves.
    fn estimate_after(&self, input: &EngineInput, _last: &mut Option<LastFit>) -> Reconstruction {
        self.estimate(input)
    }

    /// The matrices with which it computes, if it needs any.
    fn array(&self) -> Option<&Array> {
        None
    }

    /// What the estimator takes for readings of a unipolar array that are zero or less.
    fn clipped_readings(&self) -> Clipped {
        Clipped::Filled
    }
}

/// What is taken for readings that a unipolar array clips.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Clipped {
    /// They are used as they are, as upper bounds of the stress.
    AsRead,
    /// Zero.
    Zero,
    /// Tension that is estimated, see `unipolar`.
    Filled,
}
