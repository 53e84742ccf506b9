//! The floating-point golden model, one file per stage; stages have the names of the hardware's.
//!
//! | stage | in | out |
//! |---|---|---|
//! | [`receive`](crate::data::reception) | codes of a subarray | condition, centroids |
//! | [`pass`] | b, matrices | v_ij, the polynomial p(μ) |
//! | [`objective`] | p | its score |
//! | [`search`] | v_ij, objective | μ |
//! | [`forces`] | p(μ), μ | fx, fy, fz |
//!
//! With `partition.case = "contacts"` there are two more: [`segment`](crate::estimate::segment) assigns a region to each contact,
//! [`contacts`] finds the μ of each region.
//! With `search.form = "orthogonal"` the forces come from [`orthogonal`], Eq. 1 as printed.
//!
//! The hardware's `normalise`, `fold` and `unfold` have no counterpart here: floating point has its own exponents, and
//! folding is an exact change of basis.
//!
//! The driver: [`Golden`] runs an estimator (`golden`) between the input and the output options (`run`, with `unipolar`
//! for readings that a sensor clips); over time, with an adaptive mean, `over_time` and its `template` remember the pressure. The
//! estimators (`estimator`) compute with the matrices of
//! `array`: `by_subarray`, `adaptive` and `by_contacts` search, `by_evidence` and `by_network` take the place of a search.

pub mod contacts;
pub mod forces;
pub mod objective;
pub mod orthogonal;
pub mod pass;
pub mod search;

mod adaptive;
mod array;
#[cfg(test)]
mod bonded_tests;
mod by_contacts;
mod by_evidence;
mod by_network;
mod by_subarray;
mod error;
mod estimator;
mod golden;
#[cfg(test)]
mod golden_tests;
mod over_time;
mod ratio_mean;
mod run;
mod template;
mod unipolar;

pub use error::GoldenError;
pub use golden::Golden;
pub use over_time::Past;
