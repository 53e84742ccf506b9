//! Contact track: a contact over the results of a stream.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A contact of a result and what the results before say of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ContactTrack {
    /// Its number in the stream, from 1: it stays while the contact moves.
    pub number: u64,
    /// Number of results since the first one with it, that one included.
    pub age: u64,
    /// Centre of pressure in mm from the array's centre.
    pub centre_mm: [f64; 2],
    /// How far the centre moves from one result to the next in mm, as a mean of the last ones.
    pub velocity_mm: [f64; 2],
    /// Whether a contact of the array moves, comes or goes, by the template of an adaptive mean; absent without one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub moving: Option<bool>,
    /// Shear over normal force.
    pub load_ratio: f64,
    /// Its standard deviation; absent where the estimator gives none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub load_ratio_sigma: Option<f64>,
    /// The largest load ratio before the contact last began to move: what is known of its friction. Absent before that, and without an
    /// adaptive mean.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub slip_ratio: Option<f64>,
}
