//! Stage `unfold`: words from the mixer to the coefficients of the taxels' polynomials, and their sum.

use dermis_golden::fixed::arith::round_shift;
use dermis_golden::fixed::formats::Formats;
use dermis_golden::fixed::schedule::{vectors, EXPONENTS};
use dermis_golden::fixed::serial::{polynomials, word_bits};
use rust_hdl::prelude::*;

use super::solve::extended;
use crate::primitives::count_bits;
use crate::wire::{Wire, Word};

/// Words of v_ij, one vector after the other, to words of the polynomial memory. Polynomial 0 is the sum, polynomial 1
/// + p the taxel at place p; coefficient v_ij of a polynomial is at 4j + i.
#[derive(LogicBlock)]
pub struct Unfold {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Synchronous reset, active high.
    pub rst: Signal<In, Bit>,
    /// A new frame.
    pub start: Signal<In, Bit>,
    /// A word from the mixer, signed; places in order.
    pub mixed: Wire<In>,
    /// `mixed` is valid.
    pub valid: Signal<In, Bit>,
    /// A taxel's coefficient, `vector_bits` + 2 wide, signed.
    pub taxel: Wire<Out>,
    /// `taxel` is valid.
    pub taxel_valid: Signal<Out, Bit>,
    /// Write `data` to the polynomial memory.
    pub write: Signal<Out, Bit>,
    /// `{0, polynomial, coefficient}`: lower region; valid with `write`.
    pub address: Wire<Out>,
    /// Coefficient of a taxel or of the sum, signed; valid with `write`.
    pub data: Wire<Out>,
    _taxels: u64,
    _vectors: usize,
    _state: State,
}

#[derive(Clone, Copy, Debug, Default)]
struct State {
    word: i64,
    valid: bool,
    place: u64,
    vector: usize,
    sum: i64,
    closing: bool,
}

impl Unfold {
    /// With the widths of `formats`; words from the mixer have `mixed` bits.
    pub fn new(formats: &Formats, mixed: usize) -> Self {
        Unfold {
            clk: Default::default(),
            rst: Default::default(),
            start: Default::default(),
            mixed: Wire::new(mixed),
            valid: Default::default(),
            taxel: Wire::new(formats.vector_bits as usize + 2),
            taxel_valid: Default::default(),
            write: Default::default(),
            address: Wire::new(1 + count_bits(polynomials(formats)) + 4),
            data: Wire::new(word_bits(formats)),
            _taxels: 4 * formats.quads as u64,
            _vectors: vectors(formats.degree),
            _state: State::default(),
        }
    }
}

/// Position 4j + i of coefficient v_ij in its polynomial.
fn code(vector: usize) -> u64 {
    let (i, j) = EXPONENTS[vector % EXPONENTS.len()];
    u64::from(4 * j + i)
}

impl Logic for Unfold {
    fn update(&mut self) {
        if self.clk.pos_edge() {
            let s = self._state;
            let (i, j) = EXPONENTS[s.vector % EXPONENTS.len()];
            let mixed = self.mixed.val().signed(0, self.mixed.width());
            let last = s.valid && s.place == self._taxels - 1;
            self._state = State {
                word: round_shift(mixed, 2 * (i + j)),
                valid: self.valid.val() && !self.rst.val(),
                place: match s.valid {
                    true if last => 0,
                    valid => s.place + u64::from(valid),
                },
                vector: s.vector + usize::from(s.closing),
                sum: if s.closing { 0 } else { s.sum + if s.valid { s.word } else { 0 } },
                closing: last,
            };
            if self.start.val() || self.rst.val() {
                self._state = State::default();
            }
        }
        let s = self._state;
        self.taxel.next = Word::of_fields(&[s.word], self.taxel.width());
        self.taxel_valid.next = s.valid;
        self.write.next = s.valid || s.closing;
        let polynomial = if s.closing { 0 } else { s.place + 1 };
        self.address.next = Word::from(polynomial << 4 | code(s.vector));
        self.data.next = Word::of_fields(&[if s.closing { s.sum } else { s.word }], self.data.width());
    }

    fn connect(&mut self) {
        [&mut self.taxel, &mut self.address, &mut self.data].into_iter().for_each(Wire::connect);
        [&mut self.taxel_valid, &mut self.write].into_iter().for_each(Signal::connect);
    }

    fn hdl(&self) -> Verilog {
        let (taxel, data, mixed) = (self.taxel.width(), self.data.width(), self.mixed.width());
        let place = self.address.width() - 5;
        let bits = count_bits(self._vectors + 1);
        let set = |of: &dyn Fn(usize) -> u64, bit: u64| {
            let terms: Vec<String> = (0..self._vectors)
                .filter(|&k| of(k) >> bit & 1 == 1)
                .map(|k| format!("vector == {bits}'d{k}"))
                .collect();
            if terms.is_empty() {
                "1'b0".to_string()
            } else {
                format!("({})", terms.join(" || "))
            }
        };
        let degree = |k: usize| u64::from(EXPONENTS[k].0 + EXPONENTS[k].1);
        Verilog::Custom(format!(
            "\
reg [{taxel_end}:0] word;
reg valid_then, closing;
reg [{pe}:0] polynomial;
reg [{be}:0] vector;
reg [{de}:0] sum;
wire last = valid_then && polynomial == {place}'d{taxels};
wire [1:0] degree = {{{degree1}, {degree0}}};
// An extra bit on the right keeps the half LSB for the rounding.
wire signed [{mixed}:0] doubled = {{mixed, 1'b0}};
wire signed [{mixed}:0] shifted = doubled >>> {{degree, 1'b0}};
wire [{mixed}:0] half = shifted + {{{mixed}'d0, 1'b1}};
wire [{de}:0] wider = {wider};
wire unused = &{{1'b0, half[0]{beyond}}};
always @(posedge clk) begin
  word <= half[{taxel}:1];
  valid_then <= valid && !rst;
  closing <= last && !rst;
  if (valid_then) polynomial <= last ? {place}'d1 : polynomial + {place}'d1;
  if (closing) vector <= vector + {bits}'d1;
  if (closing) sum <= {data}'d0;
  else if (valid_then) sum <= sum + wider;
  if (start || rst) begin
    polynomial <= {place}'d1;
    vector <= {bits}'d0;
    sum <= {data}'d0;
  end
end
always @(*) begin
  taxel = word;
  taxel_valid = valid_then;
  write = valid_then || closing;
  address = {{1'b0, closing ? {place}'d0 : polynomial, {code3}, {code2}, {code1}, {code0}}};
  data = closing ? sum : wider;
end",
            taxel_end = taxel - 1,
            beyond = if mixed > taxel { format!(", half[{mixed}:{}]", taxel + 1) } else { String::new() },
            pe = place - 1,
            be = bits - 1,
            de = data - 1,
            taxels = self._taxels,
            degree1 = set(&degree, 1),
            degree0 = set(&degree, 0),
            wider = extended("word", taxel, data),
            code3 = set(&code, 3),
            code2 = set(&code, 2),
            code1 = set(&code, 1),
            code0 = set(&code, 0),
        ))
    }
}
