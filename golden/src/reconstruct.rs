//! Reconstruct: a result put together the same way for every engine, and the golden engine itself.
//!
//! [`Reconstruction`] serialises to the JSON of `dermis reconstruct --json`; forces are row-major over the whole array,
//! errors fractions with Eq. 3's sign, `null` where there is nothing.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: per subarray | condition, centroids, μ, objective | –, mm, –, bits |
//! | in: forces | 3 × taxels | N |
//! | out: resultant | 3 | N |
//! | out: error | 5 | fraction, where the frame has a resultant |

mod adaptive;
#[cfg(test)]
mod bonded_tests;
mod contacts;
mod extra;
mod golden;
mod output;
mod run;
#[cfg(test)]
mod tests;

pub use extra::{CaseChoice, Extra, Region, RejectedCase};
pub use golden::{Golden, GoldenError};
pub use output::Resultant;

use crate::errors::Errors;
use crate::flags::Flag;
use crate::frame::{Forces, Frame};
use crate::partition::Grid;
use crate::scene::Scene;
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;

/// What was found in one subarray.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SubarrayResult {
    /// First row in the array.
    pub row0: usize,
    /// First column in the array.
    pub col0: usize,
    /// Number of rows.
    pub rows: usize,
    /// Number of columns.
    pub cols: usize,
    /// Whether the scene's condition for a search is met.
    pub centroid_condition: bool,
    /// Centroid of the compressed taxels in mm from the array's centre.
    pub compression_centroid_mm: Option<[f64; 2]>,
    /// Centroid of the taxels in tension in mm from the array's centre.
    pub tension_centroid_mm: Option<[f64; 2]>,
    /// Ratio of shear to normal force, [x, y].
    pub mu: [f64; 2],
    /// The objective at μ, `None` where no search was made or none succeeded.
    pub objective_value: Option<f64>,
}

/// Everything found in one frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Reconstruction {
    /// The scene's name.
    pub scene: String,
    /// The frame's id.
    pub frame: String,
    /// `golden`, `fixed` or `rtl`.
    pub engine: String,
    /// Subarrays along rows and columns.
    pub case: Grid,
    /// One entry per subarray, row-major.
    pub subarrays: Vec<SubarrayResult>,
    /// Sum of the forces in N, [x, y, normal].
    pub resultant_N: [f64; 3],
    /// One force vector per taxel.
    pub forces_N: Forces,
    /// Errors against the frame's resultant, where it has one.
    pub error: Option<Errors>,
    /// Remarks, sorted, each once.
    pub flags: Vec<Flag>,
    /// What only some scenes ask for; its fields stand beside the others.
    #[serde(flatten)]
    pub extra: Extra,
}

/// Puts a result together: resultant, errors against the frame's truth, and the flags `no-contact` and
/// `condition-unmet`, which follow from the result; all others come in `flags`.
pub fn assemble(
    scene: &Scene,
    frame: &Frame,
    engine: &str,
    subarrays: Vec<SubarrayResult>,
    forces: Forces,
    flags: Vec<Flag>,
) -> Reconstruction {
    let resultant_N = forces.resultant();
    let mut flags: BTreeSet<Flag> = flags.into_iter().collect();
    if forces.fz.iter().all(|&fz| fz == 0.0) {
        flags.insert(Flag::NoContact);
    }
    if subarrays.iter().any(|subarray| !subarray.centroid_condition) {
        flags.insert(Flag::ConditionUnmet);
    }
    Reconstruction {
        scene: scene.name.clone(),
        frame: frame.id.clone(),
        engine: engine.to_string(),
        case: grid(&subarrays),
        resultant_N,
        error: frame.resultant_N.map(|truth| Errors::new(truth, resultant_N)),
        subarrays,
        forces_N: forces,
        flags: flags.into_iter().collect(),
        extra: Extra::default(),
    }
}

/// How many subarrays lie below and beside each other.
fn grid(subarrays: &[SubarrayResult]) -> Grid {
    let rows: BTreeSet<usize> = subarrays.iter().map(|subarray| subarray.row0).collect();
    let cols: BTreeSet<usize> = subarrays.iter().map(|subarray| subarray.col0).collect();
    Grid { rows: rows.len(), cols: cols.len() }
}
