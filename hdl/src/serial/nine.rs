//! The nine candidates about a centre, computed from the coefficients of a polynomial as they arrive.
//!
//! Coefficient (i, j) arrives in cycle 4i + j. Even and odd powers of x are summed separately, for y = +1 and for y =
//! −1:
//! ```text
//! U, V = Σ over even i of (±1)^j w_ij        p(±1,  1) = U ± M        p(0,  1) = U before i = 2
//! M, N = Σ over odd  i of (±1)^j w_ij        p(±1, −1) = V ± N        p(0, −1) = V before i = 2
//! H = w00 + w20,  G = w10 + w30              p(±1,  0) = H ± G        p(0,  0) = U after w00
//! ```
//! One candidate leaves in each of the cycles 1, 4, 5, 13, 14, 15 and, of the previous polynomial, 0, 2, 3.

use dermis_golden::fixed::formats::Formats;
use dermis_golden::fixed::serial::word_bits;
use rust_hdl::prelude::*;

use crate::wire::{Wire, Word};

/// Schedule in the module docs; `value` and `index` are registered, one cycle after the sums.
#[derive(LogicBlock)]
pub struct Nine {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// A coefficient, signed.
    pub word: Wire<In>,
    /// Cycle of the polynomial, 4i + j.
    pub cycle: Wire<In>,
    /// Bit 0: the polynomial that arrives is to be evaluated; bit 1: so was the previous one.
    pub present: Wire<In>,
    /// Bit 0: the polynomial that arrives is the sum polynomial; bit 1: the previous one was.
    pub sums: Wire<In>,
    /// A candidate's value p, signed.
    pub value: Wire<Out>,
    /// Index of the candidate, 3(y + 1) + x + 1; valid with `valid`.
    pub index: Wire<Out>,
    /// `value` is valid.
    pub valid: Signal<Out, Bit>,
    /// `value` belongs to the sum polynomial; valid with `valid`.
    pub sum: Signal<Out, Bit>,
    _degree: usize,
    _sums: Sums,
}

#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    u: i64,
    v: i64,
    m: i64,
    n: i64,
    a: i64,
    h: i64,
    g: i64,
}

/// By cycle: index of the candidate that leaves, and whether it belongs to the previous polynomial.
const LEAVES: [Option<(u64, bool)>; 16] = {
    let mut leaves = [None; 16];
    leaves[1] = Some((4, false));
    leaves[4] = Some((7, false));
    leaves[5] = Some((1, false));
    leaves[13] = Some((8, false));
    leaves[14] = Some((6, false));
    leaves[15] = Some((2, false));
    leaves[0] = Some((0, true));
    leaves[2] = Some((5, true));
    leaves[3] = Some((3, true));
    leaves
};

impl Nine {
    /// With the widths and the degree of `formats`.
    pub fn new(formats: &Formats) -> Self {
        let bits = word_bits(formats);
        Nine {
            clk: Default::default(),
            word: Wire::new(bits),
            cycle: Wire::new(4),
            present: Wire::new(2),
            sums: Wire::new(2),
            value: Wire::new(bits),
            index: Wire::new(4),
            valid: Default::default(),
            sum: Default::default(),
            _degree: formats.degree,
            _sums: Sums::default(),
        }
    }
}

