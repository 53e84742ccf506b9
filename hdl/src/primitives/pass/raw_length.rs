//! Block exponent of v_00: the right shift that brings its largest accumulator to a full word.

use dermis_golden::fixed::words::formats::Formats;

use crate::block;
use crate::language::{Block, Builder, Inside, Type};
use crate::primitives::address::counter::count_bits;
use crate::primitives::arithmetic::leading_one::by_leading_one;

block! {
    /// ORs the magnitudes of the raw quads; `shift` is valid three cycles after the last of them.
    pub struct RawLength {
        /// Width of an accumulator in bits.
        acc: usize,
        /// Length to which a word is brought, in bits without the sign.
        full: usize,
    }
    ports RawLengthPorts {
        clock;
        /// Clears the OR for a new subarray, and the quad of the cycle before with it.
        in clear;
        /// `quad` is valid and taken in.
        in accept;
        /// Four accumulators, `acc_bits` each, signed; valid with `accept`.
        in quad: 4 * acc;
        /// Right shift for `rescale`, of the quads so far; three cycles later.
        out shift: count_bits(*acc);
    }
}

/// Width of the right shift of `rescale`, in bits.
pub fn shift_bits(formats: &Formats) -> usize {
    count_bits(formats.acc_bits as usize)
}

impl RawLength {
    /// With the widths of `formats`.
    pub fn new(formats: &Formats) -> Self {
        RawLength { acc: formats.acc_bits as usize, full: formats.full_length() as usize }
    }
}

impl Block for RawLength {
    fn build<'k>(&self, k: &'k Builder, io: RawLengthPorts<Inside<'k>>) {
        let RawLength { acc, full } = *self;
        // The quad comes from an adder.
        let quad = k.delay("taken", io.quad);
        let seen = k.state("seen", Type::unsigned(acc - 1), io.clear, 0);
        let magnitude = |lane: usize| {
            let (low, sign) = (quad.slice(lane * acc, acc - 1), quad.at(lane * acc + acc - 1));
            k.wire(&format!("m{lane}"), low ^ sign.repeat(acc - 1))
        };
        let all = (0..4).map(magnitude).fold(*seen, |all, magnitude| all | magnitude);
        k.when(k.delay("accepted", io.accept), || seen.set(all));
        io.shift.delay(by_leading_one(k, *seen, full..acc - 1, io.shift.bits(), |bit| bit + 1 - full));
    }
}

#[cfg(test)]
mod tests {
    use dermis_golden::fixed::words::arith::{bit_length, magnitude_bits};

    use super::*;
    use crate::language::kernel_of;
    use crate::language::testbench::{check, Reference};
    use crate::wire::Word;

    const ACC: usize = 40;
    const FULL: usize = 23;

    /// The quad of the cycle before, the OR of the magnitudes since `clear`, and the shift one cycle later.
    #[derive(Default)]
    struct Seen {
        before: Option<(bool, u64)>,
        seen: Option<u64>,
        shift: Option<u32>,
    }

    impl Reference for Seen {
        fn outputs(&mut self, _: &[Word]) -> Vec<Option<Word>> {
            vec![self.shift.map(|shift| Word::from(u64::from(shift)))]
        }

        fn clock(&mut self, inputs: &[Word]) {
            self.shift = self.seen.map(|seen| bit_length(seen).saturating_sub(FULL as u32));
            let heeded = self.seen.zip(self.before).map(|(seen, (accept, all))| if accept { seen | all } else { seen });
            self.seen = if inputs[0].number() == 1 { Some(0) } else { heeded };
            let all = (0..4).fold(0, |all, lane| all | magnitude_bits(inputs[2].signed(lane, ACC)));
            self.before = Some((inputs[1].number() == 1, all));
        }
    }

    #[test]
    fn the_shift_brings_the_longest_word_to_full_length() {
        let mut random = fastrand::Rng::with_seed(4);
        let mut inputs = |cycle: usize| {
            // Words of all lengths.
            let scale = random.u32(0..ACC as u32 - 1);
            let quad = [(); 4].map(|()| random.i64(-(1 << scale)..1 << scale));
            let clear = cycle == 0 || random.u8(..4) == 0;
            vec![clear.into(), random.bool().into(), Word::of_fields(&quad, ACC)]
        };
        let stimulus: Vec<Vec<Word>> = (0..4000).map(&mut inputs).collect();
        let block = RawLength { acc: ACC, full: FULL };
        check(&kernel_of(&block), &stimulus, &mut Seen::default());
    }
}
