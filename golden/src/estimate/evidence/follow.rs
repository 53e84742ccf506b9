//! Follow: a frame of a stream, fitted from where the fit of the frame before ended.
//!
//! The contact of a press moves little between frames, so that its envelope, μ and noise are nearly those of the last one, and
//! one round finds the rest. That holds only while the last contacts explain the readings. A frame that they do not explain is
//! fitted as if it were the first one:
//!
//! | what | limit |
//! |---|---|
//! | the taxel that the others explain least, in standard deviations | [`WORST`] |
//! | correlation of what neighbours leave | [`CORRELATED`] |
//! | stated noise: probability that it leaves as much | [`MISFIT`] |
//! | noise that is not stated: found over that of the last frame | [`LOUDER`] |
//! | contacts into which the pressure divides | as many as in the last frame |
//! | missing taxels | the same |
//!
//! Every round narrows the envelope a little, which over 30 frames with 1 % of noise takes 10 % of the load; and only a fit from
//! the start looks for faulty taxels. So every [`LONGEST`]th frame is fitted from the start, whatever the one before was.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: stress of a frame, fit of the frame before | taxels, – | of the peak |
//! | out: fit | – | of the peak |

use super::estimator::Evidence;
use super::fit::{Fit, Fitted, Progress};
use crate::result::checks::CORRELATED;

/// See the table above.
const WORST: f64 = 4.0;
/// See the table above.
const MISFIT: f64 = 1e-3;
/// See the table above.
const LOUDER: f64 = 1.5;
/// Frames from one fit from the start to the next one.
const LONGEST: usize = 8;

/// What the fit of a frame leaves to that of the next one.
#[derive(Clone, Debug)]
pub struct LastFit {
    found: Progress,
    /// Contacts into which its pressure divides.
    parts: usize,
    /// Taxels that were neither dead nor missing.
    there: Vec<bool>,
    /// The peak in MPa.
    unit: f64,
    /// Number of frames since the last one that was fitted from the start.
    followed: usize,
}

/// The stress of a frame in units of its peak.
#[derive(Clone, Copy)]
pub(super) struct Scaled<'a> {
    /// Of the peak.
    pub b: &'a [f64],
    /// Taxels that are neither dead nor missing.
    pub there: &'a [bool],
    /// The noise in units of the peak, if it is known.
    pub stated: Option<f64>,
    /// The peak in MPa.
    pub unit: f64,
}

impl LastFit {
    /// What `fitted` leaves, which followed `before`; `None` where the next frame cannot follow.
    pub(super) fn new(fitted: &Fitted, frame: Scaled, before: Option<&LastFit>) -> Option<LastFit> {
        let followed = before.map_or(0, |before| before.followed + 1);
        let clear = fitted.estimate.suspects.is_empty() && !fitted.wide && followed + 1 < LONGEST;
        let (found, there) = (fitted.found.clone(), frame.there.to_vec());
        let last = LastFit { found, parts: fitted.parts, there, unit: frame.unit, followed };
        clear.then_some(last)
    }

    /// The fit of a frame from where this one ended, whether or not that explains it; `None` if the model is not representable.
    pub(super) fn next(&self, scene: &Evidence, frame: Scaled) -> Option<Fitted> {
        let sigma = self.found.sigma * self.unit / frame.unit;
        let before = Progress { sigma, ..self.found.clone() };
        Fit::from(scene, frame.b, frame.there, frame.stated, before).finish()
    }

    /// Whether `fitted`, which follows this one, explains its frame.
    pub(super) fn explains(&self, fitted: &Fitted, frame: Scaled) -> bool {
        let estimate = &fitted.estimate;
        let quiet = match estimate.misfit_probability {
            Some(probability) => probability >= MISFIT,
            None => fitted.found.sigma * frame.unit <= LOUDER * self.found.sigma * self.unit.max(frame.unit),
        };
        quiet
            && !fitted.wide
            && fitted.parts == self.parts
            && fitted.worst.is_some_and(|(_, size)| size <= WORST)
            && estimate.residual_correlation.is_some_and(|size| size <= CORRELATED)
            && self.there == frame.there
    }
}