impl Logic for Nine {
    fn update(&mut self) {
        if self.clk.pos_edge() {
            let bits = self.word.width();
            let cycle = self.cycle.val().number() as usize;
            let word = self.word.val().signed(0, bits);
            let s = self._sums;
            let value = match cycle {
                13 => s.u + s.m,
                14 => s.u - s.m,
                15 => s.v + s.n,
                0 => s.v - s.n,
                2 => s.h + s.g,
                3 => s.h - s.g,
                5 => s.v,
                _ => s.u,
            };
            self.value.next = Word::of_fields(&[value], bits);
            let (index, before) = LEAVES[cycle].unwrap_or_default();
            self.index.next = Word::from(index);
            let which = usize::from(before);
            self.valid.next = LEAVES[cycle].is_some() && self.present.val().field(which, 1) == 1;
            self.sum.next = self.sums.val().field(which, 1) == 1;

            let (i, j) = (cycle / 4, cycle % 4);
            let signed = if j % 2 == 1 { -word } else { word };
            let sums = &mut self._sums;
            match cycle {
                0 => (sums.u, sums.v, sums.a) = (word, word, word),
                4 => (sums.m, sums.n, sums.g) = (word, word, word),
                _ if i + j <= self._degree && i % 2 == 0 => (sums.u, sums.v) = (s.u + word, s.v + signed),
                _ if i + j <= self._degree => (sums.m, sums.n) = (s.m + word, s.n + signed),
                _ => {}
            }
            if cycle == 8 {
                sums.h = s.a + if self._degree >= 2 { word } else { 0 };
            }
            if cycle == 12 && self._degree >= 3 {
                sums.g = s.g + word;
            }
        }
    }

    fn connect(&mut self) {
        [&mut self.value, &mut self.index].into_iter().for_each(Wire::connect);
        [&mut self.valid, &mut self.sum].into_iter().for_each(Signal::connect);
    }

    fn hdl(&self) -> Verilog {
        let bits = self.word.width();
        let end = bits - 1;
        let cubic = if self._degree >= 3 { " || cycle == 4'd12" } else { "" };
        let h = if self._degree >= 2 { "a + word" } else { "a" };
        let most = self._degree;
        Verilog::Custom(format!(
            "\
reg [{end}:0] u, v, m, n, a, h, g;
wire [2:0] power = {{1'b0, cycle[3:2]}} + {{1'b0, cycle[1:0]}};
wire counts = power <= 3'd{most};
wire even = !cycle[2];
wire begins_even = cycle == 4'd0;
// Term of the alternating sums V and N: complemented where j is odd, with a carry.
wire [{end}:0] term = word ^ {{{bits}{{cycle[0]}}}};
wire [{end}:0] carry = {{{end}'d0, cycle[0]}};
wire [{end}:0] base = (cycle == 4'd2 || cycle == 4'd3) ? h : (cycle == 4'd5 || cycle == 4'd15 || cycle == 4'd0) ? v : u;
wire [{end}:0] part = (cycle == 4'd2 || cycle == 4'd3) ? g : (cycle == 4'd15 || cycle == 4'd0) ? n : m;
wire alone = cycle == 4'd1 || cycle == 4'd4 || cycle == 4'd5;
wire negate = cycle == 4'd14 || cycle == 4'd0 || cycle == 4'd3;
wire [{end}:0] other = alone ? {bits}'d0 : part ^ {{{bits}{{negate}}}};
wire from_before = cycle == 4'd0 || cycle == 4'd2 || cycle == 4'd3;
wire leaves = from_before || alone || cycle >= 4'd13;
always @(posedge clk) begin
  // Cleared when the last candidate has left, so that the adder needs no gate at the start of a polynomial.
  if (cycle == 4'd15) u <= {bits}'d0;
  else if (even && counts) u <= u + word;
  if (even && counts) v <= (begins_even ? {bits}'d0 : v) + term + carry;
  if (cycle == 4'd3) m <= {bits}'d0;
  else if (!even && counts) m <= m + word;
  if (cycle == 4'd3) n <= {bits}'d0;
  else if (!even && counts) n <= n + term + carry;
  if (begins_even) a <= word;
  if (cycle == 4'd8) h <= {h};
  if (cycle == 4'd3) g <= {bits}'d0;
  else if (cycle == 4'd4{cubic}) g <= g + word;
  value <= base + other + {{{end}'d0, negate}};
  index <= {{cycle == 4'd13,
    cycle == 4'd1 || cycle == 4'd4 || cycle == 4'd14 || cycle == 4'd2,
    cycle == 4'd4 || cycle == 4'd14 || cycle == 4'd15 || cycle == 4'd3,
    cycle == 4'd4 || cycle == 4'd5 || cycle == 4'd2 || cycle == 4'd3}};
  valid <= leaves && (from_before ? present[1] : present[0]);
  sum <= from_before ? sums[1] : sums[0];
end"
        ))
    }
}
