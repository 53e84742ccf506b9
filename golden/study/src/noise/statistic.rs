//! Statistic: quantiles and shares with confidence intervals by the bootstrap.
//!
//! The values are drawn again 400 times with replacement; the interval is that between the 2.5 % and 97.5 % quantiles
//! of the statistic.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: values | n | any |
//! | out: value, low, high | 3 | as the values |

use dermis_golden::quantile::sorted_quantile;
use dermis_golden::random::Random;
use serde::Serialize;

/// Number of resamples.
const RESAMPLES: usize = 400;
/// Quantiles of the statistic that bound the interval.
const BOUNDS: [f64; 2] = [0.025, 0.975];
/// Seed of the resamples.
const SEED: u64 = 0xb007;

/// A statistic with its 95 % confidence interval.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Interval {
    /// The statistic of all values.
    pub value: f64,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

/// Median and 90 % quantile of errors, as fractions.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct ErrorSpread {
    /// Median.
    pub median: Interval,
    /// 90 % quantile.
    pub ninety: Interval,
}

impl Interval {
    /// A statistic of `count` values, which it takes by their indices.
    pub fn bootstrap(count: usize, statistic: impl Fn(&[usize]) -> f64) -> Interval {
        let all: Vec<usize> = (0..count).collect();
        let mut random = Random::new(SEED);
        let mut again: Vec<f64> = (0..RESAMPLES)
            .map(|_| {
                let indices: Vec<usize> = (0..count).filter_map(|_| random.pick(&all).copied()).collect();
                statistic(&indices)
            })
            .collect();
        again.sort_by(f64::total_cmp);
        let [low, high] = BOUNDS.map(|share| quantile(&again, share));
        Interval { value: statistic(&all), low, high }
    }

    /// The share of trues, frame by frame, each frame giving some.
    pub fn share(frames: &[Vec<bool>]) -> Interval {
        Interval::bootstrap(frames.len(), |indices| {
            let trues = |&k: &usize| frames[k].iter().filter(|hit| **hit).count();
            let (hits, all) = (indices.iter().map(trues).sum::<usize>(), indices.iter().map(|&k| frames[k].len()));
            hits as f64 / (all.sum::<usize>().max(1)) as f64
        })
    }
}

impl ErrorSpread {
    /// Of errors; zero without any.
    pub fn of(errors: &[f64]) -> ErrorSpread {
        let at = |share: f64| {
            Interval::bootstrap(errors.len(), |indices| {
                let mut drawn: Vec<f64> = indices.iter().map(|&k| errors[k]).collect();
                drawn.sort_by(f64::total_cmp);
                quantile(&drawn, share)
            })
        };
        ErrorSpread { median: at(0.5), ninety: at(0.9) }
    }
}

/// The value below which a share of the sorted values lies; 0 without values.
pub fn quantile(sorted: &[f64], share: f64) -> f64 {
    sorted_quantile(sorted, share).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn intervals_hold_the_truth_as_often_as_they_say() {
        // Medians of 100 normal numbers: the interval of 95 % holds the true median 0 in most of 200 cases.
        let mut random = Random::new(9);
        let held = (0..200).filter(|_| {
            let values: Vec<f64> = (0..100).map(|_| random.normal()).collect();
            let median = ErrorSpread::of(&values).median;
            assert!(median.low <= median.value && median.value <= median.high);
            median.low <= 0.0 && 0.0 <= median.high
        });
        // 190 expected, deviation 3; the bootstrap of a median is a little narrow.
        assert!((178..=200).contains(&held.count()));
    }

    #[test]
    fn shares_by_hand() {
        let share = Interval::share(&[vec![true, false], vec![true, true], vec![], vec![false, false]]);
        assert_eq!(share.value, 0.5);
        assert!(share.low < 0.5 && share.high > 0.5);
        assert_eq!(Interval::share(&vec![vec![true]; 10]), Interval { value: 1.0, low: 1.0, high: 1.0 });
        assert_eq!(ErrorSpread::of(&[]), ErrorSpread::default());
        assert_eq!((quantile(&[1.0, 2.0, 3.0], 0.5), quantile(&[], 0.5)), (2.0, 0.0));
    }
}
