//! Prior: which pressures of a contact are expected before its stress is looked at.
//!
//! ```text
//! p = e ∘ (β z + α g)        z ~ N(0, 1),  g ~ N(0, k),  k_ij = exp(−|r_i − r_j|²/2ℓ²)
//! ```
//!
//! e is the envelope, the expected size of the pressure on each cell; z the load, which β leaves nearly free; g the
//! shape, smooth over ℓ. The covariance e∘(β² + α² k)∘e has few large eigenvalues: a pivoted Cholesky factor F with
//! r columns, p = F w with w ~ N(0, 1), leaves out less than σ of the largest variance on any cell, σ the noise in units of
//! the stress' peak: finer detail is not seen beside the noise. A pressure on most of the array gets as many columns as there are
//! readings, which is what they can tell of it, and bounds the time of a frame.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: envelope e | cells of a contact | N |
//! | out: F | cells × r | N |

use crate::spec::sensor::Sensor;
use faer::Mat;

/// β, standard deviation of the load in units of the envelope's.
const LOAD: f64 = 3.0;
/// α, standard deviation of the shape in units of the envelope.
const SHAPE: f64 = 2.0;
/// Largest variance left out, in units of the largest variance of the shape, over σ.
const REMAINDER: f64 = 1.0;
/// Range of that variance.
const REMAINDER_RANGE: [f64; 2] = [1e-4, 0.05];

/// Largest variance that F leaves out, in units of the largest variance of the shape; `sigma` is the noise in units of the
/// stress' peak.
pub(in crate::estimate) fn remainder(sigma: f64) -> f64 {
    (REMAINDER * sigma).clamp(REMAINDER_RANGE[0], REMAINDER_RANGE[1])
}

/// The correlation k of the shape: for each number of cells along x and along y the factor of it.
pub(in crate::estimate) struct ShapeCorrelation([Vec<f64>; 2]);

impl ShapeCorrelation {
    /// The shape on the cells of `grid`, smooth over `length_mm`.
    pub fn new(grid: &Sensor, length_mm: f64) -> ShapeCorrelation {
        let along = |count: usize, pitch_mm: f64| {
            let at = |away: usize| (-0.5 * (away as f64 * pitch_mm / length_mm).powi(2)).exp();
            (0..count).map(at).collect()
        };
        ShapeCorrelation([along(grid.cols, grid.pitch_x_mm), along(grid.rows, grid.pitch_y_mm)])
    }

    /// The factor F for cells `active` with envelope `envelope` in N that leaves out at most `remainder` but has at most
    /// `most` + 1 columns, and the largest variance that it leaves out on a cell, in units of the largest variance of the shape.
    pub fn factor(&self, active: &[usize], envelope: &[f64], remainder: f64, most: usize) -> (Mat<f64>, f64) {
        let (count, [along_x, along_y]) = (active.len(), &self.0);
        let cells: Vec<[usize; 2]> = active.iter().map(|cell| [cell % along_x.len(), cell / along_x.len()]).collect();
        let mut left: Vec<f64> = envelope.iter().map(|e| (SHAPE * e).powi(2)).collect();
        let largest = left.iter().copied().fold(0.0, f64::max);
        let mut columns: Vec<Vec<f64>> = vec![envelope.iter().map(|e| LOAD * e).collect()];
        while columns.len() <= count.min(most) {
            let Some(pivot) = (0..count).max_by(|&a, &b| left[a].total_cmp(&left[b])) else { break };
            if left[pivot] <= remainder * largest {
                break;
            }
            let (root, [col, row]) = (left[pivot].sqrt(), cells[pivot]);
            let size = SHAPE * SHAPE * envelope[pivot];
            let covariance =
                |(e, [x, y]): (&f64, &[usize; 2])| size * e * along_x[x.abs_diff(col)] * along_y[y.abs_diff(row)];
            let mut next: Vec<f64> = envelope.iter().zip(&cells).map(covariance).collect();
            for column in &columns[1..] {
                let weight = column[pivot];
                next.iter_mut().zip(column).for_each(|(next, c)| *next -= weight * c);
            }
            next.iter_mut().for_each(|next| *next /= root);
            left.iter_mut().zip(&next).for_each(|(left, c)| *left = (*left - c * c).max(0.0));
            left[pivot] = 0.0;
            columns.push(next);
        }
        let rest = left.iter().copied().fold(0.0, f64::max) / largest.max(f64::MIN_POSITIVE);
        (Mat::from_fn(count, columns.len(), |cell, column| columns[column][cell]), rest)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimate::evidence::cells::Cells;
    use crate::spec::scene::{Medium, Scene};

    /// F Fᵀ is the covariance to the stated remainder.
    #[test]
    fn factor_has_the_covariance() {
        let cells = Cells::new(&Scene::builtin("sensor-1").unwrap().sensor, Medium::HalfSpace, 2.0);
        let active: Vec<usize> = (200..260).collect();
        let envelope: Vec<f64> = (0..60).map(|k| 0.1 + f64::from(k % 7)).collect();
        let least = remainder(0.0);
        let shape = ShapeCorrelation::new(&cells.grid, 2.0);
        let of = |remainder: f64, most: usize| shape.factor(&active, &envelope, remainder, most);
        let (f, rest) = of(least, 60);
        assert!(rest <= least && of(least, 9).1 > least);
        let (coarse, rest) = of(remainder(0.01), 60);
        assert!(coarse.ncols() < f.ncols() && rest <= 0.01 && rest > least);
        assert!(f.ncols() < 60, "{}", f.ncols());
        let largest = (SHAPE * 6.1f64).powi(2);
        for i in 0..60 {
            for j in 0..60 {
                let ([x, y], [u, v]) = (cells.position_mm(active[i]), cells.position_mm(active[j]));
                let k = (-((x - u).powi(2) + (y - v).powi(2)) / 8.0).exp();
                let wanted = envelope[i] * envelope[j] * (LOAD * LOAD + SHAPE * SHAPE * k);
                let got: f64 = (0..f.ncols()).map(|c| f[(i, c)] * f[(j, c)]).sum();
                assert!((got - wanted).abs() <= least * largest, "{i} {j}: {got} {wanted}");
            }
        }
    }
}
