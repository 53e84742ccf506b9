//! Stages `force` and `send`: one product at a time, a beat every [`BEAT`](dermis_golden::fixed::serial::BEAT) cycles.
//!
//! ```text
//! phase  0 order | 1 bank | 2 … 4 factors μ1, μ2, 1 | 3 … 5 products | 4 … 6 rounder | 8 … 10 forces
//!        11 threshold | 12 beat
//! ```
//! The next taxel's value is read meanwhile and taken when the beat is accepted: from then on phases 3 to 12 repeat.
//! Before the first beat both μ words are computed in the same way; after the last force the status words take the
//! place of the forces.

use dermis_golden::fixed::formats::{Formats, FORCE_BITS, FORCE_SHIFT_MAX, MU_ROUND};
use dermis_golden::fixed::send::{FLAG_CONDITION, FLAG_FOUND, FLAG_FRAMING, FLAG_NO_CONTACT, STATUS_BEATS};
use dermis_golden::fixed::serial::{polynomials, word_bits, BEAT, FACTOR_BITS, FIRST_BEAT, MU_WORDS};
use rust_hdl::prelude::*;

use super::rounder::SHIFT_BITS;
use super::solve::{extended, padded, SATURATION_BITS};
use crate::primitives::{count_bits, position_bits};
use crate::wire::{Wire, Word};

const WORD: usize = FORCE_BITS as usize;
const FACTOR: usize = FACTOR_BITS as usize;
/// Start of the cycle count: cycles before `frame_begin` and after the count stops, at the first beat.
const COUNTED_LATER: u64 = 2;
const LAST_PHASE: u64 = FIRST_BEAT - 1;
/// First phase of a beat whose value has already been read.
const AGAIN_PHASE: u64 = FIRST_BEAT - BEAT;
/// Width of the count of cycles to the first beat, in bits.
const CYCLES: usize = 20;

/// Values in, beats out; timing in the module docs.
#[derive(LogicBlock)]
pub struct Force {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Synchronous reset, active high.
    pub rst: Signal<In, Bit>,
    /// All values are in the bank: start sending.
    pub start: Signal<In, Bit>,
    /// Row-major index of the taxel to read.
    pub index: Wire<Out>,
    /// Place 4·quad + lane of that taxel, one cycle after `index`.
    pub place: Wire<In>,
    /// Index of the taxel's polynomial, combinational from `place`.
    pub wanted: Wire<Out>,
    /// Value p(μ*) of the taxel, signed; one cycle after `wanted`.
    pub value: Wire<In>,
    /// μ1 in grid steps of the last level, signed; stable while sending.
    pub best_x: Wire<In>,
    /// μ2 in grid steps of the last level, signed; stable while sending.
    pub best_y: Wire<In>,
    /// Score of the best candidate, signed, 2^−6; stable while sending.
    pub score: Wire<In>,
    /// The search found a candidate; stable while sending.
    pub found: Signal<In, Bit>,
    /// The frame meets the scene's condition; stable while sending.
    pub condition: Signal<In, Bit>,
    /// `tlast` was early or missing; stable while sending.
    pub framing: Signal<In, Bit>,
    /// Left shift of `normalise`; stable while sending.
    pub normalise: Wire<In>,
    /// Right shift of `rescale`; stable while sending.
    pub rescale: Wire<In>,
    /// Words saturated by `rescale`; stable while sending.
    pub saturations: Wire<In>,
    /// A frame starts: its cycle count restarts.
    pub frame_begin: Signal<In, Bit>,
    /// Product for the rounder, signed.
    pub product: Wire<Out>,
    /// Right shift for the rounder.
    pub round_shift: Wire<Out>,
    /// Word from the rounder, 32 bits signed; four cycles after `product`.
    pub rounded: Wire<In>,
    /// `rounded` was saturated.
    pub clipped: Signal<In, Bit>,
    /// `{fz, fy, fx}`, 32 bits signed each, or a status beat; valid with `m_axis_tvalid`.
    pub m_axis_tdata: Wire<Out>,
    /// A beat is offered on `m_axis_tdata`; it is held until `m_axis_tready`.
    pub m_axis_tvalid: Signal<Out, Bit>,
    /// The receiver accepts a beat in this cycle.
    pub m_axis_tready: Signal<In, Bit>,
    /// The beat is the last of its frame; valid with `m_axis_tvalid`.
    pub m_axis_tlast: Signal<Out, Bit>,
    /// The frame's last beat is accepted in this cycle.
    pub done: Signal<Out, Bit>,
    _value_bits: usize,
    _mu_step: i64,
    _mu_fraction: u32,
    _shift_base: i64,
    _threshold: i64,
    _taxels: u64,
    _state: State,
}

