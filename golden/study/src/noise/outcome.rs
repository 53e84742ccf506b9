//! Outcome: the errors of one reconstruction of a drawn frame, and their summary over many.

use super::coverage::{Coverage, Deviation};
use super::matching::{found, partners};
use super::statistic::{ErrorSpread, Interval};
use dermis_golden::data::generator::draws::{ContactShape, DrawnFrame};
use dermis_golden::result::errors::Errors;
use dermis_golden::result::reconstruct::Reconstruction;
use dermis_golden::spec::sensor::Sensor;
use serde::Serialize;

/// The errors of one frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// Shape of the first contact.
    pub shape: ContactShape,
    /// e_t of the resultant.
    pub tangential: Option<f64>,
    /// e_n of the resultant.
    pub normal: Option<f64>,
    /// Error of the resultant's shear along the true one, as a fraction of it: above 0 where too much is read.
    pub bias: Option<f64>,
    /// Tangential error of the resultant over the sum of all contacts' tangential forces; the sum of shears that cancel is
    /// no measure.
    pub over_all: Option<f64>,
    /// e_t of each contact.
    pub contact_tangential: Vec<f64>,
    /// Whether the result has a flag.
    pub flagged: bool,
    /// |F − F_ref|/σ of each contact; empty without standard deviations.
    pub deviations: Vec<Deviation>,
}

/// Errors over many frames.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Summary {
    /// Number of frames.
    pub draws: usize,
    /// e_t of the resultant, a fraction.
    pub tangential: ErrorSpread,
    /// e_n of the resultant, a fraction.
    pub normal: ErrorSpread,
    /// Tangential error of the resultant over the sum of all contacts' tangential forces, where frames have several.
    pub over_all: Option<ErrorSpread>,
    /// e_t of each contact, where frames have several.
    pub contact_tangential: Option<ErrorSpread>,
    /// Share of frames with a flag.
    pub flagged: Interval,
    /// How often the forces are within their standard deviations; `None` without them.
    pub coverage: Option<Coverage>,
}

impl Outcome {
    /// Compares a result with the truth.
    pub fn new(drawn: &DrawnFrame, result: &Reconstruction) -> Outcome {
        let errors = Errors::new(drawn.total_N, result.resultant_N);
        let mut outcome = Outcome {
            shape: drawn.truth[0].shape,
            tangential: errors.tangential,
            normal: errors.normal,
            bias: bias(drawn, result.resultant_N),
            over_all: over_all(drawn, result.resultant_N),
            contact_tangential: Vec::new(),
            flagged: !result.flags.is_empty(),
            deviations: Vec::new(),
        };
        for (truth, partner) in drawn.truth.iter().zip(partners(&found(result), &drawn.truth)) {
            let force_N = partner.map_or([0.0; 3], |found| found.force_N);
            outcome.contact_tangential.extend(Errors::new(truth.force_N, force_N).tangential);
            let Some(found) = partner else { continue };
            // The deviations of the array are not those of one of several contacts.
            let is_of_contact = result.contacts().is_some() || drawn.truth.len() == 1;
            if let Some([x, y]) = found.shear_sigma_N.filter(|_| is_of_contact) {
                let off = |axis: usize, sigma: f64| (force_N[axis] - truth.force_N[axis]).abs() / sigma;
                let normal = found.normal_sigma_N.map(|sigma| off(2, sigma));
                outcome.deviations.push(Deviation { shear: [off(0, x), off(1, y)], normal });
            }
        }
        outcome
    }

    /// The baseline that needs no estimator: no shear, and Σ b·area as normal force.
    pub fn baseline(drawn: &DrawnFrame, sensor: &Sensor, reading_MPa: &[f64]) -> Outcome {
        let errors = Errors::new(drawn.total_N, [0.0, 0.0, sensor.sum_of_stress_N(reading_MPa)]);
        let alone = |truth: &dermis_golden::data::generator::draws::ContactTruth| {
            Errors::new(truth.force_N, [0.0; 3]).tangential
        };
        Outcome {
            shape: drawn.truth[0].shape,
            tangential: errors.tangential,
            normal: errors.normal,
            bias: bias(drawn, [0.0; 3]),
            over_all: over_all(drawn, [0.0; 3]),
            contact_tangential: drawn.truth.iter().filter_map(alone).collect(),
            flagged: false,
            deviations: Vec::new(),
        }
    }
}

/// Error of a resultant's shear along the true one over that; `None` without shear.
fn bias(drawn: &DrawnFrame, [x, y, _]: [f64; 3]) -> Option<f64> {
    let [true_x, true_y, _] = drawn.total_N;
    let square = true_x * true_x + true_y * true_y;
    (square > 0.0).then(|| (x * true_x + y * true_y) / square - 1.0)
}

/// Tangential error of a resultant over the sum of all contacts' tangential forces; `None` if there are none.
fn over_all(drawn: &DrawnFrame, [x, y, _]: [f64; 3]) -> Option<f64> {
    let sum: f64 = drawn.truth.iter().map(|contact| contact.force_N[0].hypot(contact.force_N[1])).sum();
    (sum > 0.0).then(|| (x - drawn.total_N[0]).hypot(y - drawn.total_N[1]) / sum)
}

impl Summary {
    /// Of some frames.
    pub fn of(outcomes: &[&Outcome]) -> Summary {
        let all = |of: fn(&Outcome) -> Option<f64>| -> Vec<f64> { outcomes.iter().filter_map(|o| of(o)).collect() };
        let contacts: Vec<f64> = outcomes.iter().flat_map(|o| o.contact_tangential.iter().copied()).collect();
        let several = contacts.len() > outcomes.len();
        let deviations: Vec<&[Deviation]> = outcomes.iter().map(|o| o.deviations.as_slice()).collect();
        Summary {
            draws: outcomes.len(),
            tangential: ErrorSpread::of(&all(|o| o.tangential)),
            normal: ErrorSpread::of(&all(|o| o.normal)),
            over_all: several.then(|| ErrorSpread::of(&all(|o| o.over_all))),
            contact_tangential: several.then(|| ErrorSpread::of(&contacts)),
            flagged: Interval::share(&outcomes.iter().map(|o| vec![o.flagged]).collect::<Vec<_>>()),
            coverage: Coverage::of(&deviations),
        }
    }
}
