//! Symmetric pressure on an ellipse, and its stress: the second stage of `symmetric` fits it.
//!
//! Pressure e(u)(1 − |u|²)^½, e an even polynomial, on x = x₀ + L u; shear μ times the pressure.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: θ = x₀, y₀, L₁₁, L₂₂, L₁₂, μ1, μ2 | 7 | mm, –  |
//! | out: stress of each coefficient of e, derivatives | 4 × n, 7 × n | MPa |

use super::disc::Disc;
use super::ellipse::{confine_ellipse, node_position};
use super::fit::Model;
use super::taxels::Taxels;
use nalgebra::{DMatrix, DVector};

/// Powers (of u, of v) of e's terms: 1, u², uv, v². With fourth powers shear and shape are hard to tell apart, which
/// doubles the error with noise.
const TERMS: [(i32, i32); 4] = [(0, 0), (2, 0), (1, 1), (0, 2)];

/// Stress model of a symmetric pressure; θ = x₀, y₀, L₁₁, L₂₂, L₁₂, μ1, μ2.
pub(super) struct SymmetricPressure<'a> {
    taxels: &'a Taxels,
    disc: &'a Disc,
    mu_max: f64,
    /// Load of each node per unit coefficient: nodes × 4.
    basis: DMatrix<f64>,
}

impl<'a> SymmetricPressure<'a> {
    /// A model with its pressure on the nodes of `disc`; |μ| is limited to `mu_max`.
    pub fn new(taxels: &'a Taxels, disc: &'a Disc, mu_max: f64) -> SymmetricPressure<'a> {
        let (weights, _) = disc.weights(0.5);
        let basis = DMatrix::from_fn(weights.len(), TERMS.len(), |node, term| {
            let ([u, v], (i, j)) = (disc.nodes[node], TERMS[term]);
            weights[node] * u.powi(i) * v.powi(j)
        });
        SymmetricPressure { taxels, disc, mu_max, basis }
    }

    /// Total load of the pressure with the given coefficients.
    pub fn load(&self, coefficients: &DVector<f64>) -> f64 {
        (&self.basis * coefficients).sum()
    }
}

impl Model for SymmetricPressure<'_> {
    fn columns(&mut self, theta: &[f64]) -> DMatrix<f64> {
        let n = self.taxels.count();
        let mut nodes = DMatrix::zeros(n, self.disc.nodes.len());
        let mut field = [(); 3].map(|()| vec![0.0; n]);
        for (&node, mut column) in self.disc.nodes.iter().zip(nodes.column_iter_mut()) {
            self.taxels.field(node_position(theta, node), [theta[5], theta[6], 1.0], &mut field);
            column.copy_from_slice(&field[0]);
        }
        nodes * &self.basis
    }

    fn slopes(&mut self, theta: &[f64], loads: &DVector<f64>) -> DMatrix<f64> {
        let n = self.taxels.count();
        let weights = &self.basis * loads;
        let mut slopes = DMatrix::zeros(n, 7);
        let mut field = [(); 3].map(|()| vec![0.0; n]);
        let mut units = [(); 3].map(|()| vec![0.0; n]);
        for (&node, &weight) in self.disc.nodes.iter().zip(&weights) {
            let position = node_position(theta, node);
            self.taxels.field(position, [theta[5] * weight, theta[6] * weight, weight], &mut field);
            let [u, v] = node;
            for i in 0..n {
                let (x, y) = (field[1][i], field[2][i]);
                slopes[(i, 0)] += x;
                slopes[(i, 1)] += y;
                slopes[(i, 2)] += x * u;
                slopes[(i, 3)] += y * v;
                slopes[(i, 4)] += x * v + y * u;
            }
            self.taxels.add_unit_forces(position, weight, &mut units);
        }
        slopes.column_mut(5).copy_from_slice(&units[0]);
        slopes.column_mut(6).copy_from_slice(&units[1]);
        slopes
    }

    fn confine(&self, theta: &mut [f64]) {
        confine_ellipse(self.taxels, theta);
        let ratio = theta[5].hypot(theta[6]);
        if ratio > self.mu_max {
            theta[5] *= self.mu_max / ratio;
            theta[6] *= self.mu_max / ratio;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spec::scene::{Medium, Scene};

    /// Central differences with steps of 10⁻⁴ mm: truncation (10⁻⁴/h)² ≈ 10⁻⁹ and rounding 10⁻¹⁶/10⁻⁴, with a margin of
    /// 10³.
    const SLOPE_TOLERANCE: f64 = 1e-6;

    #[test]
    fn slopes_are_those_of_the_columns() {
        let sensor = Scene::builtin("sensor-1").unwrap().sensor;
        let (taxels, disc) = (Taxels::new(&sensor, Medium::HalfSpace), Disc::new(5, 14));
        let mut model = SymmetricPressure::new(&taxels, &disc, 0.6);
        let theta = [0.7, -1.1, 3.0, 4.0, 0.5, 0.2, -0.1];
        let loads = DVector::from_vec(vec![5.0, -1.0, 0.4, 0.8]);
        let slopes = model.slopes(&theta, &loads);
        let largest = slopes.amax();
        for index in 0..theta.len() {
            let mut at = |by: f64| {
                let mut theta = theta;
                theta[index] += by;
                model.columns(&theta) * &loads
            };
            let step = 1e-4;
            let difference = (at(step) - at(-step)) / (2.0 * step);
            let off = (slopes.column(index) - difference).amax();
            assert!(off <= SLOPE_TOLERANCE * largest, "θ{index}: {off:e} of {largest:e}");
        }
    }
}
