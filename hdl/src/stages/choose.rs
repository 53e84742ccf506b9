//! Stage `choose`: the case that solves a frame, decided while the frame is received.
//!
//! Four cycles: position and magnitude of a code, maxima, limit for a contact, choice.

use dermis_golden::fixed::choose::{is_beside_boundary, quarters, FrameStats, CUT_SHIFT};
use dermis_golden::fixed::Model;
use dermis_golden::partition::Grid;
use dermis_golden::scene::Condition;
use dermis_golden::sensor::Sensor;
use rust_hdl::prelude::*;

use crate::primitives::count_bits;
use crate::wire::{Wire, Word};

/// Monitors the accepted codes. `which` is valid with `settled`, from four cycles after the frame's last code until
/// `free`, and keeps its value until the next choice.
#[derive(LogicBlock)]
pub struct Choose {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Synchronous reset, active high.
    pub rst: Signal<In, Bit>,
    /// A code, `input_bits` wide, two's complement; valid with `accept`.
    pub code: Wire<In>,
    /// A code is accepted in this cycle.
    pub accept: Signal<In, Bit>,
    /// The code has `tlast`; before the end of the frame it drops the frame. Valid with `accept`.
    pub tlast: Signal<In, Bit>,
    /// The frame has been read; clears `settled`.
    pub free: Signal<In, Bit>,
    /// Index of the chosen case; valid with `settled`.
    pub which: Wire<Out>,
    /// The choice for the frame in the buffer is complete.
    pub settled: Signal<Out, Bit>,
    _sensor: Sensor,
    _grids: Vec<Grid>,
    _condition: Condition,
    _floor: i32,
    _index: usize,
    _seen: FrameStats,
    _left: usize,
}

/// Cycles from the last code to `settled`.
const LATENCY: usize = dermis_golden::fixed::choose::LATENCY as usize + 2;

impl Choose {
    /// For the cases of `model`.
    pub fn new(model: &Model) -> Self {
        let bits = model.formats.input_bits as usize;
        let grids = model.grids();
        Choose {
            clk: Default::default(),
            rst: Default::default(),
            code: Wire::new(bits),
            accept: Default::default(),
            tlast: Default::default(),
            free: Default::default(),
            which: Wire::new(count_bits(grids.len())),
            settled: Default::default(),
            _sensor: model.scene.sensor.clone(),
            _grids: grids,
            _condition: model.scene.partition.condition,
            // A floor beyond the code's range is clamped to its end, which no code exceeds either.
            _floor: model.noise_floor.min((1 << (bits - 1)) - 1),
            _index: 0,
            _seen: FrameStats::default(),
            _left: 0,
        }
    }

    /// Evaluates an accepted code; returns whether it was the frame's last.
    fn take(&mut self) -> bool {
        let code = self.code.val().signed(0, self.code.width()) as i32;
        self._seen.add(&self._sensor, self._index, code, self._floor);
        self._index += 1;
        let last = self._index == self._sensor.taxels();
        if last {
            self._index = 0;
        } else if self.tlast.val() {
            (self._index, self._seen) = (0, FrameStats::default());
        }
        last
    }

    /// Verilog that collects the signs in each quarter of the array; and for each case an expression that is true if a
    /// loaded subarray does not meet the condition. With `Condition::Loaded` every loaded subarray does.
    fn signs(&self) -> (String, Vec<String>) {
        let bits = self.code.width();
        if self._condition == Condition::Loaded {
            return (String::new(), vec!["1'b0".to_string(); self._grids.len()]);
        }
        let declare = format!(
            "\
wire signed [{end}:0] value = code;
wire signed [{end}:0] floor_code = {bits}'sd{floor};
reg above1, below1;
reg [1:0] quarter1;
reg [3:0] above, below;
always @(posedge clk) begin
  quarter1 <= {{row >= {r}'d{half_rows}, col >= {c}'d{half_cols}}};
  above1 <= value > floor_code;
  below1 <= value < -floor_code;
  if (forget) {{above, below}} <= 8'd0;
  else if (valid1) begin
    above[quarter1] <= above[quarter1] || above1;
    below[quarter1] <= below[quarter1] || below1;
  end
end
",
            end = bits - 1,
            floor = self._floor,
            r = count_bits(self._sensor.rows),
            c = count_bits(self._sensor.cols),
            half_rows = self._sensor.rows.div_ceil(2),
            half_cols = self._sensor.cols.div_ceil(2),
        );
        let any = |name: &str, part: &[usize]| {
            let bits: Vec<String> = part.iter().map(|quarter| format!("{name}[{quarter}]")).collect();
            format!("|{{{}}}", bits.join(", "))
        };
        let unmet = |grid: &Grid| {
            let parts = quarters(*grid);
            let differ = parts.iter().map(|part| format!("(({}) != ({}))", any("above", part), any("below", part)));
            differ.collect::<Vec<_>>().join(" || ")
        };
        (declare, self._grids.iter().map(unmet).collect())
    }
}

