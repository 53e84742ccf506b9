//! Over time: frames in their order, of which an adaptive mean is; the pressure of a contact that holds is remembered.
//!
//! ```text
//! pressure of the frame before ── template ── fit to (newest mean − longest mean)
//!   it holds:  estimate of the longest mean, forces changed by the fit
//!   else:      estimate of the window, ratio of shear to normal force with its mean over the frames
//! ```
//! While a contact holds, its forces follow the newest frames, and its pressure has the noise of the longest mean. What the
//! template leaves is judged over the last [`FRAMES`] frames; a frame that it does not explain at all ends it at once. The newest mean
//! is that of the two shortest, the longer one as far as the forces have not changed since. Of a contact that moves the ratio of shear to
//! normal force is that of `ratio_mean`.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: a frame, what the frames before left | taxels, – | readings |
//! | out: result, with window and template | – | – |

use super::error::GoldenError;
use super::golden::Golden;
use super::ratio_mean::{self, RatioMean};
use super::template::{shares, Influences, Template};
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
/// Force of a change over that of the fit, which finds too large ones: chosen on drawn presses of sensor-1 whose shear turns and oscillates,
/// with `network` and with `evidence`.
const OF_FIT: f64 = 0.92;
/// Stress over the noise above which a taxel that reads no tension presses.
const PRESSES: f64 = 3.0;

/// What the frames of a stream leave to the next ones; the default is that after a reset.
#[derive(Clone, Debug, Default)]
pub struct Past {
    /// Of the readings.
    pub memory: Memory,
    /// The fit of the last frame by the estimator `evidence`.
    fit: Option<LastFit>,
    /// The contacts of the last result; `None` where nothing pressed.
    contacts: Option<LastContacts>,
    /// Mean residual of the template; `None` before a frame.
    residual: Option<f64>,
    /// Ratios of shear to normal force, of an adaptive mean.
    ratios: Vec<RatioMean>,
}

/// What a template is of.
#[derive(Clone, Debug)]
struct LastContacts {
    /// Share of each taxel in the normal force of each contact.
    shares: Vec<Vec<f64>>,
    suspects: Vec<SuspectTaxel>,
}

impl Past {
    /// What they leave to another estimator.
    pub fn without_fits(self) -> Past {
        Past { fit: None, ..self }
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
                self.of_mean(&mut past.fit, &past.memory, self.scene().input.newest(frames), &averaged)?
            }
        };
        Ok(self.with_output(result))
    }

    /// The result of an adaptive mean with one more frame.
    fn next(&self, past: &mut Past, influences: &Influences, frame: &Frame) -> Result<Reconstruction, GoldenError> {
        let newest = std::slice::from_ref(frame);
        let window = self.input.average_after(&mut past.memory, self.scene(), newest)?;
        let Past { memory, fit, contacts, residual, ratios } = past;
        let (Some(means), Some(sigma_MPa)) = (memory.means(), memory.sigma_MPa()) else {
            return self.of_mean(fit, memory, newest, &window);
        };
        let held = Averaged::of_window(means, &means.longest(), window.mean.clone());
        let explained =
            contacts.take().and_then(|contacts| self.explain(influences, means, sigma_MPa, &held.mean, contacts));
        // Before the first frame there is nothing that could explain it.
        let unexplained = if residual.is_some() { LARGEST } else { 1.0 };
        let own = explained.as_ref().map_or(unexplained, |explained| explained.residual.min(LARGEST));
        let before = residual.unwrap_or(1.0);
        let mean = before + (own - before) / FRAMES;
        *residual = Some(mean);
        let holds = |explained: &Explained| {
            mean <= 1.0 + MOST[0] * explained.sigma && explained.residual <= 1.0 + MOST[1] * explained.sigma
        };
        let explained = explained.filter(holds);
        let template = Some(PressureTemplate { held: explained.is_some(), residual: mean });
        let taken = if explained.is_some() { held } else { window };
        let mut result = self.of_mean(fit, memory, newest, &taken)?;
        let suspects = result.extra.suspects.clone();
        *contacts = shares(&self.scene().sensor, &result).map(|shares| LastContacts { shares, suspects });
        let shares = contacts.as_ref().map_or(&[][..], |contacts| &contacts.shares);
        if let Some(Explained { changes, age, .. }) = &explained {
            result.change(self.scene(), &taken.mean, changes);
            result.extra.lag_frames = Some(*age);
        }
        let changes = ratio_mean::follow(ratios, self.scene(), &result, 1.0 / taken.variance, shares);
        if explained.is_none() && !changes.is_empty() {
            result.change(self.scene(), &taken.mean, &changes);
        }
        result.extra.template = template;
        Ok(result)
    }

    /// How changed forces of the last `contacts` explain the newest frames, where `mean` is the longest mean; `None` where the readings
    /// do not tell.
    fn explain(
        &self,
        influences: &Influences,
        means: &Means,
        sigma_MPa: f64,
        mean: &Frame,
        contacts: LastContacts,
    ) -> Option<Explained> {
        let (longest, shortest) = (means.longest(), means.shortest());
        let counts = self.counts(mean, sigma_MPa, &contacts.suspects);
        let difference = |window: &Window, other: &Window| {
            let (mut d, variance) = self.input.stress_difference(means, window, other);
            d.iter_mut().zip(&counts).for_each(|(d, counts)| *d *= f64::from(u8::from(*counts)));
            (d, variance * sigma_MPa.powi(2))
        };
        let template = Template::new(influences, contacts.shares, &counts)?;
        let unknowns = template.unknowns();
        let freedom = counts.iter().filter(|counts| **counts).count().saturating_sub(unknowns).max(1) as f64;
        let (d, variance) = difference(&shortest, &longest);
        let fit = template.fit(&d);
        let left = (fit.left - SHAPE_ERROR.powi(2) * fit.explained).max(0.0);
        let residual = if left > 0.0 { left / (freedom * variance) } else { 0.0 };
        // What two short means differ in beyond their noise has changed since: the longer one counts by the linear estimate of least variance.
        let second = means.second_shortest();
        let (d, variance) = difference(&second, &shortest);
        let changed = template.fit(&d).explained;
        let share = if changed > 0.0 { (unknowns as f64 * variance / changed).min(1.0) } else { 1.0 };
        let newest = means.between(&shortest, &second, share);
        let (d, variance) = difference(&newest, &longest);
        let changes = std::iter::zip(template.fit(&d).changes_N, template.variances()).zip(&template.shares);
        let changes = changes.map(|((fitted_N, shares_of_variance), shares)| {
            let force_N = fitted_N.map(|fitted_N| OF_FIT * fitted_N);
            // The error of the remembered pressure is in proportion to the change.
            let shape_N = SHAPE_ERROR * force_N.iter().map(|own| own * own).sum::<f64>().sqrt() / f64::sqrt(3.0);
            let variance_N2 = shares_of_variance.map(|share| OF_FIT.powi(2) * share * variance + shape_N * shape_N);
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
