//! Drawn frames of the studies, and their error.

use anyhow::Result;
use dermis_golden::data::frame::Frame;
use dermis_golden::result::reconstruct::Reconstruction;
use dermis_golden::spec::scene::Scene;

use crate::drawn_frames::{DrawnFrames, Shapes};
use dermis_golden::quantile::median;

/// Drawn frames of a line of a study.
pub const FRAMES: u32 = 100;

/// [`FRAMES`] frames of one elliptic contact each, from the first seed.
///
/// # Errors
/// A stress that is not finite.
pub fn one_contact(scene: &Scene) -> Result<Vec<Frame>> {
    let draw = DrawnFrames { frames: FRAMES, contacts: vec![1], shapes: Shapes::Elliptic, touching: false, seed: 1 };
    draw.draw(scene)
}

/// Median tangential error of results, a fraction; `None` where no frame has a shear.
pub fn tangential(results: &[Reconstruction]) -> Option<f64> {
    median(results.iter().filter_map(|result| result.error.as_ref()?.tangential).collect())
}
