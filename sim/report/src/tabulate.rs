//! Error tables: each scene in each of the paper's cases on each frame, next to the figures of the paper.
//!
//! ```text
//! scene × case × frame -> golden ------> errors against truth, against case 0, per taxel --+
//!                      -> bit-true ----> errors, difference in LSB and % ------------------+--> ErrorRow
//! paper's Table 2 -------------------------------------------------------------------------+
//! ```
//!
//! | figure | unit |
//! |---|---|
//! | errors, ℓ2, paper | fractions; X1 X2 X3 signed as in Eq. 3 |
//! | difference | LSB of the force word, share of the largest force |
//!
//! ℓ2 = ‖f − f_ref‖/‖f_ref‖ over all taxels and components. The shears t_k of several contacts may cancel; for these
//! the error of the total shear is also given over Σ|t_k|, and for case `contacts` the error of each contact's shear,
//! ‖T_k − t_k‖/|t_k|, where T_k is the shear of the region with the nearest centre. The bit-true columns are empty
//! where the hardware does not support the case.

use anyhow::Result;
use dermis_golden::data::frame::{Contact, Forces, Frame};
use dermis_golden::data::reception::full_scale;
use dermis_golden::estimate::float::Golden;
use dermis_golden::fixed::Model;
use dermis_golden::result::errors::Errors;
use dermis_golden::result::flags::Flag;
use dermis_golden::result::reconstruct::{Reconstruction, Region};
use dermis_golden::spec::partition::{subarrays, Case, PartitionError};
use dermis_golden::spec::scene::Scene;
use dermis_study::paper::table_2;
use serde::Serialize;

use dermis_cosim::compare::{difference, Difference};

/// One subarray of a row.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SubarrayRow {
    /// Ratio of shear to normal force.
    pub mu: [f64; 2],
    /// Whether compression and tension both exceed the noise floor, the paper's condition.
    pub both_signs: bool,
    /// Whether the scene's condition for a search is met.
    pub condition: bool,
}

/// The bit-true model on one frame.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BitTrueErrors {
    /// Error against the true force.
    pub error: Option<Errors>,
    /// Difference from the floating-point result.
    pub difference: Difference,
}

/// One scene, case and frame.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ErrorRow {
    /// Scene name.
    pub scene: String,
    /// Case, as named in scene files.
    pub case: String,
    /// Frame name.
    pub frame: String,
    /// Error against the true force.
    pub error: Option<Errors>,
    /// Error against case 0 of the same frame, as in the paper for sensors 3 and 4.
    pub error_case_0: Option<Errors>,
    /// ℓ2 error over all taxels against the true forces.
    pub l2: Option<f64>,
    /// Number of contacts described in the frame.
    pub contacts: usize,
    /// ‖T − T_ref‖/Σ|t_k|: error of the total shear over the sum of the contacts' shears.
    #[serde(rename = "of_all")]
    pub shear_over_all: Option<f64>,
    /// For case `contacts`: the error of each contact's shear.
    #[serde(rename = "own")]
    pub contact_shears: Vec<f64>,
    /// The case that `adaptive` has chosen for this frame.
    #[serde(rename = "taken")]
    pub chosen_case: Option<String>,
    /// The subarrays, row-major.
    pub subarrays: Vec<SubarrayRow>,
    /// The bit-true model's errors, where the hardware supports the case.
    pub fixed: Option<BitTrueErrors>,
    /// X1 X2 X3 of this sensor and case in the paper's Table 2.
    pub paper: Option<[f64; 3]>,
    /// Flags of the golden result.
    pub flags: Vec<Flag>,
}

/// The number of the paper's sensor, if the scene is one of its four.
fn paper_sensor(scene: &Scene) -> Option<u32> {
    let number: u32 = scene.name.strip_prefix("sensor-")?.parse().ok()?;
    let builtin = Scene::builtin(&scene.name).ok()?;
    (builtin.sensor == scene.sensor).then_some(number)
}