#[derive(Clone, Copy, Debug, Default)]
struct State {
    scaling: bool,
    sending: bool,
    phase: u64,
    status: bool,
    beat: u64,
    ahead: u64,
    counting: bool,
    factors: [i64; 2],
    product: i64,
    mu: [i64; 2],
    words: [i64; 3],
    saturations: u64,
    contact: bool,
    cycles: u64,
    valid: bool,
    shift: i64,
}

impl Force {
    /// With the widths of `formats`; `threshold` is in force LSBs, the rounder takes words of `unrounded` bits.
    pub fn new(formats: &Formats, threshold: i64, unrounded: usize) -> Self {
        let f = formats;
        let places = count_bits(4 * f.quads);
        let rescale_max = i64::from(f.raw_length_max.saturating_sub(f.vector_bits - 1));
        let headroom = i64::from(FORCE_BITS - f.search_bits[0]);
        Force {
            clk: Default::default(),
            rst: Default::default(),
            start: Default::default(),
            index: Wire::new(places),
            place: Wire::new(places),
            wanted: Wire::new(count_bits(polynomials(f))),
            value: Wire::new(word_bits(f)),
            best_x: Wire::new(position_bits()),
            best_y: Wire::new(position_bits()),
            score: Wire::new(f.score_bits as usize),
            found: Default::default(),
            condition: Default::default(),
            framing: Default::default(),
            normalise: Wire::new(SHIFT_BITS),
            rescale: Wire::new(SHIFT_BITS),
            saturations: Wire::new(SATURATION_BITS),
            frame_begin: Default::default(),
            product: Wire::new(unrounded),
            round_shift: Wire::new(SHIFT_BITS),
            rounded: Wire::new(WORD),
            clipped: Default::default(),
            m_axis_tdata: Wire::new(3 * WORD),
            m_axis_tvalid: Default::default(),
            m_axis_tready: Default::default(),
            m_axis_tlast: Default::default(),
            done: Default::default(),
            _value_bits: f.search_bits[0] as usize,
            _mu_step: f.mu_step,
            _mu_fraction: f.mu_fraction,
            _shift_base: i64::from(f.mu_fraction) + rescale_max - headroom,
            _threshold: threshold,
            _taxels: 4 * f.quads as u64,
            _state: State::default(),
        }
    }

    fn value_bits(&self) -> usize {
        self._value_bits
    }

    fn shift(&self) -> i64 {
        let more = self.normalise.val().number() as i64 - self.rescale.val().number() as i64;
        (self._shift_base + more).clamp(0, i64::from(FORCE_SHIFT_MAX))
    }

    fn is_last(&self) -> bool {
        self._state.status && self._state.beat == STATUS_BEATS as u64 - 1
    }

