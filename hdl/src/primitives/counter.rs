//! A counter from 0 to `limit − 1` that wraps.

pub use dermis_golden::fixed::resources::count_bits;
use rust_hdl::prelude::*;

use crate::wire::{Wire, Word};

/// ```text
/// clear, enable --> value, last
/// ```
/// `enable` steps at the clock edge, from `limit − 1` back to 0; `clear` has priority. `last` is high while the value
/// is `limit − 1`.
#[derive(LogicBlock)]
pub struct Counter {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Sets the count to 0 at the clock edge, with priority over `enable`.
    pub clear: Signal<In, Bit>,
    /// Steps the count at the clock edge.
    pub enable: Signal<In, Bit>,
    /// The count, 0..`limit`, unsigned.
    pub value: Wire<Out>,
    /// The count is `limit − 1`; combinational.
    pub last: Signal<Out, Bit>,
    _limit: u64,
}

impl Counter {
    /// Counts 0..`limit`; a `limit` of 0 is taken as 1.
    pub fn new(limit: usize) -> Self {
        Counter {
            clk: Default::default(),
            clear: Default::default(),
            enable: Default::default(),
            value: Wire::new(count_bits(limit)),
            last: Default::default(),
            _limit: limit.max(1) as u64,
        }
    }
}

impl Logic for Counter {
    fn update(&mut self) {
        if self.clk.pos_edge() {
            let value = self.value.val().number();
            self.value.next = match (self.clear.val(), self.enable.val()) {
                (true, _) => Word::default(),
                (false, true) if value == self._limit - 1 => Word::default(),
                (false, true) => Word::from(value + 1),
                (false, false) => self.value.val(),
            };
        }
        self.last.next = self.value.val().number() == self._limit - 1;
    }

    fn connect(&mut self) {
        self.value.connect();
        self.last.connect();
    }

    fn hdl(&self) -> Verilog {
        let bits = self.value.width();
        let end = self._limit - 1;
        Verilog::Custom(format!(
            "\
always @(*) last = value == {bits}'d{end};
always @(posedge clk) begin
  if (clear) value <= {bits}'d0;
  else if (enable) value <= last ? {bits}'d0 : value + {bits}'d1;
end"
        ))
    }
}
