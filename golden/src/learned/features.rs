//! Features: what a network sees of the stress in its window.
//!
//! | input | size |
//! |---|---|
//! | b over its norm | n |
//! | p_λ = V s/(s² + λ²s_max²) Uᵀ b over its norm, Cz = U s Vᵀ, for λ = 0.15 and 0.04 | 2n |
//! | 1 on taxels that are dead or beyond the array, else 0 | n |
//! | ln(σ/‖b‖), σ the noise | 1 |
//!
//! The norms make the inputs independent of the load; each is multiplied by √n, so that its entries are about 1.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: b, mask, σ of each frame | n × frames, frames | MPa |
//! | out: inputs | 4n + 1 × frames | – |

use super::error::LearnedError;
use crate::influence::Influence;
use crate::scene::Medium;
use crate::sensor::Sensor;
use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, Par};

/// λ of the deconvolutions.
const LEVELS: [f64; 2] = [0.15, 0.04];
/// Middle and width of ln(σ/‖b‖) between 0.005 and 2 % of the peak.
const NOISE: [f64; 2] = [-8.0, 2.0];
/// Smallest σ/‖b‖ that is told apart from none.
const LEAST_NOISE: f64 = 1e-5;

/// The deconvolutions of a window.
pub(super) struct Features {
    /// p_λ for all λ, stacked: (n · levels) × n.
    inverse: Mat<f32>,
}

/// Frames of one window.
pub(super) struct Readings {
    /// Stress, n × frames; 0 on masked taxels.
    pub b: Mat<f32>,
    /// 1 on taxels that are dead or beyond the array, n × frames.
    pub masked: Mat<f32>,
    /// Standard deviation of the noise of each frame.
    pub sigma: Vec<f32>,
}

impl Features {
    /// Number of inputs for a window of `taxels`.
    pub fn inputs(taxels: usize) -> usize {
        (2 + LEVELS.len()) * taxels + 1
    }

    /// The deconvolutions for a window, given as an array.
    ///
    /// # Errors
    /// [`LearnedError::NotConverged`] if Cz has no singular value decomposition.
    pub fn new(window: &Sensor, medium: Medium) -> Result<Features, LearnedError> {
        let cz = Influence::through(window, medium).cz;
        let svd = cz.thin_svd().map_err(|_| LearnedError::NotConverged { sensor: window.to_string() })?;
        let n = window.taxels();
        let values: Vec<f64> = svd.S().column_vector().iter().copied().collect();
        let largest = values.iter().copied().fold(0.0, f64::max);
        let mut inverse = Mat::<f32>::zeros(LEVELS.len() * n, n);
        for (k, level) in LEVELS.iter().enumerate() {
            let gain = |s: f64| s / (s * s + (level * largest).powi(2));
            let scaled = Mat::from_fn(n, n, |row, value| svd.V()[(row, value)] * gain(values[value]));
            let own = scaled * svd.U().transpose();
            for (row, col) in (0..n).flat_map(|row| (0..n).map(move |col| (row, col))) {
                inverse[(k * n + row, col)] = own[(row, col)] as f32;
            }
        }
        Ok(Features { inverse })
    }

    /// The inputs of each frame.
    pub fn of(&self, readings: &Readings) -> Mat<f32> {
        let Readings { b, masked, sigma } = readings;
        let (n, frames) = (b.nrows(), b.ncols());
        let mut inputs = Mat::<f32>::zeros(Features::inputs(n), frames);
        let wide = self.inverse.nrows();
        matmul(inputs.subrows_mut(n, wide), Accum::Replace, &self.inverse, b, 1.0, Par::Seq);
        for (frame, sigma) in sigma.iter().enumerate() {
            let column = inputs.col_mut(frame).try_as_col_major_mut().map(|column| column.as_slice_mut());
            let Some(column) = column else { continue };
            let norm = norm(b.col(frame).iter());
            column[..n].iter_mut().zip(b.col(frame).iter()).for_each(|(input, b)| *input = *b);
            for part in column[..n + wide].chunks_mut(n) {
                let own = self::norm(part.iter());
                let scale = if own > 0.0 { (n as f32).sqrt() / own } else { 0.0 };
                part.iter_mut().for_each(|input| *input *= scale);
            }
            let rest = &mut column[n + wide..];
            rest.iter_mut().zip(masked.col(frame).iter()).for_each(|(input, masked)| *input = *masked);
            let share = if norm > 0.0 { sigma / norm } else { 0.0 };
            rest[n] = (share.max(LEAST_NOISE as f32).ln() - NOISE[0] as f32) / NOISE[1] as f32;
        }
        inputs
    }
}

fn norm<'a>(values: impl Iterator<Item = &'a f32>) -> f32 {
    values.map(|value| value * value).sum::<f32>().sqrt()
}

/// The noise that a network is told: σ, and the gains as if they were noise on every taxel alike; `square` is Σb² of `n`
/// taxels.
pub(super) fn effective_sigma(sigma: f32, gain_spread: f32, square: f32, n: usize) -> f32 {
    (sigma * sigma + gain_spread * gain_spread * square / n as f32).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Scene;

    /// The inputs do not depend on the load, and the sharper deconvolution finds a force on one cell again.
    #[test]
    fn a_force_on_one_cell_is_found_at_any_load() {
        let scene = Scene::builtin("sensor-1").unwrap();
        let features = Features::new(&scene.sensor, scene.medium).unwrap();
        let cz = Influence::through(&scene.sensor, scene.medium).cz;
        let readings = |load: f64| Readings {
            b: Mat::from_fn(100, 1, |t, _| (load * cz[(t, 44)]) as f32),
            masked: Mat::from_fn(100, 1, |t, _| if t == 3 { 1.0 } else { 0.0 }),
            sigma: vec![(load * 1e-3) as f32],
        };
        let (light, heavy) = (features.of(&readings(0.1)), features.of(&readings(12.0)));
        assert_eq!(light.nrows(), 401);
        assert!((0..401).all(|k| (light[(k, 0)] - heavy[(k, 0)]).abs() < 1e-4));
        for part in 0..3 {
            let square: f32 = (0..100).map(|k| light[(100 * part + k, 0)].powi(2)).sum();
            assert!((square - 100.0).abs() < 0.01, "{part}: {square}");
        }
        let sharp: Vec<f32> = (200..300).map(|k| light[(k, 0)]).collect();
        assert!((0..100).all(|k| sharp[k] <= sharp[44]));
        assert_eq!((300..400).filter(|k| light[(*k, 0)] != 0.0).collect::<Vec<_>>(), [303]);
    }
}