    fn clocked(&mut self) {
        let s = self._state;
        let mut next = s;
        let position = |wire: &Wire<In>| wire.val().signed(0, position_bits());
        next.product = s.factors[0] * s.factors[1];
        let rounded = self.rounded.val().signed(0, WORD);
        if s.scaling {
            next.phase = s.phase + 1;
            match s.phase {
                0 => next.factors = [self._mu_step, position(&self.best_x)],
                1 => next.factors[1] = position(&self.best_y),
                6 => next.mu[0] = rounded,
                7 => next.mu[1] = rounded,
                _ => {}
            }
            if s.phase == MU_WORDS - 1 {
                (next.scaling, next.sending, next.phase) = (false, true, 0);
            }
        } else if s.sending {
            next.phase = s.phase + 1;
            let forces = !s.status;
            match s.phase {
                2 => self.take_value(&mut next),
                3 => next.factors[1] = s.mu[1],
                4 => next.factors[1] = 1 << self._mu_fraction,
                8..=10 => {
                    let word = s.phase as usize - 8;
                    let captured = if s.status { i64::from(self.status(s.beat)[word]) } else { rounded };
                    // All three enter at fz and shift down: only one register has the multiplexer.
                    next.words = [s.words[1], s.words[2], captured];
                    next.saturations += u64::from(self.clipped.val() && forces);
                }
                11 => {
                    if forces && s.words[2].abs() < self._threshold {
                        next.words = [0; 3];
                    } else if forces {
                        next.contact |= s.words[2] != 0;
                    }
                    next.counting = false;
                    next.valid = true;
                }
                LAST_PHASE => {
                    next.phase = s.phase;
                    if self.m_axis_tready.val() {
                        (next.phase, next.valid) = (AGAIN_PHASE, false);
                        self.take_value(&mut next);
                        let forces_end = forces && s.beat == self._taxels - 1;
                        next.beat = if forces_end { 0 } else { s.beat + 1 };
                        next.status |= forces_end;
                        next.sending = !self.is_last();
                    }
                }
                _ => {}
            }
        } else if self.start.val() {
            next = State { scaling: true, cycles: s.cycles, counting: true, ..State::default() };
        }
        next.cycles = match (self.frame_begin.val(), s.counting) {
            (true, _) => COUNTED_LATER,
            (false, true) => next.cycles + 1,
            (false, false) => next.cycles,
        };
        next.counting |= self.frame_begin.val();
        if self.rst.val() {
            next = State::default();
        }
        // Registered: its inputs are stable long before it is used.
        next.shift = self.shift();
        self._state = next;
    }

    /// Takes the value that has been read as a factor, and addresses the next one.
    fn take_value(&self, next: &mut State) {
        let bits = self.value_bits();
        let value = Word::of_fields(&[self.value.val().signed(0, self.value.width())], bits).signed(0, bits);
        next.factors = [value, self._state.mu[0]];
        next.ahead = self._state.ahead + 1;
    }

    fn status(&self, beat: u64) -> [i32; 3] {
        let s = &self._state;
        let position = |wire: &Wire<In>| wire.val().signed(0, position_bits()) as i32;
        let flag = |set: bool, bit: u32| if set { bit as i32 } else { 0 };
        match beat {
            0 => [
                position(&self.best_x),
                position(&self.best_y),
                flag(self.condition.val(), FLAG_CONDITION)
                    | flag(self.found.val(), FLAG_FOUND)
                    | flag(!s.contact, FLAG_NO_CONTACT)
                    | flag(self.framing.val(), FLAG_FRAMING),
            ],
            1 => [
                if self.found.val() { self.score.val().signed(0, self.score.width()) as i32 } else { 0 },
                self.rescale.val().number() as i32,
                self.normalise.val().number() as i32,
            ],
            _ => [self.saturations.val().number() as i32, s.saturations as i32, s.cycles as i32],
        }
    }
}

