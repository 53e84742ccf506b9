//! Inverse: powers of the pseudo-inverse of the symmetric Cz, and the radius of the series in μ.
//!
//! Cz = U diag(λ) Uᵀ; f(Cz)⁺ = U diag(f) Uᵀ without the λ that are rounding only, |λ| ≤ n ε max|λ|.

use faer::linalg::matmul::matmul;
use faer::{Accum, Col, Mat, Par, Side};
use std::f64::consts::FRAC_PI_2;

/// Directions of θ tried from 0 to π/2.
const DIRECTIONS: usize = 9;

/// A B, on all cores.
pub(super) fn product(a: &Mat<f64>, b: &Mat<f64>) -> Mat<f64> {
    let mut c = Mat::zeros(a.nrows(), b.ncols());
    matmul(&mut c, Accum::Replace, a, b, 1.0, Par::rayon(0));
    c
}

/// Eigenvectors and inverted eigenvalues of Cz, zero for those left out.
pub(super) struct Inverse {
    vectors: Mat<f64>,
    values: Vec<f64>,
    /// Largest over smallest |λ|.
    pub(super) condition: f64,
}

impl Inverse {
    /// Decomposes Cz, `None` when the eigenvalues do not converge.
    pub(super) fn new(cz: &Mat<f64>) -> Option<Inverse> {
        let eigen = cz.self_adjoint_eigen(Side::Lower).ok()?;
        let values: Vec<f64> = eigen.S().column_vector().iter().copied().collect();
        let largest = values.iter().fold(0.0f64, |largest, v| v.abs().max(largest));
        let smallest = values.iter().fold(f64::INFINITY, |smallest, v| v.abs().min(smallest));
        let least = values.len() as f64 * f64::EPSILON * largest;
        let invert = |v: &f64| if v.abs() <= least { 0.0 } else { 1.0 / v };
        Some(Inverse {
            vectors: eigen.U().to_owned(),
            values: values.iter().map(invert).collect(),
            condition: largest / smallest,
        })
    }

    /// U diag(f) Uᵀ with f = 1/λ (`root` 1), or |1/λ|^½ (`root` 2).
    pub(super) fn power(&self, root: u32) -> Mat<f64> {
        let factor = |k: usize| match root {
            1 => self.values[k],
            _ => self.values[k].abs().sqrt(),
        };
        let n = self.values.len();
        let scaled = Mat::from_fn(n, n, |i, k| self.vectors[(i, k)] * factor(k));
        product(&scaled, &self.vectors.transpose().to_owned())
    }

    /// Largest ‖S (cos θ Cx + sin θ Cy) S‖ over the directions.
    pub(super) fn largest_radius(&self, cx: &Mat<f64>, cy: &Mat<f64>) -> f64 {
        let s = self.power(2);
        let [kx, ky] = [cx, cy].map(|c| product(&product(&s, c), &s));
        let radius = |step: usize| {
            let theta = FRAC_PI_2 * step as f64 / (DIRECTIONS - 1) as f64;
            let (sin, cos) = theta.sin_cos();
            norm2(&Mat::from_fn(kx.nrows(), kx.ncols(), |i, j| cos * kx[(i, j)] + sin * ky[(i, j)]))
        };
        (0..DIRECTIONS).map(radius).fold(0.0, f64::max)
    }
}

/// 2-norm of an antisymmetric matrix, by power iteration on KᵀK = −K². The Rayleigh quotient grows towards it and its
/// error is the square of the vector's.
fn norm2(k: &Mat<f64>) -> f64 {
    const STEPS: usize = 300;
    const ENOUGH: f64 = 1e-7;
    // A fixed start without symmetry, so that it has a part in every parity.
    let mut vector = Col::from_fn(k.nrows(), |i| 1.0 + ((i * 37 + 11) % 64) as f64 / 64.0);
    let mut norm = 0.0;
    for _ in 0..STEPS {
        let size = vector.norm_l2();
        if size == 0.0 {
            return norm;
        }
        let image = k * (vector / size);
        let next = image.norm_l2();
        let settled = (next - norm).abs() <= ENOUGH * next;
        norm = next;
        vector = k * image;
        if settled {
            break;
        }
    }
    norm
}
