//! Batch: results of frames that do not depend on each other, on all cores.
//!
//! ```text
//! stress: frames × rows × cols ── chunks ── frames, engine, cross-check on every core ── results, in the order of the frames
//! ```
//! The stress is read where it stands; only the frames that are computed at the moment are copied. A stream, whose results show what
//! the frames before tell, is [`crate::stream`].

use std::sync::Arc;

use anyhow::{bail, Result};
use dermis_golden::data::frame::Frame;
use dermis_golden::engine::CheckedEngine;
use dermis_golden::result::reconstruct::Reconstruction;
use dermis_golden::spec::scene::Scene;
use rayon::prelude::*;

use crate::engine::{result, EngineName, Engines, SharedEngine};

/// Results of a chunk per thread: the caller can interrupt between chunks.
const CHUNK: usize = 16;

/// The results of a batch, chunk by chunk.
pub struct Batch<'a> {
    engine: Arc<CheckedEngine<SharedEngine>>,
    scene: &'a Scene,
    /// Whole frames in MPa, row-major, one after the other; NaN where a reading is missing.
    stress_MPa: &'a [f64],
    cross_check: bool,
    /// Number of the next result.
    next: usize,
}

impl<'a> Batch<'a> {
    /// The results of `stress_MPa` by an engine: whole frames, 2^k for each result where `input.average` = k. Where the scene states no
    /// full scale and the bit-true model needs one, it is the largest stress of all frames.
    ///
    /// # Errors
    /// A scene whose results depend on the frames before, or that the engine refuses; another number of values.
    pub fn new(
        engines: &Engines,
        name: EngineName,
        scene: &'a Scene,
        stress_MPa: &'a [f64],
        cross_check: bool,
    ) -> Result<Batch<'a>> {
        let input = &scene.input;
        let mean = format!("mean = \"{}\"", input.mean.name());
        for (field, depends) in [(&*mean, input.slides()), ("zero = \"running\"", input.running_zero().is_some())] {
            if depends {
                bail!("scene {}: input.{field} needs the frames before: not available in a batch", scene.name);
            }
        }
        let (taxels, frames) = (scene.sensor.taxels(), input.frames_per_result());
        if !stress_MPa.len().is_multiple_of(taxels * frames) {
            let (rows, cols) = (scene.sensor.rows, scene.sensor.cols);
            bail!(
                "a batch of {} values is not allowed; scene {} has results of {frames} frames of {rows} * {cols} values",
                stress_MPa.len(),
                scene.name
            );
        }
        // Only the bit-true model of a scene without a full scale looks at them.
        let looks = name == EngineName::Fixed && input.full_scale_MPa.is_none();
        let peaks = if looks { frames_of(scene, stress_MPa, 0)? } else { Vec::new() };
        let engine = engines.engine(name, scene, &peaks)?;
        Ok(Batch { engine, scene, stress_MPa, cross_check, next: 0 })
    }

    /// Number of values of a result.
    fn length(&self) -> usize {
        self.scene.sensor.taxels() * self.scene.input.frames_per_result()
    }

    /// Number of results.
    pub fn results(&self) -> usize {
        self.stress_MPa.len() / self.length()
    }

    /// The result with this number.
    fn result(&self, number: usize) -> Result<Reconstruction> {
        let stress_MPa = &self.stress_MPa[number * self.length()..(number + 1) * self.length()];
        let frames = frames_of(self.scene, stress_MPa, number * self.scene.input.frames_per_result())?;
        result(&self.engine, &frames, self.cross_check)
    }
}

/// The frames of some values, the first with number `first`.
fn frames_of(scene: &Scene, stress_MPa: &[f64], first: usize) -> Result<Vec<Frame>> {
    let chunks = stress_MPa.chunks(scene.sensor.taxels()).zip(first..);
    let frame = |(own, number): (&[f64], usize)| {
        Ok(Frame::from_stress(&format!("frame {number}"), &scene.sensor, own.to_vec())?)
    };
    chunks.map(frame).collect()
}

