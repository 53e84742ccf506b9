//! The low bits of a word.

use rust_hdl::prelude::*;

use crate::wire::{Wire, Word};

/// The least significant bits of a wider word; combinational.
#[derive(LogicBlock)]
pub struct Slice {
    /// Input word.
    pub word: Wire<In>,
    /// Its low bits.
    pub low: Wire<Out>,
}

impl Slice {
    /// The low `low` bits of words of `bits` bits.
    pub fn new(bits: usize, low: usize) -> Self {
        Slice { word: Wire::new(bits), low: Wire::new(low) }
    }
}

impl Logic for Slice {
    fn update(&mut self) {
        let mut low = Word::default();
        for at in (0..self.low.width()).step_by(64) {
            let part = (self.low.width() - at).min(64);
            low.set(at, part, self.word.val().field(at, part));
        }
        self.low.next = low;
    }

    fn connect(&mut self) {
        self.low.connect();
    }

    fn hdl(&self) -> Verilog {
        let end = self.low.width() - 1;
        Verilog::Custom(if self.low.width() == self.word.width() {
            "always @(*) low = word;".to_string()
        } else {
            format!("always @(*) low = word[{end}:0];\nwire unused = &{{1'b0, word}};")
        })
    }
}
