//! Reconstruct: the result format that all engines share.
//!
//! [`Reconstruction`] serialises to the JSON of `dermis reconstruct --json`; forces are row-major over the whole array,
//! errors are fractions with the sign of Eq. 3, `null` where undefined.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: per subarray | condition, centroids, μ, objective | –, mm, –, bits |
//! | in: forces | 3 × taxels | N |
//! | out: resultant | 3 | N |
//! | out: wrench | 3, 3 | N, N mm |
//! | out: error | 5 | fraction, where the frame has a resultant |

mod change;
mod contact_estimate;
mod contact_track;
mod contacts;
mod diagnostics;
mod extra;
mod figures;
mod missing_taxel;
mod output;
mod pressure_template;
mod suspect_taxel;

pub(crate) use change::ForceChange;
pub use contact_estimate::ContactEstimate;
pub use contact_track::ContactTrack;
pub use contacts::FoundContact;
pub use diagnostics::Diagnostics;
pub(crate) use extra::shear_spread_of;
pub use extra::{CaseChoice, Extra, Region, RejectedCase, Unipolar};
pub use missing_taxel::MissingTaxel;
pub use output::{shear_sigma_N, Resultant, Wrench};
pub use pressure_template::PressureTemplate;
pub use suspect_taxel::SuspectTaxel;

use crate::data::frame::{Forces, Frame};
use crate::data::reception::SubarrayStats;
use crate::result::checks::Checks;
use crate::result::errors::Errors;
use crate::result::flags::Flag;
use crate::spec::partition::{Grid, Subarray};
use crate::spec::plain_text::json_schema;
use crate::spec::scene::Scene;
use crate::spec::sensor::Sensor;
use schemars::generate::SchemaSettings;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;

/// Result of one subarray.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
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
    /// Ratio of shear to normal force, [x, y]; 0 if not searched.
    pub mu: [f64; 2],
    /// Standard deviation of μ, [x, y]; absent where the estimator gives none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mu_sigma: Option<[f64; 2]>,
    /// Standard deviation of the shear in N, [x, y]; absent where the estimator gives none, see [`shear_sigma_N`].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shear_sigma_N: Option<[f64; 2]>,
    /// Standard deviation of the normal force in N; absent where the estimator gives none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub normal_sigma_N: Option<f64>,
    /// The objective at μ; `None` if no search was made or no candidate was admissible.
    pub objective_value: Option<f64>,
}

/// The result for one frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Reconstruction {
    /// The scene's name.
    pub scene: String,
    /// The frame's id.
    pub frame: String,
    /// The engine: `golden`, `fixed` or `rtl`.
    pub engine: String,
    /// Subarrays along rows and columns.
    pub case: Grid,
    /// One entry per subarray, row-major.
    pub subarrays: Vec<SubarrayResult>,
    /// Sum of the forces in N, [x, y, normal].
    pub resultant_N: [f64; 3],
    /// One force vector per taxel in N; empty with `output.forces = "resultants"`.
    pub forces_N: Forces,
    /// Errors relative to the frame's known resultant; `None` if it has none.
    pub error: Option<Errors>,
    /// Limitations of the result, sorted, without duplicates.
    pub flags: Vec<Flag>,
    /// The figures behind the flags.
    #[serde(default)]
    pub checks: Checks,
    /// Fields that only some scenes have; in JSON they are at the same level as the others.
    #[serde(flatten)]
    pub extra: Extra,
}

impl Reconstruction {
    /// JSON schema of a result as `dermis reconstruct --json` writes it.
    pub fn json_schema() -> serde_json::Value {
        json_schema::<Reconstruction>(SchemaSettings::default().for_serialize())
    }
}

/// Assembles a result: adds the resultant, standard deviations of the shear of subarrays, the errors relative to the frame's
/// known resultant, and the flags `no-contact` and `condition-unmet`; `flags` are all others.
pub fn assemble(
    scene: &Scene,
    frame: &Frame,
    engine: &str,
    mut subarrays: Vec<SubarrayResult>,
    forces: Forces,
    flags: Vec<Flag>,
) -> Reconstruction {
    let (resultant_N, wrench) = (forces.resultant(), Wrench::of(&scene.sensor, &forces));
    if !forces.fz.is_empty() {
        for own in &mut subarrays {
            let normal_N = own.part().indices(&scene.sensor).map(|k| forces.fz[k]).sum();
            own.shear_sigma_N = shear_sigma_N(own.mu_sigma, normal_N);
        }
    }
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
        checks: Checks::default(),
        extra: Extra { wrench, ..Extra::default() },
    }
}

impl Reconstruction {
    /// The result with resultants in place of its forces: one per region if it has regions, else one per subarray.
    pub(crate) fn with_resultants(mut self, sensor: &Sensor) -> Reconstruction {
        let resultants = match &self.extra.regions {
            Some(regions) => regions.iter().map(Region::resultant).collect(),
            None => {
                let of = |own: &SubarrayResult| Resultant::of(sensor, &self.forces_N, own.part().indices(sensor));
                self.subarrays.iter().map(of).collect()
            }
        };
        self.extra.resultants = Some(resultants);
        self.forces_N = Forces::default();
        self
    }

    /// Its figures, flags and suspect taxels.
    pub fn diagnostics(&mut self) -> Diagnostics<'_> {
        Diagnostics { checks: &mut self.checks, flags: &mut self.flags, suspects: &mut self.extra.suspects }
    }

    /// Adds the taxels without a reading: `frame` is the calibrated mean of `readings`.
    pub(crate) fn add_missing(&mut self, scene: &Scene, frame: &Frame, readings: &[Frame]) {
        self.extra.missing = MissingTaxel::all(scene, frame, readings);
    }

    /// Adds the figures of `checks` and the flags that they raise.
    pub(crate) fn add_checks(&mut self, scene: &Scene, checks: Checks) {
        self.diagnostics().add_checks(scene, checks);
    }
}

impl SubarrayResult {
    /// The array as one subarray that is not searched, whose regions have a μ each; its own is the ratio of the resultants.
    pub(crate) fn of_regions(part: &Subarray, received: &SubarrayStats, [x, y, normal]: [f64; 3]) -> Self {
        let mu = if normal > 0.0 { [x / normal, y / normal] } else { [0.0; 2] };
        SubarrayResult::new(part, received, mu, None)
    }

    /// The result of subarray `part`.
    pub(crate) fn new(part: &Subarray, received: &SubarrayStats, mu: [f64; 2], objective_value: Option<f64>) -> Self {
        SubarrayResult {
            row0: part.row0,
            col0: part.col0,
            rows: part.rows,
            cols: part.cols,
            centroid_condition: received.condition_met,
            compression_centroid_mm: received.compression_centroid_mm,
            tension_centroid_mm: received.tension_centroid_mm,
            mu,
            mu_sigma: None,
            shear_sigma_N: None,
            normal_sigma_N: None,
            objective_value,
        }
    }

    /// The subarray.
    pub fn part(&self) -> Subarray {
        Subarray { row0: self.row0, col0: self.col0, rows: self.rows, cols: self.cols }
    }
}

/// Number of subarrays along rows and columns.
fn grid(subarrays: &[SubarrayResult]) -> Grid {
    let rows: BTreeSet<usize> = subarrays.iter().map(|subarray| subarray.row0).collect();
    let cols: BTreeSet<usize> = subarrays.iter().map(|subarray| subarray.col0).collect();
    Grid { rows: rows.len(), cols: cols.len() }
}
