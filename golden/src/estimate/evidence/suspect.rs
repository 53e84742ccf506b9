//! Suspect: taxels whose readings no force explains, such as one that is stuck.
//!
//! A cover of thickness h smooths the stress, so that each reading is known from its neighbours within what `residual` says.
//! A reading far from that is taken as missing, and the frame is fitted without it: if the new fit predicts another stress
//! there, the taxel is suspect and stays missing; else the reading stands. The envelope of a fit adapts to a wrong reading,
//! which is why only a fit without the reading can judge it.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: stress of a frame | taxels | of its peak |
//! | out: fit without the suspect taxels | – | – |

use super::estimator::Evidence;
use super::fit::{Fit, Fitted};
use crate::result::reconstruct::SuspectTaxel;

/// Distance of a reading from its prediction, in standard deviations, from which a fit without it is made.
const CANDIDATE: f64 = crate::result::checks::OUTLIER;
/// Distance from the prediction of that fit, in standard deviations, from which a taxel is suspect.
const SUSPECT: f64 = 8.0;
/// The same in units of the peak.
const SHARE: f64 = 0.01;
/// What the fit without a suspect taxel may leave, over what the one with it leaves: a small contact on one taxel is seen by
/// its neighbours, too.
const WORSE: f64 = 1.1;
/// Largest number of suspect taxels; with more the frame as a whole does not fit.
pub(super) const MOST: usize = 3;
/// Largest number of fits of a frame.
const FITS: usize = 5;

/// The fit of `b` on the taxels `there`, live and not missing, and its suspect taxels; `stated` is the noise, if it is known. `None` if the model is not representable.
pub(super) fn fit(
    scene: &Evidence,
    b: &[f64],
    there: &[bool],
    stated: Option<f64>,
) -> Option<(Fitted, Vec<SuspectTaxel>)> {
    let mut found = Fit::new(scene, b, there, stated).run();
    let (mut suspects, mut tried): (Vec<usize>, Vec<usize>) = (Vec::new(), Vec::new());
    for _ in 1..FITS {
        let worst = found.as_ref().and_then(|found| found.worst).filter(|(_, size)| *size > CANDIDATE);
        let worst = worst.map(|(taxel, _)| taxel).filter(|taxel| !tried.contains(taxel));
        let first = tried.is_empty() && suspects.is_empty() && found.as_ref().is_none_or(|found| !found.wide);
        let screened = || scene.screen.as_ref().filter(|_| first)?.least_predicted(b).filter(|taxel| there[*taxel]);
        let Some(taxel) = worst.or_else(screened).filter(|_| suspects.len() < MOST) else { break };
        let mut used = there.to_vec();
        suspects.iter().chain([&taxel]).for_each(|&taxel| used[taxel] = false);
        let other = Fit::new(scene, b, &used, stated).run();
        let better = |other: &Fitted| found.as_ref().is_none_or(|found| other.left <= WORSE * found.left);
        match other.filter(|other| other.disagrees(taxel, b[taxel]) && better(other)) {
            Some(other) => {
                suspects.push(taxel);
                tried.clear();
                found = Some(other);
            }
            None => tried.push(taxel),
        }
    }
    let found = found?;
    let missing = found.predicted.iter().filter(|(taxel, _)| suspects.contains(taxel));
    let suspect =
        |&(taxel, [mean, _]): &(usize, [f64; 2])| SuspectTaxel::new(&scene.cells.sensor, taxel, b[taxel], mean);
    let suspects = missing.map(suspect).collect();
    Some((found, suspects))
}

impl Fitted {
    /// Whether this fit, made without taxel `taxel`, predicts another stress there than it reads.
    fn disagrees(&self, taxel: usize, reads: f64) -> bool {
        let noise = self.estimate.noise_MPa;
        let off = |(_, [mean, variance]): &&(usize, [f64; 2])| {
            let distance = (reads - mean).abs();
            distance > SUSPECT * (variance + noise * noise).sqrt() && distance > SHARE
        };
        self.predicted.iter().find(|(own, _)| *own == taxel).is_some_and(|own| off(&own))
    }
}
