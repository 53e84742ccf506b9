//! Change noise: the noise of a reading, from how readings change from frame to frame.
//!
//! ```text
//! S  = Σ over taxels of (b_t − 2 b_{t−1} + b_{t−2})²
//! σ² = S̃ / (6 n)        S̃: the level above which S is in half of the frames; n live taxels
//! S̃ ← S̃ ± S̃ / 2^5       up where S is above it, else down; S̃ ← S where S was on the same side in 16 frames
//! ```
//! A reading that changes evenly has no second difference, and the level hardly moves in the few frames in which a contact comes, goes
//! or jumps. The hardware does the same with codes.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: calibrated frames in their order | taxels | MPa |
//! | out: standard deviation of a reading | scalar | MPa |

/// The variance of a second difference over that of a reading: 1 + 4 + 1.
pub(crate) const SECOND_DIFFERENCE: f64 = 6.0;
/// The level moves by 2^−this of itself.
pub const LEVEL_SHIFT: u32 = 5;
/// Frames on the same side of the level that end it.
pub const SAME_SIDE: u32 = 16;

/// On which side of the level the last frames were, and how many; the default is that of a level that has just begun.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Side {
    above: bool,
    frames: u32,
}

impl Side {
    /// Whether one more frame, above the level or not, ends it; then it begins again.
    pub(crate) fn ends(&mut self, above: bool) -> bool {
        let frames = if self.above == above { self.frames + 1 } else { 1 };
        let ends = frames == SAME_SIDE;
        *self = if ends { Side::default() } else { Side { above, frames } };
        ends
    }
}

/// The noise of the frames so far; the default is that before any.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ChangeNoise {
    /// The frame before, and that before it.
    last: [Vec<f64>; 2],
    /// S̃ over the number of live taxels; `None` before the third frame.
    level: Option<f64>,
    side: Side,
}

impl ChangeNoise {
    /// Adds a frame in MPa; dead taxels, which are always 0, do not count: `live` taxels do.
    pub fn add(&mut self, frame_MPa: &[f64], live: usize) {
        let [before, earlier] = &self.last;
        if !earlier.is_empty() && live > 0 {
            let second = |k: usize| (frame_MPa[k] - 2.0 * before[k] + earlier[k]).powi(2);
            let sum = (0..frame_MPa.len()).map(second).sum::<f64>() / live as f64;
            self.level = Some(match self.level {
                Some(level) if !self.side.ends(sum > level) => {
                    let step = level * 0.5f64.powi(LEVEL_SHIFT as i32);
                    if sum > level {
                        level + step
                    } else {
                        level - step
                    }
                }
                _ => sum,
            });
        }
        self.last = [frame_MPa.to_vec(), std::mem::take(&mut self.last[0])];
    }

    /// Standard deviation of a reading in MPa; `None` before the third frame.
    pub fn sigma_MPa(&self) -> Option<f64> {
        self.level.map(|level| (level / SECOND_DIFFERENCE).sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::frame::Frame;
    use crate::data::generator::presses::{Motion, Press};
    use crate::spec::scene::Scene;

    /// Presses that move, change at once or come and go have the noise of those that hold.
    #[test]
    fn the_noise_of_a_press_is_found_whatever_it_does() {
        let scene = Scene::builtin("eight-by-eight").unwrap();
        for (noise, (name, motion)) in [1e-3, 1e-2].into_iter().flat_map(|noise| Motion::NAMES.map(|own| (noise, own)))
        {
            let press = Press { rate_Hz: 250.0, ..Press::new(motion) };
            let frames = press.of_frames(100, noise).frames(&scene, 5).unwrap();
            let exact = Press { rate_Hz: 250.0, ..Press::new(motion) }.of_frames(100, 0.0).frames(&scene, 5).unwrap();
            let peak = exact.iter().map(Frame::peak_MPa).fold(0.0, f64::max);
            let mut found = ChangeNoise::default();
            for (number, frame) in frames.iter().enumerate() {
                found.add(&frame.stress_MPa, 64);
                assert_eq!(found.sigma_MPa().is_some(), number >= 2);
                let share = found.sigma_MPa().unwrap_or(noise * peak) / (noise * peak);
                // 64 taxels of a few frames; at 250 Hz a contact moves by 0.08 mm a frame.
                assert!(number < 10 || (0.85..1.25).contains(&share), "{name} {noise} {number}: {share}");
            }
        }
    }
}
