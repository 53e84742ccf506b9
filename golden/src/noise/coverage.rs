//! Coverage: how often a force is within its own standard deviations.
//!
//! z = |F − F_ref|/σ per contact and axis. Of a normal distribution 68 % are within one σ, 95 % within two, and 0.5 %
//! of pairs have a member beyond three.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: z | 3 per contact and frame | – |
//! | out: shares of z within 1 and 2, of frames with a z beyond 3 | with intervals | fraction |

use super::statistic::Interval;
use serde::Serialize;

/// How often the forces are within their standard deviations; with intervals over frames.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Coverage {
    /// Number of frames with standard deviations.
    pub frames: usize,
    /// Tangential components within one standard deviation.
    pub within_1: Interval,
    /// Tangential components within two.
    pub within_2: Interval,
    /// Normal forces within one.
    pub normal_within_1: Interval,
    /// Normal forces within two.
    pub normal_within_2: Interval,
    /// Frames of which a tangential component is off by more than three.
    pub beyond_3: Interval,
}

impl Coverage {
    /// The coverage of frames, each with z of its contacts along x, y and normal; `None` without any.
    pub fn of(frames: &[&[[f64; 3]]]) -> Option<Coverage> {
        let frames: Vec<&&[[f64; 3]]> = frames.iter().filter(|contacts| !contacts.is_empty()).collect();
        let share = |of: &dyn Fn(&[[f64; 3]]) -> Vec<bool>| {
            Interval::share(&frames.iter().map(|contacts| of(contacts)).collect::<Vec<_>>())
        };
        let shear = |most: f64| {
            move |contacts: &[[f64; 3]]| contacts.iter().flat_map(|z| [z[0] <= most, z[1] <= most]).collect()
        };
        let normal = |most: f64| move |contacts: &[[f64; 3]]| contacts.iter().map(|z| z[2] <= most).collect();
        (!frames.is_empty()).then(|| Coverage {
            frames: frames.len(),
            within_1: share(&shear(1.0)),
            within_2: share(&shear(2.0)),
            normal_within_1: share(&normal(1.0)),
            normal_within_2: share(&normal(2.0)),
            // Also true of z that is not a number.
            beyond_3: share(&|contacts| vec![!contacts.iter().all(|z| z[0] <= 3.0 && z[1] <= 3.0)]),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    #[test]
    fn normal_errors_are_covered_as_a_normal_distribution() {
        let mut random = Random::new(4);
        let frames: Vec<Vec<[f64; 3]>> = (0..4000).map(|_| vec![[0; 3].map(|_| random.normal().abs())]).collect();
        let frames: Vec<&[[f64; 3]]> = frames.iter().map(Vec::as_slice).collect();
        let coverage = Coverage::of(&frames).unwrap();
        let near = |got: Interval, wanted: f64| (got.value - wanted).abs() < 0.02 && got.low <= got.value;
        assert!(near(coverage.within_1, 0.683) && near(coverage.within_2, 0.954), "{coverage:?}");
        assert!(near(coverage.normal_within_1, 0.683) && near(coverage.normal_within_2, 0.954), "{coverage:?}");
        assert!(coverage.beyond_3.value < 0.012 && coverage.beyond_3.value > 0.001, "{coverage:?}");
    }

    #[test]
    fn what_has_no_deviation_does_not_count() {
        assert_eq!(Coverage::of(&[&[], &[]]), None);
        let coverage = Coverage::of(&[&[], &[[0.5, 4.0, 1.5]]]).unwrap();
        assert_eq!((coverage.frames, coverage.within_1.value, coverage.beyond_3.value), (1, 0.5, 1.0));
        assert_eq!((coverage.normal_within_1.value, coverage.normal_within_2.value), (0.0, 1.0));
        assert_eq!(Coverage::of(&[&[[f64::NAN, 0.0, 0.0]]]).unwrap().beyond_3.value, 1.0);
    }
}
