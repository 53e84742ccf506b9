//! Counts packets taken and dropped.

use dermis_golden::link::Counters;
use rust_hdl::prelude::*;

use crate::wire::{Wire, Word};

/// One counter per event, in order of [`Counters`]; each wraps.
#[derive(LogicBlock)]
pub struct Tally {
    /// Clock.
    pub clk: Signal<In, Clock>,
    /// Reset.
    pub rst: Signal<In, Bit>,
    /// A packet is taken.
    pub taken: Signal<In, Bit>,
    /// One is dropped: framing, CRC, unknown type, length.
    pub fault: Wire<In>,
    /// One is dropped because others are not answered yet.
    pub overrun: Signal<In, Bit>,
    /// The counts.
    pub counts: Wire<Out>,
    _counts: [u16; COUNT],
}

const COUNT: usize = Counters::BYTES / 2;

impl Default for Tally {
    fn default() -> Self {
        Tally {
            clk: Default::default(),
            rst: Default::default(),
            taken: Default::default(),
            fault: Wire::new(COUNT - 2),
            overrun: Default::default(),
            counts: Wire::new(16 * COUNT),
            _counts: [0; COUNT],
        }
    }
}

impl Logic for Tally {
    fn update(&mut self) {
        if self.clk.pos_edge() {
            let faults = self.fault.val().number();
            let events = u64::from(self.overrun.val()) << (COUNT - 1) | faults << 1 | u64::from(self.taken.val());
            for (event, count) in self._counts.iter_mut().enumerate() {
                *count = if self.rst.val() { 0 } else { count.wrapping_add((events >> event & 1) as u16) };
            }
            self.counts.next = Word::of_fields(&self._counts.map(i64::from), 16);
        }
    }

    fn connect(&mut self) {
        self.counts.connect();
    }

    fn hdl(&self) -> Verilog {
        Verilog::Custom(format!(
            "\
wire [{end}:0] events = {{overrun, fault, taken}};
integer event_index;
always @(posedge clk) begin
  for (event_index = 0; event_index < {COUNT}; event_index = event_index + 1)
    counts[event_index * 16 +: 16] <= rst ? 16'd0 : counts[event_index * 16 +: 16] + {{15'd0, events[event_index]}};
end",
            end = COUNT - 1,
        ))
    }
}
