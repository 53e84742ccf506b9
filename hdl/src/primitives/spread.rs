//! One sample on all lanes of a quad, with the lanes to write.

use rust_hdl::prelude::*;

use crate::wire::{Wire, Word};

/// The sample four times, and the mask where enabled; combinational.
#[derive(LogicBlock)]
pub struct Spread {
    /// A sample.
    pub word: Wire<In>,
    /// Lanes it belongs to.
    pub mask: Wire<In>,
    /// It is to be written.
    pub enable: Signal<In, Bit>,
    /// The sample on every lane.
    pub quad: Wire<Out>,
    /// Lanes to write.
    pub write: Wire<Out>,
}

impl Spread {
    /// Samples of `bits` bits.
    pub fn new(bits: usize) -> Self {
        Spread {
            word: Wire::new(bits),
            mask: Wire::new(4),
            enable: Default::default(),
            quad: Wire::new(4 * bits),
            write: Wire::new(4),
        }
    }
}

impl Logic for Spread {
    fn update(&mut self) {
        let bits = self.word.width();
        self.quad.next = Word::of_fields(&[self.word.val().signed(0, bits); 4], bits);
        self.write.next = if self.enable.val() { self.mask.val() } else { Word::default() };
    }

    fn connect(&mut self) {
        self.quad.connect();
        self.write.connect();
    }

    fn hdl(&self) -> Verilog {
        Verilog::Custom("always @(*) quad = {4{word}};\nalways @(*) write = enable ? mask : 4'd0;".to_string())
    }
}
