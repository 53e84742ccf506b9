//! Halves a coefficient as often as its powers say.

use rust_hdl::prelude::*;

use crate::wire::{Wire, Word};

/// `halved` is ⌊word / 2^halvings⌋, a cycle later.
#[derive(LogicBlock)]
pub struct Halve {
    /// Clock.
    pub clk: Signal<In, Clock>,
    /// A coefficient.
    pub word: Wire<In>,
    /// How often.
    pub halvings: Wire<In>,
    /// The quotient.
    pub halved: Wire<Out>,
    /// Its low bits: a taxel's value.
    pub value: Wire<Out>,
}

impl Halve {
    /// Coefficients of `bits` bits, values of `value`.
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