/// The fit of a frame from where `last` ended; `None` if that does not explain it.
pub(super) fn follow(scene: &Evidence, frame: Scaled, last: &LastFit) -> Option<Fitted> {
    last.next(scene, frame).filter(|fitted| last.explains(fitted, frame))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::frame::Frame;
    use crate::data::generator::presses::{Motion, Press};
    use crate::estimate::evidence::{suspect, EvidenceEstimate};
    use crate::spec::scene::Scene;

    const MOMENTS: usize = 12;
    /// Largest number of rounds of a frame that follows another.
    const MOST_ROUNDS: usize = 3;
    /// The first moment after a jump, and with a second contact.
    const CHANGED: usize = 6;

    fn frames(scene: &Scene, motion: Motion, noise: f64) -> Vec<Frame> {
        // Every motion has a contact of its own.
        let (press, number) = (Press::new(motion).with_noise(noise), motion as u64);
        // Those in the middle, where it changes at once if it does.
        let middle = press.frames / 2;
        let part = press.exact_part(scene, number, middle - CHANGED..middle - CHANGED + MOMENTS).unwrap();
        press.read(part, number).unwrap()
    }

    fn sigma(estimate: &EvidenceEstimate, axis: usize) -> f64 {
        estimate.contacts.iter().map(|own| own.sigma_N[axis].powi(2)).sum::<f64>().sqrt()
    }

    /// Every frame of a press has the force of that frame alone: to the bit where it was fitted from the start, else within its
    /// standard deviation, and as far from the truth.
    #[test]
    fn frames_in_order_have_the_forces_of_frames_alone() {
        let scene = Scene::builtin("sensor-1").unwrap();
        let evidence = Evidence::new(&scene);
        let (mut far, mut all, mut errors) = (0, 0, [0.0, 0.0]);
        for (motion, noise) in Motion::NAMES.into_iter().flat_map(|(_, motion)| [(motion, 5e-4), (motion, 2e-3)]) {
            let (mut last, mut followed) = (None, 0);
            for (k, frame) in frames(&scene, motion, noise).iter().enumerate() {
                let after = evidence.solve_after(&mut last, &frame.stress_MPa, &[], None);
                let alone = evidence.solve(&frame.stress_MPa, None);
                if after.rounds > MOST_ROUNDS {
                    assert_eq!(after, alone, "{motion:?} {noise} {k}");
                    followed = 0;
                    continue;
                }
                followed += 1;
                let changed = matches!(motion, Motion::Jump | Motion::Second) && k == CHANGED;
                assert!(k > 0 && followed < LONGEST && !changed, "{motion:?} {noise} {k}: {followed}");
                all += 1;
                let [found, wanted] = [&after, &alone].map(|estimate| estimate.forces_N.resultant());
                let off =
                    |axis: usize| (found[axis] - wanted[axis]).abs() / sigma(&after, axis).max(sigma(&alone, axis));
                let most = (0..3).map(off).fold(0.0, f64::max);
                assert!(most < 4.0, "{motion:?} {noise} {k}: {found:?} {wanted:?}");
                far += usize::from(most > 1.0);
                let truth = frame.resultant_N.unwrap();
                for (error, (force, estimate)) in errors.iter_mut().zip([(found, &after), (wanted, &alone)]) {
                    *error +=
                        (0..3).map(|axis| ((force[axis] - truth[axis]) / sigma(estimate, axis)).powi(2)).sum::<f64>();
                }
            }
        }
        assert!(all > 100, "{all} frames followed the one before");
        assert!(far * 10 < all, "{far} of {all} frames are beyond a standard deviation");
        assert!(errors[0] < 1.1 * errors[1], "{errors:?}");
    }

    /// Without the limits, the frame after a jump and the one with a second contact would have a wrong force.
    #[test]
    fn what_is_not_explained_is_not_followed() {
        let scene = Scene::builtin("sensor-1").unwrap();
        let evidence = Evidence::new(&scene);
        let there = vec![true; scene.sensor.taxels()];
        for motion in [Motion::Jump, Motion::Second] {
            let scaled = |frame: &Frame| {
                let unit = suspect::peak(&frame.stress_MPa, &there).unwrap();
                (frame.stress_MPa.iter().map(|b| b / unit).collect::<Vec<f64>>(), unit)
            };
            let frames = frames(&scene, motion, 1e-3);
            let [(before, unit), (after, next_unit)] = [CHANGED - 1, CHANGED].map(|k| scaled(&frames[k]));
            let frame = Scaled { b: &before, there: &there, stated: None, unit };
            let fitted = Fit::new(&evidence, &before, &there, None).run().unwrap();
            let last = LastFit::new(&fitted, frame, None).unwrap();
            let frame = Scaled { b: &after, unit: next_unit, ..frame };
            let next = last.next(&evidence, frame).unwrap();
            let (truth, found) = (frames[CHANGED].resultant_N.unwrap(), next.estimate.forces_N.resultant());
            let off =
                |axis: usize| (next_unit * found[axis] - truth[axis]).abs() / (next_unit * sigma(&next.estimate, axis));
            assert!((0..3).map(off).fold(0.0, f64::max) > 5.0, "{motion:?}: {found:?} {truth:?}");
            assert!(!last.explains(&next, frame) && follow(&evidence, frame, &last).is_none(), "{motion:?}");
        }
    }

    /// Taxels that go missing, or come back, end the order of frames.
    #[test]
    fn other_taxels_are_not_followed() {
        let scene = Scene::builtin("eight-by-eight").unwrap();
        let evidence = Evidence::new(&scene);
        let (mut last, frames) = (None, frames(&scene, Motion::Hold, 1e-3));
        for (k, missing) in [&[][..], &[9], &[9], &[]].into_iter().enumerate() {
            let before = last.as_ref().map(|last: &LastFit| last.there.clone());
            let after = evidence.solve_after(&mut last, &frames[k].stress_MPa, missing, None);
            let alone = evidence.solve_without(&frames[k].stress_MPa, missing, None);
            assert_eq!(after == alone, before.is_none_or(|there| there[9] == missing.contains(&9)), "{k}");
        }
    }
}
