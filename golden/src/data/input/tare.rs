//! Tare: frames read without contact. Their mean is the zero of each taxel, their spread its noise.
//!
//! ```text
//! zero_t = mean of the frames          s²_t = (ν s̄² + Σ (reading − zero)²)/(ν + n − 1),  s̄² the mean over the taxels
//! ```
//!
//! The spread of one taxel over a few frames is itself uncertain: it counts as n − 1 readings beside ν = 8 of the whole
//! array; a dead taxel takes s̄. A taxel counts in the frames that have its reading. An array that reads zero without contact, because it reads no tension or its converter is coarse, tells
//! nothing of its noise; then there is no spread.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: frames | n × taxels | readings |
//! | out: zero | taxels | readings |
//! | out: spread | taxels | readings, standard deviation of one frame |

use super::missing::{mean_reading, readings};
use crate::data::frame::{Frame, FrameError};
use crate::spec::scene::Scene;
use std::ops::Not;
use std::path::Path;

/// ν: readings of the whole array that stand beside those of a taxel.
const PRIOR: f64 = 8.0;
/// Smallest number of frames whose spread is used.
pub(super) const LEAST_FRAMES: usize = 8;
/// Share of the live taxels that must vary for the spread to be used.
const LEAST_VARYING: f64 = 0.5;

/// The readings without contact.
#[derive(Clone, Debug, PartialEq)]
pub struct Tare {
    /// Mean reading of each taxel.
    pub zero: Vec<f64>,
    /// Standard deviation of one frame's readings, a value per taxel; `None` if the frames do not show it.
    pub spread: Option<Vec<f64>>,
    /// Number of frames.
    pub frames: usize,
}

/// Checks that each live taxel has a reading in some frame, without which it has no zero; `file` stands in the error.
///
/// # Errors
/// [`FrameError::NeverRead`]
pub fn require_readings(file: &str, frames: &[Frame], scene: &Scene) -> Result<(), FrameError> {
    let (alive, cols) = (scene.input.alive(&scene.sensor), scene.sensor.cols);
    match (0..alive.len()).find(|&k| alive[k] && frames.iter().all(|frame| frame.lacks(k))) {
        Some(k) => Err(FrameError::NeverRead { file: file.to_string(), row: k / cols, col: k % cols }),
        None => Ok(()),
    }
}

impl Tare {
    /// Reads the frames of a file or folder, as [`Frame::load_all`] does.
    ///
    /// # Errors
    /// [`FrameError`] if there is none, one is not of the scene's sensor, or none has the reading of a live taxel.
    pub fn load(path: &Path, scene: &Scene) -> Result<Tare, FrameError> {
        let frames = Frame::load_all(path, Some(scene))?;
        frames.iter().try_for_each(|frame| frame.check(scene))?;
        require_readings(&path.display().to_string(), &frames, scene)?;
        Ok(Tare::of(&frames, scene))
    }

    /// Of frames of the scene's sensor, at least one.
    pub fn of(frames: &[Frame], scene: &Scene) -> Tare {
        let (taxels, count) = (scene.sensor.taxels(), frames.len());
        let zero: Vec<f64> = (0..taxels).map(|k| mean_reading(frames, k).unwrap_or(0.0)).collect();
        let square = |k: usize| readings(frames, k).map(|reading| (reading - zero[k]).powi(2)).sum::<f64>();
        let squares: Vec<f64> = (0..taxels).map(square).collect();
        // n − 1 of each taxel.
        let freedoms: Vec<f64> = (0..taxels).map(|k| readings(frames, k).count().saturating_sub(1) as f64).collect();
        let cols = scene.sensor.cols;
        let live: Vec<usize> = (0..taxels).filter(|k| !scene.input.is_dead([k / cols, k % cols])).collect();
        // Not by the squares, which rounding makes positive.
        let varies = |k: usize| readings(frames, k).is_sorted_by(|a, b| a == b).not();
        let varying = live.iter().filter(|&&k| varies(k)).count();
        let shown = count >= LEAST_FRAMES && varying as f64 >= LEAST_VARYING * live.len() as f64;
        let spread = shown.then(|| {
            let of_live = |values: &[f64]| live.iter().map(|&k| values[k]).sum::<f64>();
            let common = of_live(&squares) / of_live(&freedoms);
            let of = |(k, square): (usize, &f64)| match live.binary_search(&k) {
                Ok(_) => ((PRIOR * common + square) / (PRIOR + freedoms[k])).sqrt(),
                Err(_) => common.sqrt(),
            };
            squares.iter().enumerate().map(of).collect()
        });
        Tare { zero, spread, frames: count }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    fn frames(count: usize, reading: impl Fn(usize, f64) -> f64) -> (Scene, Vec<Frame>) {
        let scene = Scene::builtin("eight-by-eight").unwrap();
        let mut random = Random::new(3);
        let one = |_| {
            let stress = (0..64).map(|k| reading(k, random.normal())).collect();
            Frame::from_stress("zero", &scene.sensor, stress).unwrap()
        };
        let frames = (0..count).map(one).collect();
        (scene, frames)
    }

    /// Half of the taxels are three times as noisy: 100 frames show each one's noise to a fifth, and its zero.
    #[test]
    fn zero_and_spread_of_each_taxel() {
        let sigma = |k: usize| if k < 32 { 0.01 } else { 0.03 };
        let (scene, frames) = frames(100, |k, normal| 0.5 + sigma(k) * normal);
        let tare = Tare::of(&frames, &scene);
        let spread = tare.spread.unwrap();
        for (k, (zero, spread)) in tare.zero.iter().zip(&spread).enumerate() {
            assert!((zero - 0.5).abs() < 0.4 * sigma(k), "{k}: {zero}");
            assert!((spread / sigma(k) - 1.0).abs() < 0.25, "{k}: {spread}");
        }
    }

    /// A taxel that half of the frames lack has the zero and the noise of the others; one that all lack has no zero.
    #[test]
    fn missing_readings_do_not_count() {
        let (scene, mut frames) = frames(100, |_, normal| 0.5 + 0.01 * normal);
        let whole = Tare::of(&frames, &scene);
        for frame in frames.iter_mut().step_by(2) {
            (frame.stress_MPa[9], frame.missing) = (0.0, vec![9]);
        }
        let tare = Tare::of(&frames, &scene);
        assert!((tare.zero[9] - 0.5).abs() < 5e-3 && tare.zero[8] == whole.zero[8]);
        assert!((tare.spread.unwrap()[9] / 0.01 - 1.0).abs() < 0.25);
        let folder = tempfile::tempdir().unwrap();
        for (number, frame) in frames.iter_mut().enumerate() {
            frame.missing = vec![9];
            std::fs::write(folder.path().join(format!("{number}.json")), frame.to_json()).unwrap();
        }
        let text = Tare::load(folder.path(), &scene).unwrap_err().to_string();
        assert!(text.ends_with("no frame has a reading of row 1, column 1"), "{text}");
        let mut dead = scene.clone();
        dead.input.dead = vec![[1, 1]];
        assert!(Tare::load(folder.path(), &dead).is_ok());
    }

    #[test]
    fn what_does_not_vary_tells_no_noise() {
        let (scene, zeros) = frames(100, |_, _| 0.25);
        let tare = Tare::of(&zeros, &scene);
        assert!((tare.zero[9] - 0.25).abs() < 1e-12 && tare.spread.is_none());
        let (scene, few) = frames(LEAST_FRAMES - 1, |_, normal| normal);
        assert_eq!(Tare::of(&few, &scene).spread, None);
    }
}
