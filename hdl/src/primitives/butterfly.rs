//! The four-point Hadamard butterfly, registered.

use dermis_golden::fixed::arith::hadamard;
use rust_hdl::prelude::*;

use crate::wire::{Wire, Word};

/// Four signed fields in, their Hadamard transform one cycle later: four signed sums, two bits wider.
#[derive(LogicBlock)]
pub struct Butterfly {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Four signed fields of `bits` bits, one per taxel of the quad.
    pub quad: Wire<In>,
    /// Four signed sums of `bits + 2` bits, field p = parity p; one cycle after `quad`.
    pub sums: Wire<Out>,
}

impl Butterfly {
    /// Fields of `bits` bits.
    pub fn new(bits: usize) -> Self {
        Butterfly { clk: Default::default(), quad: Wire::new(4 * bits), sums: Wire::new(4 * (bits + 2)) }
    }
}

impl Logic for Butterfly {
    fn update(&mut self) {
        if self.clk.pos_edge() {
            let bits = self.quad.width() / 4;
            let quad = std::array::from_fn(|lane| self.quad.val().signed(lane, bits));
            self.sums.next = Word::of_fields(&hadamard(quad), bits + 2);
        }
    }

    fn connect(&mut self) {
        self.sums.connect();
    }

    fn hdl(&self) -> Verilog {
        let bits = self.quad.width() / 4;
        let end = bits + 1;
        let extended: String = (0..4)
            .map(|lane| {
                let (top, low) = ((lane + 1) * bits - 1, lane * bits);
                format!("wire [{end}:0] x{lane} = {{{{2{{quad[{top}]}}}}, quad[{top}:{low}]}};\n")
            })
            .collect();
        Verilog::Custom(format!(
            "\
{extended}always @(posedge clk) begin
  sums <= {{
    x0 - x1 - x2 + x3,
    x0 + x1 - x2 - x3,
    x0 - x1 + x2 - x3,
    x0 + x1 + x2 + x3
  }};
end"
        ))
    }
}
