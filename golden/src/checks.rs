//! Checks: the figures behind the flags of a result.
//!
//! | field | unit | flag | raised when | by |
//! |---|---|---|---|---|
//! | `full_scale_share` | – | `saturated` | a reading rounds to the last code of `input.full_scale_MPa` | [`Input`](crate::input::Input) |
//! | `peak_MPa` | MPa | `implausible-stress` | above `input.plausible_MPa` | [`Reconstruction::figures`](crate::reconstruct::Reconstruction::figures) |
//! | `mu_share` | – | `mu-at-bound` | at least [`MU_AT_BOUND`] | [`Reconstruction::figures`](crate::reconstruct::Reconstruction::figures) |
//! | `border_share` | – | none; beside `load-outside` | – | [`Reconstruction::figures`](crate::reconstruct::Reconstruction::figures) |
//! | `load_ratio` | – | `load-mismatch` | off 1 by more than [`LOAD_MISMATCH`] | the golden engine |
//! | `shape_misfit` | – | `shape-mismatch` | above 1 | the golden engine, with `patch` and `symmetric` |
//! | `noise_MPa` | MPa | `shear-unreliable` | above [`FOUND_NOISE_LIMIT`](crate::reconstruct::FOUND_NOISE_LIMIT) of the peak, with `search` | the estimators `evidence` and `learned`, [`Reconstruction::find_noise`](crate::reconstruct::Reconstruction::find_noise) |
//! | `misfit_probability` | – | `misfit` | below [`MISFIT`] | the same, where the noise is stated |
//! | `noise_MPa` | MPa | `misfit` | above [`LOUD`] of the peak | the same, where the noise is not stated |
//! | `baseline_MPa` | MPa | `shear-unreliable` | above [`FOUND_NOISE_LIMIT`](crate::reconstruct::FOUND_NOISE_LIMIT) of the peak, with `search` | the estimators `evidence` and `learned`, `Reconstruction::find_noise` |
//! | `residual_outlier` | – | `misfit` | above [`OUTLIER`] | the estimators `evidence` and `learned` |
//! | `residual_correlation` | – | `misfit` | above [`CORRELATED`] | the same |
//! | `network_misfit` | – | `misfit` | above 1 | both models, with a network, [`Misfit`](crate::misfit::Misfit) |
//! | `shear_spread` | – | `shear-not-resolved` | above [`NOT_RESOLVED`] | all, with `search` where scene or tare frames state the noise ([`Deviations`](crate::deviations::Deviations)) |
//!
//! A figure is there whenever it can be computed, whether or not its flag is raised.

#[cfg(test)]
mod tests;

use crate::flags::Flag;
use crate::scene::Scene;
use serde::{Deserialize, Serialize};

/// Share of `search.mu_max` from which on a μ counts as being at its bound. The search's last step is 1/384; a friction
/// ratio beyond the bound gave 0.95 to 1 on drawn frames of the shipped sensors.
pub const MU_AT_BOUND: f64 = 0.95;
/// Share of the array's normal load below which a subarray or contact does not count for the flags of its shear.
pub const COUNTS_FROM: f64 = 0.05;
/// Largest difference of `load_ratio` from 1.
pub const LOAD_MISMATCH: f64 = 0.1;
/// Probability of what is left unexplained below which the model does not fit: one frame in a thousand.
pub const MISFIT: f64 = 1e-3;
/// Noise found from a frame, relative to its peak, that no sensor has: the model does not fit. Real arrays have 0.006 to
/// 0.027.
pub const LOUD: f64 = 0.1;
/// Distance of a reading from what the others predict, in standard deviations, that noise does not have, and correlation of
/// what the estimate leaves of neighbours. On 1600 drawn frames of sensor-1 and eight-by-eight with 0 to 1 % of noise the
/// largest were 5.0 and 2.4.
pub const OUTLIER: f64 = 5.0;
/// See [`OUTLIER`].
pub const CORRELATED: f64 = 2.5;
/// Standard deviation of a shear, over its size, above which it is not resolved.
pub const NOT_RESOLVED: f64 = 1.0 / 3.0;

