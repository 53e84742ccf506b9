//! Over time: frames in their order, of which an adaptive mean is; the pressure of a contact that holds is remembered.
//!
//! ```text
//! longest mean ── estimate ── forces ── template ── fit to (newest mean − longest mean) ─┬─ it holds: forces + changes
//!                                                                                       └─ else: estimate of the window,
//!                                                                                          μ of longer means
//! ```
//! While a contact holds, its forces follow the newest frames, and its pressure has the noise of the longest mean. What the
//! template leaves is judged over the last [`FRAMES`] frames; a frame that it does not explain at all ends it at once. The newest mean
//! is the longest one after which the forces have not changed either. Of a contact that moves, the ratio of shear to normal force is
//! that of longer means as far as they agree with the window (`longer_ratio`).
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: a frame, what the frames before left | taxels, – | readings |
//! | out: result, with window and template | – | – |

use super::error::GoldenError;
use super::golden::Golden;
use super::longer_ratio;
use super::template::{Influences, Template};
use crate::data::frame::Frame;
use crate::data::input::means::{Means, Window};
use crate::data::input::memory::{Averaged, Memory};
use crate::estimate::evidence::LastFit;
use crate::result::reconstruct::{ForceChange, PressureTemplate, Reconstruction, SuspectTaxel};

/// Frames over which the residual of the template is a mean.
const FRAMES: f64 = 16.0;
/// Standard deviations of χ² over its degrees of freedom above which the template does not hold: of the mean, of a frame.
const MOST: [f64; 2] = [2.5, 12.0];
/// Largest residual of a frame that counts in the mean.
const LARGEST: f64 = 20.0;
/// Residual over what the fit explains that is not counted: the error of the remembered pressure. A contact that moves leaves a fifth.
const SHAPE_ERROR: f64 = 0.12;
/// χ² over its degrees of freedom up to which the forces of two means are the same.
const SAME: f64 = 2.0;
/// Stress over the noise above which a taxel that reads no tension presses.
const PRESSES: f64 = 3.0;

/// What the frames of a stream leave to the next ones; the default is that after a reset.
#[derive(Clone, Debug, Default)]
pub struct Past {
    /// Of the readings.
    pub memory: Memory,
    /// The fits of the last frame by the estimator `evidence`: of its mean, of its longest mean but one, and of its longest mean.
    fits: [Option<LastFit>; 3],
    /// Mean residual of the template; `None` before a frame.
    residual: Option<f64>,
}

impl Past {
    /// What they leave to another estimator.
    pub fn without_fits(self) -> Past {
        Past { fits: Default::default(), ..self }
    }

    /// The same with the readings of `memory`.
    pub fn with_memory(self, memory: Memory) -> Past {
        Past { memory, ..self }
    }
}

/// How a template explains a frame.
struct Explained {
    changes: Vec<ForceChange>,
    /// Age of the mean that the forces follow.
    age: f64,
    /// χ² over its degrees of freedom, and the standard deviation of that.
    residual: f64,
    sigma: f64,
}

/// The mean of a window of `means`; `frame` has what does not depend on it.
fn averaged(means: &Means, window: &Window, frame: &Frame) -> Averaged {
    Averaged {
        mean: Frame { stress_MPa: means.mean(window), ..frame.clone() },
        variance: window.variance,
        frames_held: Some(window.frames_held()),
        lag_frames: Some(window.age),
    }
}

impl Golden {
    /// Reconstructs frames of one result, after those of which `past` is; it is then that after these frames. Of a mean that slides
    /// they are any number, of which the last one has the result.
    ///
    /// # Errors
    /// As [`Golden::run_averaged`].
    pub fn run_after(&self, past: &mut Past, frames: &[Frame]) -> Result<Reconstruction, GoldenError> {
        let result = match (&self.influences, frames.split_last()) {
            (Some(influences), Some((last, before))) => {
                before.iter().try_for_each(|frame| self.next(past, influences, frame).map(drop))?;
                self.next(past, influences, last)?
            }
            _ => {
                let averaged = self.input.average_after(&mut past.memory, self.scene(), frames)?;
                self.of_mean(&mut past.fits[0], &past.memory, self.scene().input.newest(frames), &averaged)?
            }
        };
        Ok(self.with_output(result))
    }

