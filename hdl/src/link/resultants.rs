//! From the engine's beats to the words of an answer: all beats, or sums and status.

use rust_hdl::prelude::*;

use super::super::primitives::count_bits;
use super::Shape;
use crate::wire::{Wire, Word};
use dermis_golden::link::Sums;

/// While `run`, beats pass as words; without resultants in the `shape` that is all. With `summarise`, the forces are
/// added up, and four words of sums go out before the status beats. No multiplier is needed: for Σ column · fz, the sum
/// of the fz to the left of each taxel is subtracted, and at the end Σ fz is added columns − 1 times, once per cycle;
/// likewise for rows.
#[derive(LogicBlock)]
pub struct Resultants {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Synchronous reset, active high.
    pub rst: Signal<In, Bit>,
    /// An answer to a frame is being sent.
    pub run: Signal<In, Bit>,
    /// The word is accepted in this cycle.
    pub taken: Signal<In, Bit>,
    /// The answer consists of sums and status; constant during an answer.
    pub summarise: Signal<In, Bit>,
    /// A beat of the engine, 96 bits; valid with `beat_valid`.
    pub beat: Wire<In>,
    /// `beat` is offered; held until `beat_ready`.
    pub beat_valid: Signal<In, Bit>,
    /// The beat is its frame's last; valid with `beat_valid`.
    pub beat_last: Signal<In, Bit>,
    /// The beat is accepted in this cycle. Registered where sums are computed, so that the packer's logic is not in the
    /// path of a fast engine: a beat that is a word then stays for two cycles after its word was accepted.
    pub beat_ready: Signal<Out, Bit>,
    /// A word of the payload, 96 bits; valid with `word_valid`.
    pub word: Wire<Out>,
    /// `word` is offered; held until `taken`.
    pub word_valid: Signal<Out, Bit>,
    /// The word is the payload's last; valid with `word_valid`.
    pub word_last: Signal<Out, Bit>,
    _shape: Shape,
    _bits: usize,
    _state: State,
}

#[derive(Clone, Copy, Debug, Default)]
struct State {
    stage: usize,
    row: usize,
    col: usize,
    more: usize,
    out: usize,
    line: i64,
    sums: Sums,
    /// `beat_ready`, separately for beats that are added and beats that pass.
    adding: bool,
    passing: bool,
    /// The word was accepted in the previous cycle.
    taken: bool,
}

const ADD: usize = 0;
const FINISH: usize = 1;
const OUT: usize = 2;
const STATUS: usize = 3;
/// Number of words of the sums.
const WORDS: usize = 4;
/// Number of sums.
const COUNT: usize = 6;

impl Resultants {
    /// For the array of `shape`.
    pub fn new(shape: &Shape) -> Self {
        Resultants {
            clk: Default::default(),
            rst: Default::default(),
            run: Default::default(),
            taken: Default::default(),
            summarise: Default::default(),
            beat: Wire::new(96),
            beat_valid: Default::default(),
            beat_last: Default::default(),
            beat_ready: Default::default(),
            word: Wire::new(96),
            word_valid: Default::default(),
            word_last: Default::default(),
            // Every intermediate sum is at most the largest force word times taxels times the longer side.
            _bits: 32 + count_bits(shape.rows * shape.cols + 1) + count_bits(shape.rows.max(shape.cols)),
            _shape: shape.clone(),
            _state: State::default(),
        }
    }

    fn passes(&self) -> bool {
        !self._shape.resultants || !self.summarise.val() || self._state.stage == STATUS
    }

