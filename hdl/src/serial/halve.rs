//! Divides a coefficient by a power of two when the grid step is halved.

use rust_hdl::prelude::*;

use crate::wire::{Wire, Word};

/// `halved` is ⌊word / 2^halvings⌋, one cycle later.
#[derive(LogicBlock)]
pub struct Halve {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// A coefficient, signed.
    pub word: Wire<In>,
    /// Right shift, 2 bits.
    pub halvings: Wire<In>,
    /// The shifted coefficient, signed; one cycle later.
    pub halved: Wire<Out>,
    /// Low bits of `halved`: a taxel's value p(μ*), signed.
    pub value: Wire<Out>,
}

impl Halve {
    /// For coefficients of `bits` bits and values of `value` bits.
    pub fn new(bits: usize, value: usize) -> Self {
        Halve {
            clk: Default::default(),
            word: Wire::new(bits),
            halvings: Wire::new(2),
            halved: Wire::new(bits),
            value: Wire::new(value),
        }
    }
}

impl Logic for Halve {
    fn update(&mut self) {
        let bits = self.word.width();
        if self.clk.pos_edge() {
            let halved = self.word.val().signed(0, bits) >> self.halvings.val().number();
            self.halved.next = Word::of_fields(&[halved], bits);
        }
        self.value.next = Word::of_fields(&[self.halved.val().signed(0, bits)], self.value.width());
    }

    fn connect(&mut self) {
        self.halved.connect();
        self.value.connect();
    }

    fn hdl(&self) -> Verilog {
        let end = self.word.width() - 1;
        Verilog::Custom(format!(
            "\
wire signed [{end}:0] number = word;
always @(posedge clk) halved <= number >>> halvings;
always @(*) value = halved[{}:0];",
            self.value.width() - 1
        ))
    }
}
