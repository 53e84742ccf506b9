//! Which beat is asked for, and of which subarray.

use rust_hdl::prelude::*;

use crate::wire::{Wire, Word};

/// Beat 0 of the scanned taxel's subarray, or beat `word + 1` of a status; combinational.
#[derive(LogicBlock)]
pub struct StatusCode {
    /// Status beats are asked for.
    pub status: Signal<In, Bit>,
    /// Word of the status.
    pub word: Wire<In>,
    /// Subarray of the status.
    pub status_part: Wire<In>,
    /// Subarray of the taxel.
    pub scan_part: Wire<In>,
    /// 0: a force; 1 … 3: a status beat.
    pub beat: Wire<Out>,
    /// The beat's subarray.
    pub part: Wire<Out>,
}

impl StatusCode {
    /// Words of `word_bits` bits, subarrays of `part_bits` bits.
    pub fn new(word_bits: usize, part_bits: usize) -> Self {
        StatusCode {
            status: Default::default(),
            word: Wire::new(word_bits),
            status_part: Wire::new(part_bits),
            scan_part: Wire::new(part_bits),
            beat: Wire::new(2),
            part: Wire::new(part_bits),
        }
    }
}

impl Logic for StatusCode {
    fn update(&mut self) {
        let status = self.status.val();
        self.beat.next = Word::from(if status { self.word.val().number() + 1 } else { 0 });
        self.part.next = if status { self.status_part.val() } else { self.scan_part.val() };
    }

    fn connect(&mut self) {
        self.beat.connect();
        self.part.connect();
    }

    fn hdl(&self) -> Verilog {
        Verilog::Custom(
            "always @(*) beat = status ? word + 2'd1 : 2'd0;\nalways @(*) part = status ? status_part : scan_part;"
                .to_string(),
        )
    }
}
