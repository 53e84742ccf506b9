//! Sequencer from the frame buffer to the polynomials: which word goes where in which cycle.
//!
//! ```text
//! step 1, 2  frame --> rounder (normalise) --> mixer (fold) --> operands, high and low limbs
//! step 3     pass of v_00 --> raw memory, length
//! step 4     raw memory --> rounder (rescale) --> operands; mixer --> unfold
//! step 5     the other passes --> rounder --> operands; mixer --> unfold
//! ```
//! Each step ends with [`DRAIN`] cycles, in which its last words reach their memory.

use dermis_golden::fixed::arith::{bit_length, magnitude_bits, round_shift, saturate};
use dermis_golden::fixed::coefficients::FLIP_X;
use dermis_golden::fixed::formats::{Formats, SEARCH_EXTRA_BITS};
use dermis_golden::fixed::resources::operand_vectors;
use dermis_golden::fixed::schedule::{schedule, Kind, Product};
use dermis_golden::fixed::serial::{first_vector, operand_index, DRAIN, OPERAND_BITS, ROW_GAP, WIDE};
use rust_hdl::prelude::*;

use super::rounder::SHIFT_BITS;
use crate::primitives::count_bits;
use crate::wire::{Wire, Word};

/// Width of the count of saturated words, in bits.
pub const SATURATION_BITS: usize = 16;
const FOLD_HIGH: u64 = 1;
const FOLD_LOW: u64 = 2;
const FIRST: u64 = 3;
const REPLAY: u64 = 4;
const OTHERS: u64 = 5;

/// The sequencer and its counters; steps in the module docs.
#[derive(LogicBlock)]
pub struct Solve {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Synchronous reset, active high; stops the sequence.
    pub rst: Signal<In, Bit>,
    /// The frame buffer holds a frame: start.
    pub start: Signal<In, Bit>,
    /// OR of the frame's magnitudes; valid with `start`.
    pub magnitude: Wire<In>,
    /// Place of the taxel to read.
    pub index: Wire<Out>,
    /// Its code, signed; two cycles after `index`.
    pub code: Wire<In>,
    /// An accumulator of the passes, `acc_bits` wide, signed.
    pub row_word: Wire<In>,
    /// `row_word` is valid.
    pub row_valid: Signal<In, Bit>,
    /// Write `row_word` to the raw memory.
    pub raw_write: Signal<Out, Bit>,
    /// Address in the raw memory; valid with `raw_write`.
    pub raw_write_address: Wire<Out>,
    /// Address of the raw word to read.
    pub raw_read_address: Wire<Out>,
    /// The raw word, one cycle after `raw_read_address`.
    pub raw_word: Wire<In>,
    /// Word for the rounder, signed.
    pub unrounded: Wire<Out>,
    /// Right shift for the rounder; valid with `round`.
    pub round_shift: Wire<Out>,
    /// `unrounded` is valid.
    pub round: Signal<Out, Bit>,
    /// Word from the rounder, signed.
    pub rounded: Wire<In>,
    /// `rounded` was saturated.
    pub clipped: Signal<In, Bit>,
    /// `rounded` is valid.
    pub round_done: Signal<In, Bit>,
    /// `rounded` goes to the mixer in this cycle.
    pub mix: Signal<Out, Bit>,
    /// Word from the mixer, signed.
    pub mixed: Wire<In>,
    /// `mixed` is valid.
    pub mixed_valid: Signal<In, Bit>,
    /// A product is issued to `pass` in this cycle.
    pub issue: Signal<Out, Bit>,
    /// The product is the last of its row; valid with `issue`.
    pub last: Signal<Out, Bit>,
    /// Wide matrix, row and column; valid with `issue`.
    pub address: Wire<Out>,
    /// Use the low limb of Cz⁺; valid with `issue`.
    pub low: Signal<Out, Bit>,
    /// Vector and column of the operand; valid with `issue`.
    pub operand_address: Wire<Out>,
    /// Read the operand with both parity bits inverted; valid with `issue`.
    pub flip: Signal<Out, Bit>,
    /// The product is of two high limbs; valid with `issue`.
    pub align: Signal<Out, Bit>,
    /// Write `write_data` to the operand memory.
    pub write: Signal<Out, Bit>,
    /// Vector and quad to write; valid with `write`.
    pub write_address: Wire<Out>,
    /// Parity to write, 2 bits; valid with `write`.
    pub write_lane: Wire<Out>,
    /// Operand of 16 bits, signed; valid with `write`.
    pub write_data: Wire<Out>,
    /// The rounder's word is a normalised code.
    pub normalised_valid: Signal<Out, Bit>,
    /// The mixer's quads are folded input, high limb.
    pub folding: Signal<Out, Bit>,
    /// The rounder's word is a rescaled v_ij.
    pub rescaled_valid: Signal<Out, Bit>,
    /// The mixer's words are taxels of a v_ij.
    pub unfolding: Signal<Out, Bit>,
    /// The frame buffer has been read; high for one cycle.
    pub free: Signal<Out, Bit>,
    /// Left shift of `normalise`; valid from step 2 or 3 until the next `start`.
    pub normalise: Wire<Out>,
    /// Right shift of `rescale`; valid from step 4 until the next `start`.
    pub rescale: Wire<Out>,
    /// Number of words saturated by `rescale`, 16 bits.
    pub saturations: Wire<Out>,
    /// The sequence is running; rounder and mixer are in use.
    pub busy: Signal<Out, Bit>,
    /// Last cycle of the sequence.
    pub done: Signal<Out, Bit>,
    _formats: Formats,
    _program: Vec<Instruction>,
    _state: State,
}

