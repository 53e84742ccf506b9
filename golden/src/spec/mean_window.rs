//! Windows of an adaptive mean: sliding means of several lengths, and pairs of them extrapolated to the newest frame.
//!
//! ```text
//! mean k                      mean_k ← mean_k + 2^−g (reading − mean_k)        as in `sliding`
//! k extrapolated with k + 1   mean_k + (1 − 2^−k) (mean_k − mean_{k+1})        no lag where readings change evenly
//! ```
//! The settled mean k has the age 2^k − 1, so that 1 − 2^−k is its age over what the next one is older. Noise and age of a window after
//! m frames follow from gains alone:
//! ```text
//! cov_jk ← (1 − 2^−g_j)(1 − 2^−g_k) cov_jk + 2^−g_j 2^−g_k        over the variance of a reading
//! age_k  ← (1 − 2^−g_k)(age_k + 1)                                mean age of what mean_k holds, in frames
//! ```
//! and settle where a frame changes nothing more.
//! A window is the mean of a frame if it agrees with the shortest one, which is tested by χ² against the noise σ of a reading:
//! ```text
//! Σ over live taxels of (window − shortest mean)² ≤ limit σ² n,    limit = (1 + AGREES √(2/n)) v
//! ```
//! v: variance of that difference once the means have settled; n: live taxels. Of those that agree the one with the least noise counts.
//! A window counts from the frame on at which the last gain of its means is reached; the next longer mean has the same frames before.

use super::sliding::gain_shift;

/// Standard deviations of χ²/n by which a window may differ. On drawn presses of sensor-1 of seven kinds at 0.2 and 1 % of noise,
/// 3.5 to 7 gave the same errors within a twentieth.
const AGREES: f64 = 5.0;

/// A window, by k.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MeanWindow {
    /// The sliding mean of this k.
    Mean(u32),
    /// That of this k and that of k + 1, extrapolated to the newest frame.
    Extrapolated(u32),
}

impl MeanWindow {
    /// The windows of means of `averages`, each one more than that before: those with less noise than the shortest mean once they have
    /// settled, the least first, and then the shortest mean.
    pub fn all(averages: &[u32]) -> Vec<MeanWindow> {
        let Some(&shortest) = averages.first() else { return Vec::new() };
        let settled = MeanNoise::settled(averages);
        let variance = |window: &MeanWindow| settled.variance(&window.weights(averages));
        let most = variance(&MeanWindow::Mean(shortest));
        let longer = averages[1..].iter().flat_map(|&k| [MeanWindow::Mean(k), MeanWindow::Extrapolated(k - 1)]);
        let mut all: Vec<MeanWindow> = longer.filter(|window| variance(window) < most).collect();
        all.sort_by(|a, b| variance(a).total_cmp(&variance(b)));
        all.push(MeanWindow::Mean(shortest));
        all
    }

    /// The weight of each mean; they add up to 1.
    pub fn weights(self, averages: &[u32]) -> Vec<f64> {
        let weight = |k: u32| match self {
            MeanWindow::Mean(window) => f64::from(u8::from(k == window)),
            MeanWindow::Extrapolated(window) if k == window => 2.0 - 0.5f64.powi(window as i32),
            MeanWindow::Extrapolated(window) if k == window + 1 => 0.5f64.powi(window as i32) - 1.0,
            MeanWindow::Extrapolated(_) => 0.0,
        };
        averages.iter().map(|&k| weight(k)).collect()
    }

    /// The number of the frame since a reset from which on the window counts.
    pub fn counts_from(self) -> usize {
        let longest = match self {
            MeanWindow::Mean(k) => k,
            MeanWindow::Extrapolated(k) => k + 1,
        };
        (1..1 << longest).find(|&frame| gain_shift(frame, longest) == longest).unwrap_or(1)
    }

    /// The limit of χ² with `live` taxels, over σ² and their number: see above.
    pub fn limit(self, averages: &[u32], live: usize) -> f64 {
        let shortest = MeanWindow::Mean(averages[0]).weights(averages);
        let difference: Vec<f64> =
            self.weights(averages).iter().zip(shortest).map(|(own, other)| own - other).collect();
        let variance = MeanNoise::settled(averages).variance(&difference);
        (1.0 + AGREES * (2.0 / live.max(1) as f64).sqrt()) * variance.max(0.0)
    }
}

/// What means of the same readings have of their noise, and their ages.
#[derive(Clone, Debug, PartialEq)]
pub struct MeanNoise {
    averages: Vec<u32>,
    covariance: Vec<Vec<f64>>,
    ages: Vec<f64>,
    frames: usize,
}

