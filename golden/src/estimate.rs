//! Estimate: from stress to forces in floating point.
//!
//! | module | content |
//! |---|---|
//! | [`float`] | the stages in floating point, the objectives, and the golden engine that runs them |
//! | [`degree`] | how many terms the series in μ needs |
//! | [`segment`] | the contact to which each taxel belongs |
//! | [`evidence`] | forces and standard deviations for contacts of any shape under noise |
//! | [`learned`] | shear by a small network that is trained on the scene's own physics |
//! | [`deviations`] | standard deviations of forces that a search found |
//! | [`misfit`] | how far a frame is from those of a network's training |
//! | [`blind_gains`] | blind calibration: gains of the taxels from presses of unknown load |

pub mod blind_gains;
pub mod degree;
pub mod deviations;
pub mod evidence;
pub mod float;
pub mod learned;
pub mod misfit;
pub mod segment;
