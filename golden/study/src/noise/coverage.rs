//! Coverage: how often a force is within its own standard deviations.
//!
//! z = |F − F_ref|/σ per contact and axis. Of a normal distribution 68 % are within one σ, 95 % within two, and 0.5 %
//! of pairs have a member beyond three.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: z | 3 per contact and frame, without normal where the estimator gives no standard deviation of it | – |
//! | out: shares of z within 1 and 2, of frames with a z beyond 3 | with intervals | fraction |

use super::statistic::Interval;
use serde::Serialize;

/// |F − F_ref|/σ of one contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Deviation {
    /// Along x and y.
    pub shear: [f64; 2],
    /// Of the normal force; `None` without its standard deviation.
    pub normal: Option<f64>,
}

/// How often the forces are within their standard deviations; with intervals over frames.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Coverage {
    /// Number of frames with standard deviations.
    pub frames: usize,
    /// Tangential components within one standard deviation.
    pub within_1: Interval,
    /// Tangential components within two.
    pub within_2: Interval,
    /// Normal forces within one; `None` without their standard deviations.
    pub normal_within_1: Option<Interval>,
    /// Normal forces within two.
    pub normal_within_2: Option<Interval>,
    /// Frames of which a tangential component is off by more than three.
    pub beyond_3: Interval,
}

impl Coverage {
    /// The coverage of frames, each with the deviations of its contacts; `None` without any.
    pub fn of(frames: &[&[Deviation]]) -> Option<Coverage> {
        let frames: Vec<&&[Deviation]> = frames.iter().filter(|contacts| !contacts.is_empty()).collect();
        let share = |of: &dyn Fn(&[Deviation]) -> Vec<bool>| {
            Interval::share(&frames.iter().map(|contacts| of(contacts)).collect::<Vec<_>>())
        };
        let shear = |most: f64| {
            move |contacts: &[Deviation]| contacts.iter().flat_map(|z| z.shear.map(|z| z <= most)).collect()
        };
        let normal = |most: f64| {
            let known = frames.iter().all(|contacts| contacts.iter().all(|z| z.normal.is_some()));
            known.then(|| share(&|contacts| contacts.iter().filter_map(|z| z.normal).map(|z| z <= most).collect()))
        };
        (!frames.is_empty()).then(|| Coverage {
            frames: frames.len(),
            within_1: share(&shear(1.0)),
            within_2: share(&shear(2.0)),
            normal_within_1: normal(1.0),
            normal_within_2: normal(2.0),
            // Also true of z that is not a number.
            beyond_3: share(&|contacts| vec![!contacts.iter().all(|z| z.shear.iter().all(|z| *z <= 3.0))]),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use dermis_golden::random::Random;

    #[test]
    fn normal_errors_are_covered_as_a_normal_distribution() {
        let mut random = Random::new(4);
        let mut z = || random.normal().abs();
        let frames: Vec<Vec<Deviation>> =
            (0..4000).map(|_| vec![Deviation { shear: [z(), z()], normal: Some(z()) }]).collect();
        let frames: Vec<&[Deviation]> = frames.iter().map(Vec::as_slice).collect();
        let coverage = Coverage::of(&frames).unwrap();
        let near = |got: Interval, wanted: f64| (got.value - wanted).abs() < 0.02 && got.low <= got.value;
        assert!(near(coverage.within_1, 0.683) && near(coverage.within_2, 0.954), "{coverage:?}");
        let [one, two] = [coverage.normal_within_1, coverage.normal_within_2].map(Option::unwrap);
        assert!(near(one, 0.683) && near(two, 0.954), "{coverage:?}");
        assert!(coverage.beyond_3.value < 0.012 && coverage.beyond_3.value > 0.001, "{coverage:?}");
    }

    #[test]
    fn what_has_no_deviation_does_not_count() {
        assert_eq!(Coverage::of(&[&[], &[]]), None);
        let z = |x: f64, y: f64, normal| Deviation { shear: [x, y], normal };
        let coverage = Coverage::of(&[&[], &[z(0.5, 4.0, Some(1.5))]]).unwrap();
        assert_eq!((coverage.frames, coverage.within_1.value, coverage.beyond_3.value), (1, 0.5, 1.0));
        let normal = [coverage.normal_within_1, coverage.normal_within_2].map(|share| share.unwrap().value);
        assert_eq!(normal, [0.0, 1.0]);
        let coverage = Coverage::of(&[&[z(f64::NAN, 0.0, None)]]).unwrap();
        assert_eq!((coverage.beyond_3.value, coverage.normal_within_1), (1.0, None));
    }
}