/// One product of the program. The operand memory holds the v_ij with their column parity inverted, as Ax needs them;
/// for Ay both parity bits of the address are inverted.
#[derive(Clone, Copy, Debug)]
struct Instruction {
    matrix: usize,
    low: bool,
    operand: usize,
    flip: bool,
    align: bool,
    last: bool,
}

#[derive(Clone, Copy, Debug, Default)]
struct State {
    step: u64,
    draining: bool,
    wait: u64,
    quad: u64,
    phase: u64,
    column: u64,
    gap: u64,
    product: u64,
    first_product: u64,
    seen: u64,
    length: u64,
    normalise: u64,
    rescale: u64,
    saturations: u64,
    read: [bool; 2],
    replayed: bool,
    written: u64,
    vector: u64,
    stored: u64,
}

impl Solve {
    /// With the schedule of `formats`; the rounder takes words of `unrounded` bits and returns words of `rounded` bits.
    pub fn new(formats: &Formats, unrounded: usize, rounded: usize) -> Self {
        let f = formats;
        let (quads, words) = (count_bits(f.quads), count_bits(4 * f.quads));
        let vectors = count_bits(first_vector(f) + operand_vectors(f.degree));
        let instructions = schedule(f).into_iter().flat_map(|products| {
            let count = products.len();
            products.into_iter().enumerate().map(move |(at, product)| (product, at + 1 == count)).collect::<Vec<_>>()
        });
        let instruction = |(product, last): (Product, bool)| Instruction {
            matrix: WIDE.iter().position(|&kind| kind == product.matrix.kind).unwrap_or(0),
            low: product.matrix.kind == Kind::InverseLow,
            operand: operand_index(f, product.operand),
            flip: product.matrix.kind == Kind::Ay,
            align: product.align,
            last,
        };
        Solve {
            clk: Default::default(),
            rst: Default::default(),
            start: Default::default(),
            magnitude: Wire::new(f.input_bits as usize - 1),
            index: Wire::new(words),
            code: Wire::new(f.input_bits as usize),
            row_word: Wire::new(f.acc_bits as usize),
            row_valid: Default::default(),
            raw_write: Default::default(),
            raw_write_address: Wire::new(words),
            raw_read_address: Wire::new(words),
            raw_word: Wire::new(f.acc_bits as usize),
            unrounded: Wire::new(unrounded),
            round_shift: Wire::new(SHIFT_BITS),
            round: Default::default(),
            rounded: Wire::new(rounded),
            clipped: Default::default(),
            round_done: Default::default(),
            mix: Default::default(),
            mixed: Wire::new(rounded + 2),
            mixed_valid: Default::default(),
            issue: Default::default(),
            last: Default::default(),
            address: Wire::new(2 + 2 * quads),
            low: Default::default(),
            operand_address: Wire::new(vectors + quads),
            flip: Default::default(),
            align: Default::default(),
            write: Default::default(),
            write_address: Wire::new(vectors + quads),
            write_lane: Wire::new(2),
            write_data: Wire::new(OPERAND_BITS as usize),
            normalised_valid: Default::default(),
            folding: Default::default(),
            rescaled_valid: Default::default(),
            unfolding: Default::default(),
            free: Default::default(),
            normalise: Wire::new(SHIFT_BITS),
            rescale: Wire::new(SHIFT_BITS),
            saturations: Wire::new(SATURATION_BITS),
            busy: Default::default(),
            done: Default::default(),
            _program: instructions.map(instruction).collect(),
            _formats: formats.clone(),
            _state: State::default(),
        }
    }