impl Logic for Force {
    fn update(&mut self) {
        if self.clk.pos_edge() {
            self.clocked();
        }
        let s = self._state;
        self.index.next = Word::from(s.ahead & ((1 << self.index.width()) - 1));
        self.wanted.next = Word::from(self.place.val().number() + 1);
        self.product.next = Word::of_fields(&[s.product], self.product.width());
        let shift = if s.scaling { i64::from(MU_ROUND) } else { s.shift };
        self.round_shift.next = Word::from(shift as u64);
        self.m_axis_tdata.next = Word::of_fields(&s.words, WORD);
        self.m_axis_tvalid.next = s.valid;
        self.m_axis_tlast.next = s.valid && self.is_last();
        self.done.next = s.valid && self.is_last() && self.m_axis_tready.val();
    }

    fn connect(&mut self) {
        let wires =
            [&mut self.index, &mut self.wanted, &mut self.product, &mut self.round_shift, &mut self.m_axis_tdata];
        wires.into_iter().for_each(Wire::connect);
        [&mut self.m_axis_tvalid, &mut self.m_axis_tlast, &mut self.done].into_iter().for_each(Signal::connect);
    }

    fn hdl(&self) -> Verilog {
        let (value, word_bits) = (self.value_bits(), self.value.width());
        let (product, places, wanted) = (value + FACTOR, self.place.width(), self.wanted.width());
        let position = position_bits();
        let score = self.score.width();
        let status_end = STATUS_BEATS - 1;
        let small = match self._threshold {
            0 => "wire too_small = 1'b0;".to_string(),
            threshold => format!(
                "wire [{WORD}:0] size = {{1'b0, fz[{end}] ? {WORD}'d0 - fz : fz}};\n\
                 wire too_small = size < 33'd{threshold};",
                end = WORD - 1
            ),
        };
        let unused = if word_bits > value {
            format!("wire unused = &{{1'b0, value[{}:{value}]}};\n", word_bits - 1)
        } else {
            String::new()
        };
        let shift_base = self._shift_base;
        let base = if shift_base < 0 { format!("-10'sd{}", -shift_base) } else { format!("10'sd{shift_base}") };
        let mu_step = format!("{value}'sd{}", self._mu_step);
        Verilog::Custom(format!(
            "\
{unused}reg scaling, sending, status, counting, contact, valid;
reg [3:0] phase;
reg [{places_end}:0] beat, ahead;
wire beat_taken = sending && phase == 4'd{last_phase} && m_axis_tready;
wire take_value = beat_taken || (sending && phase == 4'd2);
reg signed [{value_end}:0] factor_a;
reg signed [{factor_end}:0] factor_b, mu_x, mu_y;
reg signed [{product_end}:0] result;
reg [{word_end}:0] fx, fy, fz;
reg [15:0] force_saturations;
reg [{cycles_end}:0] first_cycles;
wire last_beat = status && beat == {places}'d{status_end};
wire last_force = !status && beat == {places}'d{last_force};
{small}
wire signed [9:0] shift = {base} + {{4'd0, normalise}} - {{4'd0, rescale}};
wire [{word_end}:0] status_x = beat[1:0] == 2'd0 ? {x_word} : beat[1:0] == 2'd1 ? (found ? {score_word} : {word}'d0) : {saturations_word};
wire [{word_end}:0] status_y = beat[1:0] == 2'd0 ? {y_word} : beat[1:0] == 2'd1 ? {{26'd0, rescale}} : {{16'd0, force_saturations}};
wire [{word_end}:0] status_z = beat[1:0] == 2'd0 ? {{28'd0, framing, !contact, found, condition}}
  : beat[1:0] == 2'd1 ? {{26'd0, normalise}} : {cycles_word};
wire [{word_end}:0] captured = !status ? rounded : phase[1] ? status_z : phase[0] ? status_y : status_x;
reg [5:0] settled_shift;
always @(posedge clk) begin
  settled_shift <= shift[9] ? 6'd0 : |shift[8:6] || shift[5:0] > 6'd{shift_max} ? 6'd{shift_max} : shift[5:0];
  result <= factor_a * factor_b;
  if (scaling) begin
    phase <= phase == 4'd{scaled} ? 4'd0 : phase + 4'd1;
    if (phase == 4'd0) factor_a <= {mu_step};
    if (phase == 4'd0) factor_b <= {best_x};
    if (phase == 4'd1) factor_b <= {best_y};
    if (phase == 4'd6) mu_x <= rounded[{factor_end}:0];
    if (phase == 4'd7) mu_y <= rounded[{factor_end}:0];
    if (phase == 4'd{scaled}) begin
      scaling <= 1'b0;
      sending <= 1'b1;
    end
  end else if (sending) begin
    if (phase != 4'd{last_phase}) phase <= phase + 4'd1;
    if (take_value) factor_a <= value[{value_end}:0];
    if (take_value) factor_b <= mu_x;
    if (take_value) ahead <= ahead + {places}'d1;
    if (phase == 4'd3) factor_b <= mu_y;
    if (phase == 4'd4) factor_b <= {factor}'sd{one};
    if (phase == 4'd8 || phase == 4'd9 || phase == 4'd10) begin
      fx <= fy;
      fy <= fz;
      fz <= captured;
    end
    if (clipped && !status && phase >= 4'd8 && phase <= 4'd10) force_saturations <= force_saturations + 16'd1;
    if (phase == 4'd11) begin
      if (too_small && !status) begin
        fx <= {word}'d0;
        fy <= {word}'d0;
        fz <= {word}'d0;
      end else if (!status && fz != {word}'d0) contact <= 1'b1;
      counting <= 1'b0;
      valid <= 1'b1;
    end
    if (beat_taken) begin
      phase <= 4'd{again};
      valid <= 1'b0;
      beat <= last_force ? {places}'d0 : beat + {places}'d1;
      if (last_force) status <= 1'b1;
      if (last_beat) sending <= 1'b0;
    end
  end else if (start) begin
    scaling <= 1'b1;
    phase <= 4'd0;
    status <= 1'b0;
    beat <= {places}'d0;
    ahead <= {places}'d0;
    force_saturations <= 16'd0;
    contact <= 1'b0;
  end
  if (frame_begin) counting <= 1'b1;
  if (frame_begin) first_cycles <= {cycle_bits}'d{later};
  else if (counting) first_cycles <= first_cycles + {cycle_bits}'d1;
  if (rst) begin
    scaling <= 1'b0;
    sending <= 1'b0;
    valid <= 1'b0;
  end
end
always @(*) begin
  index = ahead;
  wanted = {wanted_place} + {wanted}'d1;
  product = {result};
  round_shift = scaling ? 6'd{mu_round} : settled_shift;
  m_axis_tdata = {{fz, fy, fx}};
  m_axis_tvalid = valid;
  m_axis_tlast = valid && last_beat;
  done = valid && last_beat && m_axis_tready;
end",
            places_end = places - 1,
            value_end = value - 1,
            factor = FACTOR,
            factor_end = FACTOR - 1,
            product_end = product - 1,
            result = extended("result", product, self.product.width()),
            word = WORD,
            word_end = WORD - 1,
            cycle_bits = CYCLES,
            cycles_end = CYCLES - 1,
            last_force = self._taxels - 1,
            x_word = extended("best_x", position, WORD),
            y_word = extended("best_y", position, WORD),
            score_word = extended("score", score, WORD),
            saturations_word = padded("saturations", SATURATION_BITS, WORD),
            cycles_word = padded("first_cycles", CYCLES, WORD),
            scaled = MU_WORDS - 1,
            best_x = extended("best_x", position, FACTOR),
            best_y = extended("best_y", position, FACTOR),
            last_phase = LAST_PHASE,
            again = AGAIN_PHASE,
            one = 1u64 << self._mu_fraction,
            later = COUNTED_LATER,
            wanted_place = padded("place", places, wanted),
            mu_round = MU_ROUND,
            shift_max = FORCE_SHIFT_MAX,
        ))
    }
}
