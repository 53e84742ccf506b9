//! Accumulators to words: shift, round, saturate, count saturations.

use dermis_golden::fixed::words::formats::{Formats, SEARCH_EXTRA_BITS};

use crate::block;
use crate::language::{concat, Block, Builder, Expr, Inside, Type};
use crate::primitives::address::counter::count_bits;
use crate::primitives::arithmetic::half_up::rounded;

block! {
    /// A quad of accumulators: if `measured`, `raw` shifted right by `shift`, otherwise `quad` by the constant shift of an A
    /// pass.
    ///
    /// `words` follow three cycles later, `operands` (the same rounded and saturated to `data_bits`) four. `saturations`
    /// counts the saturated words of valid quads since `clear`; it includes a quad two cycles after its `words`.
    pub struct Rescaler {
        /// Width of an accumulator of v_00.
        acc: usize,
        /// Width of an accumulator of an A pass.
        lane: usize,
        /// Width of a word.
        word: usize,
        /// Width of an operand.
        data: usize,
        /// Shift of an A pass.
        a_shift: u32,
    }
    ports RescalerPorts {
        clock;
        /// Sets `saturations` to 0.
        in clear;
        /// There is a row; otherwise its saturations are not counted.
        in valid;
        /// The row is `raw`, to be shifted by `shift`.
        in measured;
        /// Measured right shift; valid with `measured`.
        in shift: count_bits(*acc);
        /// Four accumulators of v_00, `acc_bits` each, signed; valid with `measured`.
        in raw: 4 * acc;
        /// Four accumulators of an A pass, `lane_bits` each, signed; valid with `valid` while `measured` is low.
        in quad: 4 * lane;
        /// Four v_ij, `vector_bits` each, signed; three cycles after the row.
        out words: 4 * word;
        /// Four operands, `data_bits` each, signed; four cycles after the row.
        out operands: 4 * data;
        /// Number of saturated words since `clear`, 16 bits, stays at the largest count; includes a row five cycles after
        /// it.
        out saturations: SATURATION_BITS;
    }
}

/// Width of a saturation counter, in bits.
pub const SATURATION_BITS: usize = 16;

impl Rescaler {
    /// With the widths of `formats`.
    pub fn new(formats: &Formats) -> Self {
        Rescaler {
            acc: formats.acc_bits as usize,
            lane: formats.lane_bits as usize,
            word: formats.vector_bits as usize,
            data: formats.data_bits as usize,
            a_shift: formats.a_shift,
        }
    }

    /// Word, operand and saturation of one accumulator.
    fn lane<'k>(&self, k: &'k Builder, code: Expr<'k>, amount: Expr<'k>) -> [Expr<'k>; 3] {
        // One copy per lane: the lanes are placed far apart, near the MAC lanes that feed them.
        let copy = k.register("amount", amount.ty()).keep();
        copy.set(amount);
        // One bit below the LSB is kept, so that adding one and dropping it rounds half up.
        let moved = k.delay("moved", k.wire("doubled", code.signed().shift_left(1)).shift_right_by(*copy));
        let (half_up, clips) = rounded(k, moved, self.word);
        let clipped = k.wire("clipped", clips);
        let most = moved.top().concat((!moved.top()).repeat(self.word - 1));
        let word = k.delay("word", clipped.mux(most, half_up));
        [word, operand_of(k, word, self.data), clipped]
    }
}

impl Block for Rescaler {
    fn build<'k>(&self, k: &'k Builder, io: RescalerPorts<Inside<'k>>) {
        let extended = |lane: usize| io.quad.slice(lane * self.lane, self.lane).signed().extend(self.acc);
        let row = io.measured.mux(io.raw, concat(&[3, 2, 1, 0].map(extended)));
        let taken = k.delay("taken", row);
        let valid2 = k.delay("valid2", k.delay("valid1", io.valid));
        let amount = io.measured.mux(io.shift, k.constant(io.shift.bits(), self.a_shift.into()));
        let lane = |lane: usize| {
            let code = taken.slice(lane * self.acc, self.acc);
            k.scope(&format!("lane_{lane}"), || self.lane(k, code, amount))
        };
        let lanes: Vec<[Expr; 3]> = (0..4).rev().map(lane).collect();
        let [words, operands, clipped] =
            [0, 1, 2].map(|n| concat(&lanes.iter().map(|lane| lane[n]).collect::<Vec<_>>()));
        io.words.set(words);
        io.operands.set(operands);

        let clipped3 = k.delay("clipped3", valid2.mux(clipped, k.constant(4, 0)));
        count_saturations(k, "saturations", io.clear, clipped3);
    }
}

/// The operand of `data` bits from a word, registered: rounded, clamped where rounding would exceed the operand.
pub fn operand_of<'k>(k: &'k Builder, word: Expr<'k>, data: usize) -> Expr<'k> {
    let operand = k.wire("short", word.signed().shift_right(SEARCH_EXTRA_BITS as usize - 1).round_shift(1));
    let overflow = k.wire("overflow", operand.top().differs(operand.at(data - 1)));
    let most = k.constant(data, (1 << (data - 1)) - 1);
    k.delay("operand", overflow.mux(most, operand.low(data)))
}