    fn drained(&self) -> bool {
        self._state.draining && self._state.wait == DRAIN - 1
    }

    fn clocked(&mut self) {
        let f = &self._formats;
        let quads = f.quads as u64;
        let s = self._state;
        let mut next = s;
        let end_of_words = 4 * quads - 1;
        next.length = u64::from(bit_length(s.seen));
        next.read = [self.reads(), s.read[0]];
        next.replayed = s.step == REPLAY && !s.draining && s.phase < 4;
        if s.step == FOLD_HIGH {
            next.normalise = u64::from(f.input_bits - 1) - s.length;
        }
        if s.step == FIRST {
            next.rescale = s.length.saturating_sub(u64::from(f.vector_bits - 1));
        }
        if self.rescaled() && self.clipped.val() {
            next.saturations += 1;
        }
        if s.step == FIRST && self.row_valid.val() {
            next.seen |= magnitude_bits(self.row_word.val().signed(0, f.acc_bits as usize));
            next.stored = if s.stored == end_of_words { 0 } else { s.stored + 1 };
        }
        if (self.is_folding() && self.mixed_valid.val()) || self.rescaled() {
            next.written = if s.written == end_of_words { 0 } else { s.written + 1 };
            if self.rescaled() && s.written == end_of_words {
                next.vector += 1;
            }
        }
        let last_quad = s.quad == quads - 1;
        if s.draining {
            next.wait = s.wait + 1;
            if self.drained() {
                next.draining = false;
                next.step = match s.step {
                    FOLD_HIGH if f.input_low_bits == 0 => FIRST,
                    OTHERS => 0,
                    step => step + 1,
                };
                if next.step == FIRST {
                    next.seen = 0;
                }
            }
        } else if self.is_folding() || s.step == REPLAY {
            next.phase = (s.phase + 1) % 8;
            if s.phase == 7 {
                next.quad = if last_quad { 0 } else { s.quad + 1 };
                next.draining = last_quad;
            }
        } else if s.step != 0 {
            let last = self._program[s.product as usize].last;
            if s.gap == 0 {
                next.column = if s.column == quads - 1 { 0 } else { s.column + 1 };
                if s.column == quads - 1 {
                    if last {
                        next.gap = 1;
                    } else {
                        next.product = s.product + 1;
                    }
                }
            } else if s.gap == ROW_GAP {
                next.gap = 0;
                next.quad = if last_quad { 0 } else { s.quad + 1 };
                next.product = if last_quad { s.product + 1 } else { s.first_product };
                next.first_product = if last_quad { s.product + 1 } else { s.first_product };
                next.draining = last_quad && (s.step == FIRST || s.product as usize == self._program.len() - 1);
            } else {
                next.gap = s.gap + 1;
            }
        }
        if !s.draining {
            next.wait = 0;
        }
        if s.step == 0 && self.start.val() {
            next = State { step: FOLD_HIGH, seen: self.magnitude.val().number(), ..State::default() };
        }
        if self.rst.val() {
            next.step = 0;
            next.draining = false;
        }
        self._state = next;
    }

