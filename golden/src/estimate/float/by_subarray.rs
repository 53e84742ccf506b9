//! By subarray: each subarray of a partition on its own, with the μ that an objective finds for it.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: stress | n | MPa |
//! | out: forces, μ of each subarray | 3 × n, 2 per subarray | N, – |

use super::array::{Array, EngineInput};
use super::estimator::Estimator;
use super::objective::{of_kind, Objective};
use crate::result::reconstruct::Reconstruction;
use crate::spec::partition::{subarrays, PartitionError};
use crate::spec::scene::Scene;

/// The search by subarray.
struct BySubarray(Box<dyn Objective + Send + Sync>);

/// The search with the scene's objective.
///
/// # Errors
/// [`PartitionError`] if the partition does not fit the array.
pub(super) fn new(scene: &Scene) -> Result<Box<dyn Estimator>, PartitionError> {
    let shape = subarrays(scene.partition.case, &scene.sensor)?[0].sensor(&scene.sensor);
    Ok(Box::new(BySubarray(of_kind(scene.search.objective, &shape, scene.medium))))
}

impl Estimator for BySubarray {
    fn estimate(&self, array: &Array, input: &EngineInput) -> Reconstruction {
        array.finish(input.frame, array.subarrays(input, array.whole(), &*self.0))
    }
}
