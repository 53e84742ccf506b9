//! Folded: the basis of mirror parities, in which the matrices of a regular rectangle consist of four blocks.
//!
//! With m(a) distinct images l of the taxel of quad a, and s_t(l) = ±1 the sign of image l under parity t,
//!
//! ```text
//! f_t(a) = Σ_l s_t(l) x(l)/√m(a)          x(l) = Σ_t s_t(l) f_t(a)/√m(a)
//! B_t(a, c) = √(m(a)/m(c)) Σ_l s_s(l) M(a, image l of c)          s = t, or t with one parity flipped
//! ```
//!
//! The basis is orthonormal, so inverses, eigenvalues and norms of M are those of its blocks: a quarter of the
//! multiplications of a product, a sixteenth of those of an inverse. This is exact for Cz (no flip), Cx and Ax (x
//! flipped), Cy and Ay (y flipped), and for their products.
//!
//! | | shape |
//! |---|---|
//! | in: x | n, row-major in the subarray |
//! | out: f | n: one parity after the other; odd ones have no entry on the middle line of their mirror |
//!
//! A matrix without the symmetry, such as one with dead taxels, is one block in the basis of the taxels.

use super::parity::{has_entry, sign, FLIP_X, FLIP_Y};
use crate::physics::panels::Panels;
use crate::spec::quads::Quads;
use faer::linalg::matmul::matmul;
use faer::{Accum, ColMut, ColRef, Mat, Par};
use std::ops::Range;

/// Parity change of Cz and Cz⁺: none.
pub const EVEN: usize = 0;
/// Parity change of Cx and Ax.
pub const ODD_X: usize = FLIP_X;
/// Parity change of Cy and Ay.
pub const ODD_Y: usize = FLIP_Y;

/// One entry of a folded vector.
#[derive(Clone, Debug, PartialEq)]
struct Entry {
    /// The distinct images of a quad, each a taxel with its sign.
    taxels: Vec<(usize, f64)>,
    /// Their number m.
    images: f64,
    /// √m
    root: f64,
}

impl Entry {
    /// Σ over the images, with their signs.
    fn sum(&self, value: impl Fn(usize) -> f64) -> f64 {
        self.taxels.iter().map(|(taxel, sign)| sign * value(*taxel)).sum()
    }
}

/// A basis for the vectors and matrices of a subarray: the mirror parities, or the taxels themselves.
#[derive(Clone, Debug, PartialEq)]
pub struct Basis {
    quads: Quads,
    /// Entries of each parity; all empty in the basis of the taxels.
    entries: [Vec<Entry>; 4],
}

/// A block of a matrix in a folded basis.
#[derive(Clone, Debug)]
pub struct Block {
    /// First row.
    pub row0: usize,
    /// First column.
    pub col0: usize,
    /// The entries.
    pub entries: Mat<f64>,
    /// The same for products with a vector.
    panels: Panels<f64>,
}

impl Block {
    /// A block of these entries, the first of which is in this row and column.
    pub fn new(row0: usize, col0: usize, entries: Mat<f64>) -> Block {
        let panels = Panels::new(entries.as_ref());
        Block { row0, col0, entries, panels }
    }
}

/// A matrix in a folded basis.
#[derive(Clone, Debug)]
pub struct Operator {
    /// The blocks that are not zero.
    pub blocks: Vec<Block>,
}

/// `out += factor · m · v`
pub fn accumulate(m: &Mat<f64>, v: &[f64], factor: f64, out: &mut [f64]) {
    let v = ColRef::from_slice(v);
    matmul(ColMut::from_slice_mut(out), Accum::Add, m, v, factor, Par::Seq);
}

impl Operator {
    /// A matrix without mirror symmetry, in the basis of the taxels.
    pub fn dense(entries: Mat<f64>) -> Operator {
        Operator { blocks: vec![Block::new(0, 0, entries)] }
    }

    /// `out += factor · M · v`, all in this basis.
    pub fn accumulate(&self, v: &[f64], factor: f64, out: &mut [f64]) {
        for Block { row0, col0, entries, panels } in &self.blocks {
            let (v, out) = (&v[*col0..][..entries.ncols()], &mut out[*row0..][..entries.nrows()]);
            panels.accumulate(v, factor, out);
        }
    }
}

impl Basis {
    /// The basis of parities for a subarray of `rows` × `cols` taxels.
    pub fn parities(rows: usize, cols: usize) -> Basis {
        let quads = Quads { rows, cols };
        let entries = std::array::from_fn(|parity| {
            let entry = |quad| {
                let distinct = (0..Quads::LANES).filter(|lane| quads.lane_mask(quad) >> lane & 1 == 1);
                let taxels: Vec<(usize, f64)> =
                    distinct.map(|lane| (quads.taxel(quad, lane), sign(parity, lane))).collect();
                let images = taxels.len() as f64;
                Entry { taxels, images, root: images.sqrt() }
            };
            (0..quads.len()).filter(|&quad| has_entry(quads, quad, parity)).map(entry).collect()
        });
        Basis { quads, entries }
    }

