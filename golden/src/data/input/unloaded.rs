//! Unloaded frames: the noise of a device, from frames in which nothing presses.
//!
//! Missing readings count for nothing. The standard deviation of a calibrated reading is that of its tare frames ([`Tare`]), the root mean square over the live
//! taxels. Frames that cannot be without load are refused:
//!
//! ```text
//! common   variance of the frames' means over that of independent noise, σ²/taxels: a press, hum and drift move taxels together
//! jump     largest distance of a reading from its taxel's mean, in σ: one taxel that is touched, or loose
//! ```
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: frames | n × taxels, n ≥ 8 | the scene's readings |
//! | out: noise of one reading | 1 | MPa |

use super::tare::{Tare, LEAST_FRAMES};
use super::{root_mean_square, Input};
use crate::data::frame::{Frame, FrameError};
use crate::spec::scene::Scene;
use thiserror::Error;

/// Largest variance of the frames' means over that of independent noise. Of n frames without load it is χ²/(n − 1); of the
/// fewest, 8, it is above this in one case of 10⁵.
const COMMON: f64 = 5.0;
/// Largest distance of a reading from its mean, in standard deviations: of 10⁶ normal readings one is above 5.
const JUMP: f64 = 8.0;

/// The frames do not tell the noise.
#[derive(Debug, Error)]
pub enum UnloadedError {
    /// A frame is not of the scene's sensor.
    #[error(transparent)]
    Frame(#[from] FrameError),
    /// Too few frames.
    #[error("{frames} frames: wanted at least {LEAST_FRAMES} without load")]
    Few {
        /// Their number.
        frames: usize,
    },
    /// Readings that do not vary.
    #[error(
        "the readings of most taxels do not vary: the device hides its noise; state the step of its codes over √12"
    )]
    Constant,
    /// The readings rise and fall together.
    #[error("the readings rise and fall together ({common:.0} times as much as independent noise, at most {COMMON}): something presses, or all taxels hum or drift")]
    Common {
        /// Variance of the frames' means over that of independent noise.
        common: f64,
    },
    /// One reading is far from its mean.
    #[error("taxel {row},{col} reads {jump:.0} standard deviations off its mean (at most {JUMP}): something touches it, or it is loose")]
    Jump {
        /// Its row.
        row: usize,
        /// Its column.
        col: usize,
        /// The distance.
        jump: f64,
    },
}

