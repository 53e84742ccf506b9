//! Adaptive mean: of the [windows](super::means) of the frames so far the one with the least noise that agrees with the newest frames.
//!
//! ```text
//! χ² = Σ over live taxels of (window − shortest mean)² / (σ² v)        v: variance of that difference over that of a reading
//! window: the least variance of all with  χ² / n < 1 + AGREES √(2/n)
//! ```
//! σ is the noise of a calibrated reading, from how readings change ([`change_noise`](super::change_noise)). A window that does not
//! agree would be behind by more than the noise of some twenty frames.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: means of the frames so far, σ | taxels each, scalar | readings, MPa |
//! | out: window | – | – |

use super::means::{Means, Window};
use super::Input;
use crate::data::frame::Frame;

/// Standard deviations of χ²/n by which a window may differ. On drawn presses of sensor-1 of seven kinds at 0.2 and 1 % of noise,
/// 3.5 to 7 gave the same errors within a twentieth.
const AGREES: f64 = 5.0;

impl Input {
    /// The window of an adaptive mean, where readings have the noise `sigma_MPa`; the shortest mean before it is known. `frame` is the
    /// newest one.
    pub(super) fn window(&self, means: &Means, sigma_MPa: Option<f64>, frame: &Frame) -> Window {
        let shortest = means.shortest();
        let Some(sigma_MPa) = sigma_MPa else { return shortest };
        let live = frame.stress_MPa.len() - self.spec().dead.len();
        let most = 1.0 + AGREES * (2.0 / live.max(1) as f64).sqrt();
        let agrees = |window: &Window| {
            let (difference_MPa, variance) = self.stress_difference(means, window, &shortest);
            let square: f64 = difference_MPa.iter().map(|d| d * d).sum();
            // Where neither differs nor has noise, 0 ≤ 0.
            square <= most * live as f64 * sigma_MPa.powi(2) * variance
        };
        means.windows().into_iter().find(agrees).unwrap_or(shortest)
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
