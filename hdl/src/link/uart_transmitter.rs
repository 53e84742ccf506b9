//! UART transmitter: from bytes to the line.

use rust_hdl::prelude::*;

use super::phase::Phase;
use crate::wire::Wire;

/// Start bit, eight data bits, stop bit. A byte is accepted when `valid` and `ready` are both high.
#[derive(LogicBlock)]
pub struct UartTransmitter {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Synchronous reset, active high.
    pub rst: Signal<In, Bit>,
    /// The byte; valid with `valid`.
    pub data: Wire<In>,
    /// `data` is offered; held until `ready`.
    pub valid: Signal<In, Bit>,
    /// The byte is accepted in this cycle.
    pub ready: Signal<Out, Bit>,
    /// The line, high when idle.
    pub line: Signal<Out, Bit>,
    _phase: Phase,
    _state: State,
}

#[derive(Clone, Copy, Debug)]
struct State {
    left: u32,
    phase: u32,
    shift: u32,
    line: bool,
}

/// Bits from start bit to stop bit.
const BITS: u32 = 10;

impl UartTransmitter {
    /// For `baud` bit/s at a clock of `clock_hz` Hz.
    pub fn new(baud: u32, clock_hz: u32) -> Self {
        UartTransmitter {
            clk: Default::default(),
            rst: Default::default(),
            data: Wire::new(8),
            valid: Default::default(),
            ready: Default::default(),
            line: Default::default(),
            _phase: Phase::new(baud, clock_hz),
            _state: State { left: 0, phase: 0, shift: 0, line: true },
        }
    }

    fn next(&self) -> State {
        let s = self._state;
        let mut next = State { line: s.left == 0 || s.shift & 1 == 1, ..s };
        if s.left == 0 {
            next.phase = 0;
            if self.valid.val() {
                next.left = BITS;
                next.shift = 1 << (BITS - 1) | (self.data.val().number() as u32) << 1;
            }
        } else {
            let sum = s.phase + self._phase.increment;
            next.phase = sum & (2 * self._phase.half - 1);
            if sum >= 2 * self._phase.half {
                next.left = s.left - 1;
                next.shift = s.shift >> 1;
            }
        }
        if self.rst.val() {
            (next.left, next.line) = (0, true);
        }
        next
    }
}

impl Logic for UartTransmitter {
    fn update(&mut self) {
        if self.clk.pos_edge() {
            self._state = self.next();
        }
        self.line.next = self._state.line;
        self.ready.next = self._state.left == 0;
    }

    fn connect(&mut self) {
        self.ready.connect();
        self.line.connect();
    }

    fn hdl(&self) -> Verilog {
        let Phase { fraction, increment, .. } = self._phase;
        Verilog::Custom(format!(
            "\
reg [3:0] left;
reg [{end}:0] phase;
reg [{bits_end}:0] shift;
wire [{fraction}:0] sum = {{1'b0, phase}} + {width}'d{increment};
// Idle after configuration: a low line would be a start bit.
initial line = 1'b1;
always @(*) ready = left == 4'd0;
always @(posedge clk) begin
  phase <= ready ? {fraction}'d0 : sum[{end}:0];
  if (ready) shift <= {{1'b1, data, 1'b0}};
  else if (sum[{fraction}]) shift <= {{1'b1, shift[{bits_end}:1]}};
  if (rst) begin
    left <= 4'd0;
    line <= 1'b1;
  end else begin
    line <= ready || shift[0];
    if (ready) left <= valid ? 4'd{BITS} : 4'd0;
    else if (sum[{fraction}]) left <= left - 4'd1;
  end
end",
            end = fraction - 1,
            width = fraction + 1,
            bits_end = BITS - 1,
        ))
    }
}
