//! Kind and subarray of the beat that `send` requests.

use rust_hdl::prelude::*;

use crate::wire::{Wire, Word};

/// Beat 0 with the subarray of the scanned taxel, or beat `word + 1` with the subarray of the status; combinational.
#[derive(LogicBlock)]
pub struct StatusCode {
    /// Status beats are being requested, not forces.
    pub status: Signal<In, Bit>,
    /// Index of the status beat in its subarray, from 0.
    pub word: Wire<In>,
    /// Index of the subarray of the status beat.
    pub status_part: Wire<In>,
    /// Index of the subarray of the current taxel.
    pub scan_part: Wire<In>,
    /// 0: a force, 1 … 3: a status beat.
    pub beat: Wire<Out>,
    /// Index of the subarray of the beat.
    pub part: Wire<Out>,
}

impl StatusCode {
    /// For `word` of `word_bits` bits and subarray indices of `part_bits` bits.
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
