//! Baseline: readings that no force causes, smooth over the array, as nuisance parameters of the model.
//!
//! A drifted zero, a warm side, a bent base add the same few smooth terms to every frame:
//!
//! ```text
//! b = H(μ) w + B S c + noise        c ~ N(0, 1)        B: 1 | x, y | x² − ⅓, xy, y² − ⅓     x, y from −1 to 1
//! ```
//!
//! S holds one size for the offset, one for the slopes, one for the bends, and each is the one that makes the stress most
//! probable. With c and v the posterior means and variances of its coefficients, the stress alone says c/(1 − v) with the variance
//! v/(1 − v), so that (Tipping and Faul 2003)
//!
//! ```text
//! size² ← size² mean((c²/(1 − v) − v)/(1 − v))        z² = mean(c²/(v (1 − v)))
//! ```
//!
//! Where z² is at most [`NEEDED`], the size is [`LEAST`]: noise alone gives every frame some offset and slope, and one that were
//! free to follow it would make the shear up to 1.2 times as uncertain. So a term that the frame does not need costs nothing; one
//! that it needs makes the standard deviations grow as far as the unloaded taxels leave it unknown. A baseline is small: [`LARGEST`] of the peak, so that an
//! even pressure on the whole array is no offset.
//!
//! The rounds begin with the plane through the half of the taxels that lies closest to one (least trimmed squares,
//! Rousseeuw 1984).
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: posterior of c | terms | – |
//! | out: sizes | 3 | of the peak |

use super::cholesky::Cholesky;
use crate::spec::sensor::Sensor;
use faer::Mat;
use std::cmp::Ordering;

/// The group of each term: offset, slopes, bends.
const GROUPS: [usize; TERMS] = [0, 1, 1, 2, 2, 2];
/// Number of terms.
pub(in crate::estimate) const TERMS: usize = 6;
/// Terms of the first plane.
const PLANE: usize = 3;
/// z² above which a baseline is no noise. With 4 the medians are the same, but what noise alone leaves of neighbours is alike
/// more often.
const NEEDED: f64 = 3.0;
/// Smallest size, of the peak: it has no effect.
const LEAST: f64 = 1e-5;
/// Largest size, of the peak.
pub(super) const LARGEST: f64 = 0.05;
/// Largest first baseline, of the peak: a larger one is a contact on half of the array.
const FIRST: f64 = 0.15;
/// Steps of the trimmed fit.
const STEPS: usize = 12;

/// Sizes of offset, slopes and bends.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sizes([f64; 3]);

/// The terms of B on a taxel.
pub(in crate::estimate) fn terms(sensor: &Sensor, taxel: usize) -> [f64; TERMS] {
    let along = |index: usize, count: usize| 2.0 * index as f64 / (count - 1) as f64 - 1.0;
    let (x, y) = (along(taxel % sensor.cols, sensor.cols), along(taxel / sensor.cols, sensor.rows));
    [1.0, x, y, x * x - 1.0 / 3.0, x * y, y * y - 1.0 / 3.0]
}

impl Sizes {
    /// The sizes that agree with a first plane.
    pub fn of_plane(plane: [f64; PLANE]) -> Sizes {
        let [offset, x, y] = plane;
        Sizes([offset.abs(), (0.5 * (x * x + y * y)).sqrt(), LEAST].map(|size| size.clamp(LEAST, LARGEST)))
    }

    /// Whether there is a baseline that has an effect.
    pub fn matter(self) -> bool {
        self.0.iter().any(|size| *size > LEAST)
    }

    /// Size of a term.
    pub fn of(self, term: usize) -> f64 {
        self.0[GROUPS[term]]
    }

    /// The sizes that make the stress most probable, from means and variances of the coefficients c.
    pub fn found(self, posterior: [[f64; 2]; TERMS]) -> Sizes {
        let (mut size, mut z, mut terms) = ([0.0; 3], [0.0; 3], [0.0; 3]);
        for (&group, [mean, variance]) in GROUPS.iter().zip(posterior) {
            let free = (1.0 - variance).max(f64::EPSILON);
            size[group] += (mean * mean / free - variance) / free;
            z[group] += mean * mean / (variance * free);
            terms[group] += 1.0;
        }
        let next = |group: usize| match z[group] > NEEDED * terms[group] {
            true => (self.0[group] * (size[group] / terms[group]).max(0.0).sqrt()).clamp(LEAST, LARGEST),
            false => LEAST,
        };
        Sizes([0, 1, 2].map(next))
    }
}

/// The plane through the half of the taxels `used` that lies closest to one: offset and slopes of `b`, in its unit; 0 if
/// that half is loaded. `b` is in units of the peak.
pub(super) fn plane(sensor: &Sensor, b: &[f64], used: &[bool]) -> [f64; PLANE] {
    let all: Vec<usize> = (0..b.len()).filter(|&t| used[t]).collect();
    let half = all.len() / 2;
    if half < 2 * PLANE {
        return [0.0; PLANE];
    }
    // The shortest interval that holds half of the readings.
    let mut sorted: Vec<f64> = all.iter().map(|&t| b[t]).collect();
    sorted.sort_by(f64::total_cmp);
    let width = |k: &usize| sorted[k + half] - sorted[*k];
    let first = (0..sorted.len() - half).min_by(|a, b| width(a).total_cmp(&width(b))).unwrap_or(0);
    let mut plane = [0.5 * (sorted[first] + sorted[first + half]), 0.0, 0.0];
    let of_taxel: Vec<[f64; TERMS]> = all.iter().map(|&t| terms(sensor, t)).collect();
    for _ in 0..STEPS {
        let away = |k: usize| {
            let at: f64 = plane.iter().zip(of_taxel[k]).map(|(size, term)| size * term).sum();
            ((b[all[k]] - at).abs(), k)
        };
        let mut near: Vec<(f64, usize)> = (0..all.len()).map(away).collect();
        near.select_nth_unstable_by(half, |s, t| s.partial_cmp(t).unwrap_or(Ordering::Equal));
        let (mut gram, mut right) = (Mat::<f64>::zeros(PLANE, PLANE), [0.0; PLANE]);
        for &(_, k) in &near[..=half] {
            for i in 0..PLANE {
                right[i] += of_taxel[k][i] * b[all[k]];
                (0..PLANE).for_each(|j| gram[(i, j)] += of_taxel[k][i] * of_taxel[k][j]);
            }
        }
        let Some(factor) = Cholesky::new(gram) else { break };
        factor.solve(&mut right);
        plane = right;
    }
    let largest = plane.iter().map(|size| size.abs()).sum::<f64>();
    if largest <= FIRST {
        plane
    } else {
        [0.0; PLANE]
    }
}
