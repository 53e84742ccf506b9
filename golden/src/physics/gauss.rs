//! Gauss: nodes and weights of Gauss–Legendre quadrature on −1 … 1.
//!
//! Zeros z of the Legendre polynomial P_n, w = 2/((1 − z²) P_n′(z)²); exact up to x^(2n − 1).
//!
//! | | shape | range |
//! |---|---|---|
//! | in: n | scalar | 1 … 64 |
//! | out: (z, w) | n | z in −1 … 1, weights sum to 2 |

use std::f64::consts::PI;
use std::sync::OnceLock;

/// Maximum number of nodes.
const MOST: usize = 64;

/// Nodes and weights (z, w) of the rule with `n` nodes, 1 to 64, computed once; other `n` are clamped.
pub fn rule(n: usize) -> &'static [(f64, f64)] {
    static RULES: OnceLock<Vec<Vec<(f64, f64)>>> = OnceLock::new();
    let rules = RULES.get_or_init(|| (1..=MOST).map(nodes).collect());
    &rules[n.clamp(1, MOST) - 1]
}

fn nodes(n: usize) -> Vec<(f64, f64)> {
    let node = |k: usize| {
        let mut z = (PI * (k as f64 + 0.75) / (n as f64 + 0.5)).cos();
        // From this start Newton's method converges to rounding in four steps; the fifth is a margin.
        for _ in 0..5 {
            let (p, slope) = legendre(n, z);
            z -= p / slope;
        }
        let slope = legendre(n, z).1;
        (z, 2.0 / ((1.0 - z * z) * slope * slope))
    };
    (0..n).map(node).collect()
}

/// P_n(z) and P_n′(z), by the three-term recurrence.
fn legendre(n: usize, z: f64) -> (f64, f64) {
    let (mut before, mut p) = (1.0, z);
    for k in 2..=n {
        let k = k as f64;
        (before, p) = (p, ((2.0 * k - 1.0) * z * p - (k - 1.0) * before) / k);
    }
    (p, n as f64 * (before - z * p) / (1.0 - z * z))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integrates_what_it_must() {
        for n in [1, 2, 5, 12, 24, 64] {
            for k in (0..2 * n as i32).step_by(2) {
                let power: f64 = rule(n).iter().map(|(x, w)| w * x.powi(k)).sum();
                assert!((power - 2.0 / f64::from(k + 1)).abs() < 1e-14, "{n} {k}");
            }
        }
    }
}
