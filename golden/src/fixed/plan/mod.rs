//! The plan of a scene's hardware.

pub mod cases;
pub mod check;
pub mod cycles;
pub mod feature_costs;
pub mod fit_suggestions;
pub mod resources;
pub mod serial;
pub mod storage;
