//! Search sequencer: the order of sweeps, centres and buffers.

use dermis_golden::fixed::formats::HALVINGS;
use dermis_golden::fixed::search::COARSE_CENTRES;
use rust_hdl::prelude::*;

use super::store::{base, base_bits, base_of};
use super::sweep::{offsets, position_bits, square_bits, sweep_bits, unpack, Sweep, BUFFERS, BUFFER_BITS, START};
use crate::wire::{Wire, Word};

/// Sweeps over the coarse tiles, then the halvings, then a last sweep that only moves to the best position.
///
/// `set_up` starts a sweep. Its `step`, `sweep` and `source` are valid from the next cycle until the following
/// `set_up`; `target`, also a field of `sweep`, one cycle later. In the coarse grid `set_up` may coincide with
/// `judged`; otherwise it comes three cycles after `judged` or `begin_frame`.
///
/// Coarse sweeps follow one another without waiting for the comparison of their candidates (`chains`): each reads the
/// buffer that the previous one wrote, and writes the one that is neither that nor the best so far. Three buffers are
/// enough as long as a sweep is compared before the next but one is set up. Halvings work in place. `judged` with
/// `improved` makes the buffer of a coarse sweep the best.
#[derive(LogicBlock)]
pub struct Walk {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Synchronous reset, active high; clears `chains` only.
    pub rst: Signal<In, Bit>,
    /// A new search starts.
    pub begin_frame: Signal<In, Bit>,
    /// Search; otherwise only the last sweep follows. Valid with `begin_frame`.
    pub enabled: Signal<In, Bit>,
    /// Set up the next sweep.
    pub set_up: Signal<In, Bit>,
    /// The candidates of a sweep have been compared.
    pub judged: Signal<In, Bit>,
    /// The best candidate changed; valid with `judged`.
    pub improved: Signal<In, Bit>,
    /// Word of that sweep; valid with `judged`.
    pub judged_sweep: Wire<In>,
    /// Best position, x, in grid steps, signed.
    pub best_x: Wire<In>,
    /// Best position, y, in grid steps, signed.
    pub best_y: Wire<In>,
    /// Move of the sweep, as in [`Taylor`](super::Taylor): x in bits 1:0, y in bits 3:2, halving in bit 4.
    pub step: Wire<Out>,
    /// The sweep is the last: it only moves to the best position.
    pub last: Signal<Out, Bit>,
    /// The next sweep is a halving.
    pub next_halves: Signal<Out, Bit>,
    /// The next sweep may be set up without waiting for the comparison of this one.
    pub chains: Signal<Out, Bit>,
    /// Buffer to read.
    pub source: Wire<Out>,
    /// First address of the buffer that the next sweep reads, one cycle after that buffer is known.
    pub next_base: Wire<Out>,
    /// Buffer to write, one cycle after the other outputs.
    pub target: Wire<Out>,
    /// Word of the sweep (`Sweep`).
    pub sweep: Wire<Out>,
    /// Squared radius of the search disc in grid steps of the level.
    pub radius: Wire<Out>,
    _quads: usize,
    _state: State,
}

/// Number of sweeps whose candidates are compared.
const JUDGED: usize = COARSE_CENTRES.len() + HALVINGS as usize;
const SWEEP_BITS: usize = 4;

#[derive(Clone, Copy, Debug, Default)]
struct State {
    count: usize,
    sweep: Sweep,
    kept: Sweep,
    radius: i64,
    /// The target buffer of the sweep is output in the next cycle.
    chosen: bool,
    /// The target buffer on the output.
    target: usize,
}

impl Walk {
    /// For a search memory with buffers of `quads` quads.
    pub fn new(quads: usize) -> Self {
        let p = position_bits();
        Walk {
            clk: Default::default(),
            rst: Default::default(),
            begin_frame: Default::default(),
            enabled: Default::default(),
            set_up: Default::default(),
            judged: Default::default(),
            improved: Default::default(),
            judged_sweep: Wire::new(sweep_bits()),
            best_x: Wire::new(p),
            best_y: Wire::new(p),
            step: Wire::new(5),
            last: Default::default(),
            next_halves: Default::default(),
            chains: Default::default(),
            source: Wire::new(BUFFER_BITS),
            next_base: Wire::new(base_bits(quads)),
            target: Wire::new(BUFFER_BITS),
            sweep: Wire::new(sweep_bits()),
            radius: Wire::new(square_bits()),
            _quads: quads,
            _state: State::default(),
        }
    }
}

/// Moves between the centres of the coarse sweeps, in order.
fn coarse_moves() -> Vec<[i64; 2]> {
    let mut at = [0, 0];
    let step = |to: &[i32; 2]| {
        let step = [to[0] - at[0], to[1] - at[1]].map(i64::from);
        at = *to;
        step
    };
    COARSE_CENTRES.iter().map(step).collect()
}

