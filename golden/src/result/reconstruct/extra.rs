//! Extra: optional fields of a result; absent ones are left out of the JSON.
//!
//! | field | present with | holds |
//! |---|---|---|
//! | `taken` | `partition.case = "adaptive"` | the chosen case, the reason, and why finer ones were rejected |
//! | `regions` | `partition.case = "contacts"` | μ, centre, load and taxels of each contact |
//! | `truncation` | `search.form = "orthogonal"` | ‖x − w‖/‖w‖ of each subarray: truncation error of the series in μ |
//! | `unipolar` | `input.unipolar = true` | clipped and filled taxels, evaluations, misfit |
//! | `resultants` | `output.forces = "resultants"` | force and centre of pressure per subarray or contact |
//! | `wrench` | a force per taxel, or a record for each contact | force and moment of the whole array |
//! | `tracks` | a stream | number, age, place, velocity and load ratio of each contact |
//! | `contacts` | `search.estimator = "evidence"` | centre, μ, force and standard deviation of each contact |
//! | `suspects` | `search.estimator = "evidence"`, flag `taxel-suspect` | row, column, reading and expected stress of taxels taken as missing |
//! | `missing` | flag `taxel-missing` | row, column, frames and stress of taxels without a reading |
//! | `mean_frames` | `input.mean = "sliding"`, `"adaptive"` | number of frames that the mean holds |
//! | `lag_frames`, `template` | `input.mean = "adaptive"` | age of what the forces follow; whether the remembered pressure holds |
//! | `tables_version` | `hardware.tables = "writable"` | version of the tables of the hardware, 0 for those of the bitstream |
//! | `sweeps`, `converged` | `partition.case = "contacts"` | convergence of the search over the regions |

use super::contact_estimate::ContactEstimate;
use super::contact_track::ContactTrack;
use super::missing_taxel::MissingTaxel;
use super::output::{shear_sigma_N, Resultant, Wrench};
use super::pressure_template::PressureTemplate;
use super::suspect_taxel::SuspectTaxel;
use crate::data::frame::Forces;
use crate::result::checks::{largest_spread, relative_spread};
use crate::spec::sensor::Sensor;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Optional fields of a result.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct Extra {
    /// The case that `adaptive` chose.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub taken: Option<CaseChoice>,
    /// The regions of `contacts`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub regions: Option<Vec<Region>>,
    /// The contacts of the estimator `evidence`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub contacts: Option<Vec<ContactEstimate>>,
    /// The contacts over the results of a stream.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub tracks: Vec<ContactTrack>,
    /// Number of sweeps over all regions.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sweeps: Option<usize>,
    /// Whether the last sweep changed no μ and no region.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub converged: Option<bool>,
    /// Truncation error ‖x − w‖/‖w‖ of each subarray, a fraction.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub truncation: Option<Vec<f64>>,
    /// Statistics of the tension estimated for `input.unipolar`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unipolar: Option<Unipolar>,
    /// Number of frames that a sliding mean holds: as many of equal weight have its noise.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mean_frames: Option<usize>,
    /// Mean age in frames of the readings that the forces follow, with an adaptive mean: their lag where they change evenly.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lag_frames: Option<f64>,
    /// The remembered pressure of an adaptive mean.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub template: Option<PressureTemplate>,
    /// Version of the tables of the hardware; 0 is that of the bitstream's, and of tables that are not whole.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tables_version: Option<u16>,
    /// The forces of `output.forces = "resultants"`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub resultants: Option<Vec<Resultant>>,
    /// Force and moment of the whole array; `None` where a device sends sums of subarrays, which do not have the moments.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub wrench: Option<Wrench>,
    /// Taxels whose readings no force explains; the estimate takes them as missing.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub suspects: Vec<SuspectTaxel>,
    /// Live taxels without a reading in a frame.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub missing: Vec<MissingTaxel>,
}

/// Statistics of the estimated tension.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Unipolar {
    /// Number of readings of zero or less.
    pub clipped: usize,
    /// Number of clipped readings for which tension was estimated.
    pub pulled: usize,
    /// Number of candidates for μ, over all subarrays.
    pub evaluations: usize,
    /// Root mean square difference of the known readings and the stress of the compressive forces, relative to the
    /// peak.
    pub misfit: f64,
}

/// The choice of a case for one frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct CaseChoice {
    /// The case, as a scene names it.
    pub case: String,
    /// Why it was chosen.
    pub reason: String,
    /// The finer cases and why they were rejected.
    pub refused: Vec<RejectedCase>,
}

/// A rejected case.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RejectedCase {
    /// The case, as a scene names it.
    pub case: String,
    /// Why it was rejected.
    pub reason: String,
}

impl Region {
    /// A region with these taxels, ascending, and their `forces`; nothing is known of its μ.
    pub(crate) fn of_taxels(sensor: &Sensor, forces: &Forces, taxels: Vec<usize>) -> Region {
        let own = Resultant::of(sensor, forces, taxels.iter().copied());
        Region { taxel_count: taxels.len(), taxels, ..Region::of_resultant(own) }
    }

    /// A region with this force; nothing is known of its μ and its taxels.
    pub(crate) fn of_resultant(Resultant { force_N, centre_mm }: Resultant) -> Region {
        Region {
            centroid_condition: false,
            mu: [0.0; 2],
            mu_sigma: None,
            shear_sigma_N: None,
            objective_value: None,
            centre_mm,
            load_N: force_N,
            taxel_count: 0,
            taxels: Vec::new(),
        }
    }

    /// The force of the region.
    pub(crate) fn resultant(&self) -> Resultant {
        Resultant { force_N: self.load_N, centre_mm: self.centre_mm }
    }

    /// The region with this standard deviation of μ, and that of the shear which follows from it.
    pub(crate) fn with_sigma(self, mu_sigma: Option<[f64; 2]>) -> Region {
        Region { mu_sigma, shear_sigma_N: shear_sigma_N(mu_sigma, self.load_N[2]), ..self }
    }
}

/// Standard deviation of the shear over its size, the largest of all regions with a share of the load, from that of μ.
pub(crate) fn shear_spread_of(regions: &[Region]) -> Option<f64> {
    let spread =
        |region: &Region| (region.load_N[2], region.mu_sigma.map(|sigma| relative_spread(region.mu, sigma, 1.0)));
    largest_spread(&regions.iter().map(spread).collect::<Vec<_>>())
}

/// One contact and its region.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Region {
    /// Whether the region's taxels meet the scene's condition for a search.
    pub centroid_condition: bool,
    /// Ratio of shear to normal force, [x, y]; 0 if not searched.
    pub mu: [f64; 2],
    /// Standard deviation of μ, [x, y]; absent where the estimator gives none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mu_sigma: Option<[f64; 2]>,
    /// Standard deviation of the shear in N, [x, y]; absent where the estimator gives none, see
    /// [`shear_sigma_N`](super::shear_sigma_N).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shear_sigma_N: Option<[f64; 2]>,
    /// The objective at μ over the whole array; `None` if no search was made or no candidate was admissible.
    pub objective_value: Option<f64>,
    /// Centre of the reported compressive forces in mm from the array's centre; `None` if there are none.
    pub centre_mm: Option<[f64; 2]>,
    /// Sum of the reported forces in N, [x, y, normal].
    pub load_N: [f64; 3],
    /// Number of the region's taxels.
    #[serde(default)]
    pub taxel_count: usize,
    /// Row-major indices in the array of the region's taxels, ascending; empty where a device sends a record for each contact.
    pub taxels: Vec<usize>,
}
