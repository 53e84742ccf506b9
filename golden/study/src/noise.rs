//! Noise: the shear error of each objective on noisy stress, compared with the theoretical bound.
//!
//! Seeded random elliptic Hertz contacts in full sliding; their stress by fine quadrature of the continuous pressure;
//! Gaussian noise of σ = level · max|b| on every taxel, for single frames and for averages.
//!
//! | | unit | |
//! |---|---|---|
//! | in: scene | – | sensor, mu_max, matrices; the noise is that of each level |
//! | out: e_t: median, 90 % quantile, root mean square | fraction | ‖T − T_ref‖/‖T_ref‖ of the resultant |
//! | out: the same for the bound | fraction | of errors drawn from the Cramér–Rao covariance ([`bound`]) |
//! | out: ratio | – | median over the bound's median |
//!
//! [`shape_study`] does the same for contacts of any shape, several contacts, differing gains, clipped tension and any
//! estimator, beside two baselines and the bound of a smooth pressure on a known support ([`support_bound`]).
//! [`slip_study`] measures the bias of the shear in partial slip, [`press_study`] errors and lag over whole presses. [`sensitivities`] measures scenes that state something wrongly, [`unlike_study`] frames unlike those of a network's training,
//! [`measure_deviations`] the standard deviations of a search, [`blind_study`] gains found from presses of unknown load.
//!
//! The errors of an unbiased estimator are at least as large as the bound's. An estimator that uses |μ| ≤ mu_max can be
//! below the bound where it is wide.

mod blind;
pub mod bound;
pub mod contact;
pub mod coverage;
mod deviations;
pub mod expected;
pub mod matching;
#[cfg(test)]
mod misfit_tests;
mod names;
#[cfg(test)]
mod network_tests;
pub mod outcome;
mod presses;
mod sensitivity;
mod shapes;
mod slip;
pub mod statistic;
mod study;
pub mod support_bound;
#[cfg(test)]
mod tests;
mod unlike;

pub use blind::{blind_study, BlindRow, BlindStudy};
pub use deviations::{deviations_coverage, measure_deviations};
pub use names::{by_name, shapes_named};
pub use presses::{press_study, Averaged, PressEngine, PressRow, PressStudy};
pub use sensitivity::{other_medium, sensitivities, SensitivityRow};
pub use shapes::{shape_study, BoundSpread, Candidate, ShapeRow, ShapeStudy};
pub use slip::{slip_study, SlipRow};
pub use study::{study, Averaging, NoiseRow, Spread, Study, StudyError, AVERAGED};
pub use unlike::{misfit_limit, unlike_study, UnlikeRow};
