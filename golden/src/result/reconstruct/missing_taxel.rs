//! Missing taxel: one without a reading in a frame.

use crate::data::frame::Frame;
use crate::spec::scene::Scene;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A live taxel without a reading in some frame of a result.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct MissingTaxel {
    /// Its row.
    pub row: usize,
    /// Its column.
    pub col: usize,
    /// Number of frames of the result that lack its reading.
    pub frames: usize,
    /// What is taken for its stress in MPa, by all estimators but those with evidence: the mean of the frames that have the
    /// reading, else what the other taxels predict.
    pub stress_MPa: f64,
}

impl MissingTaxel {
    /// The missing taxels of a result, row-major: of `frame`, the calibrated mean of `readings`.
    pub fn all(scene: &Scene, frame: &Frame, readings: &[Frame]) -> Vec<MissingTaxel> {
        let cols = scene.sensor.cols;
        let of = |(taxel, &stress_MPa): (usize, &f64)| {
            let frames = readings.iter().filter(|readings| readings.lacks(taxel)).count();
            let own = MissingTaxel { row: taxel / cols, col: taxel % cols, frames, stress_MPa };
            (frames > 0 && !scene.input.is_dead([own.row, own.col])).then_some(own)
        };
        frame.stress_MPa.iter().enumerate().filter_map(of).collect()
    }
}
