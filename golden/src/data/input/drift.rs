//! Drift: how far the zeros have moved where they run, see [`running_zero`](super::running_zero).

/// How far the zeros have moved; the default is that after a reset.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Drift {
    /// o of each taxel, row-major; none after a reset.
    pub(super) moved: Vec<f64>,
    /// Largest |o| of a live taxel in the last frame over L; `None` before a frame, and where zeros are fixed.
    pub(super) share: Option<f64>,
}

impl Drift {
    /// Largest distance of a live taxel's zero in the last frame from the stored one, over the limit; `None` before a frame,
    /// and where zeros are fixed.
    pub fn share(&self) -> Option<f64> {
        self.share
    }

    /// How far each taxel's zero has moved, in readings, row-major; none after a reset.
    pub fn moved(&self) -> &[f64] {
        &self.moved
    }
}