    fn add(&mut self) {
        let [fx, fy, fz] = [0, 1, 2].map(|axis| self.beat.val().signed(axis, 32));
        let (rows, cols) = (self._shape.rows, self._shape.cols);
        let s = &mut self._state;
        if s.row == 0 && s.col == 0 {
            s.sums = Sums::default();
        }
        if s.col == 0 {
            s.sums.moment_y -= s.sums.fz;
            s.line = fz;
        } else {
            s.sums.moment_x -= s.line;
            s.line += fz;
        }
        s.sums.fx += fx;
        s.sums.fy += fy;
        s.sums.fz += fz;
        s.sums.loaded += u64::from(fz != 0);
        s.more = 0;
        s.out = 0;
        s.col += 1;
        if s.col == cols {
            (s.col, s.row) = (0, s.row + 1);
        }
        if s.row == rows {
            (s.row, s.stage) = (0, FINISH);
        }
    }

    fn advance(&mut self) {
        let (rows, cols) = (self._shape.rows, self._shape.cols);
        let old = self._state;
        let adds = old.adding && self.beat_valid.val();
        let at_end = old.row + 1 == rows && old.col + 1 == cols;
        let run = self.run.val() && !self.rst.val();
        self._state.adding = run && !self.passes() && old.stage == ADD && !(adds && at_end);
        self._state.passing = self._shape.resultants && !self.rst.val() && self.passes() && old.taken;
        self._state.taken = self.taken.val() && !self.rst.val();
        if adds {
            self.add();
        } else if self._state.stage == FINISH {
            let s = &mut self._state;
            s.sums.moment_x += if s.more + 1 < cols { s.sums.fz } else { 0 };
            s.sums.moment_y += if s.more + 1 < rows { s.sums.fz } else { 0 };
            s.more += 1;
            if s.more == rows.max(cols) {
                s.stage = OUT;
            }
        } else if self._state.stage == OUT && old.taken {
            self._state.out += 1;
            if self._state.out == WORDS {
                self._state.stage = STATUS;
            }
        } else if old.passing && self.beat_valid.val() && self.beat_last.val() {
            self._state.stage = ADD;
        }
        if self.rst.val() {
            (self._state.stage, self._state.row, self._state.col) = (ADD, 0, 0);
        }
    }
}

impl Logic for Resultants {
    fn update(&mut self) {
        if self.clk.pos_edge() {
            self.advance();
        }
        let s = self._state;
        let stands = if self.passes() { self.beat_valid.val() } else { s.stage == OUT };
        self.word_valid.next = self.run.val() && stands && !s.passing;
        self.beat_ready.next = match self._shape.resultants {
            true => s.adding || s.passing,
            false => self.run.val() && self.taken.val(),
        };
        self.word_last.next = self.passes() && self.beat_last.val();
        self.word.next = if self.passes() {
            self.beat.val()
        } else {
            let mut all = Word::default();
            for (index, bytes) in s.sums.to_bytes().chunks(8).enumerate() {
                let sum = bytes.iter().rev().fold(0, |sum, &byte| sum << 8 | u64::from(byte));
                all.set(64 * index, 64, sum);
            }
            let mut word = Word::default();
            word.set(0, 48, all.field(96 * s.out.min(WORDS - 1), 48));
            word.set(48, 48, all.field(96 * s.out.min(WORDS - 1) + 48, 48));
            word
        };
    }

    fn connect(&mut self) {
        for bit in [&mut self.beat_ready, &mut self.word_valid, &mut self.word_last] {
            bit.connect();
        }
        self.word.connect();
    }

