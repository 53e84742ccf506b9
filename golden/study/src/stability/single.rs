//! Single: the per-frame part of the golden model in single precision, for comparison with double and fixed point.
//!
//! The matrices are computed in double and rounded once, as for a processor without doubles; products, sums and the
//! polynomial p(μ) are single. The search is the shared one.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: matrices, b | n × n, n | mm², MPa |
//! | out: family | (d + 1)(d + 2)/2 of n | N |

use dermis_golden::estimate::float::pass::{term_index, Polynomial};
use dermis_golden::physics::matrices::Matrices;
use faer::Mat;

/// The polynomial p(μ) of the given degree for stress `b` in MPa, computed in single precision.
pub fn family(matrices: &Matrices, b: &[f64], degree: usize) -> Polynomial {
    let b: Vec<f32> = b.iter().map(|b| *b as f32).collect();
    let mut vectors = vec![product(&matrices.cz_pinv, &b)];
    for order in 1..=degree {
        for j in 0..=order {
            let i = order - j;
            let mut v = vec![0.0f32; b.len()];
            let mut take = |m: &Mat<f64>, from: usize| {
                let image = product(m, &vectors[from]);
                v.iter_mut().zip(image).for_each(|(v, image)| *v -= image);
            };
            if i > 0 {
                take(&matrices.ax, term_index(i - 1, j));
            }
            if j > 0 {
                take(&matrices.ay, term_index(i, j - 1));
            }
            vectors.push(v);
        }
    }
    let widen = |v: Vec<f32>| v.into_iter().map(f64::from).collect();
    Polynomial { degree, coefficients: vectors.into_iter().map(widen).collect() }
}

/// m·v, column by column.
fn product(m: &Mat<f64>, v: &[f32]) -> Vec<f32> {
    let mut sum = vec![0.0f32; m.nrows()];
    for (column, v) in m.col_iter().zip(v) {
        sum.iter_mut().zip(column.iter()).for_each(|(sum, m)| *sum += *m as f32 * v);
    }
    sum
}
