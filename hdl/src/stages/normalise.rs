//! Stage `normalise`: block exponent of the input, one left shift for all codes of a subarray.

use rust_hdl::prelude::*;

use crate::kernel_block;
use crate::language::{concat, Body, Builder, Expr, Kernel, Type};
use crate::primitives::{by_leading_one, count_bits};
use crate::wire::Wire;

/// `start` computes the shift from `magnitude`; it is valid two cycles later, before the first quad arrives. Quads are
/// then registered and shifted, one per cycle: the frame buffer may lie far from the shifter.
#[derive(dermis_hdl_derive::Block)]
pub struct Normalise {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Compute the shift for a new subarray.
    pub start: Signal<In, Bit>,
    /// OR of the subarray's magnitudes; valid with `start`.
    pub magnitude: Wire<In>,
    /// Four codes, `bits` each, signed; one quad per cycle.
    pub quad: Wire<In>,
    /// Four shifted codes, `bits` each, signed; two cycles after `quad`.
    pub shifted: Wire<Out>,
    /// The left shift; from two cycles after `start` until the next one.
    pub shift: Wire<Out>,
    kernel: Body,
}

kernel_block!(Normalise, clock clk, inputs [start, magnitude, quad], outputs [shifted, shift]);

impl Normalise {
    /// For codes of `bits` bits.
    pub fn new(bits: usize) -> Self {
        let block = Normalise {
            clk: Default::default(),
            start: Default::default(),
            magnitude: Wire::new(bits - 1),
            quad: Wire::new(4 * bits),
            shifted: Wire::new(4 * bits),
            shift: Wire::new(count_bits(bits)),
            kernel: Body::default(),
        };
        block.bind(kernel(bits))
    }
}

/// The left shift for codes whose magnitudes have the OR `magnitude`, one bit narrower than a code.
pub(super) fn left_shift<'k>(k: &'k Builder, magnitude: Expr<'k>) -> Expr<'k> {
    let bits = magnitude.bits() + 1;
    let width = count_bits(bits);
    k.comment("Codes that are all zero have the largest shift, as if a one followed the lowest bit.");
    let none = k.wire("none", (!magnitude.any()).repeat(width) & k.constant(width, bits as u64 - 1));
    none | by_leading_one(k, magnitude, 0..bits - 1, width, |bit| bits - 2 - bit)
}

fn kernel(bits: usize) -> Kernel {
    let k = Builder::new("normalise");
    let (start, magnitude) = (k.input("start", 1), k.input("magnitude", bits - 1));
    let quad = k.input("quad", 4 * bits);
    let shift = k.register("shift", Type::unsigned(count_bits(bits)));
    let left = k.delay("left", left_shift(&k, magnitude));
    let started = k.delay("started", start);
    k.when(started, || shift.set(left));
    let near = k.delay("near", quad);
    let lanes: Vec<Expr> = (0..4).rev().map(|lane| near.slice(lane * bits, bits).shift_left_by(*shift)).collect();
    k.delay("shifted", concat(&lanes));
    k.finish()
}

#[cfg(test)]
mod tests {
    use dermis_golden::fixed::stages::normalise;

    use super::*;
    use crate::language::testbench::{check, random_words, Reference};
    use crate::wire::Word;

    const BITS: usize = 13;

    /// The shift on its way, the shift, the shifted codes.
    #[derive(Default)]
    struct Shifts {
        computed: Option<u32>,
        shift: Option<u32>,
        codes: Option<[i64; 4]>,
        shifted: Option<Word>,
    }

    impl Reference for Shifts {
        fn outputs(&mut self, _: &[Word]) -> Vec<Option<Word>> {
            vec![self.shift.map(|shift| Word::from(u64::from(shift))), self.shifted]
        }

        fn clock(&mut self, inputs: &[Word]) {
            let shift = |(shift, codes): (u32, [i64; 4])| Word::of_fields(&codes.map(|code| code << shift), BITS);
            self.shifted = self.shift.zip(self.codes).map(shift);
            self.codes = Some([0, 1, 2, 3].map(|lane| inputs[2].signed(lane, BITS)));
            self.shift = self.computed.take().or(self.shift);
            self.computed = (inputs[0].number() == 1).then(|| normalise::shift(inputs[1].number(), BITS as u32));
        }
    }

    #[test]
    fn codes_are_shifted_until_the_largest_fills_the_word() {
        let mut stimulus = random_words(3000, &[1, BITS - 1, 4 * BITS]);
        // Magnitudes of all lengths.
        for (cycle, inputs) in stimulus.iter_mut().enumerate() {
            inputs[1] = Word::from(inputs[1].number() >> (cycle % BITS));
        }
        let block = Normalise::new(BITS);
        check(block.kernel.kernel(), &stimulus, &mut Shifts::default());
    }
}
