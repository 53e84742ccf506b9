//! Means: sliding means of the same readings, one or several of different length, and what they have of noise and age.
//!
//! ```text
//! mean_k ← mean_k + 2^−g (reading − mean_k)        as in `sliding`, for each k
//! cov_jk ← (1 − 2^−g_j)(1 − 2^−g_k) cov_jk + 2^−g_j 2^−g_k        over the variance of a reading
//! age_k  ← (1 − 2^−g_k)(age_k + 1)        mean age of what mean_k holds, in frames
//! ```
//!
//! A [`Window`] is one of them, or two extrapolated to the newest frame, with the noise of the shorter mean and none of its lag
//! where readings change evenly:
//! ```text
//! mean_j + (mean_j − mean_k) age_j / (age_k − age_j)        j shorter than k
//! ```
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: frames in their order | taxels | readings |
//! | out: mean of a window | taxels | readings |
//! | out: variance, age of a window | scalars | of a reading, frames |

use crate::spec::sliding;

/// Smallest difference of the ages of two means, in frames, between which a change shows.
const LEAST_AGE: f64 = 0.5;

/// Sliding means of the frames so far.
#[derive(Clone, Debug, PartialEq)]
pub struct Means {
    /// k of each mean, ascending.
    averages: Vec<u32>,
    /// A mean each, row-major.
    means: Vec<Vec<f64>>,
    covariance: Vec<Vec<f64>>,
    ages: Vec<f64>,
    frames: usize,
    /// Whether a taxel has had a reading.
    read: Vec<bool>,
}

/// A weighted sum of means whose weights add up to 1.
#[derive(Clone, Debug, PartialEq)]
pub struct Window {
    /// Weight of each mean.
    weights: Vec<f64>,
    /// Variance over that of a reading.
    pub variance: f64,
    /// Mean age of its frames, 0 where it is extrapolated.
    pub age: f64,
}

impl Window {
    /// Number of frames of equal weight with its noise.
    pub fn frames_held(&self) -> usize {
        (1.0 / self.variance).round() as usize
    }
}

impl Means {
    /// No frames of `taxels` taxels yet; a mean for each k of `averages`, ascending.
    pub fn new(averages: Vec<u32>, taxels: usize) -> Means {
        let all = averages.len();
        Means {
            averages,
            means: vec![vec![0.0; taxels]; all],
            covariance: vec![vec![0.0; all]; all],
            ages: vec![0.0; all],
            frames: 0,
            read: vec![false; taxels],
        }
    }

    /// Adds a frame without gaps, in which `lacks` says which taxels had no reading of their own.
    pub fn add(&mut self, readings: &[f64], lacks: impl Fn(usize) -> bool) {
        self.frames += 1;
        let gains: Vec<f64> =
            self.averages.iter().map(|&k| 0.5f64.powi(sliding::gain_shift(self.frames, k) as i32)).collect();
        for (j, row) in self.covariance.iter_mut().enumerate() {
            for (k, own) in row.iter_mut().enumerate() {
                *own = (1.0 - gains[j]) * (1.0 - gains[k]) * *own + gains[j] * gains[k];
            }
        }
        for ((age, gain), (mean, k)) in self.ages.iter_mut().zip(gains).zip(self.means.iter_mut().zip(&self.averages)) {
            *age = (1.0 - gain) * (*age + 1.0);
            sliding::add(mean, readings, self.frames, *k);
        }
        self.read.iter_mut().enumerate().for_each(|(taxel, read)| *read |= !lacks(taxel));
    }

    /// Number of frames.
    pub fn frames(&self) -> usize {
        self.frames
    }

    /// The longest mean so far of a taxel that has had a reading.
    pub fn reading(&self, taxel: usize) -> Option<f64> {
        (self.frames > 0 && self.read[taxel]).then(|| self.means[self.means.len() - 1][taxel])
    }

    /// The taxels that have had no reading, ascending.
    pub fn never_read(&self) -> Vec<usize> {
        (0..self.read.len()).filter(|taxel| !self.read[*taxel]).collect()
    }

    /// The longest mean.
    pub fn longest(&self) -> Window {
        self.single(self.means.len() - 1)
    }

    /// The shortest mean.
    pub fn shortest(&self) -> Window {
        self.single(0)
    }

    /// Every mean, the longest first.
    pub fn singles(&self) -> Vec<Window> {
        (0..self.means.len()).rev().map(|k| self.single(k)).collect()
    }

