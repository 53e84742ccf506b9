//! Contact estimate: a contact with the standard deviations and the covariance that `evidence` gives.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A contact as the estimator `evidence` found it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ContactEstimate {
    /// Centre of pressure in mm from the array's centre.
    pub centre_mm: [f64; 2],
    /// Ratio of shear to normal force, [x, y].
    pub mu: [f64; 2],
    /// Force in N, [x, y, normal].
    pub force_N: [f64; 3],
    /// Standard deviation of the force in N, [x, y, normal].
    pub sigma_N: [f64; 3],
    /// Covariance of μ, [xx, xy, yy].
    pub mu_covariance: [f64; 3],
}
