//! Suspect: taxels whose readings no force explains, such as one that is stuck.
//!
//! A cover of thickness h smooths the stress, so that each reading is known from its neighbours within what `residual` says.
//! A reading that may be far from that is taken as missing, and the frame is fitted without it: only such a fit can judge it, as
//! the envelope of a fit adapts to a wrong reading. It is suspect in either case:
//!
//! ```text
//! −ln p(b_t | the others) = evidence without t − evidence with t > 7        b_t is improbable under any envelope
//! |b_t − m|/√(v + (3 % max(|b_t|, m))² + (0.5 %)²) > 4.8,  m > b_t/10        or under that of the others
//! ```
//!
//! m and v are mean and variance that the others give b_t; |b_t − m| is also above 1 % of the peak. The second case is that of a
//! reading that makes another contact of the frame, one narrower or wider, which explains it. Where the others see no load, as
//! beside a light contact on one taxel, only the evidence judges.
//!
//! Tried are the reading that the fit leaves most of, and the three that `screen` ranks first; those that a fit that goes on
//! without them from where this one ended does not predict within 2 standard deviations.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: stress of a frame | taxels | of its peak |
//! | out: fit without the suspect taxels, and these | – | of the peak |

use super::estimator::Evidence;
use super::fit::{Fit, Fitted, Predicted};
use crate::result::reconstruct::SuspectTaxel;

/// Distance of a reading from its prediction, in standard deviations, from which a fit without it is made.
const CANDIDATE: f64 = crate::result::checks::OUTLIER;
/// −ln p(b_t | the others), b_t in units of the peak, from which a taxel is suspect. On 1400 drawn frames without a fault, of
/// arrays of 6 × 6 to 10 × 10 taxels with 0 to 0.2 % of noise, the largest was 6.5.
const SUSPECT: f64 = 7.0;
/// Distance of a reading from what the others predict, in standard deviations, from which a taxel is suspect. On 660 drawn frames of
/// one contact without a fault, sensor-1 and eight-by-eight with either medium and 0 to 1 % of noise, the largest was 4.75.
const UNPREDICTED: f64 = 4.8;
/// The same from which a fit from the start is made without it.
const DOUBTFUL: f64 = 2.0;
/// Error of a prediction beyond its standard deviation: a share of the larger of reading and prediction, and of the peak.
const ERROR: [f64; 2] = [0.03, 0.005];
/// Smallest prediction, as a share of the reading, that says that something presses there.
const LOADED: f64 = 0.1;
/// Readings that the screen ranks first, of those that are tried.
const SCREENED: usize = 3;
/// Smallest distance of a suspect reading from its prediction, in units of the peak.
const SHARE: f64 = 0.01;
/// Largest number of fits of a frame from the start, one more than of suspect taxels; with more the frame as a whole does not fit.
const FITS: usize = 4;

/// A frame whose suspect taxels are looked for.
struct Trial<'a> {
    scene: &'a Evidence,
    b: &'a [f64],
    /// Taxels that are live and not missing.
    there: &'a [bool],
    /// The noise, if it is known.
    stated: Option<f64>,
    suspects: Vec<usize>,
    /// Taxels whose readings stand beside the others.
    tried: Vec<usize>,
    /// Multiplications so far.
    work: u64,
}

