//! The coefficient memory: which columns of which matrix are kept for which group of rows, and in what order.
//!
//! A lane holds one row of each group. Far from the diagonal the coefficients of a whole group fall below what matters, so a
//! column is left out for a group when all its coefficients are below 2^−`prune_bits`: of the largest coefficient of
//! Cz⁺, and of one for the scaled A (whose entries act on v_ij of the size of v_00). What is left out is zero in
//! the bit-true model as well; a kept column keeps all its bits. Small arrays keep every column.
//!
//! On a square subarray of square pitch, Ay is Ax with x and y exchanged. At degree 1, where no v_ij adds both, Ay is not stored:
//! v_01 is Ax's pass over the transposed v_00, and comes out transposed.

use super::coefficients::Flipped;
use super::formats::{Formats, Quantised, MULTIPLIER_BITS};
use super::pass::coefficient;
use super::schedule::{Kind, Matrix, Product};

/// The kept columns, per matrix in order of storage and per group of rows.
#[derive(Clone, Debug, PartialEq)]
pub struct Storage {
    /// The stored matrices.
    pub matrices: Vec<Matrix>,
    /// `columns[matrix][group]`: kept columns, ascending.
    pub columns: Vec<Vec<Vec<usize>>>,
    /// First word in the memory, which several cases share.
    pub base: usize,
    /// A list of columns stands beside the coefficients: some are left out, in this case or another, or some are read
    /// transposed.
    pub listed: bool,
}

/// Rows of one group: which of them a lane has.
fn rows(group: usize, per_parity: usize, quads: usize) -> std::ops::Range<usize> {
    group * per_parity..((group + 1) * per_parity).min(quads)
}

/// Matrices in the order in which a schedule first needs them.
pub fn storage_order(schedule: &[Vec<Product>]) -> Vec<Matrix> {
    let mut order = Vec::new();
    for product in schedule.iter().flatten() {
        if !order.contains(&product.matrix) {
            order.push(product.matrix);
        }
    }
    order
}

impl Storage {
    /// Chooses the columns for `per_parity` lanes per parity; of each matrix, coefficients below so many LSBs count as
    /// nothing.
    pub fn new(limits: Vec<(Matrix, i64)>, quantised: &Quantised, quads: usize, per_parity: usize) -> Self {
        let kept = |matrix, limit, group| {
            let blocks = blocks(quantised, matrix);
            let matters = |&j: &usize| {
                blocks
                    .parity
                    .iter()
                    .any(|block| rows(group, per_parity, quads).any(|i| block[i * quads + j].abs() >= limit))
            };
            // A group of which nothing matters still needs a column to accumulate zeros.
            let columns: Vec<usize> = (0..quads).filter(matters).collect();
            if columns.is_empty() {
                vec![0]
            } else {
                columns
            }
        };
        let groups = quads.div_ceil(per_parity);
        let of = |&(matrix, limit): &(Matrix, i64)| (0..groups).map(|group| kept(matrix, limit, group)).collect();
        let columns = limits.iter().map(of).collect();
        let matrices = limits.into_iter().map(|(matrix, _)| matrix).collect();
        Storage { matrices, columns, base: 0, listed: false }
    }

