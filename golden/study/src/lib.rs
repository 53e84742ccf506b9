//! Studies of the golden model: comparisons and tables that no reconstruction needs.
//!
//! | module | content |
//! |---|---|
//! | [`noise`], [`stability`] | errors with noise against the Cramér–Rao bound; errors against conditioning |
//! | [`sensor_faults`] | frames spoiled as sensors spoil them: what is flagged, what is silently wrong |
//! | [`baseline`], [`paper`] | the paper's algorithm as printed, and its published results |

pub mod baseline;
pub mod noise;
pub mod paper;
pub mod sensor_faults;
pub mod stability;
mod steps;
