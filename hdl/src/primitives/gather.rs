//! Magnitude and signs of each subarray, gathered while the frame arrives.

use dermis_golden::fixed::arith::magnitude_bits;
use dermis_golden::fixed::receive::Received;
use rust_hdl::prelude::*;

use super::counter::count_bits;
use crate::wire::{Wire, Word};

/// For each subarray: the OR of the magnitudes of its accepted codes, and whether any code was above the noise floor or
/// below its negative. `select` chooses the subarray whose values are on the outputs.
#[derive(LogicBlock)]
pub struct Gather {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Clears the values of all subarrays, with priority over `accept`.
    pub clear: Signal<In, Bit>,
    /// `code` and `part` are valid and taken in.
    pub accept: Signal<In, Bit>,
    /// A code, `bits` wide, two's complement.
    pub code: Wire<In>,
    /// Index of the code's subarray.
    pub part: Wire<In>,
    /// Index of the subarray on the outputs; combinational.
    pub select: Wire<In>,
    /// OR of the ones' complement magnitudes of subarray `select`, one bit narrower than a code.
    pub magnitude: Wire<Out>,
    /// A code of subarray `select` was above the noise floor.
    pub positive: Signal<Out, Bit>,
    /// A code of subarray `select` was below minus the noise floor.
    pub negative: Signal<Out, Bit>,
    _floor: i64,
    _parts: Vec<Received>,
}

impl Gather {
    /// For codes of `bits` bits, a noise floor of `floor` codes and `parts` subarrays.
    pub fn new(bits: usize, floor: i32, parts: usize) -> Self {
        Gather {
            clk: Default::default(),
            clear: Default::default(),
            accept: Default::default(),
            code: Wire::new(bits),
            part: Wire::new(count_bits(parts)),
            select: Wire::new(count_bits(parts)),
            magnitude: Wire::new(bits - 1),
            positive: Default::default(),
            negative: Default::default(),
            // A floor beyond the code's range is clamped to its end, which no code exceeds either.
            _floor: i64::from(floor).min((1 << (bits - 1)) - 1),
            _parts: vec![Received::default(); parts],
        }
    }
}

impl Logic for Gather {
    fn update(&mut self) {
        if self.clk.pos_edge() {
            let code = self.code.val().signed(0, self.code.width());
            let floor = self._floor;
            if self.clear.val() {
                self._parts.fill(Received::default());
            } else if self.accept.val() {
                if let Some(seen) = self._parts.get_mut(self.part.val().number() as usize) {
                    seen.magnitude |= magnitude_bits(code);
                    seen.positive |= code > floor;
                    seen.negative |= code < -floor;
                }
            }
        }
        let seen = self._parts.get(self.select.val().number() as usize).copied().unwrap_or_default();
        self.magnitude.next = Word::from(seen.magnitude);
        self.positive.next = seen.positive;
        self.negative.next = seen.negative;
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
reg [{less_end}:0] magnitudes [0:{last}];
reg positives [0:{last}];
reg negatives [0:{last}];
integer i;
always @(posedge clk) begin
  if (clear) begin
    for (i = 0; i <= {last}; i = i + 1) begin
      magnitudes[i] <= {less}'d0;
      positives[i] <= 1'b0;
      negatives[i] <= 1'b0;
    end
  end else if (accept) begin
    magnitudes[part] <= magnitudes[part] | (code[{less_end}:0] ^ {{{less}{{code[{end}]}}}});
    positives[part] <= positives[part] || value > floor_code;
    negatives[part] <= negatives[part] || value < -floor_code;
  end
end
always @(*) begin
  magnitude = magnitudes[select];
  positive = positives[select];
  negative = negatives[select];
end",
            last = self._parts.len() - 1,
            end = bits - 1,
            less = bits - 1,
            less_end = bits - 2,
            floor = self._floor,
        ))
    }
}
