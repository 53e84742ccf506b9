//! Where a taxel lives among the quads.

use dermis_golden::fixed::quads::Quads;
use rust_hdl::prelude::*;

use super::counter::count_bits;
use crate::wire::{Wire, Word};

/// Row and column of a taxel to quad address, lane, and the lanes to write (several on a middle line); combinational.
#[derive(LogicBlock)]
pub struct Mirror {
    /// Row in the subarray.
    pub row: Wire<In>,
    /// Column in the subarray.
    pub col: Wire<In>,
    /// Quad address.
    pub address: Wire<Out>,
    /// Lane the taxel is read from, 2 bits.
    pub lane: Wire<Out>,
    /// Lanes the taxel is written to.
    pub mask: Wire<Out>,
    _layout: Quads,
}

impl Mirror {
    /// For subarrays of `layout`.
    pub fn new(layout: Quads) -> Self {
        Mirror {
            row: Wire::new(count_bits(layout.rows)),
            col: Wire::new(count_bits(layout.cols)),
            address: Wire::new(count_bits(layout.len())),
            lane: Wire::new(2),
            mask: Wire::new(4),
            _layout: layout,
        }
    }
}

impl Logic for Mirror {
    fn update(&mut self) {
        let (row, col) = (self.row.val().number() as usize, self.col.val().number() as usize);
        if row < self._layout.rows && col < self._layout.cols {
            let place = self._layout.place(row, col);
            self.address.next = Word::from(place.address as u64);
            self.lane.next = Word::from(place.lane as u64);
            self.mask.next = Word::from(u64::from(place.mask));
        }
    }

    fn connect(&mut self) {
        self.address.connect();
        self.lane.connect();
        self.mask.connect();
    }

    fn hdl(&self) -> Verilog {
        let (rows, cols) = (self._layout.rows, self._layout.cols);
        let (row_bits, col_bits, bits) = (self.row.width(), self.col.width(), self.address.width());
        let wide = bits.max(row_bits).max(col_bits);
        let extend = |name: &str, from: usize| match wide - from {
            0 => name.to_string(),
            more => format!("{{{more}'d0, {name}}}"),
        };
        // The middle line of an odd count is its own image: written to both lanes.
        let middle_row = if rows % 2 == 1 { format!("row == {row_bits}'d{}", rows / 2) } else { "1'b0".into() };
        let middle_col = if cols % 2 == 1 { format!("col == {col_bits}'d{}", cols / 2) } else { "1'b0".into() };
        let quad_cols = self._layout.quad_cols();
        let cut = if wide == bits { "" } else { &format!("[{}:0]", bits - 1) };
        Verilog::Custom(format!(
            "\
wire lower = row > {row_bits}'d{row_half};
wire right = col > {col_bits}'d{col_half};
wire [{row_end}:0] near_row = lower ? {row_bits}'d{row_last} - row : row;
wire [{col_end}:0] near_col = right ? {col_bits}'d{col_last} - col : col;
wire [{wide_end}:0] place = {row_wide} * {wide}'d{quad_cols} + {col_wide};
wire both_rows = {middle_row};
wire both_cols = {middle_col};
always @(*) begin
  address = place{cut};
  lane = {{lower, right}};
  mask[0] = (!lower || both_rows) && (!right || both_cols);
  mask[1] = (!lower || both_rows) && (right || both_cols);
  mask[2] = (lower || both_rows) && (!right || both_cols);
  mask[3] = (lower || both_rows) && (right || both_cols);
end",
            row_half = (rows - 1) / 2,
            col_half = (cols - 1) / 2,
            row_last = rows - 1,
            col_last = cols - 1,
            row_end = row_bits - 1,
            col_end = col_bits - 1,
            wide_end = wide - 1,
            row_wide = extend("near_row", row_bits),
            col_wide = extend("near_col", col_bits),
        ))
    }
}