impl Logic for Choose {
    fn update(&mut self) {
        if self.clk.pos_edge() {
            if self._left == 1 {
                let case = self._seen.choose(&self._grids, self._condition, self._floor);
                self.which.next = Word::from(case as u64);
                self._seen = FrameStats::default();
            }
            self.settled.next = (self.settled.val() || self._left == 1) && !self.free.val() && !self.rst.val();
            self._left = self._left.saturating_sub(1);
            if self.accept.val() && self.take() {
                self._left = LATENCY - 1;
            }
            if self.rst.val() {
                (self._index, self._seen, self._left) = (0, FrameStats::default(), 0);
            }
        }
    }

    fn connect(&mut self) {
        self.which.connect();
        self.settled.connect();
    }

    fn hdl(&self) -> Verilog {
        let (rows, cols) = (self._sensor.rows, self._sensor.cols);
        let (r, c, m) = (count_bits(rows), count_bits(cols), self.code.width() - 1);
        let w = self.which.width();
        // First and last of the lines beside a boundary.
        let beside = |lines: usize| {
            let mut all = (0..lines).filter(|&line| is_beside_boundary(line, lines));
            let first = all.next().unwrap_or(0);
            (first, all.next_back().unwrap_or(first))
        };
        let within = |name: &str, bits: usize, lines: usize| {
            let (first, last) = beside(lines);
            let from = if first == 0 { String::new() } else { format!("{name} >= {bits}'d{first} && ") };
            format!("{from}{name} <= {bits}'d{last}")
        };
        let (signs, unmet) = self.signs();
        let cut = |grid: &Grid| match (grid.rows > 1, grid.cols > 1) {
            (true, true) => "cut_rows || cut_cols",
            (true, false) => "cut_rows",
            _ => "cut_cols",
        };
        let refused = self._grids.iter().zip(&unmet).enumerate().skip(1);
        let choice: String =
            refused.map(|(case, (grid, unmet))| format!("!({} || {unmet}) ? {w}'d{case} : ", cut(grid))).collect();
        let share = format!("{{{CUT_SHIFT}'d0, peak[{}:{CUT_SHIFT}]}}", m - 1);
        let limit = match self._floor.max(0) {
            0 => share,
            floor => format!("{share} > {m}'d{floor} ? {share} : {m}'d{floor}"),
        };
        Verilog::Custom(format!(
            "\
reg [{r_end}:0] row;
reg [{c_end}:0] col;
reg valid1, last1, last2, last3;
reg rows1, cols1;
reg [{m_end}:0] magnitude1, peak, middle_rows, middle_cols, limit;
wire line_end = col == {c}'d{last_col};
wire frame_end = line_end && row == {r}'d{last_row};
wire restart = rst || (accept && tlast && !frame_end);
wire forget = restart || last3;
{signs}wire cut_rows = middle_rows > limit;
wire cut_cols = middle_cols > limit;
wire unused = &{{1'b0, cut_rows, cut_cols}};
always @(posedge clk) begin
  if (restart) begin
    row <= {r}'d0;
    col <= {c}'d0;
  end else if (accept) begin
    col <= line_end ? {c}'d0 : col + {c}'d1;
    if (line_end) row <= frame_end ? {r}'d0 : row + {r}'d1;
  end
  valid1 <= accept && !restart;
  last1 <= accept && frame_end && !rst;
  last2 <= last1 && !rst;
  last3 <= last2 && !rst;
  magnitude1 <= code[{m_end}:0] ^ {{{m}{{code[{m}]}}}};
  rows1 <= {beside_rows};
  cols1 <= {beside_cols};
  if (forget) begin
    peak <= {m}'d0;
    middle_rows <= {m}'d0;
    middle_cols <= {m}'d0;
  end else if (valid1) begin
    if (magnitude1 > peak) peak <= magnitude1;
    if (rows1 && magnitude1 > middle_rows) middle_rows <= magnitude1;
    if (cols1 && magnitude1 > middle_cols) middle_cols <= magnitude1;
  end
  limit <= {limit};
  if (last3) which <= {choice}{w}'d0;
  settled <= (settled || last3) && !free && !rst;
end",
            r_end = r - 1,
            c_end = c - 1,
            m_end = m - 1,
            last_col = cols - 1,
            last_row = rows - 1,
            beside_rows = within("row", r, rows),
            beside_cols = within("col", c, cols),
        ))
    }
}
