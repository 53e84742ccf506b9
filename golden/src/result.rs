//! Result: what every engine returns, and what a user must know before trusting it.
//!
//! | module | content |
//! |---|---|
//! | [`reconstruct`] | forces, contacts and their standard deviations |
//! | [`errors`] | errors relative to known forces |
//! | [`flags`], [`checks`] | limitations of a result, and their figures |

pub mod checks;
pub mod errors;
pub mod flags;
pub mod reconstruct;
