//! Magnitude and signs of a frame while its samples arrive.

use dermis_golden::fixed::arith::magnitude_bits;
use rust_hdl::prelude::*;

use crate::wire::{Wire, Word};

/// ORs the magnitudes of all accepted codes and remembers whether one lay above the noise floor or below its negative.
#[derive(LogicBlock)]
pub struct Gather {
    /// Clock.
    pub clk: Signal<In, Clock>,
    /// Forget everything.
    pub clear: Signal<In, Bit>,
    /// Take `code`.
    pub accept: Signal<In, Bit>,
    /// A code.
    pub code: Wire<In>,
    /// OR of the magnitudes, one bit narrower than a code.
    pub magnitude: Wire<Out>,
    /// A code was above the floor.
    pub positive: Signal<Out, Bit>,
    /// A code was below minus the floor.
    pub negative: Signal<Out, Bit>,
    _floor: i64,
}

impl Gather {
    /// Codes of `bits` bits, `floor` in codes.
    pub fn new(bits: usize, floor: i32) -> Self {
        Gather {
            clk: Default::default(),
            clear: Default::default(),
            accept: Default::default(),
            code: Wire::new(bits),
            magnitude: Wire::new(bits - 1),
            positive: Default::default(),
            negative: Default::default(),
            // A floor beyond the code's range is never exceeded; the range's end says the same in the code's width.
            _floor: i64::from(floor).min((1 << (bits - 1)) - 1),
        }
    }
}

impl Logic for Gather {
    fn update(&mut self) {
        if self.clk.pos_edge() {
            let code = self.code.val().signed(0, self.code.width());
            if self.clear.val() {
                self.magnitude.next = Word::default();
                self.positive.next = false;
                self.negative.next = false;
            } else if self.accept.val() {
                self.magnitude.next = Word::from(self.magnitude.val().number() | magnitude_bits(code));
                self.positive.next = self.positive.val() || code > self._floor;
                self.negative.next = self.negative.val() || code < -self._floor;
            }
        }
    }

    fn connect(&mut self) {
        self.magnitude.connect();
        self.positive.connect();
        self.negative.connect();
    }

    fn hdl(&self) -> Verilog {
        let bits = self.code.width();
        Verilog::Custom(format!(
            "\
wire signed [{end}:0] value = code;
wire signed [{end}:0] floor_code = {bits}'sd{floor};
always @(posedge clk) begin
  if (clear) begin
    magnitude <= {less}'d0;
    positive <= 1'b0;
    negative <= 1'b0;
  end else if (accept) begin
    magnitude <= magnitude | (code[{less_end}:0] ^ {{{less}{{code[{end}]}}}});
    positive <= positive || value > floor_code;
    negative <= negative || value < -floor_code;
  end
end",
            end = bits - 1,
            less = bits - 1,
            less_end = bits - 2,
            floor = self._floor,
        ))
    }
}
