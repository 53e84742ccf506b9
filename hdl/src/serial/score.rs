//! Scores of the nine candidates, one value at a time: log2(|p| + ⌊Σp / 2^20⌋) is added to the candidate's total.
//!
//! ```text
//! value --> magnitude --> + floor of the candidate --> leading one, by halves --> table --> total of the candidate
//! ```
//! The sum polynomial comes first. Its value is Σp itself: ⌊Σp / 2^20⌋ is stored as the candidate's floor, and its
//! total starts at −n log2 Σp.

use dermis_golden::fixed::plan::serial::{floor_bits, word_bits};
use dermis_golden::fixed::stages::search::log_table;
use dermis_golden::fixed::words::formats::{Formats, EPSILON_SHIFT, LOG_FRACTION};

use super::{bits_of, one_of};
use crate::block;
use crate::language::{concat, Block, Builder, Inside, Type};

/// Width of the leading one's position: words have at most 32 bits.
const PLACE_BITS: usize = 5;
const LOG_BITS: usize = PLACE_BITS + LOG_FRACTION as usize;

block! {
    /// Function in the module docs. A total is written to its memory six cycles after its value arrived; the values of
    /// a candidate are 16 cycles apart.
    pub struct Score {
        /// Width of a value.
        word: usize,
        /// Width of a floor.
        floor: usize,
        /// Width of a total.
        score: usize,
        taxels: u64,
    }
    ports ScorePorts {
        clock;
        reset;
        /// A candidate's value p, signed; valid with `valid`.
        in value: word;
        /// Index of the candidate; valid with `valid`.
        in index: 4;
        /// `value` is valid.
        in valid;
        /// `value` is Σp; valid with `valid`.
        in sum;
        /// The candidate's floor ⌊Σp / 2^20⌋; one cycle after `index`.
        in floor: floor;
        /// Write `floor_data`.
        out floor_write;
        /// Index of the candidate whose floor is written; valid with `floor_write`.
        out floor_index: 4;
        /// Floor to write, 0 if Σp ≤ 0; valid with `floor_write`.
        out floor_data: floor;
        /// Index of the candidate whose total is read; one cycle ahead of `total`.
        out read_index: 4;
        /// `{Σp > 0, total}`, total signed, 2^−6; one cycle after `read_index`.
        in total: score + 1;
        /// Write `write_data`.
        out write;
        /// Index of the candidate whose total is written; valid with `write`.
        out write_index: 4;
        /// `{Σp > 0, total}` to write; valid with `write`.
        out write_data: score + 1;
    }
}

impl Score {
    /// With the widths of `formats`.
    pub fn new(formats: &Formats) -> Self {
        Score {
            word: word_bits(formats),
            floor: floor_bits(formats),
            score: formats.score_bits as usize,
            taxels: 4 * formats.quads as u64,
        }
    }
}

impl Block for Score {
    fn build<'k>(&self, k: &'k Builder, io: ScorePorts<Inside<'k>>) {
        let Score { word: bits, floor, score, taxels } = *self;
        let [magnitude, argument] = ["magnitude", "argument"].map(|name| k.register(name, Type::unsigned(bits)));
        let (coarse, place_high) =
            (k.register("coarse", Type::unsigned(12)), k.register("place_high", Type::unsigned(2)));
        let [logarithm, late] = ["logarithm", "late"].map(|name| k.register(name, Type::unsigned(LOG_BITS)));
        let indices = [0, 1, 2, 3, 4].map(|step| k.register(&format!("index{step}"), Type::unsigned(4)));
        // valid, sum, positive of each pipeline step
        let kinds = [0, 1, 2, 3, 4].map(|step| k.state(&format!("kind{step}"), Type::unsigned(3), io.rst, 0));

        let negative = k.wire("negative", io.value.top() & !io.sum);
        magnitude.set(((io.value ^ concat(&vec![negative; bits])) + negative).low(bits));
        let of_floor = kinds[0].at(1).mux(k.constant(floor, 0), io.floor);
        argument.set((*magnitude + of_floor).low(bits));
        k.comment("Leading one: by 16 and by 8 in one cycle, by 4, 2 and 1 in the next.");
        let whole = k.wire("whole", argument.extend(32));
        let upper = k.wire("upper", whole.slice(16, 16).any());
        let half = k.wire("half", upper.mux(whole.slice(12, 20), whole.low(16).shift_left(4)));
        let upper_byte = k.wire("upper_byte", half.slice(12, 8).any());
        coarse.set(upper_byte.mux(half.slice(8, 12), half.low(12)));
        place_high.set(upper.concat(upper_byte));
        let fours = k.wire("fours", coarse.slice(8, 4).any());
        let byte_left = k.wire("byte_left", fours.mux(coarse.slice(4, 8), coarse.low(8)));
        let twos = k.wire("twos", byte_left.slice(6, 2).any());
        let pair_left = k.wire("pair_left", twos.mux(byte_left.slice(2, 6), byte_left.low(6)));
        let ones = pair_left.at(5);
        let mantissa = k.wire("mantissa", ones.mux(pair_left.slice(1, 4), pair_left.low(4)));
        // As gates: synthesis would map a table to a memory.
        let table = bits_of(LOG_FRACTION as usize, |bit| {
            let cells = log_table().iter().enumerate().filter(|(_, entry)| **entry >> bit & 1 == 1);
            one_of(k, mantissa, &cells.map(|(cell, _)| cell).collect::<Vec<_>>())
        });
        logarithm.set(concat(&[*place_high, fours, twos, ones, table]));
        late.set(*logarithm);

