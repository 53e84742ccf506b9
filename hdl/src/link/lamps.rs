//! Status LEDs.

use rust_hdl::prelude::*;

/// `alive` blinks about once a second; `busy` and `error` stay lit for a sixteenth to an eighth of that period after
/// their event.
#[derive(LogicBlock)]
pub struct Lamps {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Synchronous reset, active high.
    pub rst: Signal<In, Bit>,
    /// A packet is received or being answered.
    pub activity: Signal<In, Bit>,
    /// A packet was dropped in this cycle.
    pub dropped: Signal<In, Bit>,
    /// LED: blinks while the clock runs.
    pub alive: Signal<Out, Bit>,
    /// LED: lit by `activity`.
    pub busy: Signal<Out, Bit>,
    /// LED: lit by `dropped`.
    pub error: Signal<Out, Bit>,
    _bits: u32,
    _count: u32,
    _lit: [u32; 2],
}

/// The tick of the LED time is shorter than the period of `alive` by this power of two.
const SHORTER: u32 = 4;

impl Lamps {
    /// For a clock of `clock_hz` Hz.
    pub fn new(clock_hz: u32) -> Self {
        Lamps {
            clk: Default::default(),
            rst: Default::default(),
            activity: Default::default(),
            dropped: Default::default(),
            alive: Default::default(),
            busy: Default::default(),
            error: Default::default(),
            _bits: clock_hz.ilog2().max(SHORTER + 2),
            _count: 0,
            _lit: [0; 2],
        }
    }
}

impl Logic for Lamps {
    fn update(&mut self) {
        if self.clk.pos_edge() {
            let tick = (self._count + 1).trailing_zeros() >= self._bits - SHORTER;
            self._count = (self._count + 1) & ((1 << self._bits) - 1);
            for (lit, event) in self._lit.iter_mut().zip([self.activity.val(), self.dropped.val()]) {
                *lit = if event { 2 } else { lit.saturating_sub(u32::from(tick)) };
            }
            if self.rst.val() {
                (self._count, self._lit) = (0, [0; 2]);
            }
        }
        self.alive.next = self._count >> (self._bits - 1) == 1;
        self.busy.next = self._lit[0] != 0;
        self.error.next = self._lit[1] != 0;
    }

    fn connect(&mut self) {
        self.alive.connect();
        self.busy.connect();
        self.error.connect();
    }

    fn hdl(&self) -> Verilog {
        let (bits, lit) = (self._bits, self._bits - SHORTER);
        let light = |name: &str, event: &str| {
            format!(
                "  if (rst) {name}_left <= 2'd0;\n  else if ({event}) {name}_left <= 2'd2;\n  \
                 else if (tick) {name}_left <= {{1'b0, {name}_left[1]}};\n"
            )
        };
        Verilog::Custom(format!(
            "\
reg [{end}:0] count;
reg [1:0] busy_left, error_left;
wire tick = &count[{lit_end}:0];
always @(*) begin
  alive = count[{end}];
  busy = busy_left != 2'd0;
  error = error_left != 2'd0;
end
always @(posedge clk) begin
  count <= rst ? {bits}'d0 : count + {bits}'d1;
{busy}{error}end",
            end = bits - 1,
            lit_end = lit - 1,
            busy = light("busy", "activity"),
            error = light("error", "dropped"),
        ))
    }
}
