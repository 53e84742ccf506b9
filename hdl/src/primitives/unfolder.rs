//! Parities of a v_ij back to taxels, scaled to the units of the search.

use dermis_golden::fixed::arith::{hadamard, round_shift};
use dermis_golden::fixed::schedule::EXPONENTS;
use rust_hdl::prelude::*;

use super::butterfly::Butterfly;
use super::counter::count_bits;
use crate::wire::{Wire, Word};

/// Butterfly, then v_ij / 4^(i+j), rounded half up: taxels two cycles after their parities.
#[derive(LogicBlock)]
pub struct Unfolder {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Four parities of a v_ij, signed.
    pub quad: Wire<In>,
    /// Index of the v_ij, one cycle after `quad`.
    pub index: Wire<In>,
    /// Four taxels, two bits wider, signed; two cycles after `quad`.
    pub taxels: Wire<Out>,
    _sums: [i64; 4],
    _vectors: usize,
}

impl Unfolder {
    /// For parities of `bits` bits of `vectors` v_ij.
    pub fn new(bits: usize, vectors: usize) -> Self {
        Unfolder {
            clk: Default::default(),
            quad: Wire::new(4 * bits),
            index: Wire::new(count_bits(vectors)),
            taxels: Wire::new(4 * (bits + 2)),
            _sums: [0; 4],
            _vectors: vectors,
        }
    }

    fn shift(&self, index: usize) -> u32 {
        EXPONENTS.get(index).map_or(0, |(i, j)| 2 * (i + j))
    }
}

impl Logic for Unfolder {
    fn update(&mut self) {
        if self.clk.pos_edge() {
            let bits = self.quad.width() / 4;
            let shift = self.shift(self.index.val().number() as usize);
            self.taxels.next = Word::of_fields(&self._sums.map(|sum| round_shift(sum, shift)), bits + 2);
            self._sums = hadamard(std::array::from_fn(|lane| self.quad.val().signed(lane, bits)));
        }
    }

    fn connect(&mut self) {
        self.taxels.connect();
    }

    fn hdl(&self) -> Verilog {
        let bits = self.quad.width() / 4;
        let wide = bits + 2;
        let index_bits = self.index.width();
        let cases: String = (0..self._vectors)
            .map(|index| format!("    {index_bits}'d{index}: amount = 3'd{};\n", self.shift(index)))
            .collect();
        let Verilog::Custom(butterfly) = Butterfly::new(bits).hdl() else { return Verilog::Empty };
        Verilog::Custom(format!(
            "\
reg [{all_end}:0] sums;
{butterfly}
reg [2:0] amount;
always @(*) begin
  case (index)
{cases}    default: amount = 3'd0;
  endcase
end
genvar l;
generate
  for (l = 0; l < 4; l = l + 1) begin : lane
    wire signed [{wide}:0] doubled = {{sums[l * {wide} +: {wide}], 1'b0}};
    wire signed [{wide}:0] moved = doubled >>> amount;
    wire [{wide1}:0] half_up = {{moved[{wide}], moved}} + {wide2}'d1;
    always @(posedge clk) taxels[l * {wide} +: {wide}] <= half_up[{wide}:1];
    wire unused = &{{1'b0, half_up[{wide1}], half_up[0]}};
  end
endgenerate",
            all_end = 4 * wide - 1,
            wide1 = wide + 1,
            wide2 = wide + 2,
        ))
    }
}
