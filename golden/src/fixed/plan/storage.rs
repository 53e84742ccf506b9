//! The coefficient memory: which columns of which matrix are kept for each group of rows, and in which order.
//!
//! A lane holds one row of each group. Far from the diagonal the coefficients of a whole group are negligible, so a
//! column is left out (pruned) for a group if all its coefficients are below 2^−`prune_bits`: of the largest
//! coefficient for Cz⁺, of one for the scaled A, whose entries multiply v_ij of the size of v_00. Pruned coefficients
//! are zero in the bit-true model as well; a kept column keeps all its bits. Small arrays keep every column.
//!
//! A lane's word has the width of a multiplier's operand, 18 bits. The low limbs of Cz⁺ are a few bits wide; where the words
//! would not fit the board's block RAMs otherwise, they stand in a narrow memory of their own, as the last words.
//!
//! On a square subarray of square pitch, Ay is Ax with x and y exchanged. At degree 1, where no v_ij adds both, Ay is
//! not stored: v_01 is the Ax pass over the transposed v_00, and the result is transposed.
//!
//! The layers of a network are further matrices of other sizes, each with its own number of groups.

use crate::fixed::words::formats::{Formats, MULTIPLIER_BITS};
use crate::fixed::words::quantised::{coefficient, with_operand, Quantised};
use crate::fixed::words::schedule::{accumulations, layer, schedule, Kind, Matrix, Product, Target};

/// Least number of cycles from a quad's row of low limbs to its row of high limbs: the first is written one cycle after
/// it arrives, and read two before the other does.
const BETWEEN: usize = 4;

/// The kept columns, per matrix in storage order and per group of rows.
#[derive(Clone, Debug, PartialEq)]
pub struct Storage {
    /// The stored matrices, in storage order.
    pub matrices: Vec<Matrix>,
    /// `columns[matrix][group]`: kept columns, ascending.
    pub columns: Vec<Vec<Vec<usize>>>,
    /// Address of the case's first word; several cases share one memory.
    pub base: usize,
    /// Whether the memory has a list of columns: columns are pruned, in this case or another, or some are read
    /// transposed.
    pub listed: bool,
    /// Whether a pass reads a v_ij while it is still being written: its quads are written and read in order, one per
    /// cycle. So it is where all rows have a lane and no column is listed, in all cases.
    pub streamed: bool,
    /// Cycles without a product after each accumulation. In the first the accumulators of the lanes are cleared; where a
    /// case has one quad or two, more let the row of low limbs be written before it is read for the high limbs.
    pub pause: usize,
    /// Number of quads of the input that must be written, beside the first, before the first product is issued: the input is
    /// written one quad per cycle and read at most as fast, but a product whose first columns are left out begins further on.
    pub lead: usize,
    /// Number of words, the last ones, that are in a memory of their own, of `limb_align` bits per lane: all those of the
    /// low limbs of Cz⁺, or none.
    pub narrow: usize,
}

/// A case with its lanes and its part of the coefficient memory.
#[derive(Clone, Debug)]
pub struct LaidOut {
    /// Widths, lanes and groups of rows of the case.
    pub formats: Formats,
    /// The columns kept in the coefficient memory.
    pub storage: Storage,
    /// Number of subarrays.
    pub parts: usize,
}

/// Row indices of one group.
fn rows(group: usize, per_parity: usize, quads: usize) -> std::ops::Range<usize> {
    group * per_parity..((group + 1) * per_parity).min(quads)
}

/// The matrices of the passes in the order of their first use, then those of the network.
pub fn storage_order(formats: &Formats) -> Vec<Matrix> {
    let mut order = Vec::new();
    let layers: Vec<Product> = (0..formats.layers.len()).flat_map(|index| layer(formats, index)).collect();
    for product in schedule(formats).iter().flatten().chain(&layers) {
        if !order.contains(&product.matrix) {
            order.push(product.matrix);
        }
    }
    order
}

