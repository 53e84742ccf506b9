//! Bias of each candidate's score, n·log2 Σp, and whether the candidate is eligible.

use dermis_golden::fixed::formats::Formats;
use dermis_golden::fixed::search::log2;
use rust_hdl::prelude::*;

use super::case_counter::{by_case, largest};
use super::counter::count_bits;
use super::logarithm::{functions, located_bits, LOG_BITS};
use super::sweep::{position_bits, square_bits, sweep_bits, unpack, Sweep};
use crate::wire::{Wire, Word};

/// Three candidates per cycle, one row of equal y: Σp selected and the disc tested, first half of the logarithm, second
/// half and table, times n.
///
/// `start` with the sweep and its nine sums, which stay stable for the next three cycles. The results are valid
/// `LATENCY` cycles after `start`, until those of the next sweep.
#[derive(LogicBlock)]
pub struct Weigh {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Synchronous reset, active high; clears the control pipeline only.
    pub rst: Signal<In, Bit>,
    /// Index of the case.
    pub which: Wire<In>,
    /// Start with the nine candidates of `sweep`.
    pub start: Signal<In, Bit>,
    /// Word of the sweep (`Sweep`); valid with `start`.
    pub sweep: Wire<In>,
    /// Squared radius of the search disc; valid with `start`.
    pub radius: Wire<In>,
    /// Nine Σp, `sum_bits[0]` each, signed; valid with `start` and for three more cycles.
    pub sums: Wire<In>,
    /// Nine n·log2 Σp, unsigned, 2^−6.
    pub weights: Wire<Out>,
    /// Nine bits: Σp > 0 and inside the disc.
    pub eligible: Wire<Out>,
    /// Word of the sweep the results belong to.
    pub weighed: Wire<Out>,
    _taxels: Vec<i64>,
    _left: usize,
    _next: (Word, Word, Word),
}

/// Cycles from `start` to the results.
pub const LATENCY: usize = 8;

/// Width of n·log2 Σp for subarrays of `taxels` taxels, in bits.
pub fn weight_bits(taxels: usize) -> usize {
    LOG_BITS + count(taxels as i64)
}

fn count(taxels: i64) -> usize {
    64 - (taxels as u64).leading_zeros() as usize
}

impl Weigh {
    /// With the widths of `formats`, for subarrays of `taxels[case]` taxels.
    pub fn new(formats: &Formats, taxels: &[usize]) -> Self {
        let weight = weight_bits(largest(taxels));
        Weigh {
            clk: Default::default(),
            rst: Default::default(),
            which: Wire::new(count_bits(taxels.len())),
            start: Default::default(),
            sweep: Wire::new(sweep_bits()),
            radius: Wire::new(square_bits()),
            sums: Wire::new(9 * formats.sum_bits[0] as usize),
            weights: Wire::new(9 * weight),
            eligible: Wire::new(9),
            weighed: Wire::new(sweep_bits()),
            _taxels: taxels.iter().map(|&taxels| taxels as i64).collect(),
            _left: 0,
            _next: Default::default(),
        }
    }

    fn weigh(&self) -> (Word, Word, Word) {
        let sweep = Sweep::of_word(&self.sweep.val());
        let radius = self.radius.val().number() as i64;
        let s = self.sums.width() / 9;
        let sums: [i64; 9] = std::array::from_fn(|k| self.sums.val().signed(k, s));
        let eligible = (0..9).filter(|&k| {
            let (ux, uy) = ((k % 3) as i64 - 1, (k / 3) as i64 - 1);
            let square = sweep.square + 2 * (ux * sweep.centre[0] + uy * sweep.centre[1]) + ux.abs() + uy.abs();
            sums[k] > 0 && square <= radius
        });
        let eligible: u64 = eligible.map(|k| 1 << k).sum();
        let taxels = self._taxels[(self.which.val().number() as usize).min(self._taxels.len() - 1)];
        let weights = sums.map(|sum| taxels * log2(sum));
        (Word::of_fields(&weights, self.weights.width() / 9), Word::from(eligible), self.sweep.val())
    }
}

impl Logic for Weigh {
    fn update(&mut self) {
        if self.clk.pos_edge() {
            if self._left == 1 {
                (self.weights.next, self.eligible.next, self.weighed.next) = self._next;
            }
            self._left = match (self.rst.val(), self.start.val()) {
                (true, _) => 0,
                (false, true) => LATENCY - 1,
                (false, false) => self._left.saturating_sub(1),
            };
            if self.start.val() {
                self._next = self.weigh();
            }
        }
    }

