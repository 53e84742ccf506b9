//! Adaptive: chooses the paper's case that comes nearest to the contacts, among those in which no boundary cuts a
//! contact and every loaded subarray meets the condition.
//!
//! Cases 1, 2, 3 and 0 are tried in this order, as far as they divide the array and the scene lists them. The contacts
//! are those of `float::contacts`. The cells of a contact are those with at least 5 % of its largest force; a boundary
//! between them cuts the contact. The stress of a contact extends up to 1.5 h beyond its rim, and a neighbouring
//! subarray would take it for a load of its own. A single contact, which case 0 solves best, therefore needs that
//! distance from a boundary; several contacts do not. Case 0 has no boundary and is always possible.
//!
//! More subarrays are not always better: each is a smaller array that sees the load of its neighbours as its own. The
//! case with the smallest
//!
//! ```text
//! |T_case − T_contacts|        T: shear over the whole array
//! ```
//!
//! is chosen, of equal ones the finest. On 120 fresh frames of two to four contacts (`dermis table sensor-3 --fresh 120
//! --contacts 2 --contacts 3 --contacts 4 --case adaptive`, and 0 to 3) its median e_t is 32 %, that of the best single
//! case 40 %. Choosing the finest admissible case instead gave 43 %.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: contacts and their forces | n, 3 × n | –, N |
//! | in: per case, `receive` of its subarrays | parts | – |
//! | out: reason for rejecting the case | text | – |

use super::array::{Array, BySearch, CaseOutcome, EngineInput};
use super::by_contacts::taxels;
use super::contacts::SolvedContacts;
use super::error::GoldenError;
use super::estimator::Estimator;
use super::objective::taxels::Taxels;
use super::objective::Sparse;
use crate::data::frame::Forces;
use crate::data::reception::SubarrayStats;
use crate::estimate::segment::{segment, Segments, WIDTH};
use crate::result::reconstruct::{CaseChoice, Reconstruction, RejectedCase};
use crate::spec::partition::{Case, Subarray};
use crate::spec::scene::Scene;
use crate::spec::sensor::Sensor;

/// Fraction of a contact's largest force from which a cell is part of it.
const CELL_SHARE: f64 = 0.05;
/// Smallest distance of a boundary from the cells of a single contact, in units of the thickness.
const LONE_CLEARANCE: f64 = 1.5;

/// Bounding rectangle of the cells of one contact.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Extent {
    /// Left and right end in mm from the array's centre.
    pub x: [f64; 2],
    /// Upper and lower end in mm.
    pub y: [f64; 2],
}

/// The bounding rectangles of all contacts.
fn extents(sensor: &Sensor, p: &[f64], segments: &Segments) -> Vec<Extent> {
    let extent = |region: usize| {
        let own = || segments.taxels(region);
        let largest = own().map(|k| p[k]).fold(0.0, f64::max);
        let empty = Extent { x: [f64::INFINITY, f64::NEG_INFINITY], y: [f64::INFINITY, f64::NEG_INFINITY] };
        own().filter(|&k| largest > 0.0 && p[k] >= CELL_SHARE * largest).fold(empty, |extent, k| {
            let at = sensor.position_mm(k / sensor.cols, k % sensor.cols);
            let wider =
                |[low, high]: [f64; 2], at: f64, pitch: f64| [low.min(at - pitch / 2.0), high.max(at + pitch / 2.0)];
            Extent { x: wider(extent.x, at[0], sensor.pitch_x_mm), y: wider(extent.y, at[1], sensor.pitch_y_mm) }
        })
    };
    (0..segments.count).map(extent).collect()
}

/// The reason for rejecting a case; `None` if it is admissible.
fn rejection_reason(
    sensor: &Sensor,
    parts: &[Subarray],
    received: &[SubarrayStats],
    contacts: &[Extent],
) -> Option<String> {
    if let [_] = parts {
        return None;
    }
    for (part, received) in parts.iter().zip(received) {
        if received.loaded && !received.condition_met {
            let Subarray { row0, col0, .. } = part;
            return Some(format!(
                "the subarray at row {row0}, column {col0} is loaded and does not meet the condition"
            ));
        }
    }
    let clearance = if contacts.len() > 1 { 0.0 } else { LONE_CLEARANCE * sensor.thickness_mm };
    let edge = |first: usize, count: usize, pitch: f64| (first as f64 - count as f64 / 2.0) * pitch;
    for part in parts {
        let x = (part.col0 > 0).then(|| edge(part.col0, sensor.cols, sensor.pitch_x_mm));
        let y = (part.row0 > 0).then(|| edge(part.row0, sensor.rows, sensor.pitch_y_mm));
        for (k, contact) in contacts.iter().enumerate() {
            for (name, edge, [low, high]) in [("x", x, contact.x), ("y", y, contact.y)] {
                if let Some(edge) = edge.filter(|edge| low - clearance < *edge && *edge < high + clearance) {
                    return Some(format!(
                        "the boundary {name} = {edge} mm cuts contact {k}, from {low} to {high} mm, or comes closer than \
                         {clearance} mm"
));
                }
            }
        }
    }
    None
}

/// Distance between the shear resultants of two sets of forces, in N.
fn shear_distance(a: &Forces, b: &Forces) -> f64 {
    let ([ax, ay, _], [bx, by, _]) = (a.resultant(), b.resultant());
    (ax - bx).hypot(ay - by)
}