impl Storage {
    /// Chooses the kept columns for `per_parity` lanes per parity; `limits` has for each matrix the size in LSBs below
    /// which coefficients are negligible.
    pub fn new(limits: Vec<(Matrix, i64)>, quantised: &Quantised, quads: usize, per_parity: usize) -> Self {
        let kept = |matrix, limit, group| {
            let (blocks, [all, width]) = (quantised.blocks(matrix), quantised.size(matrix, quads));
            let matters = |&j: &usize| {
                blocks
                    .parity
                    .iter()
                    .any(|block| rows(group, per_parity, all).any(|i| block[i * width + j].abs() >= limit))
            };
            // At least as many columns as a group has rows: the rows of an accumulation leave before the next one ends.
            let mut columns: Vec<usize> = (0..width).filter(matters).collect();
            let others: Vec<usize> = (0..width).filter(|j| !columns.contains(j)).collect();
            columns.extend(others.into_iter().take(per_parity.saturating_sub(columns.len())));
            columns.sort_unstable();
            columns
        };
        let groups = |matrix| quantised.size(matrix, quads)[0].div_ceil(per_parity);
        let of =
            |&(matrix, limit): &(Matrix, i64)| (0..groups(matrix)).map(|group| kept(matrix, limit, group)).collect();
        let columns = limits.iter().map(of).collect();
        let matrices = limits.into_iter().map(|(matrix, _)| matrix).collect();
        Storage { matrices, columns, base: 0, listed: false, streamed: false, pause: 1, lead: 0, narrow: 0 }
    }

    /// With the low limbs of Cz⁺, which must be the last matrices, in a memory of their own.
    pub fn with_narrow(self) -> Self {
        let low = self.matrices.iter().zip(&self.columns).filter(|(matrix, _)| matrix.kind == Kind::InverseLow);
        let narrow = low.flat_map(|(_, groups)| groups).map(Vec::len).sum();
        Storage { narrow, ..self }
    }

    /// Number of words of the coefficient memory: those that are not in the narrow one, and, beside that, a word of zeros,
    /// which is read where the narrow one is.
    pub fn wide_words(&self) -> usize {
        self.words() - self.narrow + usize::from(self.narrow > 0)
    }

    /// Number of words of the narrow memory, a power of two, or 0: a word stands at the lower bits of its address.
    pub fn narrow_words(&self) -> usize {
        match self.narrow {
            0 => 0,
            words => words.next_power_of_two(),
        }
    }

