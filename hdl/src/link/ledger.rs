//! Identity of the board and counters of received and dropped packets, in one memory.

use dermis_golden::link::{Counters, Identity};
use rust_hdl::prelude::*;

use crate::wire::{Wire, Word};

/// Memory of 32 entries of two bytes: the first twelve bytes of the identity from entry 0, the other twelve from 8, the
/// counters, in the order of [`Counters`], from 16.
///
/// An event of a packet is counted in the three cycles after it (read, add, write); while `hold` is high it waits,
/// because the two bytes of a counter are being read. `entry` is not valid meanwhile. Counters wrap. Reset clears one
/// counter per cycle and has to last at least eight cycles.
#[derive(LogicBlock)]
pub struct Ledger {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Synchronous reset, active high for at least eight cycles.
    pub rst: Signal<In, Bit>,
    /// A packet was accepted in this cycle.
    pub taken: Signal<In, Bit>,
    /// A packet was dropped in this cycle, one bit per cause: framing, CRC, unknown type, length.
    pub fault: Wire<In>,
    /// A packet was dropped in this cycle because earlier ones are not answered yet.
    pub overrun: Signal<In, Bit>,
    /// Counting is postponed.
    pub hold: Signal<In, Bit>,
    /// Entry to read, 5 bits.
    pub address: Wire<In>,
    /// The entry, 16 bits, one cycle after `address`.
    pub entry: Wire<Out>,
    /// `entry` is that of `address`, and no counter is changing.
    pub entry_valid: Signal<Out, Bit>,
    _identity: Vec<u8>,
    _memory: [u16; ENTRIES],
    _state: State,
}

#[derive(Clone, Copy, Debug, Default)]
struct State {
    which: usize,
    due: bool,
    /// Pipeline of a count: adding, writing, just written.
    counted: [bool; 3],
    entry: u16,
    raised: u16,
}

const ENTRIES: usize = 32;
/// Entry of the first counter.
const COUNTS: usize = 16;
/// Entries cleared by reset: the counters, and two unused ones.
const KINDS: usize = 8;
const EVENTS: usize = Counters::BYTES / 2;

impl Ledger {
    /// Answers requests for the identity with `identity`.
    pub fn new(identity: &Identity) -> Self {
        let bytes = identity.to_bytes();
        let mut memory = [0; ENTRIES];
        for (at, pair) in bytes.chunks(2).enumerate() {
            memory[at % 6 + 8 * (at / 6)] = u16::from_le_bytes([pair[0], pair[1]]);
        }
        Ledger {
            clk: Default::default(),
            rst: Default::default(),
            taken: Default::default(),
            fault: Wire::new(EVENTS - 2),
            overrun: Default::default(),
            hold: Default::default(),
            address: Wire::new(5),
            entry: Wire::new(16),
            entry_valid: Default::default(),
            _identity: bytes,
            _memory: memory,
            _state: State::default(),
        }
    }

    fn clocked(&mut self) {
        let s = self._state;
        let events = self.fault.val().number() << 1
            | u64::from(self.taken.val())
            | u64::from(self.overrun.val()) << (EVENTS - 1);
        let counts = s.due && !self.hold.val();
        let address = if counts { COUNTS + s.which } else { self.address.val().number() as usize };
        self._state.entry = self._memory[address];
        if self.rst.val() {
            self._memory[COUNTS + s.which] = 0;
        } else if s.counted[1] {
            self._memory[COUNTS + s.which] = s.raised;
        }
        self._state.raised = s.entry.wrapping_add(1);
        self._state.counted = [counts && !self.rst.val(), s.counted[0] && !self.rst.val(), s.counted[1]];
        self._state.due = (events != 0 || (s.due && !counts)) && !self.rst.val();
        if self.rst.val() {
            self._state.which = (s.which + 1) % KINDS;
        } else if events != 0 {
            self._state.which = (0..EVENTS).filter(|event| events >> event & 1 == 1).fold(0, |all, event| all | event);
        }
    }
}

impl Logic for Ledger {
    fn update(&mut self) {
        if self.clk.pos_edge() {
            self.clocked();
        }
        self.entry.next = Word::from(u64::from(self._state.entry));
        self.entry_valid.next = self._state.counted == [false; 3];
    }

    fn connect(&mut self) {
        self.entry.connect();
        self.entry_valid.connect();
    }

    fn hdl(&self) -> Verilog {
        let bit = |bit: usize| {
            let of = |event: &usize| event >> bit & 1 == 1;
            let terms: Vec<String> = (0..EVENTS).filter(of).map(|event| format!("events[{event}]")).collect();
            terms.join(" || ")
        };
        let identity: String = (self._identity.chunks(2).enumerate())
            .map(|(at, pair)| format!("  memory[{}] = 16'h{:02x}{:02x};\n", at % 6 + 8 * (at / 6), pair[1], pair[0]))
            .collect();
        Verilog::Custom(format!(
            "\
(* ram_style = \"block\", no_rw_check *)
reg [15:0] memory [0:{entries_end}];
initial begin
{identity}end
reg [2:0] which;
reg due;
// Pipeline of a count: adding, writing, just written.
reg [2:0] counted;
reg [15:0] raised;
wire [{end}:0] events = {{overrun, fault, taken}};
wire counts = due && !hold;
wire [4:0] read_address = counts ? {{2'd2, which}} : address;
always @(*) entry_valid = counted == 3'd0;
always @(posedge clk) begin
  entry <= memory[read_address];
  raised <= entry + 16'd1;
  if (rst || counted[1]) memory[{{2'd2, which}}] <= rst ? 16'd0 : raised;
  counted <= {{counted[1], counted[0] && !rst, counts && !rst}};
  due <= (|events || (due && !counts)) && !rst;
  if (rst) which <= which + 3'd1;
  else if (|events) which <= {{{high}, {middle}, {low}}};
end",
            entries_end = ENTRIES - 1,
            end = EVENTS - 1,
            high = bit(2),
            middle = bit(1),
            low = bit(0),
        ))
    }
}
