//! Masked: the matrices of a subarray with dead taxels.
//!
//! The readings b_D of the dead taxels D are unknown. Of all p = Cz⁺ b that agree with the other readings, the
//! smoothest is taken: ‖L p‖ is minimal, L the second differences of p over the cells. With G = Cz⁺ and its columns
//! G_D,
//!
//! ```text
//! Π = I − G_D ((L G_D)ᵀ (L G_D))⁻¹ (L G_D)ᵀ L        Cz⁺ → Π Cz⁺        Ax → Π Ax        Ay → Π Ay
//! ```
//!
//! Π G_D = 0: the columns of D vanish, whatever D reads. The family then meets the stress on every other taxel. With L
//! = 1 this would be the pseudo-inverse of Cz without the rows D, which pulls the forces over D towards zero.
//!
//! | | shape |
//! |---|---|
//! | in: D | k taxels of the subarray, each once, fewer than all |
//! | out: matrices | n × n, columns D of Cz⁺ zero |
//!
//! A rank-k update of k n² multiplications. The mirror symmetry is lost, so products are computed in the basis of the
//! taxels.

use super::inverse::product;
use super::{FoldedMatrices, Matrices, MatricesError};
use crate::physics::symmetry::folded::{Basis, Operator};
use crate::spec::sensor::Sensor;
use faer::linalg::solvers::Solve;
use faer::Mat;

impl Matrices {
    /// The matrices without the readings of the taxels `dead`, row-major indices.
    ///
    /// # Errors
    /// [`MatricesError::TooManyDead`] if no reading remains or the remaining ones do not determine the forces.
    pub fn without(&self, dead: &[usize]) -> Result<Matrices, MatricesError> {
        let mut masked = self.clone();
        if dead.is_empty() {
            return Ok(masked);
        }
        let n = self.sensor.taxels();
        let columns = Mat::from_fn(n, dead.len(), |i, k| self.cz_pinv[(i, dead[k])]);
        let rough = roughness(&self.sensor, &columns);
        let gram = product(&rough.transpose().to_owned(), &rough);
        let weights = gram.partial_piv_lu().solve(product(&rough.transpose().to_owned(), &differences(&self.sensor)));
        let finite = weights.col_iter().all(|col| col.iter().all(|w| w.is_finite()));
        if dead.len() >= n || !finite {
            let sensor = Box::new(self.sensor.clone());
            return Err(MatricesError::TooManyDead { sensor, dead: dead.len() });
        }
        let project = |m: &Mat<f64>| m - product(&columns, &product(&weights, m));
        let [mut cz_pinv, ax, ay] = [&self.cz_pinv, &self.ax, &self.ay].map(project);
        // These entries are zero except for rounding.
        dead.iter().for_each(|&k| (0..n).for_each(|i| cz_pinv[(i, k)] = 0.0));
        masked.folded = FoldedMatrices {
            basis: Basis::taxels(self.sensor.rows, self.sensor.cols),
            cz_pinv: Operator::dense(cz_pinv.clone()),
            ax: Operator::dense(ax.clone()),
            ay: Operator::dense(ay.clone()),
        };
        (masked.cz_pinv, masked.ax, masked.ay) = (cz_pinv, ax, ay);
        Ok(masked)
    }
}

/// L: second differences over the four neighbours, in units of the pitches' mean square.
fn differences(sensor: &Sensor) -> Mat<f64> {
    let n = sensor.taxels();
    roughness(sensor, &Mat::identity(n, n))
}

/// L m.
fn roughness(sensor: &Sensor, m: &Mat<f64>) -> Mat<f64> {
    let (rows, cols) = (sensor.rows, sensor.cols);
    let (x, y) = (sensor.pitch_x_mm.powi(-2), sensor.pitch_y_mm.powi(-2));
    let (x, y) = (x / (x + y), y / (x + y));
    Mat::from_fn(m.nrows(), m.ncols(), |i, k| {
        let (row, col) = (i / cols, i % cols);
        // There is no force beyond the edge.
        let at = |inside: bool, index: usize| if inside { m[(index, k)] } else { 0.0 };
        let beside = at(col > 0, i.wrapping_sub(1)) + at(col + 1 < cols, i + 1);
        let above = at(row > 0, i.wrapping_sub(cols)) + at(row + 1 < rows, i + cols);
        2.0 * m[(i, k)] - x * beside - y * above
    })
}
