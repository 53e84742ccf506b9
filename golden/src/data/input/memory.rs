//! Memory: what the frames of a stream leave to the next ones, before any estimate.
//!
//! | | by |
//! |---|---|
//! | how far zeros have moved | [`running_zero`](super::running_zero) |
//! | sliding means | [`means`](super::means) |
//! | noise of a reading, from how readings change | [`change_noise`](super::change_noise) |

use super::change_noise::ChangeNoise;
use super::drift::Drift;
use super::means::{Means, Window};
use crate::data::frame::Frame;

/// What the frames so far leave to the next ones; the default is that after a reset.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Memory {
    /// How far the zeros have moved.
    pub(super) drift: Drift,
    /// The means of a scene whose mean slides; `None` before a frame.
    pub(super) means: Option<Means>,
    /// Noise of the calibrated readings, where the mean is adaptive.
    pub(super) noise: ChangeNoise,
}

impl Memory {
    /// How far the zeros have moved.
    pub fn drift(&self) -> &Drift {
        &self.drift
    }

    /// Noise of a calibrated reading in MPa, where the mean is adaptive; `None` before the third frame.
    pub fn sigma_MPa(&self) -> Option<f64> {
        self.noise.sigma_MPa()
    }

    /// The means of a scene whose mean slides; `None` before a frame.
    pub fn means(&self) -> Option<&Means> {
        self.means.as_ref()
    }
}

/// The mean of the frames of a result, and what it has of their noise.
#[derive(Clone, Debug, PartialEq)]
pub struct Averaged {
    /// The mean of the readings; of a block, id and known forces are those of the first frame, else those of the last.
    pub mean: Frame,
    /// Variance over that of a frame.
    pub variance: f64,
    /// Number of frames that a mean that slides holds, by its noise.
    pub frames_held: Option<usize>,
    /// Mean age of the frames that an adaptive mean holds.
    pub lag_frames: Option<f64>,
}

impl Averaged {
    /// The mean of a window of an adaptive mean; `frame` has what does not depend on it.
    pub(crate) fn of_window(means: &Means, window: &Window, frame: Frame) -> Averaged {
        Averaged {
            mean: Frame { stress_MPa: means.mean(window), ..frame },
            variance: window.variance,
            frames_held: Some(window.frames_held()),
            lag_frames: Some(window.age),
        }
    }
}
