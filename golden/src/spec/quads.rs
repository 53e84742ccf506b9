//! Quads: the four mirror images of a taxel kept in one memory word.
//!
//! A regular rectangle is its own mirror image left to right and top to bottom. Taxel (r, c) of the upper left quarter
//! and its images (r, C−1−c), (R−1−r, c), (R−1−r, C−1−c) share a word, so that fold and unfold are butterflies at the
//! memory port. With an odd number of rows or columns, the images on the middle line coincide: its sample is written to
//! every coinciding lane. The odd parities then vanish there and unfold needs no special case; [`Quads::lane_mask`]
//! says which lanes are distinct taxels.

/// The quad layout of a subarray of `rows` × `cols` taxels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Quads {
    /// Rows of the subarray.
    pub rows: usize,
    /// Columns of the subarray.
    pub cols: usize,
}

/// Memory location of one taxel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct QuadLocation {
    /// Quad address, row-major over the upper left quarter.
    pub address: usize,
    /// Lane `2·(lower half) + (right half)` from which the taxel is read.
    pub lane: usize,
    /// Lanes to which the taxel is written (bit l = lane l): more than one on a middle line.
    pub mask: u8,
}

impl Quads {
    /// Lanes of a quad.
    pub const LANES: usize = 4;

    /// Rows of quads, ⌈rows/2⌉.
    pub fn quad_rows(&self) -> usize {
        self.rows.div_ceil(2)
    }

    /// Columns of quads, ⌈cols/2⌉.
    pub fn quad_cols(&self) -> usize {
        self.cols.div_ceil(2)
    }

    /// Number of quads, Q.
    pub fn len(&self) -> usize {
        self.quad_rows() * self.quad_cols()
    }

    /// Whether there are no quads; a subarray has at least one.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Memory location of taxel (`row`, `col`) of the subarray.
    pub fn locate(&self, row: usize, col: usize) -> QuadLocation {
        let (mirror_row, mirror_col) = (self.rows - 1 - row, self.cols - 1 - col);
        let address = row.min(mirror_row) * self.quad_cols() + col.min(mirror_col);
        let lane = 2 * usize::from(row > mirror_row) + usize::from(col > mirror_col);
        let mut mask = 1u8 << lane;
        if row == mirror_row {
            mask |= mask << 2;
        }
        if col == mirror_col {
            mask |= mask << 1;
        }
        QuadLocation { address, lane, mask }
    }

    /// Row-major index in the subarray of the taxel in `lane` of quad `address`.
    pub fn taxel(&self, address: usize, lane: usize) -> usize {
        let (row, col) = (address / self.quad_cols(), address % self.quad_cols());
        let row = if lane & 2 == 0 { row } else { self.rows - 1 - row };
        let col = if lane & 1 == 0 { col } else { self.cols - 1 - col };
        row * self.cols + col
    }

    /// Cycles from the first of the quads in order, each in steps of `width` lanes, one step a cycle, until the subarray's
    /// taxels can be read row-major, one a cycle, none before its step: 0 for whole quads.
    pub fn row_major_delay(&self, width: usize) -> usize {
        let late = |taxel: usize| {
            let QuadLocation { address, lane, .. } = self.locate(taxel / self.cols, taxel % self.cols);
            ((Quads::LANES * address + lane) / width).saturating_sub(taxel)
        };
        (0..self.rows * self.cols).map(late).max().unwrap_or(0)
    }

    /// Address of the quad with row and column exchanged, in a square layout.
    pub fn transposed(&self, address: usize) -> usize {
        address % self.quad_cols() * self.quad_rows() + address / self.quad_cols()
    }

    /// Lanes of quad `address` that are distinct taxels, not copies (bit l = lane l).
    pub fn lane_mask(&self, address: usize) -> u8 {
        let (row, col) = (address / self.quad_cols(), address % self.quad_cols());
        let middle_row = 2 * row + 1 == self.rows;
        let middle_col = 2 * col + 1 == self.cols;
        match (middle_row, middle_col) {
            (false, false) => 0b1111,
            (false, true) => 0b0101,
            (true, false) => 0b0011,
            (true, true) => 0b0001,
        }
    }

    /// Packs a row-major vector into quads; samples on a middle line are duplicated.
    pub fn pack<T: Copy>(&self, taxels: &[T]) -> Vec<[T; 4]> {
        (0..self.len()).map(|address| std::array::from_fn(|lane| taxels[self.taxel(address, lane)])).collect()
    }

    /// Unpacks quads into a row-major vector.
    pub fn unpack(&self, quads: &[[i64; 4]]) -> Vec<i64> {
        let mut taxels = vec![0; self.rows * self.cols];
        for (address, quad) in quads.iter().enumerate() {
            for (lane, &value) in quad.iter().enumerate() {
                taxels[self.taxel(address, lane)] = value;
            }
        }
        taxels
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_and_taxels_are_inverse_for_even_and_odd_sizes() {
        for (rows, cols) in [(2, 2), (3, 4), (5, 5), (10, 10), (8, 7)] {
            let quads = Quads { rows, cols };
            let mut counted = vec![0; rows * cols];
            for row in 0..rows {
                for col in 0..cols {
                    let location = quads.locate(row, col);
                    for lane in 0..4 {
                        let here = quads.taxel(location.address, lane) == row * cols + col;
                        assert_eq!(here, location.mask >> lane & 1 == 1, "{rows}×{cols} ({row}, {col}) lane {lane}");
                    }
                }
            }
            for address in 0..quads.len() {
                for lane in 0..4 {
                    counted[quads.taxel(address, lane)] += usize::from(quads.lane_mask(address) >> lane & 1 == 1);
                }
            }
            assert!(counted.iter().all(|&n| n == 1), "{rows}×{cols}");
        }
    }

    #[test]
    fn taxels_are_read_after_their_steps_and_no_later_than_needed() {
        // By hand: quad 3 of 4×4 is taxel (1, 1), the sixth; with one lane per step it is step 12.
        let quads = Quads { rows: 4, cols: 4 };
        assert_eq!([4, 2, 1].map(|width| quads.row_major_delay(width)), [0, 1, 7]);
        for (rows, cols) in [(2, 2), (3, 4), (5, 7), (10, 10)] {
            let quads = Quads { rows, cols };
            for width in [4, 2, 1] {
                let delay = quads.row_major_delay(width);
                // Steps one by one, then the taxels from `delay` on.
                let mut written = vec![None; rows * cols];
                for step in 0..quads.len() * (Quads::LANES / width) {
                    for lane in step * width..(step + 1) * width {
                        let (address, lane) = (lane / Quads::LANES, lane % Quads::LANES);
                        let taxel = quads.taxel(address, lane);
                        if quads.locate(taxel / cols, taxel % cols).lane == lane {
                            written[taxel] = Some(step);
                        }
                    }
                }
                let spare = (0..rows * cols).map(|taxel| (delay + taxel).checked_sub(written[taxel].unwrap()));
                let least = spare.min().unwrap();
                assert!(least.is_some() && (delay == 0 || least == Some(0)), "{rows}×{cols}, {width}: {least:?}");
            }
        }
    }

    #[test]
    fn packing_rebuilds() {
        let quads = Quads { rows: 5, cols: 4 };
        let taxels: Vec<i64> = (0..20).collect();
        assert_eq!(quads.unpack(&quads.pack(&taxels)), taxels);
    }
}
