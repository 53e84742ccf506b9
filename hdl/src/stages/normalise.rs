//! Stage `normalise`: block exponent of the input, one left shift for all codes of a subarray.

use dermis_golden::fixed::normalise;
use rust_hdl::prelude::*;

use crate::primitives::{by_leading_one, count_bits};
use crate::wire::{Wire, Word};

/// `start` computes the shift from `magnitude`; it is valid two cycles later, before the first quad arrives. Quads are
/// then shifted one per cycle, each with a latency of one cycle.
#[derive(LogicBlock)]
pub struct Normalise {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Compute the shift for a new subarray.
    pub start: Signal<In, Bit>,
    /// OR of the subarray's magnitudes; valid with `start`.
    pub magnitude: Wire<In>,
    /// Four codes, `bits` each, signed.
    pub quad: Wire<In>,
    /// Four shifted codes, one cycle after `quad`.
    pub shifted: Wire<Out>,
    /// The left shift, from two cycles after `start` until the next one.
    pub shift: Wire<Out>,
    _left: u32,
    _started: bool,
}

impl Normalise {
    /// For codes of `bits` bits.
    pub fn new(bits: usize) -> Self {
        Normalise {
            clk: Default::default(),
            start: Default::default(),
            magnitude: Wire::new(bits - 1),
            quad: Wire::new(4 * bits),
            shifted: Wire::new(4 * bits),
            shift: Wire::new(count_bits(bits)),
            _left: 0,
            _started: false,
        }
    }
}

impl Logic for Normalise {
    fn update(&mut self) {
        if self.clk.pos_edge() {
            let bits = self.quad.width() / 4;
            if self._started {
                self.shift.next = Word::from(u64::from(self._left));
            }
            self._left = normalise::shift(self.magnitude.val().number(), bits as u32);
            self._started = self.start.val();
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
        let first = by_leading_one("magnitude", 0..bits - 1, bits - 2, shift_bits, |bit| bits - 2 - bit);
        Verilog::Custom(format!(
            "\
// An all-zero subarray has the largest shift, as if a one followed the lowest bit.
wire [{shift_end}:0] none = {{{shift_bits}{{!(|magnitude)}}}} & {shift_bits}'d{most};
reg [{shift_end}:0] left;
reg started;
always @(posedge clk) begin
  left <= none | {first};
  started <= start;
  if (started) shift <= left;
{shifts}end",
            shift_end = shift_bits - 1,
            most = bits - 1,
        ))
    }
}
