//! Options: the size of a training and what its frames allow for.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: options, medium of the scene | – | – |
//! | out: the options, or the first that is out of range | – | – |

use super::error::LearnedError;
use crate::data::generator::slip::Slip;
use crate::spec::scene::Medium;
use crate::spec::window::{Window, WindowPosition};

/// Fewest rows and columns of a sensor of a range.
const LEAST_SIDE: usize = 4;
/// Pitches over the thickness within which a range of sensors lies.
const WIDEST_RANGE: [f64; 2] = [0.25, 4.0];

/// Size of a training, and what its frames allow for.
#[derive(Clone, Debug, PartialEq)]
pub struct Training {
    /// Steps of Adam, 1 to 10 million.
    pub steps: usize,
    /// Time for the steps in minutes, above 0 to 10 000; `None`: as many as `steps`, which one machine does equally every time.
    pub minutes: Option<f64>,
    /// Frames of a step, 1 to 65 536.
    pub batch: usize,
    /// Contacts drawn until the last step, 1 to 10 million.
    pub contacts: usize,
    /// Widths of the hidden layers, each 1 to 4096.
    pub hidden: Vec<usize>,
    /// Largest rate of a step.
    pub rate: f64,
    /// How the shear is spread over the contacts.
    pub slip: Slip,
    /// How far the Poisson ratio of a bonded layer may be from the scene's, 0 to 0.1.
    pub poisson_tolerance: f64,
    /// How far the thickness of the cover may be from the scene's, as a share of it, 0 to 0.2.
    pub thickness_tolerance: f64,
    /// Least and largest pitch over the thickness of the sensors that the network serves, each above 0; `None`: the scene's sensor alone.
    pub pitch_over_thickness: Option<[f64; 2]>,
    /// Fewest rows and columns of these sensors, which have as many as the scene's or fewer by even numbers, at least 4; `None`: as many.
    pub least_side: Option<usize>,
    /// Seed of weights and frames.
    pub seed: u64,
}

impl Default for Training {
    fn default() -> Self {
        Training {
            steps: 40_000,
            minutes: None,
            batch: 384,
            contacts: 400_000,
            hidden: vec![150, 75, 25],
            rate: 2e-3,
            slip: Slip::Mixed,
            poisson_tolerance: 0.0,
            thickness_tolerance: 0.0,
            pitch_over_thickness: None,
            least_side: None,
            seed: 1,
        }
    }
}

impl Training {
    /// Checks the options for a medium.
    ///
    /// # Errors
    /// [`LearnedError::Option`] with the first that is out of range.
    pub(super) fn check(&self, medium: Medium, window: Window) -> Result<(), LearnedError> {
        let fail = |field, value, allowed| Err(LearnedError::Option { field, value, allowed });
        if !(1..=10_000_000).contains(&self.steps) {
            return fail("steps", self.steps as f64, "a whole number from 1 to 10 million");
        }
        if let Some(minutes) = self.minutes.filter(|minutes| !(*minutes > 0.0 && *minutes <= 10_000.0)) {
            return fail("minutes", minutes, "a number above 0, at most 10 000");
        }
        if !(1..=65_536).contains(&self.batch) {
            return fail("batch", self.batch as f64, "a whole number from 1 to 65 536");
        }
        if !(1..=10_000_000).contains(&self.contacts) {
            return fail("contacts", self.contacts as f64, "a whole number from 1 to 10 million");
        }
        if let Some(width) = self.hidden.iter().find(|width| !(1..=4096).contains(*width)) {
            return fail("hidden", *width as f64, "whole numbers from 1 to 4096");
        }
        if !(self.rate > 0.0 && self.rate <= 1.0) {
            return fail("rate", self.rate, "a number above 0, at most 1");
        }
        match medium {
            Medium::HalfSpace if self.poisson_tolerance != 0.0 => {
                return fail(
                    "poisson_tolerance",
                    self.poisson_tolerance,
                    "0 on a half-space, whose stress does not depend on it",
                );
            }
            _ if !(0.0..=0.1).contains(&self.poisson_tolerance) => {
                return fail("poisson_tolerance", self.poisson_tolerance, "a number from 0 to 0.1");
            }
            _ => {}
        }
        if !(0.0..=0.2).contains(&self.thickness_tolerance) {
            return fail("thickness_tolerance", self.thickness_tolerance, "a number from 0 to 0.2");
        }
        if let Some([low, high]) = self.pitch_over_thickness {
            if !(WIDEST_RANGE[0]..=WIDEST_RANGE[1]).contains(&low) {
                return fail("pitch_over_thickness", low, "from 0.25 to 4");
            }
            if !(low..=WIDEST_RANGE[1]).contains(&high) {
                return fail("pitch_over_thickness", high, "from the least one to 4");
            }
            if self.poisson_tolerance != 0.0 {
                return fail(
                    "poisson_tolerance",
                    self.poisson_tolerance,
                    "0 for a range of sensors, which has every Poisson ratio",
                );
            }
        }
        if let Some(least) = self.least_side {
            let largest = if window.place == WindowPosition::Array { window.rows.min(window.cols) } else { 0 };
            if self.pitch_over_thickness.is_none() || !(LEAST_SIDE..=largest).contains(&least) {
                let allowed = "from 4 to the rows and columns of a scene that is one window, for a range of pitches";
                return fail("least_side", least as f64, allowed);
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_out_of_range() {
        let window = Window { place: WindowPosition::Array, rows: 8, cols: 10 };
        let refused = |training: Training| match training.check(Medium::HalfSpace, window) {
            Err(LearnedError::Option { field, .. }) => field,
            _ => "none",
        };
        assert_eq!(refused(Training::default()), "none");
        assert_eq!(refused(Training { steps: 0, ..Default::default() }), "steps");
        assert_eq!(refused(Training { batch: 0, ..Default::default() }), "batch");
        assert_eq!(refused(Training { contacts: 0, ..Default::default() }), "contacts");
        assert_eq!(refused(Training { hidden: vec![0], ..Default::default() }), "hidden");
        assert_eq!(refused(Training { rate: f64::NAN, ..Default::default() }), "rate");
        assert_eq!(refused(Training { minutes: Some(0.0), ..Default::default() }), "minutes");
        assert_eq!(refused(Training { thickness_tolerance: 0.3, ..Default::default() }), "thickness_tolerance");
        let range = Training { pitch_over_thickness: Some([0.5, 2.0]), least_side: Some(6), ..Default::default() };
        assert_eq!(refused(range.clone()), "none");
        for least_side in [Some(3), Some(9)] {
            assert_eq!(refused(Training { least_side, ..range.clone() }), "least_side");
        }
        assert_eq!(refused(Training { pitch_over_thickness: None, ..range.clone() }), "least_side");
        for pitch_over_thickness in [[2.0, 0.5], [0.1, 2.0], [0.5, 5.0], [f64::NAN, 1.0]] {
            let range = Training { pitch_over_thickness: Some(pitch_over_thickness), ..range.clone() };
            assert_eq!(refused(range), "pitch_over_thickness");
        }
        let poisson = Training { poisson_tolerance: 0.02, ..Default::default() };
        assert!(poisson.check(Medium::BondedLayer { poisson: 0.48 }, window).is_ok());
        assert_eq!(refused(poisson), "poisson_tolerance");
    }
}