/// All rows of one scene, case by case; cases that do not divide the array are skipped. Calls `progress` after each
/// row.
///
/// # Errors
/// A scene or frame that the golden model refuses.
pub fn tabulate(scene: &Scene, cases: &[Case], frames: &[Frame], progress: &mut dyn FnMut()) -> Result<Vec<ErrorRow>> {
    let mut rows = Vec::new();
    let mut case_0: Vec<Reconstruction> = Vec::new();
    for &case in cases {
        if matches!(subarrays(case, &scene.sensor), Err(PartitionError::NotDividing { .. })) {
            continue;
        }
        let mut scene = scene.clone().with_chosen_hardware();
        scene.partition.case = case;
        let golden = Golden::reference(&scene)?;
        // A case without hardware is not an error here: its columns stay empty.
        let model = Model::for_frames(&scene, frames).ok();
        for (index, frame) in frames.iter().enumerate() {
            let result = golden.run(frame)?;
            let fixed = model.as_ref().map(|model| bit_true(model, frame, &result)).transpose()?;
            rows.push(row(&scene, case, frame, &result, fixed, case_0.get(index)));
            if case == Case::WHOLE {
                case_0.push(result);
            }
            progress();
        }
    }
    Ok(rows)
}

fn bit_true(model: &Model, frame: &Frame, golden: &Reconstruction) -> Result<BitTrueErrors> {
    let result = model.reconstruct(frame)?;
    let lsb_N = model.force_lsb_N(full_scale(&model.scene, frame));
    Ok(BitTrueErrors { error: result.error, difference: difference(&golden.forces_N, &result.forces_N, lsb_N) })
}

fn row(
    scene: &Scene,
    case: Case,
    frame: &Frame,
    result: &Reconstruction,
    fixed: Option<BitTrueErrors>,
    case_0: Option<&Reconstruction>,
) -> ErrorRow {
    let parts = result.subarrays.iter().map(|part| SubarrayRow {
        mu: part.mu,
        both_signs: part.compression_centroid_mm.is_some() && part.tension_centroid_mm.is_some(),
        condition: part.centroid_condition,
    });
    ErrorRow {
        scene: scene.name.clone(),
        case: case.to_string(),
        frame: frame.id.clone(),
        error: result.error,
        error_case_0: case_0.map(|case_0| Errors::new(case_0.resultant_N, result.resultant_N)),
        l2: frame.cell_forces_N.as_ref().and_then(|truth| relative_l2(truth, &result.forces_N)),
        contacts: frame.contacts.len(),
        shear_over_all: shear_over_all(&frame.contacts, frame.resultant_N, result.resultant_N),
        contact_shears: result
            .extra
            .regions
            .as_ref()
            .map_or(Vec::new(), |regions| contact_shears(&frame.contacts, regions)),
        chosen_case: result.extra.taken.as_ref().map(|taken| taken.case.clone()),
        subarrays: parts.collect(),
        fixed,
        paper: paper_sensor(scene).and_then(|sensor| table_2(sensor, case)),
        flags: result.flags.clone(),
    }
}

/// ‖value − truth‖/‖truth‖; `None` if the true force is zero.
fn relative_l2(truth: &Forces, value: &Forces) -> Option<f64> {
    let pairs = [(&truth.fx, &value.fx), (&truth.fy, &value.fy), (&truth.fz, &value.fz)];
    let each = || pairs.iter().flat_map(|(truth, value)| truth.iter().zip(value.iter()));
    let off: f64 = each().map(|(truth, value)| (value - truth).powi(2)).sum();
    let size: f64 = each().map(|(truth, _)| truth.powi(2)).sum();
    (size > 0.0).then(|| (off / size).sqrt())
}

/// The error of the total shear over the sum of the contacts' shears; `None` if that is zero or a shear is unknown.
pub(crate) fn shear_over_all(contacts: &[Contact], truth: Option<[f64; 3]>, value: [f64; 3]) -> Option<f64> {
    let truth = truth?;
    let shears: Option<Vec<[f64; 2]>> = contacts.iter().map(|contact| contact.tangential_N).collect();
    let all: f64 = shears?.iter().map(|[x, y]| x.hypot(*y)).sum();
    (all > 0.0).then(|| (value[0] - truth[0]).hypot(value[1] - truth[1]) / all)
}