/// Ratio to the normal force below which a shear counts as none.
const NO_SHEAR: f64 = 0.01;

/// Standard deviation `sigma` of the shear, [x, y], over its size. Below 0.01 of `normal` a shear counts as none, and its
/// standard deviation is taken over that.
pub(crate) fn relative_spread(shear: [f64; 2], sigma: [f64; 2], normal: f64) -> f64 {
    sigma[0].hypot(sigma[1]) / shear[0].hypot(shear[1]).max(NO_SHEAR * normal)
}

/// The largest relative spread of a shear among contacts that count, each with its normal force in N and its spread, where
/// that is known.
pub(crate) fn largest_spread(contacts: &[(f64, Option<f64>)]) -> Option<f64> {
    let total: f64 = contacts.iter().map(|(normal, _)| normal).sum();
    let counts = contacts.iter().filter(|(normal, _)| *normal >= COUNTS_FROM * total);
    counts.filter_map(|(_, spread)| *spread).filter(|spread| spread.is_finite()).reduce(f64::max)
}

/// The figures behind the flags of one result.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Checks {
    /// Largest of the readings, the zeros and the calibrated readings of live taxels, each over the stated full scale;
    /// `None` if the scene states none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub full_scale_share: Option<f64>,
    /// Largest |b| in MPa, of the calibrated mean of the frames, without dead taxels.
    pub peak_MPa: f64,
    /// Largest |μ| of a searched subarray or contact over `search.mu_max`; `None` without a search.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mu_share: Option<f64>,
    /// Share of the normal load Σ|fz| in the array's outermost rows and columns; `None` without a force per taxel, a
    /// load or an interior.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub border_share: Option<f64>,
    /// Normal force over the one of the same stress without shear, Σ Cz⁺b; `None` for other engines than `golden`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub load_ratio: Option<f64>,
    /// Root mean square of what the fitted shape leaves of the stress, over what the stated noise and the fit's own
    /// error explain; the largest of all subarrays. `None` without the objective `patch` or `symmetric`, or where `auto`
    /// takes `sparse`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shape_misfit: Option<f64>,
    /// Standard deviation of the noise in MPa that the estimate rests on: the scene's, else the one found from the
    /// frame. With `search` the one found from the frame; `None` where nothing looked for it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub noise_MPa: Option<f64>,
    /// Probability that noise of the stated size leaves as much of the stress unexplained; `None` with `search`, or
    /// where no noise is stated.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub misfit_probability: Option<f64>,
    /// What compressive forces at the network's μ leave of the stress, over what they leave of frames like those of its
    /// training, see [`Misfit`](crate::misfit::Misfit); `None` where no network gave a μ.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub network_misfit: Option<f64>,
    /// Standard deviation of the shear over its size, the largest of all contacts or searched subarrays; `None` with `search`
    /// where no noise is stated.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shear_spread: Option<f64>,
    /// Root mean square of the baseline in MPa that `evidence` finds and takes off the readings, over the taxels; `None` where
    /// nothing looked for it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub baseline_MPa: Option<f64>,
    /// Distance of the reading that the others explain least, in standard deviations; `None` but for `evidence`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub residual_outlier: Option<f64>,
    /// Correlation of what the estimate leaves of neighbouring readings, in standard deviations of that of white noise;
    /// `None` but for `evidence`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub residual_correlation: Option<f64>,
}

