//! Quad address and lane of a taxel.

use dermis_golden::fixed::quads::Quads;
use dermis_golden::fixed::Model;
use dermis_golden::partition::Grid;
use rust_hdl::prelude::*;

use super::case_counter::{by_case, largest};
use super::constant_product::times;
use super::counter::count_bits;
use crate::wire::{Wire, Word};

/// Row and column of a taxel in its subarray, and of the subarray in the array, to quad address, lane and write mask;
/// combinational. Subarrays follow each other row-major, each with all its quads. A taxel on the middle line of an odd
/// count is written to several lanes.
#[derive(LogicBlock)]
pub struct Mirror {
    /// Index of the case.
    pub which: Wire<In>,
    /// Row of the taxel in its subarray.
    pub row: Wire<In>,
    /// Column of the taxel in its subarray.
    pub col: Wire<In>,
    /// Row of the subarray in the grid of subarrays.
    pub part_row: Wire<In>,
    /// Column of the subarray in the grid.
    pub part_col: Wire<In>,
    /// Quad address in the frame buffer, over all subarrays.
    pub address: Wire<Out>,
    /// Index of the subarray, row-major.
    pub part: Wire<Out>,
    /// Lane the taxel is read from: `{lower half, right half}`, 2 bits.
    pub lane: Wire<Out>,
    /// Lanes the taxel is written to, one bit each.
    pub mask: Wire<Out>,
    _cases: Vec<(Quads, Grid)>,
}

impl Mirror {
    /// For the layout and the grid of each of `cases`.
    pub fn new(cases: &[Model]) -> Self {
        let wire =
            |of: &dyn Fn(&Model) -> usize| Wire::new(count_bits(largest(&cases.iter().map(of).collect::<Vec<_>>())));
        Mirror {
            which: Wire::new(count_bits(cases.len())),
            part_row: wire(&|case| case.grid().rows),
            part_col: wire(&|case| case.grid().cols),
            part: Wire::new(count_bits(largest(&cases.iter().map(|case| case.parts.len()).collect::<Vec<_>>()))),
            row: wire(&|case| case.layout().rows),
            col: wire(&|case| case.layout().cols),
            address: Wire::new(count_bits(frame_quads(cases))),
            lane: Wire::new(2),
            mask: Wire::new(4),
            _cases: cases.iter().map(|case| (case.layout(), case.grid())).collect(),
        }
    }
}

/// Quads of a frame over all subarrays, in the case that has most.
pub fn frame_quads(cases: &[Model]) -> usize {
    largest(&cases.iter().map(|case| case.parts.len() * case.formats.quads).collect::<Vec<_>>())
}

impl Logic for Mirror {
    fn update(&mut self) {
        let (row, col) = (self.row.val().number() as usize, self.col.val().number() as usize);
        let case = self._cases.get(self.which.val().number() as usize);
        let inside = |(layout, _): &&(Quads, Grid)| row < layout.rows && col < layout.cols;
        if let Some((layout, parts)) = case.filter(inside) {
            let place = layout.locate(row, col);
            let part = self.part_row.val().number() as usize * parts.cols + self.part_col.val().number() as usize;
            self.address.next = Word::from((part * layout.len() + place.address) as u64);
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
        let cases: String = (0..self._cases.len()).map(|case| self.place(case)).collect();
        let all = |name: &str| {
            let each: Vec<String> = (0..self._cases.len()).map(|case| format!("{name}{case}")).collect();
            by_case(&each)
        };
        // Bits beyond the target width are always zero.
        let cut = |bits: usize| match self.wide() == bits {
            true => String::new(),
            false => format!("[{}:0]", bits - 1),
        };
        Verilog::Custom(format!(
            "\
{cases}wire [{end}:0] place = {place};
wire [{end}:0] number = {number};
wire lower = {lower};
wire right = {right};
wire both_rows = {both_rows};
wire both_cols = {both_cols};
wire unused = &{{1'b0, which, place, number}};
always @(*) begin
  address = place{address_cut};
  part = number{part_cut};
  lane = {{lower, right}};
  mask[0] = (!lower || both_rows) && (!right || both_cols);
  mask[1] = (!lower || both_rows) && (right || both_cols);
  mask[2] = (lower || both_rows) && (!right || both_cols);
  mask[3] = (lower || both_rows) && (right || both_cols);
end",
            end = self.wide() - 1,
            place = all("place"),
            number = all("number"),
            lower = all("lower"),
            right = all("right"),
            both_rows = all("both_rows"),
            both_cols = all("both_cols"),
            address_cut = cut(self.address.width()),
            part_cut = cut(self.part.width()),
        ))
    }
}

impl Mirror {
    /// Width of the intermediate results.
    fn wide(&self) -> usize {
        let widths = [
            self.address.width(),
            self.row.width(),
            self.col.width(),
            self.part.width(),
            self.part_row.width(),
            self.part_col.width(),
        ];
        widths.into_iter().max().unwrap_or(1)
    }

    /// Verilog of a taxel's address and lane in case `case`.
    fn place(&self, case: usize) -> String {
        let (layout, parts) = self._cases[case];
        let (rows, cols) = (layout.rows, layout.cols);
        let (row_bits, col_bits, wide) = (self.row.width(), self.col.width(), self.wide());
        let extend = |name: &str, from: usize| match wide - from {
            0 => name.to_string(),
            more => format!("{{{more}'d0, {name}}}"),
        };
        // The middle line of an odd count is its own mirror image: written to both lanes.
        let middle_row = if rows % 2 == 1 { format!("row == {row_bits}'d{}", rows / 2) } else { "1'b0".into() };
        let middle_col = if cols % 2 == 1 { format!("col == {col_bits}'d{}", cols / 2) } else { "1'b0".into() };
        let single = parts.rows * parts.cols == 1;
        let row = extend("part_row", self.part_row.width());
        let col = extend("part_col", self.part_col.width());
        let number = if single { format!("{row} | {col}") } else { format!("{} + {col}", times(&row, parts.cols)) };
        let base = if single { String::new() } else { format!("{} + ", times(&format!("number{case}"), layout.len())) };
        format!(
            "\
wire lower{case} = row > {row_bits}'d{row_half};
wire right{case} = col > {col_bits}'d{col_half};
wire [{row_end}:0] near_row{case} = lower{case} ? {row_bits}'d{row_last} - row : row;
wire [{col_end}:0] near_col{case} = right{case} ? {col_bits}'d{col_last} - col : col;
wire [{end}:0] number{case} = {number};
wire [{end}:0] place{case} = {base}{row_place} + {col_wide};
wire both_rows{case} = {middle_row};
wire both_cols{case} = {middle_col};
",
            row_half = (rows - 1) / 2,
            col_half = (cols - 1) / 2,
            row_last = rows - 1,
            col_last = cols - 1,
            row_end = row_bits - 1,
            col_end = col_bits - 1,
            end = wide - 1,
            row_place = times(&extend(&format!("near_row{case}"), row_bits), layout.quad_cols()),
            col_wide = extend(&format!("near_col{case}"), col_bits),
        )
    }
}
