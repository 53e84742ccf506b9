//! The barrel shifter of the serial engine: right shift, rounding half up, saturation.

use dermis_golden::fixed::arith::{round_shift, saturate};
use dermis_golden::fixed::formats::FORCE_BITS;
use rust_hdl::prelude::*;

use crate::wire::{Wire, Word};

/// Width of a shift, in bits.
pub const SHIFT_BITS: usize = 6;
const WIDE: usize = FORCE_BITS as usize;

/// ```text
/// word, shift, valid --> shift by eights | by ones | round | saturate --> rounded, clipped, done
/// ```
/// Latency four cycles. `wide` saturates to a force word, otherwise to `narrow` bits; it must not change while words
/// are in the pipeline.
#[derive(LogicBlock)]
pub struct Rounder {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Word to shift, signed.
    pub word: Wire<In>,
    /// Right shift; valid with `word`.
    pub shift: Wire<In>,
    /// `word` is valid.
    pub valid: Signal<In, Bit>,
    /// Saturate to 32 bits, not to `narrow` bits.
    pub wide: Signal<In, Bit>,
    /// The result, sign-extended to 32 bits; four cycles after `word`.
    pub rounded: Wire<Out>,
    /// `rounded` was saturated.
    pub clipped: Signal<Out, Bit>,
    /// `rounded` is valid.
    pub done: Signal<Out, Bit>,
    _narrow: usize,
    _stages: Stages,
}

#[derive(Clone, Copy, Debug, Default)]
struct Stages {
    eights: i64,
    ones_shift: u64,
    ones: i64,
    half: i64,
    valid: [bool; 3],
}

impl Rounder {
    /// For words of `bits` bits, 33..=62, saturated to `narrow` bits where `wide` is low.
    pub fn new(bits: usize, narrow: usize) -> Self {
        Rounder {
            clk: Default::default(),
            word: Wire::new(bits),
            shift: Wire::new(SHIFT_BITS),
            valid: Default::default(),
            wide: Default::default(),
            rounded: Wire::new(WIDE),
            clipped: Default::default(),
            done: Default::default(),
            _narrow: narrow,
            _stages: Stages::default(),
        }
    }
}

impl Logic for Rounder {
    fn update(&mut self) {
        if self.clk.pos_edge() {
            let stages = self._stages;
            let bits = if self.wide.val() { WIDE } else { self._narrow };
            let (rounded, clipped) = saturate(stages.half, bits as u32);
            self.rounded.next = Word::of_fields(&[rounded], WIDE);
            self.clipped.next = clipped;
            self.done.next = stages.valid[2];
            let shift = self.shift.val().number();
            self._stages = Stages {
                // An extra bit on the right keeps the half LSB for the rounding.
                eights: (self.word.val().signed(0, self.word.width()) << 1) >> (shift & !7),
                ones_shift: shift & 7,
                ones: stages.eights >> stages.ones_shift,
                half: round_shift(stages.ones, 1),
                valid: [self.valid.val(), stages.valid[0], stages.valid[1]],
            };
        }
    }

    fn connect(&mut self) {
        self.rounded.connect();
        self.clipped.connect();
        self.done.connect();
    }

    fn hdl(&self) -> Verilog {
        let bits = self.word.width();
        let narrow = self._narrow;
        Verilog::Custom(format!(
            "\
// An extra bit on the right keeps the half LSB for the rounding.
reg signed [{bits}:0] eights, ones;
reg [{bits}:0] half;
reg [2:0] ones_shift;
reg [2:0] valids;
wire signed [{bits}:0] doubled = {{word, 1'b0}};
wire sign = half[{bits}];
wire unused = half[0];
wire over_wide = half[{bits}:{wide}] != {{{beyond_wide}{{sign}}}};
wire over_narrow = half[{bits}:{narrow}] != {{{beyond_narrow}{{sign}}}};
wire over = wide ? over_wide : over_narrow;
always @(posedge clk) begin
  eights <= doubled >>> {{shift[5:3], 3'd0}};
  ones_shift <= shift[2:0];
  ones <= eights >>> ones_shift;
  half <= ones + {{{{{bits}{{1'b0}}}}, 1'b1}};
  rounded <= !over ? half[{wide}:1]
    : wide ? {{sign, {{{wide_less}{{!sign}}}}}}
    : {{{{{fill}{{sign}}}}, {{{narrow_less}{{!sign}}}}}};
  clipped <= over;
  valids <= {{valids[1:0], valid}};
  done <= valids[2];
end",
            wide = WIDE,
            beyond_wide = bits - WIDE + 1,
            beyond_narrow = bits - narrow + 1,
            wide_less = WIDE - 1,
            narrow_less = narrow - 1,
            fill = WIDE - narrow + 1,
        ))
    }
}
