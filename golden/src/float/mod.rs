//! The floating-point golden model, stage by stage; the stages carry the hardware's names.
//!
//! | stage | in | out |
//! |---|---|---|
//! | [`receive`] | codes of a subarray | condition, centroids |
//! | [`pass`] | b, matrices | v_ij, the polynomial p(μ) |
//! | [`objective`] | p | its score |
//! | [`search`] | v_ij, objective | μ |
//! | [`force`] | p(μ), μ | fx, fy, fz |
//!
//! With `partition.case = "contacts"` two more: [`segment`] draws a region for each contact, [`contacts`] finds
//! their μ.
//! With `search.form = "orthogonal"` the forces come from [`orthogonal`], Eq. 1 as printed.
//!
//! The hardware's `normalise`, `fold` and `unfold` change no value here: floating point carries its exponent along, and
//! folding is an exact change of basis.

pub mod contacts;
pub mod force;
pub mod objective;
pub mod orthogonal;
pub mod pass;
pub mod receive;
pub mod search;
pub mod segment;
