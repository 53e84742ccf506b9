//! Copies a sample to all lanes of a quad, with the write enables of the lanes.

use rust_hdl::prelude::*;

use crate::wire::{Wire, Word};

/// The sample on all four lanes, and the mask gated by `enable`; combinational.
#[derive(LogicBlock)]
pub struct Spread {
    /// A sample of `bits` bits.
    pub word: Wire<In>,
    /// Lanes the sample is written to, one bit each.
    pub mask: Wire<In>,
    /// Write in this cycle.
    pub enable: Signal<In, Bit>,
    /// The sample on each of the four lanes.
    pub quad: Wire<Out>,
    /// Write enable of each lane.
    pub write: Wire<Out>,
}

impl Spread {
    /// For samples of `bits` bits.
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
