//! Reset after configuration and from a button.

use rust_hdl::prelude::*;

/// `rst` for sixteen cycles after the device is configured, and as long as the button is held. Relies on
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
}

/// Cycles of reset, without the last.
const LAST: u32 = 15;

impl Logic for PowerOn {
    fn update(&mut self) {
        if self.clk.pos_edge() {
            self._count = if self._held[1] { 0 } else { (self._count + 1).min(LAST) };
            self._held = [self.button.val(), self._held[0]];
        }
        self.rst.next = self._count != LAST;
    }

    fn connect(&mut self) {
        self.rst.connect();
    }

    fn hdl(&self) -> Verilog {
        Verilog::Custom(format!(
            "\
reg [1:0] held = 2'd0;
reg [3:0] count = 4'd0;
always @(*) rst = count != 4'd{LAST};
always @(posedge clk) begin
  held <= {{held[0], button}};
  if (held[1]) count <= 4'd0;
  else if (rst) count <= count + 4'd1;
end"
        ))
    }
}
