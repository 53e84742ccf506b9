//! Means: sliding means of the same readings, one or several of different length, and the windows of an adaptive mean.
//!
//! ```text
//! mean_k ← mean_k + 2^−g (reading − mean_k)        as in `sliding`, for each k
//! ```
//!
//! A [`Window`] is one of them, or two extrapolated to the newest frame, with the noise of the shorter mean and little of its lag
//! where readings change evenly: [`mean_window`](crate::spec::mean_window).
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: frames in their order | taxels | readings |
//! | out: mean of a window | taxels | readings |
//! | out: variance, age of a window | scalars | of a reading, frames |

use crate::spec::mean_window::{MeanNoise, MeanWindow};
use crate::spec::sliding;

/// Sliding means of the frames so far.
#[derive(Clone, Debug, PartialEq)]
pub struct Means {
    /// k of each mean, ascending.
    averages: Vec<u32>,
    /// The windows of an adaptive mean of them.
    windows: Vec<MeanWindow>,
    /// A mean each, row-major.
    means: Vec<Vec<f64>>,
    noise: MeanNoise,
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
    /// Mean age of its frames, none where it is extrapolated and its means have settled.
    pub age: f64,
}

impl Window {
    /// The window with these weights of means of which `noise` is.
    fn new(noise: &MeanNoise, weights: Vec<f64>) -> Window {
        Window { variance: noise.variance(&weights), age: noise.age(&weights), weights }
    }

    /// The window of means of `averages` of which `noise` is.
    pub(crate) fn of(averages: &[u32], window: MeanWindow, noise: &MeanNoise) -> Window {
        Window::new(noise, window.weights(averages))
    }

    /// Number of frames of equal weight with its noise.
    pub fn frames_held(&self) -> usize {
        (1.0 / self.variance).round() as usize
    }
}

impl Means {
    /// No frames of `taxels` taxels yet; a mean for each k of `averages`, ascending.
    pub fn new(averages: Vec<u32>, taxels: usize) -> Means {
        Means {
            windows: MeanWindow::all(&averages),
            means: vec![vec![0.0; taxels]; averages.len()],
            noise: MeanNoise::new(&averages),
            averages,
            read: vec![false; taxels],
        }
    }

    /// Adds a frame without gaps, in which `lacks` says which taxels had no reading of their own.
    pub fn add(&mut self, readings: &[f64], lacks: impl Fn(usize) -> bool) {
        self.noise.add();
        let frame = self.noise.frames();
        std::iter::zip(&mut self.means, &self.averages).for_each(|(mean, k)| sliding::add(mean, readings, frame, *k));
        self.read.iter_mut().enumerate().for_each(|(taxel, read)| *read |= !lacks(taxel));
    }

    /// Number of frames.
    pub fn frames(&self) -> usize {
        self.noise.frames()
    }

    /// The longest mean so far of a taxel that has had a reading.
    pub fn reading(&self, taxel: usize) -> Option<f64> {
        (self.frames() > 0 && self.read[taxel]).then(|| self.means[self.means.len() - 1][taxel])
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

    /// The second shortest mean, of one alone that.
    pub fn second_shortest(&self) -> Window {
        self.single(1.min(self.means.len() - 1))
    }

    /// The windows that count, as [`MeanWindow::all`] has them, each with the limit of its χ² with `live` taxels.
    pub fn windows(&self, live: usize) -> impl Iterator<Item = (Window, f64)> + '_ {
        let counts = |window: &&MeanWindow| window.counts_from() <= self.frames();
        self.windows
            .iter()
            .filter(counts)
            .map(move |window| (Window::of(&self.averages, *window, &self.noise), window.limit(&self.averages, live)))
    }

    /// The window between two others, with `share`, 0 to 1, of the second.
    pub fn between(&self, first: &Window, second: &Window, share: f64) -> Window {
        let weights = std::iter::zip(&first.weights, &second.weights).map(|(a, b)| a + share * (b - a));
        Window::new(&self.noise, weights.collect())
    }

    fn single(&self, mean: usize) -> Window {
        Window::of(&self.averages, MeanWindow::Mean(self.averages[mean]), &self.noise)
    }

    /// The mean of a window, row-major.
    pub fn mean(&self, window: &Window) -> Vec<f64> {
        self.sum(&window.weights)
    }

    /// What the mean of `window` is above that of `other`, row-major, with its variance over that of a reading.
    pub fn difference(&self, window: &Window, other: &Window) -> (Vec<f64>, f64) {
        let weights: Vec<f64> = std::iter::zip(&window.weights, &other.weights).map(|(a, b)| a - b).collect();
        (self.sum(&weights), self.noise.variance(&weights).max(0.0))
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

    const AVERAGES: [u32; 4] = [2, 3, 4, 5];

    /// Variances and covariances as many drawn readings have them.
    #[test]
    fn windows_have_the_stated_noise() {
        const TAXELS: usize = 4000;
        let (mut means, mut random) = (Means::new(AVERAGES.to_vec(), TAXELS), Random::new(4));
        for _ in 0..90 {
            let readings: Vec<f64> = (0..TAXELS).map(|_| random.normal()).collect();
            means.add(&readings, |_| false);
        }
        let size = |values: &[f64]| values.iter().map(|value| value * value).sum::<f64>() / TAXELS as f64;
        let windows: Vec<(Window, f64)> = means.windows(TAXELS).collect();
        assert_eq!(windows.len(), 6);
        for (window, limit) in &windows {
            // 4000 draws estimate a variance to √(2/4000) = 2.2 %; four times that.
            assert!((size(&means.mean(window)) / window.variance - 1.0).abs() < 0.09, "{window:?}");
            let (difference, variance) = means.difference(window, &means.shortest());
            assert!(variance < 1e-12 || (size(&difference) / variance - 1.0).abs() < 0.09, "{window:?}");
            // Five standard deviations of the mean of 4000 squares, and means that have nearly settled.
            assert!(variance < 1e-12 || (1.05..1.2).contains(&(limit / variance)), "{window:?}: {limit} {variance}");
        }
        // A mean alone as `sliding` has it.
        assert!((means.longest().variance - sliding::variance(90, 5)).abs() < 1e-12);
    }

    /// Readings that rise evenly: a window is behind by its age.
    #[test]
    fn ages_are_the_lag_of_even_changes() {
        let mut means = Means::new(AVERAGES.to_vec(), 1);
        for frame in 0..300 {
            means.add(&[f64::from(frame)], |_| false);
            for (window, _) in means.windows(1) {
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
