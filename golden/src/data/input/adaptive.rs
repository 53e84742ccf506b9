//! Adaptive mean: of the [windows](crate::spec::mean_window) of the frames so far the one with the least noise that agrees with the
//! newest frames, tested by χ² against the noise of a calibrated reading, which is found from how readings change
//! ([`change_noise`](super::change_noise)). A window that does not agree would be behind by more than the noise of some twenty frames.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: means of the frames so far, σ | taxels each, scalar | readings, MPa |
//! | out: window | – | – |

use super::means::{Means, Window};
use super::Input;
use crate::data::frame::Frame;

impl Input {
    /// The window of an adaptive mean, where readings have the noise `sigma_MPa`; the shortest mean before it is known. `frame` is the
    /// newest one.
    pub(super) fn window(&self, means: &Means, sigma_MPa: Option<f64>, frame: &Frame) -> Window {
        let shortest = means.shortest();
        let Some(sigma_MPa) = sigma_MPa else { return shortest };
        let live = frame.stress_MPa.len() - self.spec().dead.len();
        let agrees = |(window, limit): &(Window, f64)| {
            let (difference_MPa, _) = self.stress_difference(means, window, &shortest);
            let square: f64 = difference_MPa.iter().map(|d| d * d).sum();
            // Where neither differs nor has noise, 0 ≤ 0.
            square <= limit * live as f64 * sigma_MPa.powi(2)
        };
        let agreeing = means.windows(live).find(agrees);
        agreeing.map_or(shortest, |(window, _)| window)
    }

    /// What the mean of `window` is above that of `other`, in MPa, 0 for dead taxels, with its variance over that of a reading.
    pub(crate) fn stress_difference(&self, means: &Means, window: &Window, other: &Window) -> (Vec<f64>, f64) {
        let (mut difference, variance) = means.difference(window, other);
        if let Some((_, gain)) = &self.scale {
            difference.iter_mut().zip(gain).for_each(|(difference, gain)| *difference *= gain);
        }
        let cols = self.cols;
        self.spec().dead.iter().for_each(|&[row, col]| difference[row * cols + col] = 0.0);
        (difference, variance)
    }
}