    /// Puts the cases of a scene into one memory, one behind the other, with a list of columns where one needs it.
    pub fn share<'a>(cases: impl Iterator<Item = (&'a mut Storage, Formats)>) {
        let mut cases: Vec<(&mut Storage, Formats)> = cases.collect();
        let listed = cases.iter().any(|(storage, formats)| formats.shared_a || storage.is_pruned(formats.quads));
        let mut base = 0;
        for (storage, _) in &mut cases {
            (storage.base, storage.listed) = (base, listed);
            base += storage.words();
        }
    }

    /// The kept columns of a stored matrix for a group of rows.
    pub fn columns_of(&self, matrix: Matrix, group: usize) -> &[usize] {
        self.matrices.iter().position(|&m| m == matrix).map_or(&[], |index| &self.columns[index][group])
    }

    /// Address of the first word of (matrix, group); the words follow by column.
    pub fn address_of(&self, matrix: Matrix, group: usize) -> usize {
        let mut address = self.base;
        for (index, groups) in self.columns.iter().enumerate() {
            for (g, columns) in groups.iter().enumerate() {
                if (self.matrices[index], g) == (matrix, group) {
                    return address;
                }
                address += columns.len();
            }
        }
        address
    }

    /// Words of the case.
    pub fn words(&self) -> usize {
        self.columns.iter().flatten().map(Vec::len).sum()
    }

    /// Whether any column was left out.
    pub fn is_pruned(&self, quads: usize) -> bool {
        self.columns.iter().flatten().any(|columns| columns.len() < quads)
    }

    /// The columns of the case's words, one after the other.
    pub fn column_list(&self) -> Vec<usize> {
        self.columns.iter().flatten().flatten().copied().collect()
    }

    /// Zeroes what the memory does not hold, so that the model multiplies with what the hardware has.
    pub fn zero_pruned(&self, quantised: &mut Quantised, quads: usize, per_parity: usize) {
        for (index, &matrix) in self.matrices.iter().enumerate() {
            for (group, kept) in self.columns[index].iter().enumerate() {
                for block in blocks_mut(quantised, matrix).into_iter().flat_map(|blocks| &mut blocks.parity) {
                    for i in rows(group, per_parity, quads) {
                        for j in (0..quads).filter(|j| kept.binary_search(j).is_err()) {
                            block[i * quads + j] = 0;
                        }
                    }
                }
            }
        }
    }

    /// The case's words: one coefficient per lane, lane `parity·lanes_per_parity + k` for row
    /// `group·lanes_per_parity + k`; rows past the last are zero.
    pub fn memory(&self, formats: &Formats, quantised: &Quantised) -> Vec<Vec<i64>> {
        let lanes = formats.lanes_per_parity;
        let word = |matrix: Matrix, group: usize, j: usize| -> Vec<i64> {
            let own = blocks(quantised, matrix);
            (0..4)
                .flat_map(|parity| (0..lanes).map(move |k| (parity, group * lanes + k)))
                .map(|(parity, i)| match i < formats.quads {
                    true => coefficient(formats, matrix.kind, own.parity[parity][i * formats.quads + j]),
                    false => 0,
                })
                .collect()
        };
        let mut words = Vec::with_capacity(self.words());
        for (index, &matrix) in self.matrices.iter().enumerate() {
            for (group, columns) in self.columns[index].iter().enumerate() {
                words.extend(columns.iter().map(|&j| word(matrix, group, j)));
            }
        }
        words
    }
}

/// The blocks a stored matrix is made of; both limbs of Cz⁺ keep the same columns.
///
/// # Panics
/// When the matrix has no such flip: schedules list those it has.
pub fn blocks(quantised: &Quantised, matrix: Matrix) -> &Flipped<i64> {
    let blocks = match matrix.kind {
        Kind::InverseHigh | Kind::InverseLow => &quantised.inverse,
        Kind::Ax => &quantised.ax,
        Kind::Ay => &quantised.ay,
    };
    blocks.flips.iter().find(|own| own.flip == matrix.flip).expect("a flip of the schedule")
}

fn blocks_mut(quantised: &mut Quantised, matrix: Matrix) -> Option<&mut Flipped<i64>> {
    let blocks = match matrix.kind {
        Kind::InverseHigh | Kind::InverseLow => &mut quantised.inverse,
        Kind::Ax => &mut quantised.ax,
        Kind::Ay => &mut quantised.ay,
    };
    blocks.flips.iter_mut().find(|own| own.flip == matrix.flip)
}

/// Bits of the coefficient memory's words.
pub fn word_bits(formats: &Formats) -> usize {
    4 * formats.lanes_per_parity * MULTIPLIER_BITS as usize
}