        let values = [io.index, *indices[0], *indices[1], *indices[2], *indices[3]];
        indices.iter().zip(values).for_each(|(register, value)| register.set(value));
        let positive = !io.value.top() & io.value.any();
        let values = [concat(&[io.valid, io.sum, positive]), *kinds[0], *kinds[1], *kinds[2], *kinds[3]];
        kinds.iter().zip(values).for_each(|(register, value)| register.set(value));

        let room = score - LOG_BITS;
        let multiples =
            (0..room).filter(|shift| taxels >> shift & 1 == 1).map(|shift| late.shift_left(shift).extend(score));
        let weighted = multiples.reduce(|a, b| (a + b).low(score)).unwrap_or(k.constant(score, 0));
        let weighted = k.wire("weighted", weighted);
        let grown = k.wire("grown", (io.total.low(score) + *late).low(score));
        let [first, .., last] = kinds;
        io.floor_write.set(first.at(2) & first.at(1));
        io.floor_index.set(*indices[0]);
        let low = EPSILON_SHIFT as usize;
        let top = if bits > low { magnitude.slice(low, bits - low) } else { k.constant(floor, 0) };
        io.floor_data.set(first.at(0).mux(top, k.constant(floor, 0)));
        io.read_index.set(*indices[3]);
        io.write.set(last.at(2));
        io.write_index.set(*indices[4]);
        let negated = (k.constant(score, 0) - weighted).low(score);
        io.write_data.set(last.at(1).mux(last.at(0).concat(negated), io.total.at(score).concat(grown)));
    }
}

#[cfg(test)]
mod tests {
    use dermis_golden::fixed::stages::search::log2;

    use super::*;
    use crate::language::kernel_of;
    use crate::language::testbench::{check, Reference};
    use crate::wire::Word;

    const SIZES: Score = Score { word: 29, floor: 9, score: 20, taxels: 44 };
    const STEPS: usize = 5;

    /// A value on its way: p or Σp, index, whether it is Σp; then its logarithm.
    #[derive(Clone, Copy, Default)]
    struct Step {
        value: i64,
        index: u64,
        sum: bool,
        logarithm: i64,
    }

    /// The values of the last cycles, the last one first.
    #[derive(Default)]
    struct Values {
        steps: [Option<Step>; STEPS],
        reset: bool,
    }

    impl Reference for Values {
        fn outputs(&mut self, inputs: &[Word]) -> Vec<Option<Word>> {
            let [first, .., before, last] = self.steps;
            let bit = |bit: bool| self.reset.then(|| Word::from(bit));
            let floor = first.filter(|step| step.sum);
            let total = |step: Step| {
                let own = inputs[6];
                let (total, positive) = match step.sum {
                    true => (-(SIZES.taxels as i64) * step.logarithm, step.value > 0),
                    false => (own.signed(0, SIZES.score) + step.logarithm, own.field(SIZES.score, 1) == 1),
                };
                let mut word = Word::of_fields(&[total], SIZES.score);
                word.set(SIZES.score, 1, u64::from(positive));
                word
            };
            vec![
                bit(floor.is_some()),
                floor.map(|step| Word::from(step.index)),
                floor.map(|step| Word::from(step.value.max(0) as u64 >> EPSILON_SHIFT)),
                before.map(|step| Word::from(step.index)),
                bit(last.is_some()),
                last.map(|step| Word::from(step.index)),
                // The logarithm of a sum that is not positive is not used.
                last.map(total).filter(|_| last.is_some_and(|step| !step.sum || step.value > 0)),
            ]
        }

        fn clock(&mut self, inputs: &[Word]) {
            let [rst, _, index, valid, sum, floor] = [0, 1, 2, 3, 4, 5].map(|k| inputs[k].number());
            let value = inputs[1].signed(0, SIZES.word);
            if let Some(step) = &mut self.steps[0] {
                let number = if step.sum { step.value } else { step.value.abs() + floor as i64 };
                step.logarithm = if number > 0 { log2(number) } else { 0 };
            }
            self.steps.rotate_right(1);
            self.steps[0] = (valid == 1).then_some(Step { value, index, sum: sum == 1, logarithm: 0 });
            if rst == 1 {
                *self = Values { reset: true, ..Values::default() };
            }
        }
    }

    #[test]
    fn logarithms_are_added_to_the_totals_of_their_candidates() {
        let mut random = fastrand::Rng::with_seed(26);
        let cycle = |cycle: usize| {
            let value = random.i64(-(1 << 27)..1 << 27) >> random.u8(..28);
            vec![
                Word::from(cycle < 2 || random.u16(..500) == 0),
                Word::of_fields(&[value], SIZES.word),
                Word::from(random.u64(..9)),
                Word::from(random.bool()),
                Word::from(random.u8(..4) == 0),
                Word::from(random.u64(1..1 << SIZES.floor)),
                Word::of_fields(&[random.i64(-400_000..400_000)], SIZES.score + 1),
            ]
        };
        let all: Vec<Vec<Word>> = (0..6000).map(cycle).collect();
        check(&kernel_of(&SIZES), &all, &mut Values::default());
    }
}
