//! Reset after configuration and from a button.

use rust_hdl::prelude::*;

/// `rst` is high for eighteen cycles after configuration, and while the button is held. Relies on the register values
/// after configuration.
#[derive(LogicBlock, Default)]
pub struct PowerOn {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// The button, high when held; asynchronous to the clock.
    pub button: Signal<In, Bit>,
    /// Reset, active high, registered.
    pub rst: Signal<Out, Bit>,
    _held: [bool; 2],
    _count: u32,
    _over: [bool; 2],
}

/// Last value of the count; reset ends three cycles later.
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
// Registered once more: `rst` has long routes, the count is placed near the button.
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