    /// Puts the cases of a scene into one memory, one after the other, with a list of columns if one of them needs it.
    pub fn share<'a>(cases: impl Iterator<Item = (&'a mut Storage, Formats)>) {
        let mut cases: Vec<(&mut Storage, Formats)> = cases.collect();
        let listed = cases.iter().any(|(storage, formats)| formats.shared_a || storage.is_pruned(formats.quads));
        let whole = |formats: &Formats| formats.groups == 1 && formats.quads > 1 && !formats.has_network();
        let streamed = !listed && cases.iter().all(|(_, formats)| whole(formats));
        let least = cases.iter().map(|(_, formats)| formats.quads).min().unwrap_or(BETWEEN);
        let pause = BETWEEN.saturating_sub(least).max(1);
        let mut base = 0;
        for (storage, formats) in &mut cases {
            storage.lead = storage.lead_of_input(formats);
            (storage.base, storage.listed, storage.streamed, storage.pause) = (base, listed, streamed, pause);
            base += storage.words();
        }
    }

    /// How far the products with the input are ahead of one that reads its quads in order, one per cycle from the first.
    fn lead_of_input(&self, formats: &Formats) -> usize {
        let (mut issued, mut lead) = (0, 0);
        for (_, products) in accumulations(formats).iter().filter(|(target, _)| *target == Target::Vector(0)) {
            for group in 0..formats.groups {
                for &column in products.iter().flat_map(|product| self.columns_of(product.matrix, group)) {
                    lead = column.saturating_sub(issued).max(lead);
                    issued += 1;
                }
            }
        }
        lead
    }

    /// Number of groups of rows of an accumulation, the same for the matrices of all its products.
    pub fn groups_of(&self, products: &[Product]) -> usize {
        let index = products.first().and_then(|product| self.matrices.iter().position(|&m| m == product.matrix));
        index.map_or(0, |index| self.columns[index].len())
    }

    /// The kept columns of a matrix for a group of rows, ascending.
    pub fn columns_of(&self, matrix: Matrix, group: usize) -> &[usize] {
        self.matrices.iter().position(|&m| m == matrix).map_or(&[], |index| &self.columns[index][group])
    }

    /// Address of the first word of (matrix, group); one word per kept column follows.
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

    /// Number of words of the case.
    pub fn words(&self) -> usize {
        self.columns.iter().flatten().map(Vec::len).sum()
    }

    /// Whether any column was pruned; `quads` is the number of columns of a matrix of the passes. Those of a network are
    /// never pruned.
    pub fn is_pruned(&self, quads: usize) -> bool {
        let of_passes = |kind| !matches!(kind, Kind::Layer(_) | Kind::Mask | Kind::Bias(_));
        let own = self.matrices.iter().zip(&self.columns).filter(|(matrix, _)| of_passes(matrix.kind));
        own.flat_map(|(_, groups)| groups).any(|columns| columns.len() < quads)
    }

    /// The column of each word of the case.
    pub fn column_list(&self) -> Vec<usize> {
        self.columns.iter().flatten().flatten().copied().collect()
    }

    /// Sets the pruned coefficients to zero, so that the model multiplies by what the memory holds.
    pub fn zero_pruned(&self, quantised: &mut Quantised, quads: usize, per_parity: usize) {
        for (index, &matrix) in self.matrices.iter().enumerate() {
            for (group, kept) in self.columns[index].iter().enumerate() {
                for block in quantised.blocks_mut(matrix).into_iter().flat_map(|blocks| &mut blocks.parity) {
                    for i in rows(group, per_parity, quads) {
                        for j in (0..quads).filter(|j| kept.binary_search(j).is_err()) {
                            block[i * quads + j] = 0;
                        }
                    }
                }
            }
        }
    }

    /// The words of the case: one coefficient per lane, lane `parity·lanes_per_parity + k` for row
    /// `group·lanes_per_parity + k`; rows past the last are zero.
    pub fn memory(&self, formats: &Formats, quantised: &Quantised) -> Vec<Vec<i64>> {
        let lanes = formats.lanes_per_parity;
        let word = |matrix: Matrix, group: usize, j: usize| -> Vec<i64> {
            let (own, [rows, columns]) = (quantised.blocks(matrix), quantised.size(matrix, formats.quads));
            (0..4)
                .flat_map(|parity| (0..lanes).map(move |k| (parity, group * lanes + k)))
                .map(|(parity, i)| match i < rows {
                    true => coefficient(formats, matrix.kind, own.parity[parity][i * columns + j]),
                    false => 0,
                })
                .collect()
        };
        self.places().map(|(matrix, group, j)| word(matrix, group, j)).collect()
    }

    /// Takes the words of the case, as [`Storage::memory`] gives them, for the matrices.
    pub fn restore(&self, formats: &Formats, quantised: &mut Quantised, words: &[Vec<i64>]) {
        let lanes = formats.lanes_per_parity;
        for ((matrix, group, j), word) in self.places().zip(words) {
            let [rows, columns] = quantised.size(matrix, formats.quads);
            let Some(own) = quantised.blocks_mut(matrix) else { continue };
            for (lane, &operand) in word.iter().enumerate() {
                let (parity, i) = (lane / lanes, group * lanes + lane % lanes);
                if i < rows {
                    let c = &mut own.parity[parity][i * columns + j];
                    *c = with_operand(formats, matrix.kind, *c, operand);
                }
            }
        }
    }

    /// Matrix, group of rows and column of each word.
    fn places(&self) -> impl Iterator<Item = (Matrix, usize, usize)> + '_ {
        self.matrices.iter().zip(&self.columns).flat_map(|(&matrix, groups)| {
            let of = move |(group, columns): (usize, &'_ Vec<usize>)| (group, columns.clone());
            let all = groups.iter().enumerate().map(of);
            all.flat_map(move |(group, columns)| columns.into_iter().map(move |j| (matrix, group, j)))
        })
    }
}

/// Width of a word of the coefficient memory in bits.
pub fn word_bits(formats: &Formats) -> usize {
    4 * formats.lanes_per_parity * MULTIPLIER_BITS as usize
}