    /// The basis of the taxels, in which folding changes nothing.
    pub fn taxels(rows: usize, cols: usize) -> Basis {
        Basis { quads: Quads { rows, cols }, entries: Default::default() }
    }

    fn is_taxels(&self) -> bool {
        self.entries.iter().all(Vec::is_empty)
    }

    /// Indices of a parity in a folded vector.
    pub fn range(&self, parity: usize) -> Range<usize> {
        let start = self.entries[..parity].iter().map(Vec::len).sum();
        start..start + self.entries[parity].len()
    }

    /// Transforms a row-major vector to this basis.
    pub fn fold(&self, x: &[f64]) -> Vec<f64> {
        if self.is_taxels() {
            return x.to_vec();
        }
        self.entries.iter().flatten().map(|entry| entry.sum(|taxel| x[taxel]) / entry.root).collect()
    }

    /// Transforms a vector in this basis back to row-major taxels.
    pub fn unfold(&self, f: &[f64]) -> Vec<f64> {
        if self.is_taxels() {
            return f.to_vec();
        }
        let mut x = vec![0.0; f.len()];
        for (entry, f) in self.entries.iter().flatten().zip(f) {
            let share = f / entry.root;
            entry.taxels.iter().for_each(|(taxel, sign)| x[*taxel] += sign * share);
        }
        x
    }

    /// Transforms a matrix with the mirror symmetry `flip` to this basis; `m` gives its entry for two row-major taxels.
    pub fn fold_matrix(&self, flip: usize, m: impl Fn(usize, usize) -> f64) -> Operator {
        if self.is_taxels() {
            let n = self.quads.rows * self.quads.cols;
            return Operator::dense(Mat::from_fn(n, n, m));
        }
        let block = |target: usize| {
            let (rows, cols) = (&self.entries[target], &self.entries[target ^ flip]);
            let entries = Mat::from_fn(rows.len(), cols.len(), |i, j| {
                let (row, col) = (&rows[i], &cols[j]);
                let (first, _) = row.taxels[0];
                (row.images / col.images).sqrt() * col.sum(|taxel| m(first, taxel))
            });
            Block::new(self.range(target).start, self.range(target ^ flip).start, entries)
        };
        Operator { blocks: (0..4).map(block).collect() }
    }

    /// Transforms a matrix in this basis back to row-major taxels; its symmetry holds to the bit.
    pub fn unfold_matrix(&self, flip: usize, operator: &Operator) -> Mat<f64> {
        if self.is_taxels() {
            return operator.blocks[0].entries.clone();
        }
        let n = self.quads.rows * self.quads.cols;
        let mut m = Mat::zeros(n, n);
        for (target, Block { entries, .. }) in operator.blocks.iter().enumerate() {
            let (rows, cols) = (&self.entries[target], &self.entries[target ^ flip]);
            for (j, col) in cols.iter().enumerate() {
                for (i, row) in rows.iter().enumerate() {
                    // The same sum for each image of the pair, up to its sign.
                    let share = entries[(i, j)] / (row.images * col.images).sqrt();
                    for (i, k) in &row.taxels {
                        col.taxels.iter().for_each(|(j, l)| m[(*i, *j)] += k * l * share);
                    }
                }
            }
        }
        m
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::physics::influence::Influence;
    use crate::spec::sensor::Sensor;

    /// Sums of up to 20 products of both signs, each rounded a few times.
    const ROUNDING: f64 = 1e-14;

    #[test]
    fn products_are_the_dense_ones() {
        for (rows, cols) in [(4, 4), (5, 4), (3, 5), (2, 7)] {
            let sensor = Sensor { rows, cols, pitch_x_mm: 2.0, pitch_y_mm: 4.0, thickness_mm: 3.0 };
            let Influence { cx, cy, cz } = Influence::new(&sensor);
            let x: Vec<f64> = (0..rows * cols).map(|k| ((k * k * 7 + 3 * k) % 41) as f64 / 20.0 - 1.0).collect();
            for basis in [Basis::parities(rows, cols), Basis::taxels(rows, cols)] {
                let folded = basis.fold(&x);
                let size = |v: &[f64]| v.iter().map(|v| v * v).sum::<f64>();
                assert!((size(&folded) - size(&x)).abs() < ROUNDING * size(&x));
                for (matrix, flip) in [(&cz, EVEN), (&cx, ODD_X), (&cy, ODD_Y)] {
                    let operator = basis.fold_matrix(flip, |i, j| matrix[(i, j)]);
                    let mut product = vec![0.0; x.len()];
                    operator.accumulate(&folded, 1.0, &mut product);
                    let mut dense = vec![0.0; x.len()];
                    accumulate(matrix, &x, 1.0, &mut dense);
                    for (value, wanted) in basis.unfold(&product).iter().zip(&dense) {
                        assert!((value - wanted).abs() < ROUNDING, "{rows}×{cols}, {flip}: {value} {wanted}");
                    }
                    let back = basis.unfold_matrix(flip, &operator);
                    assert!((&back - matrix).norm_max() < ROUNDING);
                }
            }
        }
    }
}
