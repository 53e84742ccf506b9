//! Taylor shift along one axis: polynomials of up to four coefficients about a centre moved by −1, 0 or 1, one
//! coefficient per cycle.

use rust_hdl::prelude::*;

use crate::wire::{Wire, Word};

/// ```text
/// word (c3, c2, c1, c0) --> s0 --> s1 --> s2 --> s3 --> moved (c0, c1, c2, c3 about the new centre)
/// ```
/// Horner's scheme as a systolic chain: register k runs k cycles behind and accumulates the values that pass it, so
/// that all four are complete when c0 has arrived. They leave in the next four cycles, each before its register
/// restarts. `element` counts the cycles of a polynomial, `top` is its degree; coefficients above the degree are
/// ignored, and the outputs in their place are undefined.
#[derive(LogicBlock)]
pub struct Horner {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Coefficient 3 − `element` of the polynomial that enters, signed.
    pub word: Wire<In>,
    /// Cycle of the polynomial, 0..=3.
    pub element: Wire<In>,
    /// Degree of the polynomial that enters.
    pub top: Wire<In>,
    /// The centre moves.
    pub moves: Signal<In, Bit>,
    /// By −1 instead of +1; valid with `moves`.
    pub down: Signal<In, Bit>,
    /// Coefficient `element` of the previous polynomial about the new centre, signed.
    pub moved: Wire<Out>,
    _stages: [i64; 4],
}

impl Horner {
    /// For coefficients of `bits` bits.
    pub fn new(bits: usize) -> Self {
        Horner {
            clk: Default::default(),
            word: Wire::new(bits),
            element: Wire::new(2),
            top: Wire::new(2),
            moves: Default::default(),
            down: Default::default(),
            moved: Wire::new(bits),
            _stages: [0; 4],
        }
    }
}

impl Logic for Horner {
    fn update(&mut self) {
        let bits = self.word.width();
        let element = self.element.val().number() as usize;
        if self.clk.pos_edge() {
            let top = self.top.val().number() as usize;
            let by = match (self.moves.val(), self.down.val()) {
                (false, _) => 0,
                (true, false) => 1,
                (true, true) => -1,
            };
            let [s0, s1, s2, _] = self._stages;
            // Register k receives coefficient 3 − element + k in this cycle.
            let incoming = [self.word.val().signed(0, bits), s0, s1, s2];
            for (k, stage) in self._stages.iter_mut().enumerate().filter(|(k, _)| *k <= element) {
                let begins = 3 + k - element == top || k == 3;
                let kept = if begins { 0 } else { by * *stage };
                *stage = Word::of_fields(&[incoming[k] + kept], bits).signed(0, bits);
            }
        }
        self.moved.next = Word::of_fields(&[self._stages[element]], bits);
    }

    fn connect(&mut self) {
        self.moved.connect();
    }

    fn hdl(&self) -> Verilog {
        let bits = self.word.width();
        let end = bits - 1;
        Verilog::Custom(format!(
            "\
reg [{end}:0] s0, s1, s2, s3;
// Zero at the start of a polynomial; complement, with a carry, where the centre moves by -1.
wire [{end}:0] kept0 = (moves && element != 2'd3 - top) ? s0 ^ {{{bits}{{down}}}} : {bits}'d0;
wire [{end}:0] kept1 = (moves && element != 2'd0 - top) ? s1 ^ {{{bits}{{down}}}} : {bits}'d0;
wire [{end}:0] kept2 = (moves && element != 2'd1 - top) ? s2 ^ {{{bits}{{down}}}} : {bits}'d0;
wire carry0 = moves && down && element != 2'd3 - top;
wire carry1 = moves && down && element != 2'd0 - top;
wire carry2 = moves && down && element != 2'd1 - top;
always @(posedge clk) begin
  s0 <= word + kept0 + {{{end}'d0, carry0}};
  if (element != 2'd0) s1 <= s0 + kept1 + {{{end}'d0, carry1}};
  if (element[1]) s2 <= s1 + kept2 + {{{end}'d0, carry2}};
  if (element == 2'd3) s3 <= s2;
end
always @(*)
  case (element)
    2'd0: moved = s0;
    2'd1: moved = s1;
    2'd2: moved = s2;
    default: moved = s3;
  endcase"
        ))
    }
}