/// The error of each contact's shear; contacts without shear or centre are skipped.
pub(crate) fn contact_shears(contacts: &[Contact], regions: &[Region]) -> Vec<f64> {
    let error = |contact: &Contact| {
        let ([x, y], [tx, ty]) = (contact.centre_mm?, contact.tangential_N?);
        let far = |region: &Region| region.centre_mm.map_or(f64::INFINITY, |at| (at[0] - x).hypot(at[1] - y));
        let [fx, fy, _] = regions.iter().min_by(|a, b| far(a).total_cmp(&far(b)))?.load_N;
        Some((fx - tx).hypot(fy - ty) / tx.hypot(ty)).filter(|error| error.is_finite())
    };
    contacts.iter().filter_map(error).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn l2_by_hand() {
        let truth = Forces { fx: vec![0.0; 2], fy: vec![0.0; 2], fz: vec![3.0, 4.0] };
        let value = Forces { fz: vec![3.0, 3.0], ..truth.clone() };
        assert_eq!(relative_l2(&truth, &value), Some(0.2));
        assert_eq!(relative_l2(&Forces::zeros(2), &value), None);
    }

    #[test]
    fn shear_of_several_by_hand() {
        let contact = |x: f64, tangential_N: [f64; 2]| Contact {
            centre_mm: Some([x, 0.0]),
            tangential_N: Some(tangential_N),
            ..Contact::default()
        };
        let contacts = [contact(-5.0, [3.0, 0.0]), contact(5.0, [0.0, -1.0])];
        assert_eq!(shear_over_all(&contacts, Some([3.0, -1.0, 9.0]), [3.0, 1.0, 9.0]), Some(0.5));
        assert_eq!(shear_over_all(&[], Some([3.0, -1.0, 9.0]), [3.0, 1.0, 9.0]), None);
        let region = |x: f64, load_N: [f64; 3]| Region {
            centroid_condition: true,
            mu: [0.0; 2],
            mu_sigma: None,
            shear_sigma_N: None,
            objective_value: None,
            centre_mm: Some([x, 0.0]),
            load_N,
            taxel_count: 0,
            taxels: Vec::new(),
        };
        assert_eq!(
            contact_shears(&contacts, &[region(4.0, [0.0, -2.0, 5.0]), region(-6.0, [3.0, 1.5, 4.0])]),
            [0.5, 1.0]
        );
    }

    #[test]
    fn every_case_of_a_small_scene() {
        let scene = Scene::builtin("sensor-1").unwrap();
        let frames = &Frame::shipped(&scene)[..1];
        let mut done = 0;
        let cases = ["0", "1", "2", "3", "5x2", "3x3", "adaptive", "contacts"].map(|name| name.parse().unwrap());
        let rows = tabulate(&scene, &cases, frames, &mut || done += 1).unwrap();
        // Case 3x3 is skipped: 3 does not divide 10.
        assert_eq!((rows.len(), done), (7, 7));
        assert_eq!(rows.iter().map(|row| row.subarrays.len()).collect::<Vec<_>>(), [1, 4, 2, 2, 10, 1, 1]);
        // The hardware supports every case except `contacts`.
        assert!(rows.iter().all(|row| row.fixed.is_some() != (row.case == "contacts")));
        assert_eq!(rows[5].chosen_case.as_deref(), Some("0"));
        assert_eq!(rows.iter().map(|row| row.contact_shears.len()).collect::<Vec<_>>(), [0, 0, 0, 0, 0, 0, 1]);
        assert!(rows[6].contact_shears[0] < 0.05 && rows[0].error_case_0.is_none());
        assert!(rows[1].error_case_0.is_some());
        assert_eq!(rows[0].paper, Some([0.1284, 0.1293, 0.0754]));
    }
}
