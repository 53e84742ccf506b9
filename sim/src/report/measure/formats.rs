//! Formats: a few number formats for a scene, from the cheapest to the finest, on the same frames.

use anyhow::Result;
use dermis_golden::fixed::{Cycles, Model};
use dermis_golden::frame::Frame;
use dermis_golden::scene::Scene;

use crate::compare::{median, quantile};

/// `input_bits`, `inverse_bits`, `data_bits`, `coef_bits` that are worth a choice.
const CANDIDATES: [[u32; 4]; 5] =
    [[16, 18, 16, 16], [16, 18, 18, 18], [16, 24, 18, 18], [20, 18, 18, 18], [20, 24, 18, 18]];

/// A format of a scene and what it gives.
#[derive(Clone, Debug, PartialEq)]
pub struct FormatRow {
    /// Scene name.
    pub scene: String,
    /// The case, as scenes name it.
    pub case: String,
    /// `input_bits`, `inverse_bits`, `data_bits`, `coef_bits`.
    pub bits: [u32; 4],
    /// Tangential error of the bit-true model, median over the frames.
    pub tangential: Option<f64>,
    /// Nine of ten frames stay below.
    pub ninety: Option<f64>,
    /// Normal error, median.
    pub normal: Option<f64>,
    /// From the first input beat to the last output beat with every subarray searched.
    pub cycles: u64,
    /// Block RAMs.
    pub block_rams: usize,
    /// Multipliers.
    pub multipliers: usize,
}

/// The candidates that a scene can have on its board.
///
/// # Errors
/// A frame that is not the scene's.
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