/// The reason for rejecting a case that is not the nearest to the contacts.
fn not_nearest_reason(off: f64) -> String {
    format!("its shear is {off:.3} N from that of the contacts: another case is nearer, or finer and as near")
}

/// The search in the case that fits the contacts; `taxels` for fits of ellipses.
struct Adaptive {
    taxels: Option<Taxels>,
    array: Array,
}

/// The adaptive search of a scene.
///
/// # Errors
/// As [`Array::new`].
pub(super) fn new(scene: &Scene) -> Result<Box<dyn Estimator>, GoldenError> {
    Ok(Box::new(Adaptive { taxels: taxels(scene), array: Array::new(scene)? }))
}

impl Estimator for Adaptive {
    /// Solves all admissible cases and returns the one whose shear is nearest to that of the contacts.
    fn estimate(&self, input: &EngineInput) -> Reconstruction {
        let (array, sensor) = (&self.array, &input.scene.sensor);
        let whole = array.subarrays(input, array.whole(), &BySearch(&Sparse::default()));
        let solved = array.find_contacts(self.taxels.as_ref(), input);
        let target = solved.as_ref().map(SolvedContacts::forces);
        let contacts = match &solved {
            Some(contacts) if contacts.segments.count > 1 => extents(sensor, &contacts.p, &contacts.segments),
            _ => extents(sensor, &whole.forces.fz, &segment(sensor, &whole.forces.fz, WIDTH)),
        };
        let off = |outcome: &CaseOutcome| target.as_ref().map_or(0.0, |target| shear_distance(target, &outcome.forces));
        let nothing = "nothing finer is as near to the contacts".to_string();
        let mut refused: Vec<(Case, String)> = Vec::new();
        let mut best = (off(&whole), Case::WHOLE, whole, nothing);
        for tiling in array.tilings.iter().rev().filter(|tiling| tiling.case != Case::WHOLE) {
            let received: Vec<SubarrayStats> = tiling.parts.iter().map(|part| input.receive(part)).collect();
            if let Some(reason) = rejection_reason(sensor, &tiling.parts, &received, &contacts) {
                refused.push((tiling.case, reason));
                continue;
            }
            let outcome = array.subarrays(input, tiling, &BySearch(&Sparse::default()));
            let own = off(&outcome);
            if own <= best.0 {
                let reason = "no boundary cuts a contact and nothing is nearer to them".to_string();
                let (off, case, ..) = std::mem::replace(&mut best, (own, tiling.case, outcome, reason));
                refused.push((case, not_nearest_reason(off)));
            } else {
                refused.push((tiling.case, not_nearest_reason(own)));
            }
        }
        let (_, case, outcome, reason) = best;
        // The finer cases, in their order.
        let finer = array.tilings.iter().take_while(|tiling| tiling.case != case);
        let refused = finer
            .filter_map(|tiling| refused.iter().find(|(other, _)| *other == tiling.case))
            .map(|(case, reason)| RejectedCase { case: case.to_string(), reason: reason.clone() })
            .collect();
        let mut result = input.finish(outcome);
        result.extra.taken = Some(CaseChoice { case: case.to_string(), reason, refused });
        result
    }

    fn array(&self) -> Option<&Array> {
        Some(&self.array)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::reception::receive;
    use crate::spec::partition::subarrays;
    use crate::spec::scene::Condition;

    fn sensor() -> Sensor {
        Sensor { rows: 8, cols: 12, pitch_x_mm: 2.0, pitch_y_mm: 2.0, thickness_mm: 1.0 }
    }

    /// A force of 1 N on the taxel at row 2, column 2, and 0.01 N beside it.
    fn contact() -> Vec<Extent> {
        let mut p = vec![0.0; 96];
        (p[26], p[27]) = (1.0, 0.01);
        extents(&sensor(), &p, &Segments::whole(96))
    }

    fn against(case: i64, codes: &[i32], condition: Condition) -> Option<String> {
        let parts = subarrays(Case::numbered(case).unwrap(), &sensor()).unwrap();
        let received = |part: &Subarray| receive(&sensor(), part, &part.gather(&sensor(), codes), 0, condition);
        let received: Vec<SubarrayStats> = parts.iter().map(received).collect();
        rejection_reason(&sensor(), &parts, &received, &contact())
    }

    #[test]
    fn the_cells_that_count() {
        assert_eq!(contact(), [Extent { x: [-8.0, -6.0], y: [-4.0, -2.0] }]);
        let nothing = extents(&sensor(), &[0.0; 96], &Segments::whole(96));
        assert!(nothing[0].x[0] > nothing[0].x[1]);
    }

    #[test]
    fn a_near_boundary_is_named() {
        assert_eq!(against(0, &[1; 96], Condition::Loaded), None);
        assert_eq!(against(2, &[1; 96], Condition::Loaded), None);
        let tiling = against(3, &[1; 96], Condition::Loaded);
        assert_eq!(tiling, None);
    }

    #[test]
    fn an_unmet_condition_is_named() {
        let Some(unmet) = against(2, &[1; 96], Condition::BothSigns) else { panic!("no objection") };
        assert!(unmet.starts_with("the subarray at row 0, column 0 is loaded"), "{unmet}");
        assert_eq!(against(2, &[0; 96], Condition::BothSigns), None);
    }
}
