//! The words of the pipeline and the arithmetic on them; nothing here knows a board or a scene.
//!
//! | module | content |
//! |---|---|
//! | [`arith`] | shifts, rounding, saturation, the butterfly |
//! | [`coefficients`] | a matrix folded into parity blocks and quantised |
//! | [`formats`] | widths and scales of all words |
//! | [`schedule`] | which product feeds which v_ij |
//! | [`network`] | the layers of the network that gives μ |
//! | [`quantised`] | the matrices of the passes, and the operands a lane multiplies |

pub mod arith;
pub mod coefficients;
pub mod formats;
pub mod network;
pub mod quantised;
pub mod schedule;