impl Trial<'_> {
    /// Whether each taxel is used, without the suspect ones and `also`.
    fn used(&self, also: Option<usize>) -> Vec<bool> {
        (0..self.b.len()).map(|t| self.there[t] && !self.suspects.contains(&t) && also != Some(t)).collect()
    }

    /// A fit of the frame from the start.
    fn fit(&mut self, without: Option<usize>) -> Option<Fitted> {
        let fitted = Fit::new(self.scene, self.b, &self.used(without), self.stated).run();
        self.counted(fitted)
    }

    fn counted(&mut self, fitted: Option<Fitted>) -> Option<Fitted> {
        self.work += fitted.as_ref().map_or(0, |fitted| fitted.estimate.work);
        fitted
    }

    /// The next taxel without which a fit from the start is worth its time.
    fn next(&mut self, found: Option<&Fitted>) -> Option<usize> {
        if self.work > self.scene.work {
            return None;
        }
        let worst = found.and_then(|found| found.worst).filter(|(taxel, _)| !self.tried.contains(taxel));
        if let Some((taxel, _)) = worst.filter(|(_, size)| *size > CANDIDATE) {
            return Some(taxel);
        }
        if !self.suspects.is_empty() || found.is_some_and(|found| found.wide) {
            return None;
        }
        let ranked = self.scene.screen.as_ref().map(|screen| screen.least_predicted(self.b)).unwrap_or_default();
        let screened = ranked.into_iter().filter(|taxel| self.there[*taxel]).take(SCREENED);
        let all: Vec<usize> = worst.map(|(taxel, _)| taxel).into_iter().chain(screened).collect();
        for taxel in all {
            if self.tried.contains(&taxel) {
                continue;
            }
            if found.is_none_or(|found| self.is_doubtful(found, taxel)) {
                return Some(taxel);
            }
            self.tried.push(taxel);
        }
        None
    }

    /// Whether a fit that goes on from `found` without a taxel predicts another stress there.
    fn is_doubtful(&mut self, found: &Fitted, taxel: usize) -> bool {
        let used = self.used(Some(taxel));
        let other = Fit::from(self.scene, self.b, &used, self.stated, found.found.clone()).finish();
        let other = self.counted(other);
        let says = other.as_ref().and_then(|other| other.predicts(taxel));
        says.is_none_or(|says| self.distance(says) > DOUBTFUL)
    }

    /// Distance of a taxel's reading from what the others say of it, in standard deviations.
    fn distance(&self, says: &Predicted) -> f64 {
        let reads = self.b[says.taxel];
        // An array that reads no tension reads 0 for it.
        let mean = if self.scene.unipolar { says.mean.max(0.0) } else { says.mean };
        let [share, least] = ERROR;
        let error = (share * reads.abs().max(mean.abs())).hypot(least);
        (reads - mean).abs() / (says.variance + error * error).sqrt()
    }

    /// Whether no force explains the reading of a taxel: `other` is the fit without it, `found` that with it.
    fn is_suspect(&self, taxel: usize, other: &Fitted, found: Option<&Fitted>) -> bool {
        let Some(says) = other.predicts(taxel) else { return false };
        let (reads, Some(found)) = (self.b[taxel], found) else { return true };
        let unpredicted = self.distance(says) > UNPREDICTED && says.mean > LOADED * reads;
        (reads - says.mean).abs() > SHARE && (unpredicted || other.evidence - found.evidence > SUSPECT)
    }
}

/// The fit of `b` on the taxels `there`, live and not missing, but for its suspect ones; `stated` is the noise, if it is known.
/// `None` if the model is not representable.
pub(super) fn fit(scene: &Evidence, b: &[f64], there: &[bool], stated: Option<f64>) -> Option<Fitted> {
    let (suspects, tried) = (Vec::new(), Vec::new());
    let mut trial = Trial { scene, b, there, stated, suspects, tried, work: 0 };
    let mut found = trial.fit(None);
    for _ in 1..FITS {
        let Some(taxel) = trial.next(found.as_ref()) else { break };
        match trial.fit(Some(taxel)).filter(|other| trial.is_suspect(taxel, other, found.as_ref())) {
            Some(other) => {
                trial.suspects.push(taxel);
                trial.tried.clear();
                found = Some(other);
            }
            None => trial.tried.push(taxel),
        }
    }
    let others = trial.used(None);
    let peak = peak(b, &others)?;
    if peak < 1.0 {
        // A suspect reading was the peak; the contact is fitted in units of its own.
        let scaled: Vec<f64> = b.iter().map(|b| b / peak).collect();
        let own = Fit::new(scene, &scaled, &others, stated.map(|noise| noise / peak)).run();
        found = trial.counted(own).map(|own| own.times(peak));
    }
    let mut found = found?;
    let suspect = |says: &Predicted| SuspectTaxel::new(&scene.cells.sensor, says.taxel, b[says.taxel], says.mean);
    let missing = found.predicted.iter().filter(|says| trial.suspects.contains(&says.taxel));
    found.estimate.suspects = missing.map(suspect).collect();
    found.estimate.work = trial.work;
    Some(found)
}

/// The largest of the readings `b` that are `used`; `None` without one above 0 that is finite.
pub(super) fn peak(b: &[f64], used: &[bool]) -> Option<f64> {
    let peak = b.iter().zip(used).filter(|(_, used)| **used).fold(0.0f64, |peak, (b, _)| b.max(peak));
    (peak > 0.0 && peak.is_finite()).then_some(peak)
}

impl Fitted {
    /// What this fit, made without taxel `taxel`, says of it.
    fn predicts(&self, taxel: usize) -> Option<&Predicted> {
        self.predicted.iter().find(|says| says.taxel == taxel)
    }

