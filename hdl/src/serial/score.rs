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
use rust_hdl::prelude::*;

use super::{bits_of, one_of};
use crate::kernel_block;
use crate::language::{concat, Body, Builder, Kernel, Type};
use crate::wire::Wire;

/// Width of the leading one's position: words have at most 32 bits.
const PLACE_BITS: usize = 5;
const LOG_BITS: usize = PLACE_BITS + LOG_FRACTION as usize;

/// Function in the module docs. A total is written to its memory six cycles after its value arrived; the values of a
/// candidate are 16 cycles apart.
#[derive(dermis_hdl_derive::Block)]
pub struct Score {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Synchronous reset, active high.
    pub rst: Signal<In, Bit>,
    /// A candidate's value p, signed; valid with `valid`.
    pub value: Wire<In>,
    /// Index of the candidate; valid with `valid`.
    pub index: Wire<In>,
    /// `value` is valid.
    pub valid: Signal<In, Bit>,
    /// `value` is Σp; valid with `valid`.
    pub sum: Signal<In, Bit>,
    /// The candidate's floor ⌊Σp / 2^20⌋; one cycle after `index`.
    pub floor: Wire<In>,
    /// Write `floor_data`.
    pub floor_write: Signal<Out, Bit>,
    /// Index of the candidate whose floor is written; valid with `floor_write`.
    pub floor_index: Wire<Out>,
    /// Floor to write, 0 if Σp ≤ 0; valid with `floor_write`.
    pub floor_data: Wire<Out>,
    /// Index of the candidate whose total is read; one cycle ahead of `total`.
    pub read_index: Wire<Out>,
    /// `{Σp > 0, total}`, total signed, 2^−6; one cycle after `read_index`.
    pub total: Wire<In>,
    /// Write `write_data`.
    pub write: Signal<Out, Bit>,
    /// Index of the candidate whose total is written; valid with `write`.
    pub write_index: Wire<Out>,
    /// `{Σp > 0, total}` to write; valid with `write`.
    pub write_data: Wire<Out>,
    kernel: Body,
}

kernel_block!(
    Score,
    clock clk,
    inputs [rst, value, index, valid, sum, floor, total],
    outputs [floor_write, floor_index, floor_data, read_index, write, write_index, write_data]
);

impl Score {
    /// With the widths of `formats`.
    pub fn new(formats: &Formats) -> Self {
        let sizes = Sizes {
            word: word_bits(formats),
            floor: floor_bits(formats),
            score: formats.score_bits as usize,
            taxels: 4 * formats.quads as u64,
        };
        let total = sizes.score + 1;
        let block = Score {
            clk: Default::default(),
            rst: Default::default(),
            value: Wire::new(sizes.word),
            index: Wire::new(4),
            valid: Default::default(),
            sum: Default::default(),
            floor: Wire::new(sizes.floor),
            floor_write: Default::default(),
            floor_index: Wire::new(4),
            floor_data: Wire::new(sizes.floor),
            read_index: Wire::new(4),
            total: Wire::new(total),
            write: Default::default(),
            write_index: Wire::new(4),
            write_data: Wire::new(total),
            kernel: Body::default(),
        };
        block.bind(kernel(sizes))
    }
}

/// Widths of the words and number of taxels.
#[derive(Clone, Copy)]
struct Sizes {
    word: usize,
    floor: usize,
    score: usize,
    taxels: u64,
}

fn kernel(sizes: Sizes) -> Kernel {
    let Sizes { word: bits, floor, score, taxels } = sizes;
    let k = Builder::new("score");
    let (rst, value, index) = (k.input("rst", 1), k.input("value", bits), k.input("index", 4));
    let (valid, sum, floor_in) = (k.input("valid", 1), k.input("sum", 1), k.input("floor", floor));
    let total = k.input("total", score + 1);
    let [magnitude, argument] = ["magnitude", "argument"].map(|name| k.register(name, Type::unsigned(bits)));
    let (coarse, place_high) = (k.register("coarse", Type::unsigned(12)), k.register("place_high", Type::unsigned(2)));
    let [logarithm, late] = ["logarithm", "late"].map(|name| k.register(name, Type::unsigned(LOG_BITS)));
    let indices = [0, 1, 2, 3, 4].map(|step| k.register(&format!("index{step}"), Type::unsigned(4)));
    // valid, sum, positive of each pipeline step
    let kinds = [0, 1, 2, 3, 4].map(|step| k.state(&format!("kind{step}"), Type::unsigned(3), rst, 0));

    let negative = k.wire("negative", value.top() & !sum);
    magnitude.set(((value ^ concat(&vec![negative; bits])) + negative).low(bits));
    let of_floor = kinds[0].at(1).mux(k.constant(floor, 0), floor_in);
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
        one_of(&k, mantissa, &cells.map(|(cell, _)| cell).collect::<Vec<_>>())
    });
    logarithm.set(concat(&[*place_high, fours, twos, ones, table]));
    late.set(*logarithm);

    let values = [index, *indices[0], *indices[1], *indices[2], *indices[3]];
    indices.iter().zip(values).for_each(|(register, value)| register.set(value));
    let positive = !value.top() & value.any();
    let values = [concat(&[valid, sum, positive]), *kinds[0], *kinds[1], *kinds[2], *kinds[3]];
    kinds.iter().zip(values).for_each(|(register, value)| register.set(value));

    let room = score - LOG_BITS;
    let multiples =
        (0..room).filter(|shift| taxels >> shift & 1 == 1).map(|shift| late.shift_left(shift).extend(score));
    let weighted = multiples.reduce(|a, b| (a + b).low(score)).unwrap_or(k.constant(score, 0));
    let weighted = k.wire("weighted", weighted);
    let grown = k.wire("grown", (total.low(score) + *late).low(score));
    let [first, .., last] = kinds;
    k.wire("floor_write", first.at(2) & first.at(1));
    k.wire("floor_index", *indices[0]);
    let low = EPSILON_SHIFT as usize;
    let top = if bits > low { magnitude.slice(low, bits - low) } else { k.constant(floor, 0) };
    k.wire("floor_data", first.at(0).mux(top, k.constant(floor, 0)));
    k.wire("read_index", *indices[3]);
    k.wire("write", last.at(2));
    k.wire("write_index", *indices[4]);
    let negated = (k.constant(score, 0) - weighted).low(score);
    k.wire("write_data", last.at(1).mux(last.at(0).concat(negated), total.at(score).concat(grown)));
    k.finish()
}

#[cfg(test)]
mod tests {
    use dermis_golden::fixed::stages::search::log2;

    use super::*;
    use crate::language::testbench::{check, Reference};
    use crate::wire::Word;

    const SIZES: Sizes = Sizes { word: 29, floor: 9, score: 20, taxels: 44 };
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
        let ports = [
            ("floor_write", 1),
            ("floor_index", 4),
            ("floor_data", SIZES.floor),
            ("read_index", 4),
            ("write", 1),
            ("write_index", 4),
            ("write_data", SIZES.score + 1),
        ];
        check(Body::new(kernel(SIZES), &[], &ports).kernel(), &all, &mut Values::default());
    }
}
