//! Where a taxel lives among the quads.

use dermis_golden::fixed::quads::Quads;
use dermis_golden::partition::Grid;
use rust_hdl::prelude::*;

use super::constant_product::times;
use super::counter::count_bits;
use crate::wire::{Wire, Word};

/// Row and column of a taxel in its subarray, and the subarray's in the array, to quad address, lane, and the lanes to write
/// (several on a middle line); combinational. Subarrays follow each other row-major, each with all its quads.
#[derive(LogicBlock)]
pub struct Mirror {
    /// Row in the subarray.
    pub row: Wire<In>,
    /// Column in the subarray.
    pub col: Wire<In>,
    /// Row of the subarray.
    pub part_row: Wire<In>,
    /// Column of the subarray.
    pub part_col: Wire<In>,
    /// Quad address in the array.
    pub address: Wire<Out>,
    /// Which subarray.
    pub part: Wire<Out>,
    /// Lane the taxel is read from, 2 bits.
    pub lane: Wire<Out>,
    /// Lanes the taxel is written to.
    pub mask: Wire<Out>,
    _layout: Quads,
    _parts: Grid,
}

impl Mirror {
    /// For `parts` subarrays of `layout`.
    pub fn new(layout: Quads, parts: Grid) -> Self {
        let count = parts.rows * parts.cols;
        Mirror {
            part_row: Wire::new(count_bits(parts.rows)),
            part_col: Wire::new(count_bits(parts.cols)),
            part: Wire::new(count_bits(count)),
            row: Wire::new(count_bits(layout.rows)),
            col: Wire::new(count_bits(layout.cols)),
            address: Wire::new(count_bits(count * layout.len())),
            lane: Wire::new(2),
            mask: Wire::new(4),
            _layout: layout,
            _parts: parts,
        }
    }
}

impl Logic for Mirror {
    fn update(&mut self) {
        let (row, col) = (self.row.val().number() as usize, self.col.val().number() as usize);
        if row < self._layout.rows && col < self._layout.cols {
            let place = self._layout.place(row, col);
            let part = self.part_row.val().number() as usize * self._parts.cols + self.part_col.val().number() as usize;
            self.address.next = Word::from((part * self._layout.len() + place.address) as u64);
            self.part.next = Word::from(part as u64);
            self.lane.next = Word::from(place.lane as u64);
            self.mask.next = Word::from(u64::from(place.mask));
        }
    }

    fn connect(&mut self) {
        self.address.connect();
        self.part.connect();
        self.lane.connect();
        self.mask.connect();
    }

    fn hdl(&self) -> Verilog {
        let (rows, cols) = (self._layout.rows, self._layout.cols);
        let (row_bits, col_bits, bits) = (self.row.width(), self.col.width(), self.address.width());
        let (part_row_bits, part_col_bits, part_bits) =
            (self.part_row.width(), self.part_col.width(), self.part.width());
        let wide =
            [bits, row_bits, col_bits, part_bits, part_row_bits, part_col_bits].into_iter().max().unwrap_or(bits);
        let extend = |name: &str, from: usize| match wide - from {
            0 => name.to_string(),
            more => format!("{{{more}'d0, {name}}}"),
        };
        // The middle line of an odd count is its own image: written to both lanes.
        let middle_row = if rows % 2 == 1 { format!("row == {row_bits}'d{}", rows / 2) } else { "1'b0".into() };
        let middle_col = if cols % 2 == 1 { format!("col == {col_bits}'d{}", cols / 2) } else { "1'b0".into() };
        let cut = |bits: usize| if wide == bits { String::new() } else { format!("[{}:0]", bits - 1) };
        let single = self._parts.rows * self._parts.cols == 1;
        let number = if single {
            format!("{} | {}", extend("part_row", part_row_bits), extend("part_col", part_col_bits))
        } else {
            let row = extend("part_row", part_row_bits);
            format!("{} + {}", times(&row, self._parts.cols), extend("part_col", part_col_bits))
        };
        // What is wider than its target never carries anything there.
        Verilog::Custom(format!(
            "\
wire unused = &{{1'b0, place, number}};
wire lower = row > {row_bits}'d{row_half};
wire right = col > {col_bits}'d{col_half};
wire [{row_end}:0] near_row = lower ? {row_bits}'d{row_last} - row : row;
wire [{col_end}:0] near_col = right ? {col_bits}'d{col_last} - col : col;
wire [{wide_end}:0] number = {number};
wire [{wide_end}:0] place = {base}{row_place} + {col_wide};
wire both_rows = {middle_row};
wire both_cols = {middle_col};
always @(*) begin
  address = place{address_cut};
  part = number{part_cut};
  lane = {{lower, right}};
  mask[0] = (!lower || both_rows) && (!right || both_cols);
  mask[1] = (!lower || both_rows) && (right || both_cols);
  mask[2] = (lower || both_rows) && (!right || both_cols);
  mask[3] = (lower || both_rows) && (right || both_cols);
end",
            base = if single { String::new() } else { format!("{} + ", times("number", self._layout.len())) },
            address_cut = cut(bits),
            part_cut = cut(part_bits),
            row_half = (rows - 1) / 2,
            col_half = (cols - 1) / 2,
            row_last = rows - 1,
            col_last = cols - 1,
            row_end = row_bits - 1,
            col_end = col_bits - 1,
            wide_end = wide - 1,
            row_place = times(&extend("near_row", row_bits), self._layout.quad_cols()),
            col_wide = extend("near_col", col_bits),
        ))
    }
}
