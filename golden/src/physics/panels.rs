//! Panels: a matrix for products with one vector after another, with the widest instructions that the processor has.
//!
//! ```text
//! out_i ← out_i + Σ_j m_ij (factor · v_j)          added in the order of j
//! ```
//!
//! The entries stand in the order in which they are read: [`ROWS`] rows of the first column, of the next one, …, then the next rows. So
//! the sums of a panel stay in registers until they are complete; a product that goes through whole columns reads and writes them for
//! each, which for matrices of some hundred entries a side takes twice as long.
//!
//! | | shape |
//! |---|---|
//! | in: v | columns |
//! | in, out: out | rows |

use faer::MatRef;
use pulp::{Arch, Simd, WithSimd};
use std::ops::Mul;

/// Rows of a panel: as many sums as registers hold.
const ROWS: usize = 32;

/// A number of single or double precision, and the vectors of it.
pub(crate) trait Real: Copy + Default + Mul<Output = Self> {
    /// A vector.
    type Vector<S: Simd>: Copy;

    /// Values as vectors, without what fills none.
    fn vectors<S: Simd>(values: &[Self]) -> &[Self::Vector<S>];

    /// The same to be changed.
    fn vectors_mut<S: Simd>(values: &mut [Self]) -> &mut [Self::Vector<S>];

    /// A value in every lane.
    fn splat<S: Simd>(self, simd: S) -> Self::Vector<S>;

    /// a · b + c, rounded once where the processor can.
    fn mul_add<S: Simd>(simd: S, a: Self::Vector<S>, b: Self::Vector<S>, c: Self::Vector<S>) -> Self::Vector<S>;
}

macro_rules! real {
    ($real:ty, $vector:ident, $vectors:ident, $vectors_mut:ident, $splat:ident, $mul_add:ident) => {
        impl Real for $real {
            type Vector<S: Simd> = S::$vector;

            #[inline(always)]
            fn vectors<S: Simd>(values: &[Self]) -> &[S::$vector] {
                S::$vectors(values).0
            }

            #[inline(always)]
            fn vectors_mut<S: Simd>(values: &mut [Self]) -> &mut [S::$vector] {
                S::$vectors_mut(values).0
            }

            #[inline(always)]
            fn splat<S: Simd>(self, simd: S) -> S::$vector {
                simd.$splat(self)
            }

            #[inline(always)]
            fn mul_add<S: Simd>(simd: S, a: S::$vector, b: S::$vector, c: S::$vector) -> S::$vector {
                simd.$mul_add(a, b, c)
            }
        }
    };
}

real!(f32, f32s, as_simd_f32s, as_mut_simd_f32s, splat_f32s, mul_add_e_f32s);
real!(f64, f64s, as_simd_f64s, as_mut_simd_f64s, splat_f64s, mul_add_e_f64s);

/// A matrix in panels.
#[derive(Clone, Debug)]
pub(crate) struct Panels<T> {
    cols: usize,
    /// Panel by panel, in each column by column; 0 behind the last row.
    entries: Vec<[T; ROWS]>,
}

impl<T: Real> Panels<T> {
    /// The panels of a matrix.
    pub fn new(m: MatRef<T>) -> Panels<T> {
        let entry = |row: usize, col: usize| if row < m.nrows() { m[(row, col)] } else { T::default() };
        let column = |first: usize, col: usize| std::array::from_fn(|row| entry(first + row, col));
        let firsts = (0..m.nrows()).step_by(ROWS);
        let entries = firsts.flat_map(|first| (0..m.ncols()).map(move |col| column(first, col))).collect();
        Panels { cols: m.ncols(), entries }
    }

    /// `out += factor · m · v`
    pub fn accumulate(&self, v: &[T], factor: T, out: &mut [T]) {
        Arch::new().dispatch(Product { panels: self, v, factor, out });
    }
}

/// A product, for [`Arch::dispatch`].
struct Product<'a, T> {
    panels: &'a Panels<T>,
    v: &'a [T],
    factor: T,
    out: &'a mut [T],
}

impl<T: Real> WithSimd for Product<'_, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Product { panels: Panels { cols, entries }, v, factor, out } = self;
        for (panel, out) in entries.chunks_exact((*cols).max(1)).zip(out.chunks_mut(ROWS)) {
            let mut values = [T::default(); ROWS];
            values[..out.len()].copy_from_slice(out);
            let sums = T::vectors_mut::<S>(&mut values);
            for (column, v) in panel.iter().zip(v) {
                let v = (*v * factor).splat(simd);
                for (sum, own) in sums.iter_mut().zip(T::vectors::<S>(column)) {
                    *sum = T::mul_add(simd, *own, v, *sum);
                }
            }
            out.copy_from_slice(&values[..out.len()]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::physics::symmetry::folded::accumulate;
    use crate::random::Random;
    use faer::linalg::matmul::matmul;
    use faer::{Accum, ColMut, ColRef, Mat, Par};

    /// Also where rows fill no panel, and none is there.
    const SHAPES: [[usize; 2]; 7] = [[25, 25], [32, 5], [33, 40], [2, 128], [128, 100], [0, 3], [4, 0]];

    /// Largest difference over the sum of the sizes of what is added, in units of the last place.
    fn apart(own: &[f64], wanted: &[f64], sizes: &[f64], last_place: f64) -> f64 {
        let apart = own.iter().zip(wanted).zip(sizes).map(|((own, wanted), size)| (own - wanted).abs() / size);
        apart.fold(0.0, f64::max) / last_place
    }

    /// Sums that are rounded in another order differ by less than the number of their terms.
    #[test]
    fn products_are_those_of_matrices() {
        let mut random = Random::new(5);
        for [rows, cols] in SHAPES {
            let m = Mat::from_fn(rows, cols, |_, _| random.normal());
            let (v, before): (Vec<f64>, Vec<f64>) =
                ((0..cols).map(|_| random.normal()).collect(), (0..rows).map(|_| random.normal()).collect());
            let size =
                |row: usize| before[row].abs() + (0..cols).map(|col| (m[(row, col)] * v[col]).abs()).sum::<f64>();
            let sizes: Vec<f64> = (0..rows).map(size).collect();
            let (mut own, mut wanted) = (before.clone(), before.clone());
            Panels::new(m.as_ref()).accumulate(&v, -0.7, &mut own);
            accumulate(&m, &v, -0.7, &mut wanted);
            assert!(apart(&own, &wanted, &sizes, f64::EPSILON) <= cols as f64, "{rows}×{cols}");
            assert!(rows * cols == 0 || own != before);
            let single = |values: &[f64]| values.iter().map(|value| *value as f32).collect::<Vec<_>>();
            let double = |values: &[f32]| values.iter().map(|value| f64::from(*value)).collect::<Vec<_>>();
            let (m, v) = (Mat::from_fn(rows, cols, |i, j| m[(i, j)] as f32), single(&v));
            let (mut own, mut wanted) = (single(&before), single(&before));
            Panels::new(m.as_ref()).accumulate(&v, 1.0, &mut own);
            matmul(ColMut::from_slice_mut(&mut wanted), Accum::Add, &m, ColRef::from_slice(&v), 1.0, Par::Seq);
            let apart = apart(&double(&own), &double(&wanted), &sizes, f64::from(f32::EPSILON));
            assert!(apart <= cols as f64, "{rows}×{cols}");
        }
    }
}
