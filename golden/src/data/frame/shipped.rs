//! The frames that are embedded in the crate.

use super::{json, Frame};
use crate::spec::scene::Scene;
use include_dir::{include_dir, Dir};

static FRAMES: Dir = include_dir!("$CARGO_MANIFEST_DIR/data/frames");

impl Frame {
    /// The embedded frames of the scene's sensor and medium, sorted by id; all have a known resultant.
    ///
    /// ```
    /// use dermis_golden::{data::frame::Frame, spec::scene::Scene};
    ///
    /// for frame in Frame::shipped(&Scene::builtin("sensor-1")?) {
    ///     // All contacts are inside the array: the forces on the cells add up to the resultant.
    ///     let (resultant, cells) = (frame.resultant_N.unwrap(), frame.cell_forces_N.unwrap().resultant());
    ///     assert!((0..3).all(|axis| (cells[axis] - resultant[axis]).abs() < 1e-6 * resultant[2]));
    /// }
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn shipped(scene: &Scene) -> Vec<Frame> {
        let mut frames: Vec<Frame> = texts()
            .filter_map(|(file, text)| json::parse(text, &file, &file, None).ok())
            .filter(|frame| frame.sensor == scene.sensor && frame.medium == Some(scene.medium))
            .collect();
        frames.sort_by(|a, b| a.id.cmp(&b.id));
        frames
    }
}

/// Name and text of every shipped JSON file.
fn texts() -> impl Iterator<Item = (String, &'static str)> {
    FRAMES.files().filter_map(|file| {
        let name = file.path().to_str()?;
        let text = file.contents_utf8()?;
        name.ends_with(".json").then(|| (name.to_string(), text))
    })
}

/// Whether every shipped file can be parsed.
#[cfg(test)]
pub(super) fn all_parse() -> bool {
    texts().all(|(file, text)| json::parse(text, &file, &file, None).is_ok())
}
