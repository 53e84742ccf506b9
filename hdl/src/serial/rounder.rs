//! The barrel shifter of the serial engine: right shift, rounding half up, saturation.

use dermis_golden::fixed::words::formats::FORCE_BITS;
use rust_hdl::prelude::*;

use crate::kernel_block;
use crate::language::{concat, Body, Builder, Kernel, Type};
use crate::wire::Wire;

/// Width of a shift, in bits.
pub const SHIFT_BITS: usize = 6;
const WIDE: usize = FORCE_BITS as usize;

/// ```text
/// word, shift, valid --> shift by eights | by ones | round | saturate --> rounded, clipped, done
/// ```
/// Latency four cycles. `wide` saturates to a force word, otherwise to `narrow` bits; it must not change while words
/// are in the pipeline.
#[derive(dermis_hdl_derive::Block)]
pub struct Rounder {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Word to shift, signed; taken in every cycle.
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
    kernel: Body,
}

kernel_block!(Rounder, clock clk, inputs [word, shift, valid, wide], outputs [rounded, clipped, done]);

impl Rounder {
    /// For words of `bits` bits, 33..=62, saturated to `narrow` bits where `wide` is low.
    pub fn new(bits: usize, narrow: usize) -> Self {
        let block = Rounder {
            clk: Default::default(),
            word: Wire::new(bits),
            shift: Wire::new(SHIFT_BITS),
            valid: Default::default(),
            wide: Default::default(),
            rounded: Wire::new(WIDE),
            clipped: Default::default(),
            done: Default::default(),
            kernel: Body::default(),
        };
        block.bind(kernel(bits, narrow))
    }
}

fn kernel(bits: usize, narrow: usize) -> Kernel {
    let k = Builder::new("rounder");
    let (word, shift) = (k.input("word", bits), k.input("shift", SHIFT_BITS));
    let (valid, wide) = (k.input("valid", 1), k.input("wide", 1));
    let ty = Type::signed(bits + 1);
    let eights = k.register("eights", ty).comment("An extra bit on the right keeps the half LSB for the rounding.");
    let (ones, half) = (k.register("ones", ty), k.register("half", Type::unsigned(bits + 1)));
    let (ones_shift, valids) = (k.register("ones_shift", Type::unsigned(3)), k.register("valids", Type::unsigned(3)));
    let rounded = k.register("rounded", Type::unsigned(WIDE));
    let [clipped, done] = ["clipped", "done"].map(|name| k.register(name, Type::unsigned(1)));

    let sign = k.wire("sign", half.top());
    let copies = |bit, count: usize| concat(&vec![bit; count]);
    let beyond = |to: usize| half.slice(to, bits + 1 - to).differs(copies(sign, bits + 1 - to));
    let over = k.wire("over", wide.mux(beyond(WIDE), beyond(narrow)));
    eights.set(word.concat(k.constant(1, 0)).signed().shift_right_by(shift.slice(3, 3).shift_left(3)));
    ones_shift.set(shift.low(3));
    ones.set(eights.shift_right_by(*ones_shift));
    half.set(ones.unsigned().plus(1));
    let most = |to: usize| copies(sign, WIDE - to + 1).concat(copies(!sign, to - 1));
    rounded.set((!over).mux(half.slice(1, WIDE), wide.mux(most(WIDE), most(narrow))));
    clipped.set(over);
    valids.set(valids.low(2).concat(valid));
    done.set(valids.top());
    k.finish()
}

#[cfg(test)]
mod tests {
    use dermis_golden::fixed::words::arith::{round_shift, saturate};

    use super::*;
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
        check(Rounder::new(BITS, NARROW).kernel.kernel(), &all, &mut Rounded::default());
    }
}
