//! By subarray: each subarray of a partition on its own, with the μ that an objective finds for it.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: stress | n | MPa |
//! | out: forces, μ of each subarray | 3 × n, 2 per subarray | N, – |

use super::array::{Array, BySearch, EngineInput};
use super::error::GoldenError;
use super::estimator::Estimator;
use super::objective::{of_kind, Objective};
use crate::result::reconstruct::Reconstruction;
use crate::spec::partition::subarrays;
use crate::spec::scene::Scene;

/// The search by subarray.
struct BySubarray {
    objective: Box<dyn Objective + Send + Sync>,
    array: Array,
}

/// The search with the scene's objective.
///
/// # Errors
/// As [`Array::new`].
pub(super) fn new(scene: &Scene) -> Result<Box<dyn Estimator>, GoldenError> {
    let shape = subarrays(scene.partition.case, &scene.sensor)?[0].sensor(&scene.sensor);
    let objective = of_kind(scene.search.objective, &shape, scene.medium);
    Ok(Box::new(BySubarray { objective, array: Array::new(scene)? }))
}

impl Estimator for BySubarray {
    fn estimate(&self, input: &EngineInput) -> Reconstruction {
        input.finish(self.array.subarrays(input, self.array.whole(), &BySearch(&*self.objective)))
    }

    fn array(&self) -> Option<&Array> {
        Some(&self.array)
    }
}