impl MeanNoise {
    /// Of no frames yet, for means of `averages`.
    pub fn new(averages: &[u32]) -> MeanNoise {
        let all = averages.len();
        MeanNoise {
            averages: averages.to_vec(),
            covariance: vec![vec![0.0; all]; all],
            ages: vec![0.0; all],
            frames: 0,
        }
    }

    /// After `frames` frames.
    pub fn after(averages: &[u32], frames: usize) -> MeanNoise {
        let mut noise = MeanNoise::new(averages);
        (0..frames).for_each(|_| noise.add());
        noise
    }

    /// After so many frames that more change nothing: each gain is the last one, 2^−k.
    pub fn settled(averages: &[u32]) -> MeanNoise {
        let gains: Vec<f64> = averages.iter().map(|&k| 0.5f64.powi(k as i32)).collect();
        let covariance = |j: f64, k: f64| j * k / (1.0 - (1.0 - j) * (1.0 - k));
        MeanNoise {
            averages: averages.to_vec(),
            covariance: gains.iter().map(|&j| gains.iter().map(|&k| covariance(j, k)).collect()).collect(),
            ages: gains.iter().map(|gain| (1.0 - gain) / gain).collect(),
            frames: usize::MAX,
        }
    }

    /// With one more frame.
    pub fn add(&mut self) {
        self.frames += 1;
        let gain = |k: &u32| 0.5f64.powi(gain_shift(self.frames, *k) as i32);
        let gains: Vec<f64> = self.averages.iter().map(gain).collect();
        for (j, row) in self.covariance.iter_mut().enumerate() {
            for (k, own) in row.iter_mut().enumerate() {
                *own = (1.0 - gains[j]) * (1.0 - gains[k]) * *own + gains[j] * gains[k];
            }
        }
        self.ages.iter_mut().zip(gains).for_each(|(age, gain)| *age = (1.0 - gain) * (*age + 1.0));
    }

    /// Number of frames.
    pub fn frames(&self) -> usize {
        self.frames
    }

    /// Variance of a sum of the means with these weights, over that of a reading.
    pub fn variance(&self, weights: &[f64]) -> f64 {
        let row =
            |(row, weight): (&Vec<f64>, &f64)| weight * std::iter::zip(row, weights).map(|(c, w)| c * w).sum::<f64>();
        std::iter::zip(&self.covariance, weights).map(row).sum()
    }

    /// Mean age of the frames in it, in frames.
    pub fn age(&self, weights: &[f64]) -> f64 {
        std::iter::zip(&self.ages, weights).map(|(age, weight)| age * weight).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use MeanWindow::{Extrapolated, Mean};

    #[test]
    fn windows_by_their_noise() {
        let averages = [2, 3, 4, 5, 6];
        let all = MeanWindow::all(&averages);
        assert_eq!(
            all,
            [Mean(6), Mean(5), Extrapolated(5), Mean(4), Extrapolated(4), Mean(3), Extrapolated(3), Mean(2)]
        );
        assert_eq!(MeanWindow::all(&[2, 3]), [Mean(3), Mean(2)]);
        assert_eq!(all.iter().map(|own| own.counts_from()).collect::<Vec<_>>(), [48, 24, 48, 12, 24, 6, 12, 3]);
        let settled = MeanNoise::settled(&averages);
        // As a thousand frames leave them.
        let after = MeanNoise::after(&averages, 1000);
        for window in &all {
            let weights = window.weights(&averages);
            assert!((settled.variance(&weights) / after.variance(&weights) - 1.0).abs() < 1e-4, "{window:?}");
            assert!((settled.age(&weights) - after.age(&weights)).abs() < 1e-4, "{window:?}");
        }
        for window in &all {
            let weights = window.weights(&averages);
            let age = match window {
                Mean(k) => f64::from((1 << k) - 1),
                Extrapolated(_) => 0.0,
            };
            assert!((weights.iter().sum::<f64>() - 1.0).abs() < 1e-12, "{window:?}");
            assert!((settled.age(&weights) - age).abs() < 1e-4, "{window:?}: {}", settled.age(&weights));
        }
        // That of a sliding mean alone, and none against itself.
        assert!((settled.variance(&Mean(5).weights(&averages)) - 1.0 / 63.0).abs() < 1e-9);
        assert_eq!(Mean(2).limit(&averages, 64), 0.0);
        assert!(all[..7].iter().all(|own| (0.01..0.5).contains(&own.limit(&averages, 64))));
    }
}