    fn is_folding(&self) -> bool {
        matches!(self._state.step, FOLD_HIGH | FOLD_LOW)
    }

    fn reads(&self) -> bool {
        self.is_folding() && !self._state.draining && self._state.phase < 4
    }

    fn is_unfolding(&self) -> bool {
        matches!(self._state.step, REPLAY | OTHERS)
    }

    fn rescaled(&self) -> bool {
        self.is_unfolding() && self.round_done.val()
    }

    /// The operand to write: a limb of a folded word, or a rescaled word rounded to `data_bits`.
    fn operand(&self) -> i64 {
        let f = &self._formats;
        let low = f.input_low_bits;
        let mixed = self.mixed.val().signed(0, self.mixed.width());
        match self._state.step {
            FOLD_HIGH => mixed >> low,
            FOLD_LOW => (mixed & ((1 << low) - 1)) << (f.limb_align - low),
            _ => {
                let word = self.rounded.val().signed(0, self.rounded.width());
                saturate(round_shift(word, SEARCH_EXTRA_BITS), f.data_bits).0
            }
        }
    }
}

impl Logic for Solve {
    fn update(&mut self) {
        if self.clk.pos_edge() {
            self.clocked();
        }
        let f = &self._formats;
        let s = self._state;
        let at = 4 * s.quad + s.phase % 4;
        let bits = count_bits(f.quads);
        self.index.next = Word::from(at);
        self.raw_read_address.next = Word::from(at);
        self.raw_write.next = s.step == FIRST && self.row_valid.val();
        self.raw_write_address.next = Word::from(s.stored);
        let (unrounded, shift, round) = match s.step {
            REPLAY => (self.raw_word.val().signed(0, self.raw_word.width()), s.rescale, s.replayed),
            OTHERS => {
                (self.row_word.val().signed(0, self.row_word.width()), u64::from(f.a_shift), self.row_valid.val())
            }
            _ => (self.code.val().signed(0, self.code.width()) << (f.input_bits - 1), s.length, s.read[1]),
        };
        self.unrounded.next = Word::of_fields(&[unrounded], self.unrounded.width());
        self.round_shift.next = Word::from(shift);
        self.round.next = round;
        self.mix.next = self.round_done.val() && s.step != 0;
        let instruction = self._program[(s.product as usize).min(self._program.len() - 1)];
        self.issue.next = matches!(s.step, FIRST | OTHERS) && !s.draining && s.gap == 0;
        self.last.next = instruction.last && s.column == f.quads as u64 - 1;
        self.address.next = Word::from(((instruction.matrix as u64) << bits | s.quad) << bits | s.column);
        self.low.next = instruction.low;
        self.operand_address.next = Word::from((instruction.operand as u64) << bits | s.column);
        self.flip.next = instruction.flip;
        self.align.next = instruction.align;
        let vector = match s.step {
            FOLD_HIGH => 0,
            FOLD_LOW => 1,
            _ => first_vector(f) as u64 + s.vector,
        };
        let kept = s.vector < operand_vectors(f.degree) as u64;
        self.write.next = (self.is_folding() && self.mixed_valid.val()) || (self.rescaled() && kept);
        let mut write_address = Word::default();
        write_address.set(0, self.write_address.width(), vector << bits | s.written >> 2);
        self.write_address.next = write_address;
        let stored_flip = if self.is_folding() { 0 } else { FLIP_X as u64 };
        self.write_lane.next = Word::from(s.written & 3 ^ stored_flip);
        self.write_data.next = Word::of_fields(&[self.operand()], OPERAND_BITS as usize);
        self.normalised_valid.next = s.step == FOLD_HIGH && self.round_done.val();
        self.folding.next = s.step == FOLD_HIGH;
        self.rescaled_valid.next = self.rescaled();
        self.unfolding.next = self.is_unfolding();
        self.free.next = self.drained() && (s.step == FOLD_LOW || (s.step == FOLD_HIGH && f.input_low_bits == 0));
        self.normalise.next = Word::from(s.normalise);
        self.rescale.next = Word::from(s.rescale);
        self.saturations.next = Word::from(s.saturations);
        self.busy.next = s.step != 0;
        self.done.next = self.drained() && s.step == OTHERS;
    }

