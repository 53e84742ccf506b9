//! Block exponent of v_00: the right shift that brings its largest accumulator to a full word.

use dermis_golden::fixed::arith::{bit_length, magnitude_bits};
use dermis_golden::fixed::formats::Formats;
use dermis_golden::fixed::rescale;
use rust_hdl::prelude::*;

use super::counter::count_bits;
use super::leading_one::by_leading_one;
use crate::wire::{Wire, Word};

/// ORs the magnitudes of the raw quads; `shift` is valid two cycles after the last of them.
#[derive(LogicBlock)]
pub struct RawLength {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Clears the OR for a new subarray, with priority over `accept`.
    pub clear: Signal<In, Bit>,
    /// `quad` is valid and taken in.
    pub accept: Signal<In, Bit>,
    /// Four accumulators, `acc_bits` each, signed.
    pub quad: Wire<In>,
    /// Right shift for `rescale`, of the quads so far; two cycles later.
    pub shift: Wire<Out>,
    _seen: u64,
    _formats: Formats,
}

/// Width of the right shift of `rescale`, in bits.
pub fn shift_bits(formats: &Formats) -> usize {
    count_bits(formats.acc_bits as usize)
}

impl RawLength {
    /// With the widths of `formats`.
    pub fn new(formats: &Formats) -> Self {
        RawLength {
            clk: Default::default(),
            clear: Default::default(),
            accept: Default::default(),
            quad: Wire::new(4 * formats.acc_bits as usize),
            shift: Wire::new(shift_bits(formats)),
            _seen: 0,
            _formats: formats.clone(),
        }
    }
}

impl Logic for RawLength {
    fn update(&mut self) {
        if self.clk.pos_edge() {
            self.shift.next = Word::from(u64::from(rescale::shift(&self._formats, bit_length(self._seen))));
            let bits = self._formats.acc_bits as usize;
            let magnitude = (0..4).fold(0, |m, lane| m | magnitude_bits(self.quad.val().signed(lane, bits)));
            if self.clear.val() {
                self._seen = 0;
            } else if self.accept.val() {
                self._seen |= magnitude;
            }
        }
    }

    fn connect(&mut self) {
        self.shift.connect();
    }

    fn hdl(&self) -> Verilog {
        let bits = self._formats.acc_bits as usize;
        let shift_bits = self.shift.width();
        let full = self._formats.vector_bits as usize - 1;
        let magnitudes: String = (0..4)
            .map(|lane| {
                let (low, top) = (lane * bits, lane * bits + bits - 1);
                format!(
                    "wire [{end}:0] m{lane} = quad[{before}:{low}] ^ {{{less}{{quad[{top}]}}}};\n",
                    end = bits - 2,
                    before = top - 1,
                    less = bits - 1
                )
            })
            .collect();
        let shift = by_leading_one("seen", full..bits - 1, bits - 2, shift_bits, |bit| bit + 1 - full);
        Verilog::Custom(format!(
            "\
reg [{end}:0] seen;
{magnitudes}always @(posedge clk) begin
  if (clear) seen <= {less}'d0;
  else if (accept) seen <= seen | m0 | m1 | m2 | m3;
  shift <= {shift};
end",
            end = bits - 2,
            less = bits - 1,
        ))
    }
}
