//! The words of the pipeline and the arithmetic on them; nothing here knows a board or a scene.

pub mod arith;
pub mod coefficients;
pub mod formats;
pub mod schedule;