impl Iterator for Batch<'_> {
    /// The next results in the order of the frames, or the error of the first of them that is refused.
    type Item = Result<Vec<Reconstruction>>;

    fn next(&mut self) -> Option<Self::Item> {
        let begin = self.next;
        self.next = self.results().min(begin + CHUNK * rayon::current_num_threads());
        let all: Vec<Result<Reconstruction>> =
            (begin..self.next).into_par_iter().with_max_len(1).map(|number| self.result(number)).collect();
        (begin < self.next).then(|| all.into_iter().collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use dermis_golden::spec::scene::{EstimatorKind, MeanKind};

    fn scene() -> Scene {
        Scene::builtin("eight-by-eight").unwrap().estimated_by(EstimatorKind::Search)
    }

    /// The shipped frames over and over, each a little stronger than the last.
    fn stress(scene: &Scene, frames: usize) -> Vec<f64> {
        let shipped = Frame::shipped(scene);
        let own = |k: usize| shipped[k % shipped.len()].stress_MPa.iter().map(move |b| b * (1.0 + k as f64 / 64.0));
        (0..frames).flat_map(own).collect()
    }

    fn all(name: EngineName, scene: &Scene, stress: &[f64], cross_check: bool) -> Result<Vec<Reconstruction>> {
        let batch = Batch::new(&Engines::default(), name, scene, stress, cross_check)?;
        let (results, chunks) = (batch.results(), batch.collect::<Result<Vec<_>>>()?);
        let all: Vec<Reconstruction> = chunks.into_iter().flatten().collect();
        assert_eq!(all.len(), results);
        Ok(all)
    }

    #[test]
    fn results_are_those_of_frames_alone_in_their_order() {
        let mut scene = scene();
        for (name, average, cross_check) in
            [(EngineName::Golden, 0, false), (EngineName::Golden, 1, true), (EngineName::Fixed, 0, false)]
        {
            scene.input.average = average;
            let frames = if cross_check { 6 } else { 2 * CHUNK * rayon::current_num_threads() + 2 };
            let stress = stress(&scene, frames);
            let results = all(name, &scene, &stress, cross_check).unwrap();
            let peaks = frames_of(&scene, &stress, 0).unwrap();
            let engine = Engines::default().engine(name, &scene, &peaks).unwrap();
            for (result, frames) in results.iter().zip(peaks.chunks(scene.input.frames_per_result())) {
                assert_eq!(*result, self::result(&engine, frames, cross_check).unwrap());
                assert_eq!(result.checks.cross_check_age, cross_check.then_some(0));
            }
        }
        assert_eq!(all(EngineName::Golden, &scene, &[], false).unwrap(), []);
    }

    #[test]
    fn a_missing_reading_is_named_and_what_cannot_be_used_is_refused() {
        let mut scene = scene();
        let mut stress = stress(&scene, 40);
        stress[64 * 3 + 9] = f64::NAN;
        let results = all(EngineName::Golden, &scene, &stress, false).unwrap();
        assert_eq!(results.iter().filter(|own| !own.extra.missing.is_empty()).count(), 1);
        assert!(!results[3].extra.missing.is_empty());
        let refused =
            |scene: &Scene, stress: &[f64]| all(EngineName::Golden, scene, stress, false).unwrap_err().to_string();
        // The first of two.
        (stress[64 * 39], stress[64 * 38]) = (f64::INFINITY, f64::INFINITY);
        assert!(refused(&scene, &stress).contains("frame 38"), "{}", refused(&scene, &stress));
        let wanted =
            "a batch of 65 values is not allowed; scene eight-by-eight has results of 1 frames of 8 * 8 values";
        assert_eq!(refused(&scene, &stress[..65]), wanted);
        (scene.input.mean, scene.input.average) = (MeanKind::Sliding, 1);
        assert!(refused(&scene, &stress[..64]).contains("input.mean = \"sliding\" needs the frames before"));
    }
}
