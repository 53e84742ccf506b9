//! Reset after configuration and from a button.

use rust_hdl::prelude::*;

/// `rst` for eighteen cycles after the device is configured, and as long as the button is held. Relies on
/// the value that a register has after configuration.
#[derive(LogicBlock, Default)]
pub struct PowerOn {
    /// Clock.
    pub clk: Signal<In, Clock>,
    /// The button, high when held.
    pub button: Signal<In, Bit>,
    /// Reset.
    pub rst: Signal<Out, Bit>,
    _held: [bool; 2],
    _count: u32,
    _over: [bool; 2],
}

/// Where the count ends: cycles of reset, without the last three.
const LAST: u32 = 15;

impl Logic for PowerOn {
    fn update(&mut self) {
        if self.clk.pos_edge() {
            self._over = [self._count == LAST, self._over[0]];
            self._count = if self._held[1] { 0 } else { (self._count + 1).min(LAST) };
            self._held = [self.button.val(), self._held[0]];
        }
        self.rst.next = !self._over[1];
    }

    fn connect(&mut self) {
        self.rst.connect();
    }

    fn hdl(&self) -> Verilog {
        Verilog::Custom(format!(
            "\
reg [1:0] held = 2'd0;
reg [3:0] count = 4'd0;
// From a register of its own: it goes everywhere, the count stays by the button.
reg counting = 1'b1;
initial rst = 1'b1;
always @(posedge clk) begin
  counting <= count != 4'd{LAST};
  rst <= counting;
  held <= {{held[0], button}};
  if (held[1]) count <= 4'd0;
  else if (count != 4'd{LAST}) count <= count + 4'd1;
end"
        ))
    }
}
