//! Frames of the arrays that one hardware serves, and the results that they give.
//!
//! ```text
//! frames ──> array 0: 0, n, 2n, …   array 1: 1, n + 1, …   ──> results in the order of the frames ──> vectors
//! ```

use std::borrow::Cow;

use anyhow::Result;
use dermis_golden::data::frame::Frame;
use dermis_golden::fixed::Model;

use super::against_model::Vector;

/// The frames of one array and its bit-true model.
pub struct ArrayFrames<'a> {
    array: usize,
    /// The model of the array alone.
    pub model: Cow<'a, Model>,
    frames: Cow<'a, [Frame]>,
}

/// What one result is of.
#[derive(Clone, Copy)]
pub struct ArrayResult<'a> {
    /// Number of the array.
    pub array: usize,
    /// Its bit-true model.
    pub model: &'a Model,
    /// Its frames: those that are averaged, or all since a reset.
    pub frames: &'a [Frame],
}

impl<'a> ArrayFrames<'a> {
    /// The frames of each array of the hardware of `model`: those of array k have the numbers k, n + k, 2n + k, … of n arrays.
    ///
    /// # Errors
    /// What is wrong with the files of an array.
    pub fn all(model: &'a Model, frames: &'a [Frame]) -> Result<Vec<Self>> {
        let arrays = model.scene.hardware.arrays;
        if arrays == 1 {
            return Ok(vec![ArrayFrames { array: 0, model: Cow::Borrowed(model), frames: Cow::Borrowed(frames) }]);
        }
        let of_array = |array: usize| {
            let own: Vec<Frame> = frames.iter().skip(array).step_by(arrays).cloned().collect();
            Ok(ArrayFrames { array, model: Cow::Owned(model.of_array(array)?), frames: Cow::Owned(own) })
        };
        (0..arrays.min(frames.len())).map(of_array).collect()
    }

    /// The results of all arrays, in the order in which the last frames of each arrive.
    pub fn results<'f>(all: &'f [ArrayFrames]) -> Vec<ArrayResult<'f>> {
        let by_array: Vec<Vec<&[Frame]>> =
            all.iter().map(|own| own.model.scene.input.frames_of_results(&own.frames)).collect();
        let turns = by_array.iter().map(Vec::len).max().unwrap_or(0);
        let of_turn = |turn: usize| {
            let arrays = all.iter().zip(&by_array);
            arrays.filter_map(move |(own, results)| {
                Some(ArrayResult { array: own.array, model: &own.model, frames: results.get(turn)? })
            })
        };
        (0..turns).flat_map(of_turn).collect()
    }
}

impl ArrayResult<'_> {
    /// The test vector: codes of the newest frames, and the bit-true model's results of all.
    ///
    /// # Errors
    /// A frame of another sensor, or a number of frames that the scene does not average.
    pub fn vector(self) -> Result<Vector> {
        let ArrayResult { array, model, frames } = self;
        let codes = model.readings(frames)?;
        let expected = model.run(&codes);
        let before = frames.len() - model.scene.input.frames_per_result();
        let frame = frames.get(before).map_or_else(String::new, |frame| frame.id.clone());
        let codes = codes[before * model.scene.sensor.taxels()..].to_vec();
        Ok(Vector { array, ..Vector::new(model, frame, codes, expected) })
    }
}
