//! UART receiver: from the line to bytes.

use rust_hdl::prelude::*;

use super::phase::Phase;
use crate::wire::{Wire, Word};

/// Two registers against metastability, then the majority of three samples. After a falling edge, ten bits are sampled
/// in their middle: the start bit half a bit later, which must still be low, eight data bits, and the stop bit. A byte
/// without stop bit is `broken`; the next one starts only after the line has been idle again.
///
/// `valid` and `broken` are pulses of one cycle; `data` is stable until the first data bit of the next byte.
#[derive(LogicBlock)]
pub struct UartReceiver {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Synchronous reset, active high.
    pub rst: Signal<In, Bit>,
    /// The line, high when idle; asynchronous to the clock.
    pub line: Signal<In, Bit>,
    /// The byte received last; valid with `valid`.
    pub data: Wire<Out>,
    /// A byte was received in this cycle.
    pub valid: Signal<Out, Bit>,
    /// A byte without stop bit was received in this cycle.
    pub broken: Signal<Out, Bit>,
    _phase: Phase,
    _state: State,
}

#[derive(Clone, Copy, Debug, Default)]
struct State {
    samples: u32,
    armed: bool,
    left: u32,
    phase: u32,
    data: u32,
    valid: bool,
    broken: bool,
}

/// Bits from start bit to stop bit.
const BITS: u32 = 10;

impl UartReceiver {
    /// For `baud` bit/s at a clock of `clock_hz` Hz.
    pub fn new(baud: u32, clock_hz: u32) -> Self {
        UartReceiver {
            clk: Default::default(),
            rst: Default::default(),
            line: Default::default(),
            data: Wire::new(8),
            valid: Default::default(),
            broken: Default::default(),
            _phase: Phase::new(baud, clock_hz),
            _state: State::default(),
        }
    }

    fn next(&self) -> State {
        let s = self._state;
        let level = (s.samples >> 2).count_ones() >= 2;
        let mut next =
            State { samples: (s.samples << 1 | u32::from(self.line.val())) & 0x1f, valid: false, broken: false, ..s };
        if s.left == 0 {
            next.armed = level;
            if s.armed && !level {
                next.left = BITS;
                next.phase = self._phase.half;
            }
        } else {
            let sum = s.phase + self._phase.increment;
            next.phase = sum & (2 * self._phase.half - 1);
            if sum >= 2 * self._phase.half {
                next.left = s.left - 1;
                match s.left {
                    // A glitch, not a start bit.
                    BITS if level => next.left = 0,
                    BITS => (),
                    1 => (next.valid, next.broken) = (level, !level),
                    _ => next.data = u32::from(level) << 7 | s.data >> 1,
                }
            }
        }
        if self.rst.val() {
            (next.left, next.armed, next.valid, next.broken) = (0, false, false, false);
        }
        next
    }
}

impl Logic for UartReceiver {
    fn update(&mut self) {
        if self.clk.pos_edge() {
            // The outputs are one cycle later, as in the Verilog.
            let State { data, valid, broken, .. } = self._state;
            self._state = self.next();
            self.data.next = Word::from(u64::from(data));
            self.valid.next = valid && !self.rst.val();
            self.broken.next = broken && !self.rst.val();
        }
    }

    fn connect(&mut self) {
        self.data.connect();
        self.valid.connect();
        self.broken.connect();
    }

    fn hdl(&self) -> Verilog {
        let Phase { fraction, half, increment } = self._phase;
        Verilog::Custom(format!(
            "\
reg [4:0] samples;
reg armed;
// Sampled bit, shift and stop are registered once to shorten the route to the data register.
reg sampled, shifts, stops;
reg [3:0] left;
reg [{end}:0] phase;
wire level = (samples[4] & samples[3]) | (samples[4] & samples[2]) | (samples[3] & samples[2]);
wire [{fraction}:0] sum = {{1'b0, phase}} + {width}'d{increment};
wire tick = left != 4'd0 && sum[{fraction}];
wire false_start = left == 4'd{BITS} && level;
always @(posedge clk) begin
  samples <= {{samples[3:0], line}};
  if (left == 4'd0) phase <= {fraction}'d{half};
  else phase <= sum[{end}:0];
  sampled <= level;
  shifts <= tick && left != 4'd{BITS} && left != 4'd1;
  stops <= !rst && tick && left == 4'd1;
  if (shifts) data <= {{sampled, data[7:1]}};
  valid <= !rst && stops && sampled;
  broken <= !rst && stops && !sampled;
  if (rst) begin
    left <= 4'd0;
    armed <= 1'b0;
  end else begin
    if (left == 4'd0) begin
      armed <= level;
      if (armed && !level) left <= 4'd{BITS};
    end else if (tick) left <= false_start ? 4'd0 : left - 4'd1;
  end
end",
            end = fraction - 1,
            width = fraction + 1,
        ))
    }
}
