//! Cholesky factor of a positive definite matrix, on one core: a frame is too small for the thread pool of the solvers of faer.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt;
use faer::{Mat, MatMut, Par};

/// L of A = L Lᵀ.
pub(in crate::estimate) struct Cholesky(Mat<f64>);

impl Cholesky {
    /// Factors a matrix of which the lower half is filled; `None` if it is not positive definite.
    pub fn new(mut matrix: Mat<f64>) -> Option<Cholesky> {
        let n = matrix.nrows();
        let mut memory = MemBuffer::new(llt::factor::cholesky_in_place_scratch::<f64>(n, Par::Seq, Default::default()));
        let stack = MemStack::new(&mut memory);
        let (none, seq, auto) = (Default::default(), Par::Seq, Default::default());
        llt::factor::cholesky_in_place(matrix.as_mut(), none, seq, stack, auto).ok()?;
        Some(Cholesky(matrix))
    }

    /// Replaces `right` by A⁻¹ `right`.
    pub fn solve(&self, right: &mut [f64]) {
        let (n, none) = (right.len(), MemStack::new(&mut []));
        let right = MatMut::from_column_major_slice_mut(right, n, 1);
        llt::solve::solve_in_place(self.0.as_ref(), right, Par::Seq, none);
    }

    /// A⁻¹.
    pub fn inverse(&self) -> Mat<f64> {
        let n = self.0.nrows();
        let mut memory = MemBuffer::new(llt::inverse::inverse_scratch::<f64>(n, Par::Seq));
        let mut inverse = Mat::zeros(n, n);
        llt::inverse::inverse(inverse.as_mut(), self.0.as_ref(), Par::Seq, MemStack::new(&mut memory));
        (0..n).for_each(|j| (0..j).for_each(|i| inverse[(i, j)] = inverse[(j, i)]));
        inverse
    }

    /// ln |A|.
    pub fn log_determinant(&self) -> f64 {
        2.0 * (0..self.0.nrows()).map(|i| self.0[(i, i)].ln()).sum::<f64>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_by_three_by_hand() {
        let lower = Mat::from_fn(3, 3, |i, j| [[2.0, 0.0, 0.0], [1.0, 3.0, 0.0], [-1.0, 2.0, 0.5]][i][j]);
        let matrix = &lower * lower.transpose();
        let factor = Cholesky::new(matrix.clone()).unwrap();
        assert!((factor.log_determinant() - 9.0f64.ln()).abs() < 1e-14);
        let unit = &matrix * factor.inverse();
        let mut right = vec![4.0, 5.0, -5.0];
        factor.solve(&mut right);
        for i in 0..3 {
            let row: f64 = (0..3).map(|j| matrix[(i, j)] * right[j]).sum();
            assert!((row - [4.0, 5.0, -5.0][i]).abs() < 1e-12);
            (0..3).for_each(|j| assert!((unit[(i, j)] - f64::from(i == j)).abs() < 1e-12));
        }
        assert!(Cholesky::new(Mat::from_fn(2, 2, |i, j| if i == j { 1.0 } else { 2.0 })).is_none());
    }
}
