//! Number formats: errors and resources of candidate formats of a scene on the same frames.

use anyhow::Result;
use dermis_golden::data::frame::Frame;
use dermis_golden::fixed::{Cycles, Model};
use dermis_golden::spec::scene::Scene;

use dermis_golden::quantile::{median, quantile};

/// Candidate formats from the cheapest to the finest: `input_bits`, `inverse_bits`, `data_bits`, `coef_bits`.
const CANDIDATES: [[u32; 4]; 5] =
    [[16, 18, 16, 16], [16, 18, 18, 18], [16, 24, 18, 18], [20, 18, 18, 18], [20, 24, 18, 18]];

/// Errors and resources of a scene in one format.
#[derive(Clone, Debug, PartialEq)]
pub struct FormatRow {
    /// Scene name.
    pub scene: String,
    /// Case, as named in scene files.
    pub case: String,
    /// `input_bits`, `inverse_bits`, `data_bits`, `coef_bits`.
    pub bits: [u32; 4],
    /// Tangential error of the bit-true model, median over the frames.
    pub tangential: Option<f64>,
    /// 90 % quantile of the tangential error.
    pub ninety: Option<f64>,
    /// Number of frames.
    pub frames: usize,
    /// Normal error, median over the frames.
    pub normal: Option<f64>,
    /// Cycles from the first input beat to the last output beat if every subarray is searched.
    pub cycles: u64,
    /// Number of block RAMs.
    pub block_rams: usize,
    /// Number of multipliers.
    pub multipliers: usize,
}

/// Measures the candidate formats with which a scene fits its board.
///
/// # Errors
/// A frame of another sensor.
pub fn formats(scene: &Scene, frames: &[Frame]) -> Result<Vec<FormatRow>> {
    let mut rows = Vec::new();
    for bits in CANDIDATES {
        let mut scene = scene.clone();
        let fixed = &mut scene.fixed;
        [fixed.input_bits, fixed.inverse_bits, fixed.data_bits, fixed.coef_bits] = bits;
        let Ok(model) = Model::new(&scene) else { continue };
        let results = frames.iter().map(|frame| model.reconstruct(frame)).collect::<Result<Vec<_>, _>>()?;
        let shear: Vec<f64> = results.iter().filter_map(|result| result.error?.tangential).collect();
        rows.push(FormatRow {
            scene: scene.name.clone(),
            case: scene.partition.case.to_string(),
            bits,
            frames: frames.len(),
            ninety: quantile(shear.clone(), 0.9),
            tangential: median(shear),
            normal: median(results.iter().filter_map(|result| result.error?.normal).collect()),
            cycles: Cycles::longest(&model).total,
            block_rams: model.resources.block_rams(),
            multipliers: model.resources.multipliers(),
        });
    }
    Ok(rows)
}
