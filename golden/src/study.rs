//! Study: comparisons and tables that no reconstruction needs.
//!
//! | module | content |
//! |---|---|
//! | [`noise`], [`stability`] | errors with noise against the Cramér–Rao bound; errors against conditioning |
//! | [`baseline`], [`paper`] | the paper's algorithm as printed, and its published results |

pub mod baseline;
pub mod noise;
pub mod paper;
pub mod stability;
