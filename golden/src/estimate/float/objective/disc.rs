//! Disc: quadrature nodes and weights on the unit disc.
//!
//! A pressure ∝ (1 − r²)^g on the disc has, with t = √(1 − r²), the integral ∫∫ f (1 − r²)^g dA = ∫ dφ ∫₀¹ f t^(2g + 1)
//! dt. Gauss–Legendre nodes in t, equal angles in φ, alternate rings turned by half an angle. Few nodes are enough
//! because they do not depend on g and t^(2g + 1) is smooth for g ≥ 0.
//!
//! | | shape | unit | range |
//! |---|---|---|---|
//! | in: rings, angles | scalars | – | at least 1 |
//! | out: nodes | rings·angles | – | inside the unit disc |
//! | out: weights | rings·angles | – | positive, their sum is 1 |
//!
//! Feeds `patch` and `symmetric`, which put point forces at mapped nodes.

use std::f64::consts::TAU;

use crate::physics::gauss::rule;

/// Quadrature on the unit disc.
#[derive(Clone, Debug)]
pub struct Disc {
    /// Nodes, ring by ring.
    pub nodes: Vec<[f64; 2]>,
    /// t = √(1 − r²) of each node.
    heights: Vec<f64>,
    /// Gauss weight of each node's ring.
    gauss: Vec<f64>,
}

impl Disc {
    /// A quadrature of `rings` Gauss nodes in t, 1 to 64, with `angles` equal angles each, at least 1.
    pub fn new(rings: usize, angles: usize) -> Disc {
        let mut disc = Disc { nodes: Vec::new(), heights: Vec::new(), gauss: Vec::new() };
        for (ring, (z, weight)) in rule(rings).iter().enumerate() {
            // From −1 … 1 to 0 … 1; the constant factor of the weights goes with their sum.
            let t = 0.5 * (1.0 - z);
            let r = (1.0 - t * t).sqrt();
            for step in 0..angles {
                let phi = TAU * (step as f64 + 0.5 * (ring % 2) as f64) / angles as f64;
                disc.nodes.push([r * phi.cos(), r * phi.sin()]);
                disc.heights.push(t);
                disc.gauss.push(*weight);
            }
        }
        disc
    }

    /// Weights of a pressure ∝ (1 − r²)^g, sum 1, and their derivatives in g.
    pub fn weights(&self, g: f64) -> (Vec<f64>, Vec<f64>) {
        let mut weights: Vec<f64> =
            self.heights.iter().zip(&self.gauss).map(|(t, w)| w * t.powf(2.0 * g + 1.0)).collect();
        let sum: f64 = weights.iter().sum();
        weights.iter_mut().for_each(|w| *w /= sum);
        let logs = || self.heights.iter().map(|t| 2.0 * t.ln());
        let mean: f64 = weights.iter().zip(logs()).map(|(w, log)| w * log).sum();
        let slopes = weights.iter().zip(logs()).map(|(w, log)| w * (log - mean)).collect();
        (weights, slopes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integrates_moments_of_a_hertz_pressure() {
        let disc = Disc::new(5, 12);
        let (weights, _) = disc.weights(0.5);
        let mean = |f: &dyn Fn(f64, f64) -> f64| -> f64 {
            disc.nodes.iter().zip(&weights).map(|([x, y], w)| w * f(*x, *y)).sum()
        };
        // ⟨x²⟩ = 1/5 and ⟨x⁴⟩ = 3/35 of a Hertz pressure; polynomials up to t⁹ are exact.
        assert!((mean(&|x, _| x * x) - 0.2).abs() < 1e-14);
        assert!((mean(&|x, _| x.powi(4)) - 3.0 / 35.0).abs() < 1e-14);
        assert!(mean(&|x, y| x * y).abs() < 1e-14 && mean(&|x, _| x).abs() < 1e-14);
    }

    /// There is one Gauss–Legendre rule: the nodes are its own to the last bit.
    #[test]
    fn nodes_are_those_of_the_rule() {
        for rings in 1..=24 {
            let heights = rule(rings).iter().map(|(z, _)| 0.5 * (1.0 - z));
            assert!(Disc::new(rings, 1).heights.into_iter().eq(heights), "{rings}");
        }
    }

    #[test]
    fn slopes_are_those_of_the_weights() {
        let disc = Disc::new(4, 3);
        let (d, g) = (1e-6, 0.3);
        let (_, slopes) = disc.weights(g);
        let (above, below) = (disc.weights(g + d).0, disc.weights(g - d).0);
        for ((slope, a), b) in slopes.iter().zip(above).zip(below) {
            assert!((slope - (a - b) / (2.0 * d)).abs() < 1e-8);
        }
    }
}