impl Walk {
    fn advance(&mut self) {
        let s = &mut self._state;
        let coarse = s.count < COARSE_CENTRES.len();
        let halving = !coarse && s.count < JUDGED;
        let best = [&self.best_x, &self.best_y].map(|wire| wire.val().signed(0, position_bits()));
        let from = if coarse { s.sweep } else { s.kept };
        let by = match coarse_moves().get(s.count) {
            Some(by) => *by,
            None => [best[0] - from.centre[0], best[1] - from.centre[1]],
        };
        let moved = [from.centre[0] + by[0], from.centre[1] + by[1]];
        let square = from.square + 2 * (by[0] * from.centre[0] + by[1] * from.centre[1]) + by[0].abs() + by[1].abs();
        let double = u32::from(halving);
        let free = (1..=BUFFERS).map(|b| b % BUFFERS).find(|b| *b != from.buffer && *b != s.kept.buffer);
        let buffer = if coarse { free.unwrap_or(0) } else { s.kept.buffer };
        let closes = !coarse || s.count + 1 == COARSE_CENTRES.len();
        s.sweep = Sweep { centre: moved.map(|c| c << double), square: square << (2 * double), buffer, coarse, closes };
        s.radius <<= 2 * double;
        // The first coarse sweep replaces START as the best so far; its centre is one step away from μ = 0.
        if !coarse || s.count == 0 {
            s.kept = s.sweep;
        }
        s.count += 1;
        self.source.next = Word::from(from.buffer as u64);
        s.chosen = true;
        self.step.next = Word::of_fields(&[by[0], by[1], i64::from(halving)], 2);
        self.last.next = !coarse && !halving;
        self.chains.next = !closes;
    }
}

impl Logic for Walk {
    fn update(&mut self) {
        if self.clk.pos_edge() {
            let s = &self._state;
            let next = if s.count < COARSE_CENTRES.len() { s.target } else { s.kept.buffer };
            self.next_base.next = Word::from(base(next, self._quads) as u64);
            if self.begin_frame.val() {
                let start = Sweep { buffer: START, ..Sweep::default() };
                let count = if self.enabled.val() { 0 } else { JUDGED };
                self._state = State { count, radius: 9, sweep: start, kept: start, chosen: false, target: START };
            }
            if std::mem::take(&mut self._state.chosen) {
                self._state.target = self._state.sweep.buffer;
            }
            let judged = Sweep::of_word(&self.judged_sweep.val());
            if self.judged.val() && self.improved.val() && judged.coarse {
                self._state.kept = judged;
            }
            if self.set_up.val() {
                self.advance();
            }
            if self.rst.val() {
                self.chains.next = false;
            }
            let s = &self._state;
            self.sweep.next = Sweep { buffer: s.target, ..s.sweep }.word();
            self.target.next = Word::from(s.target as u64);
            self.radius.next = Word::from(s.radius as u64);
            self.next_halves.next = (COARSE_CENTRES.len()..JUDGED).contains(&s.count);
        }
    }

    fn connect(&mut self) {
        for wire in
            [&mut self.step, &mut self.source, &mut self.next_base, &mut self.target, &mut self.sweep, &mut self.radius]
        {
            wire.connect();
        }
        for bit in [&mut self.last, &mut self.next_halves, &mut self.chains] {
            bit.connect();
        }
    }

