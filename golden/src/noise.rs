//! Noise: what each objective finds of the shear when the stress is noisy, beside what can be found at all.
//!
//! Seeded draws of elliptic Hertz contacts in full sliding; their stress by fine quadrature of the continuous pressure,
//! Gaussian noise of σ = level · max|b| on every taxel, once as it is and once averaged over frames.
//!
//! | | unit | |
//! |---|---|---|
//! | in: scene | – | sensor, mu_max, matrices; its noise floor is set to each level's σ |
//! | out: e_t median, 90 %, root mean square | fraction | ‖T − T_ref‖/‖T_ref‖ of the resultant |
//! | out: the same of the bound | fraction | of errors drawn from the Cramér–Rao covariance ([`bound`]) |
//! | out: ratio | – | median over the bound's median |
//!
//! An estimator without bias has errors at least as large as the bound's. One that knows that |μ| ≤ mu_max can be below
//! it where the bound is wide.

pub mod bound;
pub mod contact;
mod study;
#[cfg(test)]
mod tests;

pub use study::{study, Averaging, Row, Spread, Study, StudyError};
