//! The floating-point golden model, one file per stage; stages have the names of the hardware's.
//!
//! | stage | in | out |
//! |---|---|---|
//! | [`receive`](crate::reception) | codes of a subarray | condition, centroids |
//! | [`pass`] | b, matrices | v_ij, the polynomial p(μ) |
//! | [`objective`] | p | its score |
//! | [`search`] | v_ij, objective | μ |
//! | [`force`] | p(μ), μ | fx, fy, fz |
//!
//! With `partition.case = "contacts"` there are two more: [`segment`] assigns a region to each contact, [`contacts`]
//! finds the μ of each region.
//! With `search.form = "orthogonal"` the forces come from [`orthogonal`], Eq. 1 as printed.
//!
//! The hardware's `normalise`, `fold` and `unfold` have no counterpart here: floating point has its own exponents, and
//! folding is an exact change of basis.

pub mod contacts;
pub mod force;
pub mod objective;
pub mod orthogonal;
pub mod pass;
pub mod search;
pub mod segment;