    fn connect(&mut self) {
        self.weights.connect();
        self.eligible.connect();
        self.weighed.connect();
    }

    fn hdl(&self) -> Verilog {
        let s = self.sums.width() / 9;
        let w = self.weights.width() / 9;
        let (p, q) = (position_bits(), square_bits());
        // n·log2 Σp without a multiplier: one term per set bit of n, added up in two halves, then their sum a cycle
        // later.
        let halves = |taxels: &i64| -> [String; 2] {
            let bits = (0..64).filter(|bit| taxels >> bit & 1 == 1);
            let terms: Vec<String> = bits.map(|bit| format!("({{{}'d0, log}} << {bit})", w - LOG_BITS)).collect();
            let (first, rest) = terms.split_at(terms.len().div_ceil(2));
            [first.join(" + "), if rest.is_empty() { format!("{w}'d0") } else { rest.join(" + ") }]
        };
        let halves: Vec<[String; 2]> = self._taxels.iter().map(halves).collect();
        let [first, rest] = [0, 1].map(|half| by_case(&halves.iter().map(|of| of[half].clone()).collect::<Vec<_>>()));
        let rows: String = (0..3)
            .map(|row| {
                format!(
                    "      if (row5 == 2'd{row}) begin\n        weights[({row} * 3 + c) * {w} +: {w}] <= first + rest;\n        \
                     eligible[{row} * 3 + c] <= fits4;\n      end\n"
                )
            })
            .collect();
        Verilog::Custom(format!(
            "\
{functions}wire unused_which = &{{1'b0, which}};
reg [{sweep_end}:0] held;
reg [{q_end}:0] held_radius;
reg [1:0] row, row2, row3, row4, row5;
reg running;
reg [3:0] valid;
{fields}wire unused = &{{1'b0, held_buffer, held_coarse, held_closes}};
// |c + u|² = |c|² + 2 (ux cx + uy cy) + |ux| + |uy|, so the disc needs no multiplier. Rows in order uy = −1, 0, 1.
wire [{q_end}:0] twice_x = {{{{{q_more}{{held_centre_x[{p_end}]}}}}, held_centre_x, 1'b0}};
wire [{q_end}:0] twice_y = {{{{{q_more}{{held_centre_y[{p_end}]}}}}, held_centre_y, 1'b0}};
// One carry chain per cycle, the comparison in a third cycle.
reg [{q_end}:0] in_row;
reg [{distances_end}:0] distance;
always @(posedge clk) begin
  in_row <= row == 2'd0 ? held_square - twice_y + {q}'d1 : row == 2'd2 ? held_square + twice_y + {q}'d1 : held_square;
  distance <= {{in_row + twice_x + {q}'d1, in_row, in_row - twice_x + {q}'d1}};
  if (rst) begin
    running <= 1'b0;
    valid <= 4'd0;
  end else begin
    if (start) running <= 1'b1;
    else if (row == 2'd2) running <= 1'b0;
    valid <= {{valid[2:0], running}};
  end
  if (start) begin
    held <= sweep;
    held_radius <= radius;
  end
  row <= start ? 2'd0 : row + 2'd1;
  {{row5, row4, row3, row2}} <= {{row4, row3, row2, row}};
  if (valid[3] && row5 == 2'd2) weighed <= held;
end
genvar c;
generate
  for (c = 0; c < 3; c = c + 1) begin : column
    wire [{s_end}:0] sum = row == 2'd0 ? sums[c * {s} +: {s}] : row == 2'd1 ? sums[(3 + c) * {s} +: {s}]
      : sums[(6 + c) * {s} +: {s}];
    reg [{s_end}:0] sum1;
    reg [{located_end}:0] located;
    reg [{log_end}:0] log;
    reg presses2, fits3, fits4;
    reg [{w_end}:0] first, rest;
    always @(posedge clk) begin
      sum1 <= sum;
      presses2 <= !sum1[{s_end}] && sum1 != {s}'d0;
      fits3 <= presses2 && distance[c * {q} +: {q}] <= held_radius;
      fits4 <= fits3;
      located <= locate(sum1);
      log <= logarithm(located);
      first <= {first};
      rest <= {rest};
      if (valid[3]) begin
{rows}      end
    end
  end
endgenerate",
            functions = functions(s),
            fields = unpack("held", "held_"),
            sweep_end = sweep_bits() - 1,
            s_end = s - 1,
            w_end = w - 1,
            located_end = located_bits(s) - 1,
            log_end = LOG_BITS - 1,
            p_end = p - 1,
            q_end = q - 1,
            q_more = q - p - 1,
            distances_end = 3 * q - 1,
        ))
    }
}
