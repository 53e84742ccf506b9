//! Pressure template: whether the pressure of the frames before explains how readings change.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The pressure that is remembered, and how well changes of its forces alone explain those of the readings.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PressureTemplate {
    /// Whether it holds: the forces are those of the longest mean, changed by what the newest frames show.
    pub held: bool,
    /// What changed forces leave of the change of the readings, χ² over its degrees of freedom, as a mean of the last frames: 1 for
    /// noise alone, more where a contact moves.
    pub residual: f64,
}
