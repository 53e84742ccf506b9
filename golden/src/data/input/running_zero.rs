//! Running zero: the zero of each taxel follows its readings while nothing presses.
//!
//! ```text
//! r − o                                    a reading, as if its zero had not drifted
//! r − s > L  and  r − s − o > L            of a live taxel: something presses
//! o ← o + 2^−k (r − s − o), held to ±L     after a frame in which nothing presses; r − s − o is held to ±L too
//! ```
//! r is a taxel's reading, s its stored zero, o its drift, 0 after a reset; k is `input.zero_average`, L is
//! `input.zero_limit_MPa` at the largest gain. A taxel whose gain is negative reads less under load: its signs are changed.
//!
//! Only readings above the zero are a touch, since nothing pulls at the array as a whole: a zero that was stored under load
//! is followed down. Readings within L of the stored zero never are: while the drift stays within the limit, the zero follows
//! it after each press, however long that was. So L must be above the drift, and what presses with less than L is taken for
//! drift, by L at most.
//!
//! A missing reading neither presses nor moves its zero. A device takes for it what the others predict
//! ([`missing`](super::missing)), and so does its bit-true model: there the zero follows the prediction.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: frames in their order | taxels | readings |
//! | out: the same without drift | taxels | readings |
//! | drift | taxels | readings, −L … L |

use super::drift::Drift;
use super::Input;
use crate::data::frame::Frame;
use std::borrow::Cow;

impl Input {
    /// Frames of the scene's sensor as if zeros had not drifted, where they run; `drift` is that before the frames, then that
    /// after them.
    pub fn without_drift<'a>(&self, drift: &mut Drift, frames: &'a [Frame]) -> Cow<'a, [Frame]> {
        let Some(limit) = self.zero_limit() else { return Cow::Borrowed(frames) };
        frames.iter().map(|frame| self.follow(drift, frame, limit)).collect()
    }

    fn follow(&self, drift: &mut Drift, frame: &Frame, limit: f64) -> Frame {
        let (taxels, cols) = (frame.stress_MPa.len(), frame.sensor.cols);
        drift.moved.resize(taxels, 0.0);
        let live = |taxel: usize| !self.spec().is_dead([taxel / cols, taxel % cols]);
        let direction = |taxel: usize| self.scale.as_ref().map_or(1.0, |(_, gain)| gain[taxel].signum());
        let zero = |taxel: usize| self.zero().map_or(0.0, |zero| zero[taxel]);
        let off: Vec<f64> = frame.stress_MPa.iter().enumerate().map(|(taxel, reading)| reading - zero(taxel)).collect();
        let has = |taxel: &usize| live(*taxel) && !frame.lacks(*taxel);
        let readings: Vec<usize> = (0..taxels).filter(has).collect();
        let presses = |taxel: &usize| {
            let taxel = *taxel;
            let of = |off: f64| direction(taxel) * off > limit;
            of(off[taxel]) && of(off[taxel] - drift.moved[taxel])
        };
        let pressed = readings.iter().any(presses);
        let mut frame = frame.clone();
        frame.stress_MPa.iter_mut().zip(&drift.moved).for_each(|(reading, moved)| *reading -= moved);
        let size = |taxel: usize| drift.moved[taxel].abs();
        drift.share = (0..taxels).map(size).reduce(f64::max).map(|largest| largest / limit);
        let gain = 0.5f64.powi(self.spec().running_zero().map_or(0, |running| running.average as i32));
        for taxel in readings.into_iter().filter(|_| !pressed) {
            let moved = &mut drift.moved[taxel];
            let step = gain * (off[taxel] - *moved).clamp(-limit, limit);
            *moved = (*moved + step).clamp(-limit, limit);
        }
        frame
    }
}

#[cfg(test)]
mod tests;