    fn connect(&mut self) {
        let wires = [
            &mut self.index,
            &mut self.raw_write_address,
            &mut self.raw_read_address,
            &mut self.unrounded,
            &mut self.round_shift,
            &mut self.address,
            &mut self.operand_address,
            &mut self.write_address,
            &mut self.write_lane,
            &mut self.write_data,
            &mut self.normalise,
            &mut self.rescale,
            &mut self.saturations,
        ];
        wires.into_iter().for_each(Wire::connect);
        let bits = [
            &mut self.raw_write,
            &mut self.round,
            &mut self.mix,
            &mut self.issue,
            &mut self.last,
            &mut self.low,
            &mut self.align,
            &mut self.flip,
            &mut self.write,
            &mut self.normalised_valid,
            &mut self.folding,
            &mut self.rescaled_valid,
            &mut self.unfolding,
            &mut self.free,
            &mut self.busy,
            &mut self.done,
        ];
        bits.into_iter().for_each(Signal::connect);
    }

    fn hdl(&self) -> Verilog {
        let f = &self._formats;
        let (quads, words) = (count_bits(f.quads), count_bits(4 * f.quads));
        let count = self._program.len();
        let pc = count_bits(count + 1);
        let vectors = self.write_address.width() - quads;
        // As gates: synthesis would map a table to a memory.
        let set = |bit: &dyn Fn(&Instruction) -> bool| {
            let terms: Vec<String> =
                (0..count).filter(|&at| bit(&self._program[at])).map(|at| format!("product == {pc}'d{at}")).collect();
            if terms.is_empty() {
                "1'b0".to_string()
            } else {
                format!("({})", terms.join(" || "))
            }
        };
        let field = |bits: usize, of: &dyn Fn(&Instruction) -> usize| {
            let bits: Vec<String> = (0..bits).rev().map(|bit| set(&|i| of(i) >> bit & 1 == 1)).collect();
            format!("{{{}}}", bits.join(", "))
        };
        let (acc, seen) = (f.acc_bits as usize, f.acc_bits.max(f.input_bits) as usize - 1);
        let unrounded = self.unrounded.width();
        let low = f.input_low_bits as usize;
        let mixed = self.mixed.width();
        let operand = OPERAND_BITS as usize;
        let data = f.data_bits as usize;
        let high_limb = if low + operand > mixed {
            format!("{{{{{}{{mixed[{}]}}}}, mixed[{}:{low}]}}", low + operand - mixed, mixed - 1, mixed - 1)
        } else {
            format!("mixed[{}:{low}]", low + operand - 1)
        };
        let align = (f.limb_align as usize).saturating_sub(low);
        let low_limb = match (low, align) {
            (0, _) => high_limb.clone(),
            (_, 0) => format!("{{{}'d0, mixed[{}:0]}}", operand - low, low - 1),
            _ => format!("{{{}'d0, mixed[{}:0], {align}'d0}}", operand - low - align, low - 1),
        };
        let extra = SEARCH_EXTRA_BITS as usize;
        let after_fold = if low == 0 { "3'd3" } else { "3'd2" };
        let freed = if low == 0 { "3'd1" } else { "3'd2" };
        let code = f.input_bits as usize;
        let code_word = format!("{{{{{}{{code[{}]}}}}, code, {}'d0}}", unrounded - 2 * code + 1, code - 1, code - 1);
        Verilog::Custom(format!(
            "\
reg [2:0] step, phase, gap;
reg draining;
reg [3:0] wait_count;
reg [{qe}:0] quad, column;
reg [{pe}:0] product, first_product;
reg [{se}:0] seen;
reg [5:0] length;
reg [1:0] read;
reg replayed;
reg [{we}:0] written, stored;
reg [{ve}:0] vector;
wire row_folding = step == 3'd1 || step == 3'd2;
wire rescaled = unfolding && round_done;
wire drained = draining && wait_count == 4'd{drain};
wire last_quad = quad == {quads}'d{last_quad};
wire last_column = column == {quads}'d{last_quad};
wire row_last = {row_last};
wire [{pe}:0] next_product = product + {pc}'d1;
wire [{we}:0] place = {{quad, phase[1:0]}};
wire folded = row_folding && mixed_valid;
wire [{acc_less}:0] row_magnitude = row_word[{acc_less}:0] ^ {{{acc_end}{{row_word[{acc_end}]}}}};
// Binary search for the leading one.
wire [63:0] whole = {{{seen_fill}'d0, seen}};
wire [31:0] half = |whole[63:32] ? whole[63:32] : whole[31:0];
wire [15:0] quarter = |half[31:16] ? half[31:16] : half[15:0];
wire [7:0] byte_left = |quarter[15:8] ? quarter[15:8] : quarter[7:0];
wire [3:0] nibble = |byte_left[7:4] ? byte_left[7:4] : byte_left[3:0];
wire [1:0] pair = |nibble[3:2] ? nibble[3:2] : nibble[1:0];
wire [5:0] leading = {{|whole[63:32], |half[31:16], |quarter[15:8], |byte_left[7:4], |nibble[3:2], pair[1]}};
wire [5:0] seen_length = leading + {{5'd0, |pair}};
always @(posedge clk) begin
  length <= seen_length;
  read <= {{read[0], row_folding && !draining && !phase[2]}};
  replayed <= step == 3'd4 && !draining && !phase[2];
  if (step == 3'd1) normalise <= 6'd{most} - length;
  if (step == 3'd3) rescale <= length > 6'd{vector_less} ? length - 6'd{vector_less} : 6'd0;
  if (rescaled && clipped) saturations <= saturations + {saturation_bits}'d1;
  if (step == 3'd3 && row_valid) begin
    seen <= seen | {row_seen};
    stored <= stored == {words}'d{last_word} ? {words}'d0 : stored + {words}'d1;
  end
  if (folded || rescaled) begin
    written <= written == {words}'d{last_word} ? {words}'d0 : written + {words}'d1;
    if (rescaled && written == {words}'d{last_word} && vector != {vectors}'d{kept}) vector <= vector + {vectors}'d1;
  end
  wait_count <= draining ? wait_count + 4'd1 : 4'd0;
  if (draining) begin
    if (drained) begin
      draining <= 1'b0;
      step <= step == 3'd1 ? {after_fold} : step == 3'd5 ? 3'd0 : step + 3'd1;
      if (step == {freed}) seen <= {seen}'d0;
    end
  end else if (row_folding || step == 3'd4) begin
    phase <= phase + 3'd1;
    if (phase == 3'd7) begin
      quad <= last_quad ? {quads}'d0 : quad + {quads}'d1;
      draining <= last_quad;
    end
  end else if (step != 3'd0) begin
    if (gap == 3'd0) begin
      column <= last_column ? {quads}'d0 : column + {quads}'d1;
      if (last_column && row_last) gap <= 3'd1;
      else if (last_column) product <= next_product;
    end else if (gap == 3'd{row_gap}) begin
      gap <= 3'd0;
      quad <= last_quad ? {quads}'d0 : quad + {quads}'d1;
      product <= last_quad ? next_product : first_product;
      if (last_quad) first_product <= next_product;
      draining <= last_quad && (step == 3'd3 || product == {pc}'d{last_product});
    end else gap <= gap + 3'd1;
  end
  if (step == 3'd0 && start) begin
    step <= 3'd1;
    phase <= 3'd0;
    gap <= 3'd0;
    draining <= 1'b0;
    quad <= {quads}'d0;
    column <= {quads}'d0;
    product <= {pc}'d0;
    first_product <= {pc}'d0;
    seen <= {magnitude};
    length <= 6'd0;
    saturations <= {saturation_bits}'d0;
    read <= 2'd0;
    replayed <= 1'b0;
    written <= {words}'d0;
    stored <= {words}'d0;
    vector <= {vectors}'d0;
    normalise <= 6'd0;
    rescale <= 6'd0;
  end
  if (rst) begin
    step <= 3'd0;
    draining <= 1'b0;
  end
end
// Adds half an LSB of the operand; only the largest positive values can overflow.
wire [{data_end}:0] nearest = (!rounded[{top}] && &rounded[{below}:{half}]) ? {{1'b0, {{{data_less}{{1'b1}}}}}}
  : rounded[{top}:{extra}] + {{{data_less}'d0, rounded[{half}]}};
wire [{operand_end}:0] rescaled_operand = {extended_operand};
wire unused = &{{1'b0, rounded[{unused_end}:0]}};
always @(*) begin
  index = place;
  raw_read_address = place;
  raw_write = step == 3'd3 && row_valid;
  raw_write_address = stored;
  case (step)
    3'd4: begin unrounded = {raw}; round_shift = rescale; round = replayed; end
    3'd5: begin unrounded = {row}; round_shift = 6'd{a_shift}; round = row_valid; end
    default: begin unrounded = {code_word}; round_shift = length; round = read[1]; end
  endcase
  mix = round_done && step != 3'd0;
  issue = (step == 3'd3 || step == 3'd5) && !draining && gap == 3'd0;
  last = row_last && last_column;
  address = {{{matrix}, quad, column}};
  low = {is_low};
  operand_address = {{{operand_vector}, column}};
  flip = {flips};
  align = {aligned};
  write = folded || (rescaled && vector < {vectors}'d{kept});
  write_address = {{step == 3'd1 ? {vectors}'d0 : step == 3'd2 ? {vectors}'d1 : vector + {vectors}'d{first}, written[{we}:2]}};
  write_lane = {{written[1], written[0] ^ !row_folding}};
  write_data = step == 3'd1 ? {high_limb} : step == 3'd2 ? {low_limb} : rescaled_operand;
  normalised_valid = step == 3'd1 && round_done;
  folding = step == 3'd1;
  rescaled_valid = rescaled;
  unfolding = step == 3'd4 || step == 3'd5;
  free = drained && step == {freed};
  busy = step != 3'd0;
  done = drained && step == 3'd5;
end",
            qe = quads - 1,
            pe = pc - 1,
            se = seen - 1,
            seen_fill = 64 - seen,
            we = words - 1,
            ve = vectors - 1,
            drain = DRAIN - 1,
            last_quad = f.quads - 1,
            last_word = 4 * f.quads - 1,
            row_last = set(&|i| i.last),
            acc_less = acc - 2,
            acc_end = acc - 1,
            unused_end = SEARCH_EXTRA_BITS - 2,
            most = f.input_bits - 1,
            vector_less = f.vector_bits - 1,
            saturation_bits = SATURATION_BITS,
            row_seen = padded("row_magnitude", acc - 1, seen),
            row_gap = ROW_GAP,
            last_product = count - 1,
            magnitude = padded("magnitude", code - 1, seen),
            operand_end = operand - 1,
            raw = extended("raw_word", acc, unrounded),
            row = extended("row_word", acc, unrounded),
            a_shift = f.a_shift,
            matrix = field(2, &|i| i.matrix),
            is_low = set(&|i| i.low),
            operand_vector = field(vectors, &|i| i.operand),
            flips = set(&|i| i.flip),
            aligned = set(&|i| i.align),
            kept = operand_vectors(f.degree),
            first = first_vector(f),
            data_end = data - 1,
            data_less = data - 1,
            top = data + extra - 1,
            below = data + extra - 2,
            half = extra - 1,
            extended_operand = extended("nearest", data, operand),
        ))
    }
}

/// Verilog that sign-extends `signal` of `bits` bits to `wide` bits.
pub(super) fn extended(signal: &str, bits: usize, wide: usize) -> String {
    match wide - bits {
        0 => signal.to_string(),
        more => format!("{{{{{more}{{{signal}[{}]}}}}, {signal}}}", bits - 1),
    }
}

/// Verilog that zero-extends `signal` of `bits` bits to `wide` bits.
pub(super) fn padded(signal: &str, bits: usize, wide: usize) -> String {
    match wide - bits {
        0 => signal.to_string(),
        more => format!("{{{more}'d0, {signal}}}"),
    }
}
