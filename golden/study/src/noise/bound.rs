//! Bound: the smallest covariance of any unbiased estimate of the shear (Cramér–Rao).
//!
//! With noise of deviation σ on every taxel the Fisher information is JᵀJ/σ², J the derivatives of b by the unknowns;
//! the bound of the shear is its 2 × 2 block of σ² (JᵀJ)⁻¹.
//!
//! | unknowns | what is known |
//! |---|---|
//! | 6: centre, size, force | Hertz pressure, the ellipse's shape and direction are given |
//! | 9: also two more of the ellipse, the exponent g | what `patch` assumes |
//!
//! The 6-parameter bound is the smaller one. J is made of the kernel's derivatives, with the quadrature of the stress.

use super::contact::{ContactStress, HertzContact};
use nalgebra::{DMatrix, Matrix2};

/// Covariance of (Tx, Ty) in N² for σ = 1 MPa, with 6 and with 9 unknowns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bound {
    /// With 6 unknowns: centre, size and force.
    pub six: Matrix2<f64>,
    /// With 9 unknowns: all that `patch` fits.
    pub nine: Matrix2<f64>,
}

impl Bound {
    /// The bound for one contact; `None` if its unknowns cannot be distinguished.
    pub fn new(truth: &ContactStress, contact: &HertzContact) -> Option<Bound> {
        let theta = contact.parameters();
        let ellipse = truth.ellipse();
        let loads = ellipse.unit_loads(&theta);
        let shape = ellipse.derivatives(&theta, contact.force_N());
        let all: Vec<&[f64]> = loads.iter().chain(&shape).map(Vec::as_slice).collect();
        // A change of size scales the three entries of L together.
        let size: Vec<f64> = (0..all[0].len()).map(|i| (2..5).map(|k| theta[k] * shape[k][i]).sum()).collect();
        let few = [all[0], all[1], all[2], all[3], all[4], &size];
        Some(Bound { six: shear_block(&few)?, nine: shear_block(&all)? })
    }
}

/// The first 2 × 2 block of (JᵀJ)⁻¹.
fn shear_block(columns: &[&[f64]]) -> Option<Matrix2<f64>> {
    let jacobian = DMatrix::from_fn(columns[0].len(), columns.len(), |i, k| columns[k][i]);
    // Columns are first scaled to length 1: their units differ by orders of magnitude.
    let lengths: Vec<f64> = jacobian.column_iter().map(|column| column.norm()).collect();
    let scaled = DMatrix::from_fn(jacobian.nrows(), jacobian.ncols(), |i, k| jacobian[(i, k)] / lengths[k]);
    let covariance = scaled.tr_mul(&scaled).cholesky()?.inverse();
    Some(Matrix2::from_fn(|i, k| covariance[(i, k)] / (lengths[i] * lengths[k])))
}
