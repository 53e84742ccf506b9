//! The barrel shifter of the serial engine: right shift, rounding half up, saturation.

use dermis_golden::fixed::words::formats::FORCE_BITS;

use crate::block;
use crate::language::{concat, Block, Builder, Inside, Type};

/// Width of a shift, in bits.
pub const SHIFT_BITS: usize = 6;
const WIDE: usize = FORCE_BITS as usize;

block! {
    /// ```text
    /// word, shift, valid --> shift by eights | by ones | round | saturate --> rounded, clipped, done
    /// ```
    /// Latency four cycles. `wide` saturates to a force word, otherwise to `narrow` bits; it must not change while
    /// words are in the pipeline.
    pub struct Rounder {
        bits: usize,
        narrow: usize,
    }
    ports RounderPorts {
        clock;
        /// Word to shift, signed; taken in every cycle.
        in word: bits;
        /// Right shift; valid with `word`.
        in shift: SHIFT_BITS;
        /// `word` is valid.
        in valid;
        /// Saturate to 32 bits, not to `narrow` bits.
        in wide;
        /// The result, sign-extended to 32 bits; four cycles after `word`.
        out rounded: WIDE;
        /// `rounded` was saturated.
        out clipped;
        /// `rounded` is valid.
        out done;
    }
}

impl Rounder {
    /// For words of `bits` bits, 33..=62, saturated to `narrow` bits where `wide` is low.
    pub fn new(bits: usize, narrow: usize) -> Self {
        Rounder { bits, narrow }
    }
}

impl Block for Rounder {
    fn build<'k>(&self, k: &'k Builder, io: RounderPorts<Inside<'k>>) {
        let Rounder { bits, narrow } = *self;
        let ty = Type::signed(bits + 1);
        let eights = k.register("eights", ty).comment("An extra bit on the right keeps the half LSB for the rounding.");
        let (ones, half) = (k.register("ones", ty), k.register("half", Type::unsigned(bits + 1)));
        let (ones_shift, valids) =
            (k.register("ones_shift", Type::unsigned(3)), k.register("valids", Type::unsigned(3)));
        let rounded = io.rounded.register();
        let [clipped, done] = [io.clipped, io.done].map(|output| output.register());

        let sign = k.wire("sign", half.top());
        let copies = |bit, count: usize| concat(&vec![bit; count]);
        let beyond = |to: usize| half.slice(to, bits + 1 - to).differs(copies(sign, bits + 1 - to));
        let over = k.wire("over", io.wide.mux(beyond(WIDE), beyond(narrow)));
        eights.set(io.word.concat(k.constant(1, 0)).signed().shift_right_by(io.shift.slice(3, 3).shift_left(3)));
        ones_shift.set(io.shift.low(3));
        ones.set(eights.shift_right_by(*ones_shift));
        half.set(ones.unsigned().plus(1));
        let most = |to: usize| copies(sign, WIDE - to + 1).concat(copies(!sign, to - 1));
        rounded.set((!over).mux(half.slice(1, WIDE), io.wide.mux(most(WIDE), most(narrow))));
        clipped.set(over);
        valids.set(valids.low(2).concat(io.valid));
        done.set(valids.top());
    }
}

#[cfg(test)]
mod tests {
    use dermis_golden::fixed::words::arith::{round_shift, saturate};

    use super::*;
    use crate::language::kernel_of;
    use crate::language::testbench::{check, Reference};
    use crate::wire::Word;

    const BITS: usize = 44;
    const NARROW: usize = 20;
    const LATENCY: usize = 4;

    /// Words and shifts of the last cycles, the last one first.
    #[derive(Default)]
    struct Rounded {
        before: Vec<(i64, u32, bool)>,
        wide: bool,
    }

    impl Reference for Rounded {
        fn outputs(&mut self, _: &[Word]) -> Vec<Option<Word>> {
            let now = self.before.get(LATENCY - 1);
            let result = |&(word, shift, _): &(i64, u32, bool)| {
                saturate(round_shift(word, shift), if self.wide { WIDE } else { NARROW } as u32)
            };
            let result = now.map(result);
            vec![
                result.map(|(word, _)| Word::of_fields(&[word], WIDE)),
                result.map(|(_, clipped)| Word::from(clipped)),
                now.map(|(.., valid)| Word::from(*valid)),
            ]
        }

        fn clock(&mut self, inputs: &[Word]) {
            let [shift, valid, wide] = [1, 2, 3].map(|k| inputs[k].number());
            self.before.insert(0, (inputs[0].signed(0, BITS), shift as u32, valid == 1));
            self.before.truncate(LATENCY);
            self.wide = wide == 1;
        }
    }

    #[test]
    fn words_are_rounded_half_up_and_saturated() {
        let mut random = fastrand::Rng::with_seed(1);
        let mut wide = false;
        let cycle = |_| {
            wide ^= random.u8(..64) == 0;
            // Words of any length.
            let word = random.i64(-(1 << (BITS - 1))..1 << (BITS - 1)) >> random.usize(..BITS);
            vec![
                Word::of_fields(&[word], BITS),
                Word::from(random.u64(..63)),
                Word::from(random.bool()),
                Word::from(wide),
            ]
        };
        let all: Vec<Vec<Word>> = (0..6000).map(cycle).collect();
        check(&kernel_of(&Rounder::new(BITS, NARROW)), &all, &mut Rounded::default());
    }
}