    fn hdl(&self) -> Verilog {
        let (p, q, w) = (position_bits(), square_bits(), sweep_bits());
        let [_, _, _, buffer, ..] = offsets();
        let low = buffer - 1;
        let cases: String = coarse_moves()
            .iter()
            .enumerate()
            .map(|(count, [x, y])| {
                format!("    {SWEEP_BITS}'d{count}: {{table_y, table_x}} = 4'b{:02b}{:02b};\n", y & 3, x & 3)
            })
            .collect();
        Verilog::Custom(format!(
            "\
reg [{s_end}:0] count;
reg [{w_end}:0] kept;
reg [1:0] table_x, table_y;
always @(*) begin
  case (count)
{cases}    default: {{table_y, table_x}} = 4'd0;
  endcase
end
reg is_coarse, is_halving;
wire closing = !is_coarse || count == {SWEEP_BITS}'d{final_coarse};
always @(*) next_halves = is_halving;
// A coarse sweep set up in the cycle of `judged` already uses its result for the choice of buffers; a halving is set up
// later.
{judged_fields}wire keeps = judged && improved && judged_coarse;
wire [1:0] kept_buffer = kept[{buffer} +: 2];
wire [{w_end}:0] from = is_coarse ? sweep : kept;
{from_fields}wire unused = &{{1'b0, from_coarse, from_closes, best_x, best_y, judged_centre_x, judged_centre_y, judged_square,
  judged_buffer, judged_closes}};
// The best position is at most one step from the centre of its polynomials, so two bits of the difference are the move.
// Move, starting point and destination are registered before the sweep is set up.
reg [1:0] go_x, go_y;
reg [1:0] base_buffer;
reg [{p_end}:0] base_x, base_y;
reg [{q_end}:0] base_square;
wire [1:0] step_x = is_coarse ? table_x : best_x[1:0] - from_centre_x[1:0];
wire [1:0] step_y = is_coarse ? table_y : best_y[1:0] - from_centre_y[1:0];
wire [{q_end}:0] twice_x = {{{{{q_more}{{base_x[{p_end}]}}}}, base_x, 1'b0}};
wire [{q_end}:0] twice_y = {{{{{q_more}{{base_y[{p_end}]}}}}, base_y, 1'b0}};
wire [{q_end}:0] along_x = go_x[1] ? {q}'d1 - twice_x : go_x[0] ? {q}'d1 + twice_x : {q}'d0;
wire [{q_end}:0] along_y = go_y[1] ? {q}'d1 - twice_y : go_y[0] ? {q}'d1 + twice_y : {q}'d0;
wire [{q_end}:0] to_square = base_square + along_x + along_y;
wire [{p_end}:0] to_x = base_x + {{{{{p_more}{{go_x[1]}}}}, go_x}};
wire [{p_end}:0] to_y = base_y + {{{{{p_more}{{go_y[1]}}}}, go_y}};
reg [{p_end}:0] at_x, at_y;
reg [{q_end}:0] at_square;
always @(posedge clk) begin
  go_x <= step_x;
  go_y <= step_y;
  base_buffer <= from_buffer;
  next_base <= {next_base};
  base_x <= from_centre_x;
  base_y <= from_centre_y;
  base_square <= from_square;
  at_x <= to_x;
  at_y <= to_y;
  at_square <= to_square;
end
wire [{low}:0] next = {{is_halving ? at_square << 2 : at_square, is_halving ? at_y << 1 : at_y,
  is_halving ? at_x << 1 : at_x}};
// A coarse sweep writes the first of buffers 1, 2, 0 that is neither read nor the best, chosen one cycle after the
// set-up, when a `judged` in the cycle of the set-up has taken effect. The first, which reads START, writes 1. Other
// sweeps work in place.
reg set_up1, coarse1, taken_closes, taken_coarse;
reg [{low}:0] place;
wire [1:0] free = source == 2'd{START} || (source != 2'd1 && kept_buffer != 2'd1) ? 2'd1
  : source != 2'd2 && kept_buffer != 2'd2 ? 2'd2 : 2'd0;
always @(*) sweep = {{taken_closes, taken_coarse, target, place}};
always @(posedge clk) begin
  if (begin_frame) begin
    count <= enabled ? {SWEEP_BITS}'d0 : {SWEEP_BITS}'d{JUDGED};
    is_coarse <= enabled;
    is_halving <= 1'b0;
    {{taken_closes, taken_coarse, place}} <= {w_less}'d0;
    target <= 2'd{START};
    kept <= {start};
    radius <= {q}'d9;
  end else begin
    kept <= set_up && (!is_coarse || count == {SWEEP_BITS}'d0)
      ? {{closing, is_coarse, is_coarse ? 2'd1 : kept_buffer, next}} : keeps ? judged_sweep : kept;
    if (set_up1) target <= coarse1 ? free : source;
    if (set_up) begin
      count <= count + {SWEEP_BITS}'d1;
      if (count == {SWEEP_BITS}'d{final_coarse}) is_coarse <= 1'b0;
      is_halving <= (is_halving || count == {SWEEP_BITS}'d{final_coarse}) && count != {SWEEP_BITS}'d{final_halving};
      {{taken_closes, taken_coarse, place}} <= {{closing, is_coarse, next}};
      step <= {{is_halving, go_y, go_x}};
      last <= !is_coarse && !is_halving;
      source <= base_buffer;
      if (is_halving) radius <= radius << 2;
    end
  end
  set_up1 <= set_up;
  coarse1 <= is_coarse;
  if (rst) chains <= 1'b0;
  else if (set_up) chains <= !closing;
end",
            s_end = SWEEP_BITS - 1,
            w_end = w - 1,
            w_less = w - 2,
            p_end = p - 1,
            q_end = q - 1,
            next_base = base_of("from_buffer", self._quads),
            q_more = q - p - 1,
            p_more = p - 2,
            final_coarse = COARSE_CENTRES.len() - 1,
            final_halving = JUDGED - 1,
            start = format_args!("{{2'd0, 2'd{START}, {}'d0}}", q + 2 * p),
            judged_fields = unpack("judged_sweep", "judged_"),
            from_fields = unpack("from", "from_"),
        ))
    }
}
