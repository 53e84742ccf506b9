//! Suspect taxel: one whose reading no force explains.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A taxel whose reading no force explains.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SuspectTaxel {
    /// Its row.
    pub row: usize,
    /// Its column.
    pub col: usize,
    /// Its reading in MPa.
    pub stress_MPa: f64,
    /// The stress in MPa that the other readings predict there.
    pub expected_MPa: f64,
}
