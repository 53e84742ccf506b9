//! Suspect: taxels whose readings no force explains, such as one that is stuck.
//!
//! A cover of thickness h smooths the stress, so that each reading is known from its neighbours within what `residual` says.
//! A reading far from that is taken as missing, and the frame is fitted without it. The evidence of all readings over that of the
//! others is the density p(b_t | the others) of the one that was taken out:
//!
//! ```text
//! −ln p(b_t | the others) = evidence without t − evidence with t > 7        and |b_t − prediction| > 1 % of the peak
//! ```
//!
//! A taxel whose reading is that improbable is suspect and stays missing; else the reading stands. The envelope of a fit adapts to
//! a wrong reading, which is why only a fit without the reading can judge it.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: stress of a frame | taxels | of its peak |
//! | out: fit without the suspect taxels, and these | – | of the peak |

use super::estimator::Evidence;
use super::fit::{Fit, Fitted};
use crate::result::reconstruct::SuspectTaxel;

/// Distance of a reading from its prediction, in standard deviations, from which a fit without it is made.
const CANDIDATE: f64 = crate::result::checks::OUTLIER;
/// −ln p(b_t | the others), b_t in units of the peak, from which a taxel is suspect. On 1400 drawn frames without a fault, of
/// arrays of 6 × 6 to 10 × 10 taxels with 0 to 0.2 % of noise, the largest was 6.5.
const SUSPECT: f64 = 7.0;
/// Smallest distance of a suspect reading from its prediction, in units of the peak.
const SHARE: f64 = 0.01;
/// Largest number of suspect taxels; with more the frame as a whole does not fit.
pub(super) const MOST: usize = 3;
/// Largest number of fits of a frame.
const FITS: usize = 4;

/// The fit of `b` on the taxels `there`, live and not missing, but for its suspect ones; `stated` is the noise, if it is known.
/// `None` if the model is not representable.
pub(super) fn fit(scene: &Evidence, b: &[f64], there: &[bool], stated: Option<f64>) -> Option<Fitted> {
    let mut found = Fit::new(scene, b, there, stated).run();
    let (mut suspects, mut tried): (Vec<usize>, Vec<usize>) = (Vec::new(), Vec::new());
    let used = |missing: &[usize]| (0..b.len()).map(|t| there[t] && !missing.contains(&t)).collect::<Vec<_>>();
    for _ in 1..FITS {
        let worst = found.as_ref().and_then(|found| found.worst).filter(|(_, size)| *size > CANDIDATE);
        let worst = worst.map(|(taxel, _)| taxel).filter(|taxel| !tried.contains(taxel));
        let first = tried.is_empty() && suspects.is_empty() && found.as_ref().is_none_or(|found| !found.wide);
        let screened = || scene.screen.as_ref().filter(|_| first)?.least_predicted(b).filter(|taxel| there[*taxel]);
        let Some(taxel) = worst.or_else(screened).filter(|_| suspects.len() < MOST) else { break };
        suspects.push(taxel);
        let improbable = |other: &Fitted| found.as_ref().is_none_or(|all| other.evidence - all.evidence > SUSPECT);
        let other = Fit::new(scene, b, &used(&suspects), stated).run();
        match other.filter(|other| other.misses(taxel, b[taxel]) && improbable(other)) {
            Some(other) => {
                tried.clear();
                found = Some(other);
            }
            None => tried.extend(suspects.pop()),
        }
    }
    let others = used(&suspects);
    let peak = peak(b, &others)?;
    if peak < 1.0 {
        // A suspect reading was the peak; the contact is fitted in units of its own.
        let scaled: Vec<f64> = b.iter().map(|b| b / peak).collect();
        found =
            Fit::new(scene, &scaled, &others, stated.map(|noise| noise / peak)).run().map(|found| found.times(peak));
    }
    let mut found = found?;
    let missing = found.predicted.iter().filter(|(taxel, _)| suspects.contains(taxel));
    let suspect = |&(taxel, mean): &(usize, f64)| SuspectTaxel::new(&scene.cells.sensor, taxel, b[taxel], mean);
    found.estimate.suspects = missing.map(suspect).collect();
    Some(found)
}

/// The largest of the readings `b` that are `used`; `None` without one above 0 that is finite.
pub(super) fn peak(b: &[f64], used: &[bool]) -> Option<f64> {
    let peak = b.iter().zip(used).filter(|(_, used)| **used).fold(0.0f64, |peak, (b, _)| b.max(peak));
    (peak > 0.0 && peak.is_finite()).then_some(peak)
}

impl Fitted {
    /// Whether this fit, made without taxel `taxel`, predicts another stress there than it reads.
    fn misses(&self, taxel: usize, reads: f64) -> bool {
        self.predicted.iter().any(|(own, mean)| *own == taxel && (reads - mean).abs() > SHARE)
    }

    /// Forces and stress of readings that are `unit` times as large.
    fn times(mut self, unit: f64) -> Fitted {
        self.estimate.scale(unit);
        self.predicted.iter_mut().for_each(|(_, mean)| *mean *= unit);
        Fitted { load: self.load * unit, ..self }
    }
}
