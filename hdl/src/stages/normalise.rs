//! Stage `normalise`: block floating point on the input, one left shift for all codes of a subarray.

use dermis_golden::fixed::normalise;
use rust_hdl::prelude::*;

use crate::primitives::{by_leading_one, count_bits};
use crate::wire::{Wire, Word};

/// `start` takes the shift from `magnitude`; then one quad per cycle is shifted (`shifted`, one cycle later).
#[derive(LogicBlock)]
pub struct Normalise {
    /// Clock.
    pub clk: Signal<In, Clock>,
    /// Take the shift.
    pub start: Signal<In, Bit>,
    /// OR of the subarray's magnitudes.
    pub magnitude: Wire<In>,
    /// Four codes.
    pub quad: Wire<In>,
    /// The codes shifted, one cycle later.
    pub shifted: Wire<Out>,
    /// The left shift, held until the next start.
    pub shift: Wire<Out>,
}

impl Normalise {
    /// Codes of `bits` bits.
    pub fn new(bits: usize) -> Self {
        Normalise {
            clk: Default::default(),
            start: Default::default(),
            magnitude: Wire::new(bits - 1),
            quad: Wire::new(4 * bits),
            shifted: Wire::new(4 * bits),
            shift: Wire::new(count_bits(bits)),
        }
    }
}

impl Logic for Normalise {
    fn update(&mut self) {
        if self.clk.pos_edge() {
            let bits = self.quad.width() / 4;
            if self.start.val() {
                let shift = normalise::shift(self.magnitude.val().number(), bits as u32);
                self.shift.next = Word::from(u64::from(shift));
            }
            let shift = self.shift.val().number();
            let shifted: [i64; 4] = std::array::from_fn(|lane| self.quad.val().signed(lane, bits) << shift);
            self.shifted.next = Word::of_fields(&shifted, bits);
        }
    }

    fn connect(&mut self) {
        self.shifted.connect();
        self.shift.connect();
    }

    fn hdl(&self) -> Verilog {
        let bits = self.quad.width() / 4;
        let shift_bits = self.shift.width();
        let shifts: String = (0..4)
            .map(|lane| format!("  shifted[{lane} * {bits} +: {bits}] <= quad[{lane} * {bits} +: {bits}] << shift;\n"))
            .collect();
        let left = by_leading_one("magnitude", 0..bits - 1, bits - 2, shift_bits, |bit| bits - 2 - bit);
        Verilog::Custom(format!(
            "\
// Zeros stay zero, whatever the shift: as if the first place behind them were set.
wire [{shift_end}:0] none = {{{shift_bits}{{!(|magnitude)}}}} & {shift_bits}'d{most};
wire [{shift_end}:0] left = {left};
always @(posedge clk) begin
  if (start) shift <= left | none;
{shifts}end",
            shift_end = shift_bits - 1,
            most = bits - 1,
        ))
    }
}
