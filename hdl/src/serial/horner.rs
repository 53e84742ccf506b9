//! Half a Taylor shift: polynomials of up to four coefficients about a centre moved by −1, 0 or 1, a coefficient a cycle.

use rust_hdl::prelude::*;

use crate::wire::{Wire, Word};

/// ```text
/// word (c3, c2, c1, c0) --> s0 --> s1 --> s2 --> s3 --> moved (c0, c1, c2, c3 about the new centre)
/// ```
/// Horner's scheme, systolic: register k runs k cycles behind and adds what passes it, so that all four are ready when c0 has come
/// in. They leave during the next four cycles, each before it begins anew. `element` counts a polynomial's cycles,
/// `top` is its degree; coefficients beyond it are not looked at, and what leaves in their place means nothing.
#[derive(LogicBlock)]
pub struct Horner {
    /// Clock.
    pub clk: Signal<In, Clock>,
    /// Coefficient 3 − element.
    pub word: Wire<In>,
    /// The cycle.
    pub element: Wire<In>,
    /// Degree of the polynomial that comes in.
    pub top: Wire<In>,
    /// The centre moves.
    pub moves: Signal<In, Bit>,
    /// By −1.
    pub down: Signal<In, Bit>,
    /// Coefficient `element` of the polynomial before.
    pub moved: Wire<Out>,
    _stages: [i64; 4],
}

impl Horner {
    /// Coefficients of `bits` bits.
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
            // Of the coefficients that reach register k in this cycle: 3 − element + k.
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
// Zero where a polynomial begins, complement and carry where the centre moves down.
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
