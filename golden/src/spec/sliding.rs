//! Sliding mean: one number per taxel, so that every frame gives a result.
//!
//! ```text
//! mean ← mean + 2^−g (reading − mean)      g of frame m: 2^g is the power of two nearest to m, at most 2^k
//! ```
//! The gains 1, 1/2, 1/4, 1/4, 1/4, 1/8, … follow 1/m, so that the first frame is its own mean and nothing pulls the
//! first means to zero. From m = ¾·2^k on, the gain is 2^−k, and older frames fade exponentially.
//!
//! Of readings whose noise has the variance σ², the mean of m frames has σ² v(m):
//! ```text
//! v(1) = 1,  v(m) = (1 − 2^−g)² v(m − 1) + 4^−g  →  1 / (2^(k+1) − 1)
//! ```
//! The mean of N frames of equal weight has the noise σ² / N and an age of (N − 1) / 2 frames. The settled sliding mean has
//! both with N = 2^(k+1) − 1, the number of frames at which its count stops; up to there σ² v(m) is at most 1.15 times σ² / m.

/// The number of frames at which the count of a sliding mean stops: a mean of as many frames has the same noise.
pub fn most_frames(average: u32) -> usize {
    (2 << average) - 1
}

/// g, where frame number `frame` since the start, from 1, has the gain 2^−g.
pub fn gain_shift(frame: usize, average: u32) -> u32 {
    // 2^g is the power of two nearest to the number: the next one where the second bit is set.
    let floor = frame.max(1).ilog2();
    let second_bit = ((2 * frame) >> floor & 1) as u32;
    (floor + second_bit).min(average)
}

/// v: variance of the mean of `frames` frames, at least one, over that of a frame.
pub fn variance(frames: usize, average: u32) -> f64 {
    let gain = |frame| 0.5f64.powi(gain_shift(frame, average) as i32);
    let first = frames.min(1 << average);
    let variance =
        (1..=first).fold(0.0, |variance, frame| (1.0 - gain(frame)).powi(2) * variance + gain(frame).powi(2));
    // The gain stays: what is more than the limit fades.
    let limit = 1.0 / most_frames(average) as f64;
    limit + (variance - limit) * (1.0 - gain(first)).powf(2.0 * (frames - first) as f64)
}

/// Adds frame number `frame` since the start, from 1, to the mean.
pub fn add(mean: &mut [f64], reading: &[f64], frame: usize, average: u32) {
    let gain = 0.5f64.powi(gain_shift(frame, average) as i32);
    for (mean, reading) in mean.iter_mut().zip(reading) {
        // Two products, so that the difference of large readings does not overflow.
        *mean = (1.0 - gain) * *mean + gain * reading;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gains_follow_the_number_of_frames() {
        let gains: Vec<u32> = (1..=13).map(|frame| gain_shift(frame, 3)).collect();
        assert_eq!(gains, [0, 1, 2, 2, 2, 3, 3, 3, 3, 3, 3, 3, 3]);
        assert!((1..100).all(|frame| gain_shift(frame, 0) == 0));
    }

    #[test]
    fn noise_falls_as_that_of_equal_weights_until_the_count_stops() {
        for average in 0..=12 {
            let most = most_frames(average);
            let over_equal = |frames| variance(frames, average) * frames as f64;
            assert!((1..=most).all(|frames| (1.0..1.15).contains(&(over_equal(frames) + 1e-12))), "{average}");
            let settled = variance(usize::MAX, average);
            assert!((settled * most as f64 - 1.0).abs() < 1e-9, "{average}: {settled}");
        }
    }
}
