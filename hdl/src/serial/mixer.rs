//! The Hadamard butterfly of the serial engine, for `fold` and `unfold`: a quad enters in four cycles and leaves in
//! four.

use rust_hdl::prelude::*;

use crate::wire::{Wire, Word};

/// ```text
/// word, valid (four of a quad) --> four accumulators --> mixed, one after the other
/// ```
/// Accumulator p adds (−1)^{p·l} times word l, as [`hadamard`](dermis_golden::fixed::arith::hadamard). The first sum
/// leaves in the cycle after the last word; the next quad may start when the fourth has left.
#[derive(LogicBlock)]
pub struct Mixer {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Synchronous reset, active high.
    pub rst: Signal<In, Bit>,
    /// A word of a quad, signed; lanes in order.
    pub word: Wire<In>,
    /// `word` is valid.
    pub valid: Signal<In, Bit>,
    /// All four sums; valid with `quad_valid`.
    pub quad: Wire<Out>,
    /// The first of the four sums leaves in this cycle.
    pub quad_valid: Signal<Out, Bit>,
    /// One sum, two bits wider than a word, signed.
    pub mixed: Wire<Out>,
    /// `mixed` is valid.
    pub mixed_valid: Signal<Out, Bit>,
    _sums: [i64; 4],
    _taken: u64,
    _given: u64,
    _giving: bool,
}

impl Mixer {
    /// For words of `bits` bits; sums have two more.
    pub fn new(bits: usize) -> Self {
        Mixer {
            clk: Default::default(),
            rst: Default::default(),
            word: Wire::new(bits),
            valid: Default::default(),
            quad: Wire::new(4 * (bits + 2)),
            quad_valid: Default::default(),
            mixed: Wire::new(bits + 2),
            mixed_valid: Default::default(),
            _sums: [0; 4],
            _taken: 0,
            _given: 0,
            _giving: false,
        }
    }
}

impl Logic for Mixer {
    fn update(&mut self) {
        if self.clk.pos_edge() {
            let lane = self._taken;
            let word = self.word.val().signed(0, self.word.width());
            if self._giving && self._given == 3 {
                self._sums = [0; 4];
            } else if self.valid.val() {
                for (parity, sum) in self._sums.iter_mut().enumerate() {
                    let odd = (parity as u64 & lane).count_ones() % 2 == 1;
                    *sum += if odd { -word } else { word };
                }
            }
            let last = self.valid.val() && lane == 3;
            self._given = if self._giving { (self._given + 1) % 4 } else { 0 };
            self._giving = (last || (self._giving && self._given != 0)) && !self.rst.val();
            self._taken = if self.rst.val() { 0 } else { (self._taken + u64::from(self.valid.val())) % 4 };
            if self.rst.val() {
                self._given = 0;
                self._sums = [0; 4];
            }
        }
        let bits = self.mixed.width();
        self.quad.next = Word::of_fields(&self._sums, bits);
        self.quad_valid.next = self._giving && self._given == 0;
        self.mixed.next = Word::of_fields(&[self._sums[self._given as usize]], bits);
        self.mixed_valid.next = self._giving;
    }

    fn connect(&mut self) {
        self.quad.connect();
        self.quad_valid.connect();
        self.mixed.connect();
        self.mixed_valid.connect();
    }

    fn hdl(&self) -> Verilog {
        let (bits, end) = (self.mixed.width(), self.mixed.width() - 1);
        let word_end = self.word.width() - 1;
        let odd = ["1'b0", "taken[0]", "taken[1]", "taken[0] ^ taken[1]"];
        let sums: String = (0..4)
            .map(|parity| {
                let odd = odd[parity];
                format!("  else if (valid) sum{parity} <= ({odd}) ? sum{parity} - wider : sum{parity} + wider;\n")
            })
            .enumerate()
            .map(|(parity, add)| format!("  if (rst || (giving && given == 2'd3)) sum{parity} <= {bits}'d0;\n{add}"))
            .collect();
        Verilog::Custom(format!(
            "\
reg [{end}:0] sum0, sum1, sum2, sum3;
reg [1:0] taken, given;
reg giving;
wire [{end}:0] wider = {{{{2{{word[{word_end}]}}}}, word}};
always @(posedge clk) begin
{sums}  taken <= rst ? 2'd0 : taken + {{1'b0, valid}};
  given <= rst || !giving ? 2'd0 : given + 2'd1;
  giving <= ((valid && taken == 2'd3) || (giving && given != 2'd3)) && !rst;
end
always @(*) begin
  quad = {{sum3, sum2, sum1, sum0}};
  quad_valid = giving && given == 2'd0;
  case (given)
    2'd0: mixed = sum0;
    2'd1: mixed = sum1;
    2'd2: mixed = sum2;
    default: mixed = sum3;
  endcase
  mixed_valid = giving;
end"
        ))
    }
}