/// State `name`: the number of bits of `clipped`, four in each cycle, that were 1 since `clear`; two cycles later.
pub fn count_saturations<'k>(k: &'k Builder, name: &str, clear: Expr<'k>, clipped: Expr<'k>) -> Expr<'k> {
    let clips = k.delay("clips", (clipped.at(0) + clipped.at(1)) + (clipped.at(2) + clipped.at(3)));
    let count = k.state(name, Type::unsigned(SATURATION_BITS), clear, 0);
    count.set(saturating_sum(k, "count", *count, clips));
    *count
}

/// Sum of two counts of saturations, the largest count where it is larger.
pub fn saturating_sum<'k>(k: &'k Builder, name: &str, one: Expr<'k>, other: Expr<'k>) -> Expr<'k> {
    let count = k.wire(name, one + other);
    let most = k.constant(SATURATION_BITS, (1 << SATURATION_BITS) - 1);
    count.top().mux(most, count.low(SATURATION_BITS))
}

#[cfg(test)]
mod tests {
    use dermis_golden::fixed::words::arith::{round_shift, saturate};

    use super::*;
    use crate::language::kernel_of;
    use crate::language::testbench::{check, random_word, Reference};
    use crate::wire::Word;

    const BLOCK: Rescaler = Rescaler { acc: 45, lane: 41, word: 18 + SEARCH_EXTRA_BITS as usize, data: 18, a_shift: 9 };

    /// The quads on their way with their shift, and the counts.
    #[derive(Default)]
    struct Quads {
        /// Accumulators, then v_ij, of one, two and three cycles ago, and how many of them were saturated.
        taken: Option<([i64; 4], u32, bool)>,
        shifted: Option<([i64; 4], bool)>,
        words: Option<[i64; 4]>,
        operands: Option<[i64; 4]>,
        clipped: Option<usize>,
        clips: Option<usize>,
        count: Option<usize>,
    }

    impl Reference for Quads {
        fn outputs(&mut self, _: &[Word]) -> Vec<Option<Word>> {
            vec![
                self.words.map(|words| Word::of_fields(&words, BLOCK.word)),
                self.operands.map(|operands| Word::of_fields(&operands, BLOCK.data)),
                self.count.map(|count| Word::from(count as u64)),
            ]
        }

        fn clock(&mut self, inputs: &[Word]) {
            let operand = |word| saturate(round_shift(word, SEARCH_EXTRA_BITS), BLOCK.data as u32).0;
            self.operands = self.words.map(|words| words.map(operand));
            let counted = self.count.zip(self.clips).map(|(count, clips)| (count + clips).min(0xffff));
            self.count = if inputs[0].number() == 1 { Some(0) } else { counted };
            self.clips = self.clipped;
            let rounded =
                self.shifted.map(|(quad, valid)| (quad.map(|value| saturate(value, BLOCK.word as u32)), valid));
            self.words = rounded.map(|(quad, _)| quad.map(|(word, _)| word));
            self.clipped = rounded.map(|(quad, valid)| quad.iter().filter(|(_, clipped)| *clipped && valid).count());
            self.shifted = self.taken.map(|(quad, shift, valid)| (quad.map(|value| round_shift(value, shift)), valid));
            let (shift, row, bits) = match inputs[2].number() {
                1 => (inputs[3].number() as u32, inputs[4], BLOCK.acc),
                _ => (BLOCK.a_shift, inputs[5], BLOCK.lane),
            };
            let quad = [0, 1, 2, 3].map(|lane| row.signed(lane, bits));
            self.taken = Some((quad, shift, inputs[1].number() == 1));
        }
    }

    #[test]
    fn words_are_rounded_and_saturated_and_the_saturations_counted() {
        let mut random = fastrand::Rng::with_seed(12);
        let mut inputs = |cycle: usize| {
            // Accumulators of all lengths, and some that round to just beyond the range.
            let shift = random.u64(..BLOCK.acc as u64 - 1);
            let mut code = |bits: usize| match random.u8(..4) {
                0 => random_word(&mut random, bits).signed(0, bits),
                1 => ((1 << (BLOCK.word - 1)) << BLOCK.a_shift) - random.i64(..1 << BLOCK.a_shift),
                _ => random_word(&mut random, bits).signed(0, bits) >> random.u32(..bits as u32),
            };
            let mut quad = |bits: usize| Word::of_fields(&[(); 4].map(|()| code(bits)), bits);
            let (raw, quad) = (quad(BLOCK.acc), quad(BLOCK.lane));
            let clear = cycle < 6 || random.u16(..500) == 0;
            vec![clear.into(), random.bool().into(), random.bool().into(), shift.into(), raw, quad]
        };
        let stimulus: Vec<Vec<Word>> = (0..5000).map(&mut inputs).collect();
        check(&kernel_of(&BLOCK), &stimulus, &mut Quads::default());
    }
}
