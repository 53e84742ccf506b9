//! What is done to the codes of a frame as they arrive.

mod adaptive_mean;
pub(crate) mod arrays;
pub(crate) mod arrival;
pub(crate) mod average;
pub(crate) mod calibrate;
pub(crate) mod code_check;
pub(crate) mod frame_stats;
pub(crate) mod input_mask;
pub(crate) mod load;
mod running_zero;
pub(crate) mod sliding_mean;