/// Standard deviation of one reading in MPa, from frames without load; zero and gain are those of `input`.
///
/// ```
/// use dermis_golden::data::{frame::Frame, generator::converter::Converter, input::{unloaded::noise_MPa, Input}};
/// use dermis_golden::spec::scene::Scene;
///
/// let scene = Scene::builtin("eight-by-eight")?;
/// let (input, press) = (Input::new(&scene)?, Frame::shipped(&scene).remove(1));
/// let peak_MPa = press.peak_MPa();
/// let noisy = |seed| Converter { noise: 0.01, seed, ..Converter::default() }.convert(&press).unwrap();
/// // Whatever does not change is no noise.
/// let held: Vec<Frame> = (0..100).map(noisy).collect();
/// let found_MPa = noise_MPa(&scene, &input, &held)?;
/// assert!((found_MPa / (0.01 * peak_MPa) - 1.0).abs() < 0.05);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`UnloadedError`]: frames of another sensor, too few, that do not vary, or in which something presses.
pub fn noise_MPa(scene: &Scene, input: &Input, frames: &[Frame]) -> Result<f64, UnloadedError> {
    frames.iter().try_for_each(|frame| frame.check(scene))?;
    if frames.len() < LEAST_FRAMES {
        return Err(UnloadedError::Few { frames: frames.len() });
    }
    let stress: Vec<Frame> = frames.iter().map(|frame| input.calibrate(frame)).collect();
    let Tare { zero, spread, .. } = Tare::of(&stress, scene);
    let alive = scene.input.alive(&scene.sensor);
    let live: Vec<usize> = (0..alive.len()).filter(|k| alive[*k]).collect();
    let spread = spread.ok_or(UnloadedError::Constant)?;
    let noise_MPa = root_mean_square(&live.iter().map(|k| spread[*k]).collect::<Vec<_>>());
    let off = |frame: &Frame, k: usize| if frame.lacks(k) { 0.0 } else { frame.stress_MPa[k] - zero[k] };
    let mean = |frame: &Frame| live.iter().map(|k| off(frame, *k)).sum::<f64>() / live.len() as f64;
    let means: Vec<f64> = stress.iter().map(mean).collect();
    let variance = means.iter().map(|mean| mean * mean).sum::<f64>() / (means.len() - 1) as f64;
    let common = variance / (noise_MPa * noise_MPa / live.len() as f64);
    let jumps = stress.iter().flat_map(|frame| live.iter().map(move |k| (*k, off(frame, *k).abs() / noise_MPa)));
    if let Some((k, jump)) = jumps.max_by(|a, b| a.1.total_cmp(&b.1)).filter(|(_, jump)| *jump > JUMP) {
        return Err(UnloadedError::Jump { row: k / scene.sensor.cols, col: k % scene.sensor.cols, jump });
    }
    if common > COMMON {
        return Err(UnloadedError::Common { common });
    }
    Ok(noise_MPa)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    /// Frames of noise 0.01 with something added by frame and taxel.
    fn found(count: usize, seed: u64, added: impl Fn(usize, usize) -> f64) -> Result<f64, UnloadedError> {
        let scene = Scene::builtin("eight-by-eight").unwrap();
        let mut random = Random::new(seed);
        let one = |number: usize| {
            let stress = (0..64).map(|k| 0.3 + 0.01 * random.normal() + added(number, k)).collect();
            Frame::from_stress("zero", &scene.sensor, stress).unwrap()
        };
        let frames: Vec<Frame> = (0..count).map(one).collect();
        noise_MPa(&scene, &Input::new(&scene).unwrap(), &frames)
    }

    #[test]
    fn noise_is_found_and_what_moves_is_refused() {
        for seed in 0..200 {
            let noise = found(8 + seed as usize, seed, |_, _| 0.0).unwrap();
            assert!((noise / 0.01 - 1.0).abs() < 0.15, "{seed}: {noise}");
        }
        // A press that comes, drift, hum, one taxel that is touched once.
        let press = |number: usize, k: usize| if number > 50 && (20..30).contains(&k) { 0.05 } else { 0.0 };
        assert!(matches!(found(100, 1, press), Err(UnloadedError::Common { .. } | UnloadedError::Jump { .. })));
        assert!(matches!(found(100, 1, |number, _| 2e-4 * number as f64), Err(UnloadedError::Common { .. })));
        assert!(matches!(found(100, 1, |number, _| 0.01 * (number as f64).sin()), Err(UnloadedError::Common { .. })));
        let touched = |number: usize, k: usize| if (number, k) == (50, 13) { 0.2 } else { 0.0 };
        assert!(matches!(found(100, 1, touched), Err(UnloadedError::Jump { row: 1, col: 5, .. })));
        assert!(matches!(found(7, 1, |_, _| 0.0), Err(UnloadedError::Few { frames: 7 })));
    }

    #[test]
    fn missing_readings_change_nothing() {
        let gap = |number: usize, k: usize| if (7 * number + k).is_multiple_of(31) { f64::NAN } else { 0.0 };
        for seed in 0..20 {
            let [whole, lacking] = [found(100, seed, |_, _| 0.0), found(100, seed, gap)].map(Result::unwrap);
            assert!((lacking / whole - 1.0).abs() < 0.02, "{seed}: {lacking} {whole}");
        }
    }

    #[test]
    fn readings_that_stand_still_tell_nothing() {
        let scene = Scene::builtin("eight-by-eight").unwrap();
        let still = vec![Frame::from_stress("zero", &scene.sensor, vec![0.25; 64]).unwrap(); 20];
        let found = noise_MPa(&scene, &Input::new(&scene).unwrap(), &still);
        assert!(matches!(found, Err(UnloadedError::Constant)));
    }
}