    /// The result of an adaptive mean with one more frame.
    fn next(&self, past: &mut Past, influences: &Influences, frame: &Frame) -> Result<Reconstruction, GoldenError> {
        let newest = std::slice::from_ref(frame);
        let window = self.input.average_after(&mut past.memory, self.scene(), newest)?;
        let Past { memory, fits: [of_window, of_long, of_longest], residual } = past;
        let (Some(means), Some(sigma_MPa)) = (memory.means(), memory.sigma_MPa()) else {
            return self.of_mean(of_window, memory, newest, &window);
        };
        let longest = means.longest();
        let held = averaged(means, &longest, &window.mean);
        let mut result = self.of_mean(of_longest, memory, newest, &held)?;
        let explained = self.explain(influences, means, sigma_MPa, (&held.mean, &result));
        let before = residual.unwrap_or(1.0);
        let own = explained.as_ref().map_or(LARGEST, |explained| explained.residual.min(LARGEST));
        let mean = before + (own - before) / FRAMES;
        *residual = Some(mean);
        let holds = |explained: &Explained| {
            mean <= 1.0 + MOST[0] * explained.sigma && explained.residual <= 1.0 + MOST[1] * explained.sigma
        };
        let explained = explained.filter(holds);
        let template = Some(PressureTemplate { held: explained.is_some(), residual: mean });
        match explained {
            Some(Explained { changes, age, .. }) => {
                result.change(self.scene(), &held.mean, &changes);
                result.extra.lag_frames = Some(age);
            }
            None if window.variance == held.variance => (),
            None => {
                let longest = result;
                result = self.of_mean(of_window, memory, newest, &window)?;
                if longer_ratio::contacts(&result).is_some() {
                    let long = means.singles().into_iter().nth(1).filter(|long| long.variance < window.variance);
                    let long = long.map(|long| averaged(means, &long, &window.mean));
                    let long = long.map(|long| self.of_mean(of_long, memory, newest, &long)).transpose()?;
                    // From short to long: what of μ has changed shows against the noise of the mean before.
                    for longer in long.into_iter().chain([longest]) {
                        if let Some(changes) = longer_ratio::changes(self.scene(), &result, &longer) {
                            result.change(self.scene(), &window.mean, &changes);
                        }
                    }
                }
            }
        }
        result.extra.template = template;
        Ok(result)
    }

    /// How changed forces of the contacts of `result` explain the newest frames, where `mean`
    /// is the longest mean; `None` without contacts.
    fn explain(
        &self,
        influences: &Influences,
        means: &Means,
        sigma_MPa: f64,
        (mean, result): (&Frame, &Reconstruction),
    ) -> Option<Explained> {
        let (longest, shortest) = (means.longest(), means.shortest());
        let counts = self.counts(mean, sigma_MPa, &result.extra.suspects);
        let difference = |window: &Window, other: &Window| {
            let (mut d, variance) = self.input.stress_difference(means, window, other);
            d.iter_mut().zip(&counts).for_each(|(d, counts)| *d *= f64::from(u8::from(*counts)));
            (d, variance * sigma_MPa.powi(2))
        };
        let template = Template::new(influences, result, &counts)?;
        let unknowns = template.unknowns();
        let freedom = counts.iter().filter(|counts| **counts).count().saturating_sub(unknowns).max(1) as f64;
        let (d, variance) = difference(&shortest, &longest);
        let fit = template.fit(&d);
        let left = (fit.left - SHAPE_ERROR.powi(2) * fit.explained).max(0.0);
        let residual = if left > 0.0 { left / (freedom * variance) } else { 0.0 };
        // The longest mean with the forces of the newest frames.
        let same = |window: &Window| {
            let (d, variance) = difference(&shortest, window);
            template.fit(&d).explained <= SAME * unknowns as f64 * variance
        };
        let newest = means.singles().into_iter().find(same).unwrap_or(shortest);
        let (d, variance) = difference(&newest, &longest);
        let changes = std::iter::zip(template.fit(&d).changes_N, template.variances()).zip(&template.shares);
        let changes = changes.map(|((force_N, shares_of_variance), shares)| {
            // The error of the remembered pressure is in proportion to the change.
            let shape_N = SHAPE_ERROR * force_N.iter().map(|own| own * own).sum::<f64>().sqrt() / f64::sqrt(3.0);
            let variance_N2 = shares_of_variance.map(|share| share * variance + shape_N * shape_N);
            ForceChange { force_N, variance_N2, shares: shares.clone() }
        });
        Some(Explained { changes: changes.collect(), age: newest.age, residual, sigma: (2.0 / freedom).sqrt() })
    }

    /// The taxels on which readings show changed forces: live ones that no flag names, and that have a reading; of an array that reads
    /// no tension those that press.
    fn counts(&self, mean: &Frame, sigma_MPa: f64, suspects: &[SuspectTaxel]) -> Vec<bool> {
        let scene = self.scene();
        let mut counts = scene.input.alive(&scene.sensor);
        mean.missing.iter().for_each(|&taxel| counts[taxel] = false);
        suspects.iter().for_each(|own| counts[own.row * scene.sensor.cols + own.col] = false);
        if scene.input.unipolar {
            let least_MPa = PRESSES * sigma_MPa;
            counts
                .iter_mut()
                .zip(self.input.calibrate(mean).stress_MPa)
                .for_each(|(counts, b)| *counts &= b > least_MPa);
        }
        counts
    }
}

#[cfg(test)]
mod tests;
