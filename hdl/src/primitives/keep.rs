//! A register with enable.

use rust_hdl::prelude::*;

use crate::wire::{Wire, Word};

/// `kept` is the value of `word` at the last clock edge at which `keep` was high.
#[derive(LogicBlock)]
pub struct Keep {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Enable: store `word` at the clock edge.
    pub keep: Signal<In, Bit>,
    /// Input word.
    pub word: Wire<In>,
    /// Stored word, from the cycle after `keep`; undefined before the first.
    pub kept: Wire<Out>,
    _value: Word,
    _constant: bool,
}

impl Keep {
    /// A register of `bits` bits.
    pub fn new(bits: usize) -> Self {
        Keep {
            clk: Default::default(),
            keep: Default::default(),
            word: Wire::new(bits),
            kept: Wire::new(bits),
            _value: Word::default(),
            _constant: false,
        }
    }

    /// With `constant`, wires in place of the register, for a word that never changes.
    pub fn constant(mut self, constant: bool) -> Self {
        self._constant = constant;
        self
    }
}

impl Logic for Keep {
    fn update(&mut self) {
        if self.clk.pos_edge() {
            if self.keep.val() {
                self._value = self.word.val();
            }
            self.kept.next = self._value;
        }
        if self._constant {
            self.kept.next = self.word.val();
        }
    }

    fn connect(&mut self) {
        self.kept.connect();
    }

    fn hdl(&self) -> Verilog {
        let text = match self._constant {
            false => "always @(posedge clk) if (keep) kept <= word;",
            true => "wire unused = &{1'b0, clk, keep};\nalways @(*) kept = word;",
        };
        Verilog::Custom(text.to_string())
    }
}
