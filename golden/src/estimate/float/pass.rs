//! Pass: the matrix products, from stress to the consistent family p(μ), a polynomial in μ.
//!
//! (Cz + μ1 Cx + μ2 Cy) p = b, solved as a series p(μ) = Σ v_ij μ1^i μ2^j, i + j ≤ d:
//!
//! ```text
//! v_00 = Cz⁺ b        v_ij = −(Ax v_{i−1,j} + Ay v_{i,j−1})
//! ```
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: b | n | MPa |
//! | out: v_ij | (d + 1)(d + 2)/2 of n | N |
//!
//! 1 + d(d + 1) matrix-vector products of n²/4 multiplications in the basis of mirror parities
//! ([`crate::physics::symmetry::folded`]); at one μ that is known, [`at`], 1 + 2d. The remainder of the series is of the order r^(d+1) ([`crate::physics::matrices`]). Feeds
//! `search` and `forces`.

#[cfg(test)]
mod tests;

use crate::physics::matrices::{FoldedMatrices, Matrices};
use faer::linalg::solvers::Solve;
use faer::{Col, ColRef, Mat};

/// The polynomial p(μ) of one subarray in one frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Polynomial {
    /// Largest i + j.
    pub degree: usize,
    /// v_ij in N, each row-major in the subarray; sorted by rising i + j, then rising j: 00, 10, 01, 20, 11, 02, …
    pub coefficients: Vec<Vec<f64>>,
}

/// Index of v_ij in [`Polynomial::coefficients`].
pub fn term_index(i: usize, j: usize) -> usize {
    let order = i + j;
    order * (order + 1) / 2 + j
}

impl Polynomial {
    /// The polynomial for stress `b` in MPa, row-major, of the matrices' degree.
    pub fn new(matrices: &Matrices, b: &[f64]) -> Polynomial {
        Polynomial::of_degree(matrices, b, matrices.degree)
    }

    /// The polynomial of a given degree; degree 0 is p₀ alone, for a subarray that is not searched.
    pub fn of_degree(matrices: &Matrices, b: &[f64], degree: usize) -> Polynomial {
        let FoldedMatrices { basis, ax, ay, .. } = &matrices.folded;
        let n = b.len();
        let mut folded = vec![first(&matrices.folded, b)];
        for order in 1..=degree {
            for j in 0..=order {
                let i = order - j;
                let mut v = vec![0.0; n];
                if i > 0 {
                    ax.accumulate(&folded[term_index(i - 1, j)], -1.0, &mut v);
                }
                if j > 0 {
                    ay.accumulate(&folded[term_index(i, j - 1)], -1.0, &mut v);
                }
                folded.push(v);
            }
        }
        let coefficients = folded.iter().map(|v| basis.unfold(v)).collect();
        Polynomial { degree, coefficients }
    }

    /// v_ij in N, row-major; i + j must not exceed the degree.
    pub fn v(&self, i: usize, j: usize) -> &[f64] {
        &self.coefficients[term_index(i, j)]
    }

    /// p(μ) in N.
    pub fn eval(&self, mu: [f64; 2]) -> Vec<f64> {
        let mut p = vec![0.0; self.coefficients[0].len()];
        self.eval_into(mu, &mut p);
        p
    }

    /// Writes p(μ) in N to `p`, which has n entries.
    pub fn eval_into(&self, mu: [f64; 2], p: &mut [f64]) {
        p.copy_from_slice(&self.coefficients[0]);
        // Powers of μ of one order: μ1^order, μ1^(order−1) μ2, …, μ2^order.
        let mut terms = self.coefficients.iter().skip(1);
        for order in 1..=self.degree {
            for (j, v) in terms.by_ref().take(order + 1).enumerate() {
                let factor = mu[0].powi((order - j) as i32) * mu[1].powi(j as i32);
                for (p, v) in p.iter_mut().zip(v) {
                    *p += factor * v;
                }
            }
        }
    }
}

/// v_00 = Cz⁺ b in the basis of parities.
fn first(FoldedMatrices { basis, cz_pinv, .. }: &FoldedMatrices, b: &[f64]) -> Vec<f64> {
    let mut first = vec![0.0; b.len()];
    cz_pinv.accumulate(&basis.fold(b), 1.0, &mut first);
    first
}

/// p(μ) in N of the series of the matrices' degree for stress `b` in MPa, where no other μ is asked for: each order is the one before
/// times −(μ1 Ax + μ2 Ay).
pub fn at(matrices: &Matrices, b: &[f64], mu: [f64; 2]) -> Vec<f64> {
    let FoldedMatrices { basis, ax, ay, .. } = &matrices.folded;
    let mut order = first(&matrices.folded, b);
    let mut sum = order.clone();
    for _ in 0..matrices.degree {
        let mut next = vec![0.0; b.len()];
        ax.accumulate(&order, -mu[0], &mut next);
        ay.accumulate(&order, -mu[1], &mut next);
        sum.iter_mut().zip(&next).for_each(|(sum, next)| *sum += next);
        order = next;
    }
    basis.unfold(&sum)
}

/// p(μ) in N without the series, from (Cz + μ1 Cx + μ2 Cy) p = b by LU decomposition with row exchanges: n³/3
/// multiplications, for verification.
pub fn solve_direct(matrices: &Matrices, b: &[f64], mu: [f64; 2]) -> Vec<f64> {
    let Matrices { cx, cy, cz, .. } = matrices;
    let sum = Mat::from_fn(cz.nrows(), cz.ncols(), |i, j| cz[(i, j)] + mu[0] * cx[(i, j)] + mu[1] * cy[(i, j)]);
    let p: Col<f64> = sum.partial_piv_lu().solve(ColRef::from_slice(b));
    p.iter().copied().collect()
}