impl Checks {
    /// The figure behind a flag, in words; `None` for flags without one.
    pub fn figure(&self, flag: Flag) -> Option<String> {
        match flag {
            Flag::Saturated => self.full_scale_share.map(|share| format!("{share:.3} of full scale")),
            Flag::MuAtBound => self.mu_share.map(|share| format!("{share:.3} of mu_max")),
            Flag::ImplausibleStress => Some(format!("{:.3} MPa", self.peak_MPa)),
            Flag::LoadOutside => {
                self.border_share.map(|share| format!("{:.1} % of the load at the border", 1e2 * share))
            }
            Flag::LoadMismatch => self.load_ratio.map(|ratio| format!("{ratio:.3} of the load without shear")),
            Flag::ShapeMismatch => self.shape_misfit.map(|misfit| format!("misfit {misfit:.3} times the allowed")),
            Flag::ShearNotResolved => {
                self.shear_spread.map(|spread| format!("standard deviation {:.0} % of the shear", 1e2 * spread))
            }
            Flag::ShearUnreliable => self.noise_MPa.map(|noise| noise_figure(noise, self.peak_MPa)),
            Flag::Misfit => match (self.misfit_probability, self.network_misfit) {
                (probability, Some(misfit)) if misfit > 1.0 || probability.is_none() => {
                    Some(format!("misfit {misfit:.3} times that of frames like the training"))
                }
                _ if self.leaves_structure() && probability_explains(self.misfit_probability) => {
                    let figure = |size: Option<f64>| size.map_or("–".to_string(), |size| format!("{size:.1}"));
                    let [outlier, correlation] = [self.residual_outlier, self.residual_correlation].map(figure);
                    Some(format!(
                        "a reading {outlier} standard deviations off, correlation of neighbours {correlation}"
                    ))
                }
                (Some(probability), _) => Some(format!("probability {probability:.1e}")),
                _ => self.noise_MPa.map(|noise| noise_figure(noise, self.peak_MPa)),
            },
            _ => None,
        }
    }

    /// Whether the estimate leaves more than noise explains, of the stated size, else of one that a sensor can have, or more
    /// than of frames like those of the network's training.
    fn misfits(&self) -> bool {
        let unlike = self.network_misfit.is_some_and(|misfit| misfit > 1.0);
        unlike
            || self.leaves_structure()
            || match self.misfit_probability {
                Some(probability) => probability < MISFIT,
                None => self.noise_MPa.is_some_and(|noise| noise > LOUD * self.peak_MPa),
            }
    }

    /// Whether what the estimate leaves cannot be white noise of any size.
    pub(crate) fn leaves_structure(&self) -> bool {
        self.residual_outlier.is_some_and(|size| size > OUTLIER)
            || self.residual_correlation.is_some_and(|size| size > CORRELATED)
    }

    /// The flags that the figures raise.
    pub fn flags(&self, scene: &Scene) -> impl Iterator<Item = Flag> {
        let last_code = 1.0 - 0.5 / f64::from(crate::quantise::largest_code(scene.fixed.input_bits));
        [
            (Flag::Saturated, self.full_scale_share.is_some_and(|share| share >= last_code)),
            (Flag::MuAtBound, self.mu_share.is_some_and(|share| share >= MU_AT_BOUND)),
            (Flag::ImplausibleStress, self.peak_MPa > scene.input.plausible_MPa),
            (Flag::ShapeMismatch, self.shape_misfit.is_some_and(|misfit| misfit > 1.0)),
            (Flag::Misfit, self.misfits()),
            (Flag::ShearNotResolved, self.shear_spread.is_some_and(|spread| spread > NOT_RESOLVED)),
            (Flag::LoadMismatch, self.load_ratio.is_some_and(|ratio| (ratio - 1.0).abs() > LOAD_MISMATCH)),
        ]
        .into_iter()
        .filter_map(|(flag, raised)| raised.then_some(flag))
    }
}

/// Whether the stated noise, if there is one, explains what is left.
fn probability_explains(probability: Option<f64>) -> bool {
    probability.is_none_or(|probability| probability >= MISFIT)
}

fn noise_figure(noise_MPa: f64, peak_MPa: f64) -> String {
    format!("noise {:.3} % of the peak", 1e2 * noise_MPa / peak_MPa)
}
