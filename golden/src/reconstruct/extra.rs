//! Extra: what a result holds beyond the contract's fields, left out of the JSON where there is nothing.
//!
//! | field | present with | holds |
//! |---|---|---|
//! | `taken` | `partition.case = "adaptive"` | the case taken and why, and why the finer ones were not |
//! | `regions` | `partition.case = "contacts"` | μ, centre, load and taxels of each contact |
//! | `truncation` | `search.form = "orthogonal"` | ‖x − w‖/‖w‖ of each subarray: what the series in μ leaves out |
//! | `unipolar` | `input.unipolar = true` | clipped and pulled taxels, evaluations, misfit |
//! | `resultants` | `output.forces = "resultants"` | force and centre of pressure per subarray or contact |
//! | `sweeps`, `converged` | `partition.case = "contacts"` | how the search over the regions went |

use super::output::Resultant;
use crate::float::contacts::Contacts;
use crate::frame::Forces;
use crate::input::unipolar::Unipolar;
use crate::sensor::Sensor;
use serde::{Deserialize, Serialize};

/// Additional fields of a result.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Extra {
    /// The case that `adaptive` took.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub taken: Option<CaseChoice>,
    /// The contacts of `contacts`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub regions: Option<Vec<Region>>,
    /// Sweeps over all regions.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sweeps: Option<usize>,
    /// Whether the last sweep moved no μ and no region.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub converged: Option<bool>,
    /// ‖x − w‖/‖w‖ of each subarray.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub truncation: Option<Vec<f64>>,
    /// How `input.unipolar` went.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unipolar: Option<Unipolar>,
    /// The forces of `output.forces = "resultants"`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub resultants: Option<Vec<Resultant>>,
}

/// A choice of case.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CaseChoice {
    /// The case, as a scene names it.
    pub case: String,
    /// Why it was taken.
    pub reason: String,
    /// The finer cases and why they were not taken.
    pub refused: Vec<RejectedCase>,
}

/// A case that was not taken.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RejectedCase {
    /// The case, as a scene names it.
    pub case: String,
    /// What stands against it.
    pub reason: String,
}

/// One contact.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Region {
    /// Whether the scene's condition for a search is met by the region's taxels.
    pub centroid_condition: bool,
    /// Ratio of shear to normal force, [x, y].
    pub mu: [f64; 2],
    /// The objective at μ, over the whole array; `None` where no search was made or none succeeded.
    pub objective_value: Option<f64>,
    /// Centre of the reported compressive forces in mm from the array's centre; `None` where there are none.
    pub centre_mm: Option<[f64; 2]>,
    /// Sum of the reported forces in N, [x, y, normal].
    pub load_N: [f64; 3],
    /// Indices of the region's taxels in the array, rising.
    pub taxels: Vec<usize>,
}

/// The regions of a frame, out of the solved contacts and the forces reported for them.
pub fn regions(sensor: &Sensor, contacts: &Contacts, met: &[bool], forces: &Forces) -> Vec<Region> {
    let region = |k: usize| {
        let taxels: Vec<usize> = (0..sensor.taxels()).filter(|&t| contacts.segments.labels[t] == k).collect();
        let sum = |axis: &[f64]| taxels.iter().map(|&t| axis[t]).sum();
        let (mut moment, mut weight) = ([0.0; 2], 0.0);
        for &taxel in &taxels {
            let at = sensor.position_mm(taxel / sensor.cols, taxel % sensor.cols);
            let fz = forces.fz[taxel].max(0.0);
            weight += fz;
            moment = [moment[0] + fz * at[0], moment[1] + fz * at[1]];
        }
        Region {
            centroid_condition: met[k],
            mu: contacts.mu(k),
            objective_value: contacts.found[k].map(|found| found.objective),
            centre_mm: (weight > 0.0).then(|| moment.map(|sum| sum / weight)),
            load_N: [sum(&forces.fx), sum(&forces.fy), sum(&forces.fz)],
            taxels,
        }
    };
    (0..contacts.segments.count).map(region).collect()
}