    /// Every mean, and each with the next longer one extrapolated; the least variance first.
    pub fn windows(&self) -> Vec<Window> {
        let pairs = (1..self.means.len()).filter_map(|k| self.extrapolated(k - 1, k));
        let mut all: Vec<Window> = self.singles().into_iter().chain(pairs).collect();
        all.sort_by(|a, b| a.variance.total_cmp(&b.variance));
        all
    }

    fn single(&self, mean: usize) -> Window {
        let weights = (0..self.means.len()).map(|k| f64::from(u8::from(k == mean))).collect();
        Window { weights, variance: self.covariance[mean][mean], age: self.ages[mean] }
    }

    /// `None` before the ages differ.
    fn extrapolated(&self, short: usize, long: usize) -> Option<Window> {
        let apart = self.ages[long] - self.ages[short];
        let share = self.ages[short] / apart;
        let mut weights = vec![0.0; self.means.len()];
        (weights[short], weights[long]) = (1.0 + share, -share);
        (apart > LEAST_AGE).then(|| Window { variance: self.variance(&weights), weights, age: 0.0 })
    }

    fn variance(&self, weights: &[f64]) -> f64 {
        let row =
            |(row, weight): (&Vec<f64>, &f64)| weight * std::iter::zip(row, weights).map(|(c, w)| c * w).sum::<f64>();
        std::iter::zip(&self.covariance, weights).map(row).sum()
    }

    /// The mean of a window, row-major.
    pub fn mean(&self, window: &Window) -> Vec<f64> {
        self.sum(&window.weights)
    }

    /// What the mean of `window` is above that of `other`, row-major, with its variance over that of a reading.
    pub fn difference(&self, window: &Window, other: &Window) -> (Vec<f64>, f64) {
        let weights: Vec<f64> = std::iter::zip(&window.weights, &other.weights).map(|(a, b)| a - b).collect();
        (self.sum(&weights), self.variance(&weights).max(0.0))
    }

    fn sum(&self, weights: &[f64]) -> Vec<f64> {
        let at = |taxel: usize| std::iter::zip(&self.means, weights).map(|(mean, weight)| weight * mean[taxel]).sum();
        (0..self.read.len()).map(at).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    /// Variances and covariances as many drawn readings have them.
    #[test]
    fn windows_have_the_stated_noise() {
        const TAXELS: usize = 4000;
        let (mut means, mut random) = (Means::new(vec![2, 3, 5], TAXELS), Random::new(4));
        for _ in 0..90 {
            let readings: Vec<f64> = (0..TAXELS).map(|_| random.normal()).collect();
            means.add(&readings, |_| false);
        }
        let size = |values: &[f64]| values.iter().map(|value| value * value).sum::<f64>() / TAXELS as f64;
        let windows = means.windows();
        assert_eq!(windows.len(), 5);
        for window in &windows {
            // 4000 draws estimate a variance to √(2/4000) = 2.2 %; four times that.
            assert!((size(&means.mean(window)) / window.variance - 1.0).abs() < 0.09, "{window:?}");
            let (difference, variance) = means.difference(window, &means.shortest());
            assert!(variance < 1e-12 || (size(&difference) / variance - 1.0).abs() < 0.09, "{window:?}");
        }
        // A mean alone as `sliding` has it.
        assert!((means.longest().variance - sliding::variance(90, 5)).abs() < 1e-12);
    }

    /// Readings that rise evenly: a mean is behind by its age, an extrapolated window is not.
    #[test]
    fn ages_are_the_lag_of_even_changes() {
        let mut means = Means::new(vec![2, 3, 5], 1);
        for frame in 0..300 {
            means.add(&[f64::from(frame)], |_| false);
            for window in means.windows() {
                let behind = f64::from(frame) - means.mean(&window)[0];
                assert!((behind - window.age).abs() < 1e-9, "{frame} {window:?}: {behind}");
            }
        }
        assert!((means.shortest().age - 3.0).abs() < 1e-9 && (means.longest().age - 31.0).abs() < 0.01);
    }

    #[test]
    fn taxels_without_a_reading_are_named() {
        let mut means = Means::new(vec![1], 3);
        assert_eq!(means.reading(1), None);
        means.add(&[1.0, 2.0, 3.0], |taxel| taxel == 1);
        assert_eq!((means.reading(0), means.reading(1), means.never_read()), (Some(1.0), None, vec![1]));
        means.add(&[1.0, 2.0, 3.0], |_| false);
        assert_eq!((means.reading(1), means.never_read()), (Some(2.0), vec![]));
    }
}
