//! Stage `normalise`: block exponent of the input, one left shift for all codes of a subarray.

use crate::block;
use crate::language::{concat, Block, Builder, Expr, Inside};
use crate::primitives::{by_leading_one, count_bits};

block! {
    /// `start` computes the shift from `magnitude`; it is valid two cycles later, before the first quad arrives. Quads are
    /// then registered and shifted, one per cycle: the frame buffer may lie far from the shifter.
    pub struct Normalise {
        /// Width of a code.
        bits: usize,
    }
    ports NormalisePorts {
        clock;
        /// Compute the shift for a new subarray.
        in start;
        /// OR of the subarray's magnitudes; valid with `start`.
        in magnitude: bits - 1;
        /// Four codes, `bits` each, signed; one quad per cycle.
        in quad: 4 * bits;
        /// Four shifted codes, `bits` each, signed; two cycles after `quad`.
        out shifted: 4 * bits;
        /// The left shift; from two cycles after `start` until the next one.
        out shift: count_bits(*bits);
    }
}

impl Normalise {
    /// For codes of `bits` bits.
    pub fn new(bits: usize) -> Self {
        Normalise { bits }
    }
}

impl Block for Normalise {
    fn build<'k>(&self, k: &'k Builder, io: NormalisePorts<Inside<'k>>) {
        let shift = io.shift.register();
        let left = k.delay("left", left_shift(k, io.magnitude));
        let started = k.delay("started", io.start);
        k.when(started, || shift.set(left));
        let near = k.delay("near", io.quad);
        let lane = |lane: usize| near.slice(lane * self.bits, self.bits).shift_left_by(*shift);
        io.shifted.delay(concat(&[3, 2, 1, 0].map(lane)));
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

#[cfg(test)]
mod tests {
    use dermis_golden::fixed::stages::normalise;

    use super::*;
    use crate::language::kernel_of;
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
        check(&kernel_of(&block), &stimulus, &mut Shifts::default());
    }
}