    /// Forces and stress of readings that are `unit` times as large.
    fn times(mut self, unit: f64) -> Fitted {
        self.estimate.scale(unit);
        for says in &mut self.predicted {
            (says.mean, says.variance) = (says.mean * unit, says.variance * unit * unit);
        }
        Fitted { load: self.load * unit, ..self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::generator::draws::{DrawOptions, Draws};
    use crate::estimate::evidence::EvidenceEstimate;
    use crate::random::Random;
    use crate::result::checks::{CORRELATED, LOUD, OUTLIER};
    use crate::result::errors::Errors;
    use crate::spec::scene::Scene;

    /// Error of the normal force up to which it is right.
    const RIGHT: f64 = 0.1;

    fn draws(name: &str) -> (Scene, Draws) {
        let scene = Scene::builtin(name).unwrap();
        let draws = Draws::new(&scene, DrawOptions { seed: 61, ..Default::default() }).unwrap();
        (scene, draws)
    }

    /// Whether the estimate says that something is wrong with the readings; `peak` is their largest.
    fn says_so(estimate: &EvidenceEstimate, peak: f64) -> bool {
        let suspect = estimate.failed || !estimate.suspects.is_empty() || estimate.noise_MPa > LOUD * peak;
        suspect
            || estimate.outlier.is_some_and(|size| size > OUTLIER)
            || estimate.residual_correlation.is_some_and(|size| size > CORRELATED)
    }

    /// Drawn presses with one taxel that is stuck, at a drawn value: at the peak, beside it, anywhere.
    fn stuck(name: &str, presses: u64) -> Vec<(Vec<f64>, [f64; 3])> {
        let ((scene, draws), mut random) = (draws(name), Random::new(62));
        let (cols, taxels) = (scene.sensor.cols, scene.sensor.taxels());
        let of = |number: u64| {
            let drawn = draws.frame(number).unwrap();
            let (b, peak_MPa) = (drawn.exact_MPa.clone(), drawn.peak_MPa());
            let at = b.iter().position(|b| *b == peak_MPa).unwrap();
            let beside = if (at + 1) % cols > 0 { at + 1 } else { at - 1 };
            let any = random.between(0.0, taxels as f64) as usize;
            [at, beside, any].map(|taxel| {
                let mut b = b.clone();
                b[taxel] = random.between(-0.5, 1.5) * peak_MPa;
                (b, drawn.total_N)
            })
        };
        (0..presses).flat_map(of).collect()
    }

    /// Frames with a wrong normal force and not a word of it.
    fn silent(evidence: &Evidence, frames: &[(Vec<f64>, [f64; 3])]) -> usize {
        let is_silent = |(b, truth): &&(Vec<f64>, [f64; 3])| {
            let estimate = evidence.solve(b, None);
            let error = Errors::new(*truth, estimate.forces_N.resultant()).normal.unwrap().abs();
            error > RIGHT && !says_so(&estimate, b.iter().fold(0.0, |peak: f64, b| peak.max(*b)))
        };
        frames.iter().filter(is_silent).count()
    }

    /// One stuck taxel, any value, any place: the normal force is right or the frame is flagged, in all but 3 of 100 frames. Were
    /// only readings tried that the fit leaves over, there would be more.
    #[test]
    fn one_stuck_taxel_is_found_or_does_no_harm() {
        for (name, presses) in [("eight-by-eight", 24), ("sensor-1", 8)] {
            let (frames, evidence) = (stuck(name, presses), Evidence::new(&Scene::builtin(name).unwrap()));
            let wrong = silent(&evidence, &frames);
            assert!(100 * wrong <= 3 * frames.len(), "{name}: {wrong} of {}", frames.len());
            let (_, draws) = draws(name);
            for number in 0..presses {
                let b = draws.frame(number).unwrap().exact_MPa;
                assert!(evidence.solve(&b, None).suspects.is_empty(), "{name} {number}");
            }
            let unscreened = silent(&Evidence { screen: None, ..evidence }, &frames);
            assert!(name == "sensor-1" || 100 * unscreened > 3 * frames.len(), "{name}: {unscreened}");
        }
    }

    /// Where the other readings see no load, as beside a light contact on one taxel, only the evidence judges.
    #[test]
    fn what_the_others_do_not_see_is_not_suspect() {
        let (scene, draws) = draws("eight-by-eight");
        let evidence = Evidence::new(&scene);
        let b = draws.frame(0).unwrap().exact_MPa;
        let peak_MPa = draws.frame(0).unwrap().peak_MPa();
        let b: Vec<f64> = b.iter().map(|b| b / peak_MPa).collect();
        fn trial<'a>(scene: &'a Evidence, b: &'a [f64]) -> Trial<'a> {
            let (suspects, tried) = (Vec::new(), Vec::new());
            Trial { scene, b, there: &[true; 64], stated: None, suspects, tried, work: 0 }
        }
        let found = trial(&evidence, &b).fit(None).unwrap();
        let judged = |evidence: &Evidence, reads: f64, mean: f64| {
            let mut b = b.clone();
            b[9] = reads;
            let mut other = Fit::new(evidence, &b, &[true; 64], None).run().unwrap();
            other.predicted = vec![Predicted { taxel: 9, mean, variance: 1e-4 }];
            // Neither is more probable.
            other.evidence = found.evidence;
            trial(evidence, &b).is_suspect(9, &other, Some(&found))
        };
        assert!(judged(&evidence, 0.5, 0.2) && !judged(&evidence, 0.5, 0.04));
        // An array that reads no tension reads 0 for it.
        let unipolar = Evidence { unipolar: true, ..Evidence::new(&scene) };
        let zeros = [0.0; 64];
        let of = |scene| trial(scene, &zeros).distance(&Predicted { taxel: 9, mean: -0.2, variance: 1e-4 });
        assert!(of(&evidence) > UNPREDICTED && of(&unipolar) == 0.0);
    }
}
