//! Checks: the figures behind the flags of a result.
//!
//! | field | unit | by |
//! |---|---|---|
//! | `full_scale_share` | – | [`Input`](crate::data::input::Input) |
//! | `peak_MPa`, `mu_share`, `border_share` | MPa, –, – | [`Reconstruction::figures`](crate::result::reconstruct::Reconstruction::figures) |
//! | `load_ratio` | – | the golden engine |
//! | `shape_misfit` | – | the golden engine, with `patch` and `symmetric` |
//! | `noise_MPa` | MPa | the estimators with evidence, the [cross-check](crate::engine::CrossCheck) of the others |
//! | `misfit_probability` | – | the same, where the noise is stated |
//! | `baseline_MPa`, `residual_outlier`, `residual_correlation` | MPa, –, – | the same |
//! | `tangential_difference`, `normal_difference`, `cross_check_age` | –, –, results | the cross-check |
//! | `network_misfit` | – | both models, with a network, [`Misfit`](crate::estimate::misfit::Misfit) |
//! | `shear_spread` | – | all, with `search` where scene or tare frames state the noise ([`Deviations`](crate::estimate::deviations::Deviations)) |
//! | `score_margin` | bits | all, with `search` and a table of [`Deviations`](crate::estimate::deviations::Deviations) |
//! | `negative_pressure` | – | the same, with a force per taxel |
//! | `plateau`, `line_share`, `coarse_share`, `missing_share` | – | all, [`readings`] |
//! | `missing_load`, `missing_shear` | – | all, where a reading is missing |
//! | `pull_share` | – | all, [`pull`] |
//! | `zero_share` | – | all, with `input.zero = "running"`, [`running_zero`](crate::data::input::running_zero) |
//! | `constant_share`, `torn_share` | – | streams, [`history`] |
//!
//! The flag of a figure, its limit and its words are in the flag's row, [`crate::result::flags`].
//! A figure is there whenever it can be computed, whether or not its flag is raised.

pub mod history;
pub mod pull;
pub mod readings;
#[cfg(test)]
mod tests;

use crate::data::frame::Frame;
use crate::data::input::missing::open_share;
use crate::spec::scene::Scene;
use schemars::JsonSchema;
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
/// Distance of a reading from what the others predict, in standard deviations, that noise does not have: Gaussian noise has it
/// on one of 48 × 48 taxels in a hundredth of the frames. And correlation of what the estimate leaves of neighbours: on 1600 drawn
/// frames of sensor-1 and eight-by-eight with 0 to 1 % of noise the largest was 2.4.
pub const OUTLIER: f64 = 4.6;
/// See [`OUTLIER`].
pub const CORRELATED: f64 = 2.5;
/// [`Checks::tangential_difference`] and [`Checks::normal_difference`] above which two estimates of one frame differ.
pub const DIFFERENT: [f64; 2] = [0.12, 0.08];
/// Standard deviation of a shear, over its size, above which it is not resolved.
pub const NOT_RESOLVED: f64 = 1.0 / 3.0;
/// [`Checks::plateau`] above which readings are clipped: one frame in a thousand by chance.
pub const PLATEAU: f64 = 7.0;
/// [`Checks::line_share`] above which a row or column is faulty.
pub const LINE: f64 = 0.2;
/// [`Checks::coarse_share`] above which the shear is unreliable. Of 80 drawn presses on sensor-1 and eight-by-eight that were
/// rounded to steps of 0.39 % of the peak 7 had a shear that `evidence` reads wrong by more than 20 %, with steps of 0.78 % 23, with
/// a deadband of 0.5 % 22.
pub const COARSE: f64 = 0.004;
/// [`Checks::constant_share`] above which a taxel is stuck.
pub const CONSTANT: f64 = 0.06;
/// [`Checks::torn_share`] above which a frame's parts are of two moments.
pub const TORN: f64 = 0.08;

