//! Smooth patterns: what the gains of an array can have in common that no press shows.
//!
//! Gains that change slowly over the array change a press as another pressure would, so that the readings cannot tell one from the
//! other; an estimate that is free to take them runs away. They are the polynomials of the place up to [`ORDER`] in all,
//! orthonormal over the taxels whose gain is looked for:
//!
//! ```text
//! xⁱ yʲ, i + j ≤ 4, x and y from −1 to 1        rough part of v = v − U Uᵀ v
//! ```
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: sensor, taxels | – | – |
//! | out: U | taxels × patterns | – |

use crate::spec::sensor::Sensor;

/// Highest sum of the powers of x and y.
pub(super) const ORDER: i32 = 4;
/// Share of a pattern that others leave of it below which it is none of its own: the taxels do not tell it from them.
const OWN: f64 = 1e-6;

/// The smooth patterns, each orthonormal to the others.
pub(super) struct Smooth(Vec<Vec<f64>>);

impl Smooth {
    /// The patterns over `taxels`, row-major indices, for powers up to `order` in all; a negative one has none.
    pub fn new(sensor: &Sensor, taxels: &[usize], order: i32) -> Smooth {
        let along = |index: usize, count: usize| 2.0 * index as f64 / (count.max(2) - 1) as f64 - 1.0;
        let place = |t: &usize| (along(t % sensor.cols, sensor.cols), along(t / sensor.cols, sensor.rows));
        let mut patterns = Smooth(Vec::new());
        for (i, j) in (0..=order).flat_map(|sum| (0..=sum).map(move |i| (i, sum - i))) {
            let value = |(x, y): (f64, f64)| x.powi(i) * y.powi(j);
            let mut own: Vec<f64> = taxels.iter().map(place).map(value).collect();
            let size = norm(&own);
            // Twice, so that rounding leaves nothing of the others.
            patterns.take_off(&mut own);
            patterns.take_off(&mut own);
            let left = norm(&own);
            if left > OWN * size {
                own.iter_mut().for_each(|v| *v /= left);
                patterns.0.push(own);
            }
        }
        patterns
    }

    /// Leaves the rough part of values, one per taxel.
    pub fn take_off(&self, values: &mut [f64]) {
        for pattern in &self.0 {
            let share: f64 = pattern.iter().zip(values.iter()).map(|(u, v)| u * v).sum();
            values.iter_mut().zip(pattern).for_each(|(v, u)| *v -= share * u);
        }
    }

    /// (U Uᵀ)_ij.
    pub fn product(&self, i: usize, j: usize) -> f64 {
        self.0.iter().map(|pattern| pattern[i] * pattern[j]).sum()
    }

    /// Number of patterns.
    pub fn count(&self) -> usize {
        self.0.len()
    }
}

fn norm(values: &[f64]) -> f64 {
    values.iter().map(|v| v * v).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A polynomial of order 4 is smooth, one of order 5 and a single taxel are not; an array of three rows has fewer patterns.
    #[test]
    fn polynomials_are_smooth() {
        let sensor = |rows: usize| Sensor { rows, cols: 9, pitch_x_mm: 2.0, pitch_y_mm: 4.0, thickness_mm: 3.0 };
        let all: Vec<usize> = (0..81).filter(|t| *t != 17).collect();
        let smooth = Smooth::new(&sensor(9), &all, ORDER);
        assert_eq!(smooth.count(), 15);
        let left = |of: &dyn Fn(f64, f64) -> f64| {
            let mut values: Vec<f64> = all.iter().map(|t| of((t % 9) as f64, (t / 9) as f64)).collect();
            let before = norm(&values);
            smooth.take_off(&mut values);
            norm(&values) / before
        };
        assert!(left(&|x, y| 3.0 - x + x * x * y * y - y.powi(4)) < 1e-9);
        assert!(left(&|x, y| if (x, y) == (4.0, 4.0) { 1.0 } else { 0.0 }) > 0.9);
        assert!(left(&|x, _| (x - 4.0).powi(5)) > 0.05);
        assert_eq!(Smooth::new(&sensor(3), &(0..27).collect::<Vec<_>>(), ORDER).count(), 12);
        assert_eq!(Smooth::new(&sensor(9), &all, -1).count(), 0);
    }
}