    fn hdl(&self) -> Verilog {
        if !self._shape.resultants {
            return Verilog::Custom(
                "\
wire unused = &{1'b0, clk, rst, summarise};
always @(*) begin
  beat_ready = run && taken;
  word_valid = run && beat_valid;
  word_last = beat_last;
  word = beat;
end"
                .to_string(),
            );
        }
        let (rows, cols, bits) = (self._shape.rows, self._shape.cols, self._bits);
        let (r, c, m) = (count_bits(rows), count_bits(cols), count_bits(rows.max(cols)));
        let l = count_bits(rows * cols + 1);
        let sums: Vec<String> = ["moment_y", "moment_x", "sum_z", "sum_y", "sum_x"]
            .iter()
            .map(|sum| format!("{{{{{}{{{sum}[{}]}}}}, {sum}}}", 64 - bits, bits - 1))
            .collect();
        Verilog::Custom(format!(
            "\
reg [1:0] stage, out;
// beat_ready, separately for beats that are added and beats that pass.
reg adding, passing;
// Registered to shorten the route from the packer; meanwhile the CRC processes the last byte of the word.
reg was_taken;
reg [{r_end}:0] row;
reg [{c_end}:0] col;
reg [{m_end}:0] more;
reg [{end}:0] sum_x, sum_y, sum_z, moment_x, moment_y, line;
reg [{l_end}:0] loaded;
wire [{end}:0] x = {{{{{wider}{{beat[31]}}}}, beat[31:0]}};
wire [{end}:0] y = {{{{{wider}{{beat[63]}}}}, beat[63:32]}};
wire [{end}:0] z = {{{{{wider}{{beat[95]}}}}, beat[95:64]}};
wire [{all_end}:0] all = {{{l_more}'d0, loaded, {sums}}};
wire passes = !summarise || stage == 2'd{STATUS};
wire line_end = col == {c}'d{last_col};
wire first = row == {r}'d0 && col == {c}'d0;
always @(*) begin
  beat_ready = adding || passing;
  word_valid = run && (passes ? beat_valid && !passing : stage == 2'd{OUT});
  word_last = passes && beat_last;
  word = passes ? beat : out[1] ? (out[0] ? all[383:288] : all[287:192]) : (out[0] ? all[191:96] : all[95:0]);
end
wire adds = adding && beat_valid;
wire at_end = line_end && row == {r}'d{last_row};
always @(posedge clk) begin
  adding <= !rst && run && !passes && stage == 2'd{ADD} && !(adds && at_end);
  passing <= !rst && passes && was_taken;
  was_taken <= !rst && taken;
  if (adds) begin
    sum_x <= first ? x : sum_x + x;
    sum_y <= first ? y : sum_y + y;
    sum_z <= first ? z : sum_z + z;
    loaded <= (first ? {l}'d0 : loaded) + {{{l_less}'d0, beat[95:64] != 32'd0}};
    line <= col == {c}'d0 ? z : line + z;
    moment_x <= first ? {bits}'d0 : col == {c}'d0 ? moment_x : moment_x - line;
    moment_y <= first ? {bits}'d0 : col == {c}'d0 ? moment_y - sum_z : moment_y;
    more <= {m}'d0;
    out <= 2'd0;
  end
  if (stage == 2'd{FINISH}) begin
    if (more < {m}'d{last_col}) moment_x <= moment_x + sum_z;
    if (more < {m}'d{last_row}) moment_y <= moment_y + sum_z;
    more <= more + {m}'d1;
  end
  if (stage == 2'd{OUT} && was_taken) out <= out + 2'd1;
  if (rst) begin
    stage <= 2'd{ADD};
    row <= {r}'d0;
    col <= {c}'d0;
  end else begin
    if (adds) begin
      col <= line_end ? {c}'d0 : col + {c}'d1;
      if (line_end) row <= at_end ? {r}'d0 : row + {r}'d1;
      if (at_end) stage <= 2'd{FINISH};
    end else if (stage == 2'd{FINISH}) begin
      if (more == {m}'d{last_more}) stage <= 2'd{OUT};
    end else if (stage == 2'd{OUT} && was_taken) begin
      if (out == 2'd3) stage <= 2'd{STATUS};
    end else if (passing && beat_valid && beat_last) stage <= 2'd{ADD};
  end
end",
            r_end = r - 1,
            c_end = c - 1,
            m_end = m - 1,
            end = bits - 1,
            l_end = l - 1,
            wider = bits - 32,
            all_end = 64 * COUNT - 1,
            l_more = 64 - l,
            l_less = l - 1,
            sums = sums.join(", "),
            last_col = cols - 1,
            last_row = rows - 1,
            last_more = rows.max(cols) - 1,
        ))
    }
}