/// Error of the normal force, and of the shear, of estimators that take predicted stress for missing readings, over the share of
/// the load that the prediction leaves open. Of 1200 drawn presses with 1 to 9 taxels missing, at the peak, anywhere and as a
/// row, 95 % of the normal forces that are wrong by more than 10 %, and 90 % of the shears that are wrong by more than 20 %,
/// are beyond the limits of the flags.
const ERROR_PER_OPEN: [f64; 2] = [2.0, 33.0];
/// [`Checks::pull_share`] above which zeros are too high. Presses with shear have at most 0.003 on the shipped sensors.
pub const PULL: f64 = 0.1;

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
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
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
    /// frame; `None` where nothing looked for it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub noise_MPa: Option<f64>,
    /// Probability that noise of the stated size leaves as much of the stress unexplained; `None` where no noise is stated,
    /// or without evidence.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub misfit_probability: Option<f64>,
    /// What compressive forces at the network's μ leave of the stress, over what they leave of frames like those of its
    /// training, see [`Misfit`](crate::estimate::misfit::Misfit); `None` where no network gave a μ.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub network_misfit: Option<f64>,
    /// Standard deviation of the shear over its size, the largest of all contacts or searched subarrays; `None` with `search`
    /// where no noise is stated, unless the cross-check tells it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shear_spread: Option<f64>,
    /// Root mean square of the baseline in MPa that `evidence` finds and takes off the readings, over the taxels; `None` where
    /// nothing looked for it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub baseline_MPa: Option<f64>,
    /// Distance of the reading that the others explain least, in standard deviations; `None` without evidence.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub residual_outlier: Option<f64>,
    /// Correlation of what the estimate leaves of neighbouring readings, in standard deviations of that of white noise;
    /// `None` without evidence.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub residual_correlation: Option<f64>,
    /// Maximum of the objective less the least one of clean drawn frames, in bits, the least of the searched subarrays with a
    /// share of the load; `None` without a search or a table of [`Deviations`](crate::estimate::deviations::Deviations).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub score_margin: Option<f64>,
    /// Share of the normal forces that is below zero, over the largest one of clean drawn frames; `None` without a search, a table of
    /// [`Deviations`](crate::estimate::deviations::Deviations) or a force per taxel.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub negative_pressure: Option<f64>,
    /// Difference of the shear from that of the cross-check, beyond the standard deviation of the latter, over the larger of
    /// the two, or over 5 % of the normal force if that is more; `None` without a cross-check or where that fails.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tangential_difference: Option<f64>,
    /// The same of the normal force.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub normal_difference: Option<f64>,
    /// Number of results since the one that was cross-checked last, whose figures these are; `None` without a cross-check.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cross_check_age: Option<u64>,
    /// Logarithm of the inverse probability that as many readings are the largest by rounding, see [`readings`]; `None` where
    /// all are equal.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub plateau: Option<f64>,
    /// Largest range of a row or column that repeats the next one or lies beside a silent one, over the frame's, see
    /// [`readings`]; `None` on arrays of few rows and columns, and where all readings are equal.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub line_share: Option<f64>,
    /// Distance from the value that a quarter of the readings have to the bit to the next one, a converter's step or a deadband,
    /// over the largest distance from it, see [`readings`]; `None` where fewer are equal.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub coarse_share: Option<f64>,
    /// Largest change of the taxels beside one that stands still, over the range of a frame, see [`history`]; `None` but in
    /// streams.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub constant_share: Option<f64>,
    /// Range of a part of the frame that is that of the frame before, or change of the rest if smaller, over the range of a
    /// frame, see [`history`]; `None` but in streams.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub torn_share: Option<f64>,
    /// Largest share of the live taxels without a reading in a frame; `None` where none is missing.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub missing_share: Option<f64>,
    /// Error of the normal force that missing readings leave open, over the force: with evidence twice its standard deviation;
    /// `None` where no reading is missing.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub missing_load: Option<f64>,
    /// The same of the shear; `None` too with evidence, whose `shear_spread` holds it, and without a search.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub missing_shear: Option<f64>,
    /// Largest sum of stress below zero over that and the largest above, see [`pull`]; `None` where none is significant.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pull_share: Option<f64>,
    /// Largest distance of a running zero from the stored one, over its limit; `None` where zeros are fixed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub zero_share: Option<f64>,
}

impl Checks {
    /// With what missing readings of the calibrated `frame` leave open, where the estimator has not said it.
    pub fn with_missing(self, scene: &Scene, frame: &Frame) -> Checks {
        let open = open_share(&scene.input, frame).filter(|_| self.missing_load.is_none());
        let [load, shear] = ERROR_PER_OPEN.map(|error| open.map(|open| error * open));
        let missing_shear = shear.filter(|_| scene.search.mu_max > 0.0);
        Checks { missing_load: self.missing_load.or(load), missing_shear, ..self }
    }

    /// Whether the estimate leaves more than noise explains, of the stated size, else of one that a sensor can have, or more
    /// than of frames like those of the network's training.
    pub(crate) fn misfits(&self) -> bool {
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

    /// Whether the cross-check reads another force.
    pub(crate) fn differs(&self) -> bool {
        let all = [self.tangential_difference, self.normal_difference];
        std::iter::zip(all, DIFFERENT).any(|(difference, most)| difference.is_some_and(|size| size > most))
    }

    /// The figure behind `misfit`, in words: of the rules that raise it the first.
    pub(crate) fn misfit_figure(&self) -> Option<String> {
        match (self.misfit_probability, self.network_misfit) {
            (probability, Some(misfit)) if misfit > 1.0 || probability.is_none() => {
                Some(format!("misfit {misfit:.3} times that of frames like the training"))
            }
            (probability, _) if self.leaves_structure() && probability.is_none_or(|p| p >= MISFIT) => {
                let figure = |size: Option<f64>| size.map_or("–".to_string(), |size| format!("{size:.1}"));
                let [outlier, correlation] = [self.residual_outlier, self.residual_correlation].map(figure);
                Some(format!("a reading {outlier} standard deviations off, correlation of neighbours {correlation}"))
            }
            (Some(probability), _) => Some(format!("probability {probability:.1e}")),
            _ => self.noise_figure(),
        }
    }

    /// Standard deviation of the shear over its size, with what missing readings leave open.
    pub(crate) fn shear_error(&self) -> Option<f64> {
        [self.shear_spread, self.missing_shear].into_iter().flatten().reduce(f64::max)
    }

    /// Whether steps of the readings hide the shear.
    pub(crate) fn is_coarse(&self) -> bool {
        self.coarse_share.is_some_and(|share| share > COARSE)
    }

    /// The steps of the readings or the noise, in words.
    pub(crate) fn rounding_figure(&self) -> Option<String> {
        let coarse = self.coarse_share.filter(|_| self.is_coarse());
        coarse
            .map(|share| format!("steps of {:.1} % of the largest reading", 1e2 * share))
            .or_else(|| self.noise_figure())
    }

    /// The noise, in words.
    pub(crate) fn noise_figure(&self) -> Option<String> {
        self.noise_MPa.map(|noise| format!("noise {:.3} % of the peak", 1e2 * noise / self.peak_MPa))
    }
}
