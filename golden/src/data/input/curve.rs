//! Curve: the characteristic of a sensor whose readings are no straight line of the stress, common to its taxels.
//!
//! ```text
//! u = gain · (reading − zero),  b = c(u)
//! ```
//!
//! c goes through the knots (u, b) of `input.curve`, which rise, as a monotone cubic (Fritsch and Butland 1984), and is straight
//! beyond the first and the last one. Table, tare frame and running zero are as without it: c(0) = 0.
//!
//! | | unit | range |
//! |---|---|---|
//! | u | MPa at the gain of the table | finite |
//! | b | MPa | finite |
//! | slope | – | above 0 |

use crate::spec::scene::rise;

/// Smallest slope at an end, over that of the line to the next knot.
const LEAST_END_SLOPE: f64 = 0.1;
/// Largest, so that the cubic is monotone.
const MOST_END_SLOPE: f64 = 3.0;
/// Halvings of a segment, after which it has no more digits.
const HALVINGS: u32 = 60;

/// A curve through two knots or more.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    /// u and b, both rising.
    knots: Vec<[f64; 2]>,
    /// Slope in each knot, above 0.
    slopes: Vec<f64>,
}

impl Curve {
    /// The curve through these knots; `None` unless they are two or more and both values rise from one to the next.
    ///
    /// ```
    /// use dermis_golden::data::input::curve::Curve;
    ///
    /// let curve = Curve::new(&[[0.0, 0.0], [0.05, 0.02], [0.1, 0.1]]).unwrap();
    /// assert_eq!([0.0, 0.05, 0.1].map(|u| curve.stress_MPa(u)), [0.0, 0.02, 0.1]);
    /// assert!((curve.straight_MPa(curve.stress_MPa(0.07)) - 0.07).abs() < 1e-15);
    /// assert_eq!(Curve::new(&[[0.0, 0.0], [0.0, 0.1]]), None);
    /// ```
    pub fn new(knots: &[[f64; 2]]) -> Option<Curve> {
        (knots.len() > 1 && rise(knots)).then(|| Curve { knots: knots.to_vec(), slopes: slopes(knots) })
    }

    /// b in MPa of the straight value u.
    pub fn stress_MPa(&self, straight_MPa: f64) -> f64 {
        let last = self.knots.len() - 1;
        let line = |k: usize| self.knots[k][1] + self.slopes[k] * (straight_MPa - self.knots[k][0]);
        if straight_MPa <= self.knots[0][0] {
            return line(0);
        }
        if straight_MPa >= self.knots[last][0] {
            return line(last);
        }
        self.between(self.segment(0, straight_MPa), straight_MPa)
    }

    /// u in MPa of the stress b.
    pub fn straight_MPa(&self, stress_MPa: f64) -> f64 {
        let last = self.knots.len() - 1;
        let line = |k: usize| self.knots[k][0] + (stress_MPa - self.knots[k][1]) / self.slopes[k];
        if stress_MPa <= self.knots[0][1] {
            return line(0);
        }
        if stress_MPa >= self.knots[last][1] {
            return line(last);
        }
        let k = self.segment(1, stress_MPa);
        let [mut low, mut high] = [self.knots[k][0], self.knots[k + 1][0]];
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            let half = if self.between(k, middle) < stress_MPa { &mut low } else { &mut high };
            *half = middle;
        }
        0.5 * (low + high)
    }

    /// Slope of b over u without load.
    pub fn slope_without_load(&self) -> f64 {
        self.knots.iter().position(|knot| knot[0] == 0.0).map_or(1.0, |k| self.slopes[k])
    }

    /// The segment that holds a value of one column, between the first and the last knot.
    fn segment(&self, column: usize, value: f64) -> usize {
        self.knots.partition_point(|knot| knot[column] <= value).clamp(1, self.knots.len() - 1) - 1
    }

    /// The cubic of segment `k`.
    fn between(&self, k: usize, u: f64) -> f64 {
        let [[u0, b0], [u1, b1]] = [self.knots[k], self.knots[k + 1]];
        let (width, t) = (u1 - u0, (u - u0) / (u1 - u0));
        let (m0, m1) = (width * self.slopes[k], width * self.slopes[k + 1]);
        let rise = b1 - b0;
        // Hermite's form, from b0 on, so that the knots are met exactly.
        b0 + t * (m0 + t * (3.0 * rise - 2.0 * m0 - m1 + t * (m0 + m1 - 2.0 * rise)))
    }
}

/// Slopes in the knots: within, a harmonic mean of those of the lines beside, weighted by their widths; at the ends, that of the
/// parabola through three knots, within bounds.
fn slopes(knots: &[[f64; 2]]) -> Vec<f64> {
    let widths: Vec<f64> = knots.windows(2).map(|pair| pair[1][0] - pair[0][0]).collect();
    let lines: Vec<f64> =
        knots.windows(2).zip(&widths).map(|(pair, width)| (pair[1][1] - pair[0][1]) / width).collect();
    let end = |k: usize, next: usize| {
        let (own, other) = (widths[k], widths[next]);
        let parabola = ((2.0 * own + other) * lines[k] - own * lines[next]) / (own + other);
        parabola.clamp(LEAST_END_SLOPE * lines[k], MOST_END_SLOPE * lines[k])
    };
    let last = lines.len() - 1;
    let inner = |k: usize| {
        let (before, behind) = (widths[k] + 2.0 * widths[k - 1], 2.0 * widths[k] + widths[k - 1]);
        (before + behind) / (behind / lines[k - 1] + before / lines[k])
    };
    let mut slopes = vec![if last == 0 { lines[0] } else { end(0, 1) }];
    slopes.extend((1..=last).map(inner));
    slopes.push(if last == 0 { lines[0] } else { end(last, last - 1) });
    slopes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    /// Whatever the knots, the curve rises and its inverse leads back.
    #[test]
    fn it_rises_through_its_knots_and_back() {
        let mut random = Random::new(7);
        for _ in 0..200 {
            let mut knots = vec![[0.0, 0.0]];
            for _ in 0..random.between(2.0, 8.0) as usize {
                let [u, b] = knots[knots.len() - 1];
                knots.push([u + 1e-3 + random.between(0.0, 1.0), b + 1e-3 + random.between(0.0, 1.0).powi(4)]);
            }
            let curve = Curve::new(&knots).unwrap();
            assert!(knots.iter().all(|[u, b]| (curve.stress_MPa(*u) - b).abs() < 1e-12), "{knots:?}");
            let most = knots[knots.len() - 1][0];
            let values: Vec<f64> = (-20..=120).map(|k| curve.stress_MPa(most * k as f64 / 100.0)).collect();
            assert!(values.is_sorted_by(|a, b| a < b), "{knots:?}");
            for k in -20..=120 {
                let u = most * k as f64 / 100.0;
                assert!((curve.straight_MPa(curve.stress_MPa(u)) - u).abs() < 1e-9 * most, "{knots:?} {u}");
            }
        }
        assert_eq!(Curve::new(&[[0.0, 0.0]]), None);
        assert_eq!(Curve::new(&[[0.0, 0.0], [1.0, 1.0]]).unwrap().stress_MPa(0.3), 0.3);
    }
}
