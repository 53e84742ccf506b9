//! Stage `relax`: with a network, adds v_00 to the products of each step; its sums are p, and the operands of the next step.

use dermis_golden::fixed::plan::resources::Holds;
use dermis_golden::fixed::Model;

use crate::block;
use crate::language::{concat, Block, Builder, Contents, Expr, Inside, Type};
use crate::primitives::{count_bits, count_saturations, operand_of, saturated, saturating_sum, SATURATION_BITS};

block! {
    /// Words of `rescale` in, the first Q of a subarray v_00; their sums with v_00 three cycles later, the operands four.
    pub struct Relax {
        word: usize,
        data: usize,
        quads: usize,
        /// Each contact has a μ of its own.
        contacts: bool,
    }
    ports RelaxPorts {
        clock;
        reset;
        /// A subarray starts: v_00 comes next, and saturations are counted from 0.
        in start;
        /// Four parities, `vector_bits` each, signed; valid with `words_valid`.
        in words: 4 * word;
        /// `words` holds a quad.
        in words_valid;
        /// Saturations of `rescale` in this subarray; taken in every cycle.
        in rescaled: SATURATION_BITS;
        /// Saturations of `estimate` in this subarray; taken in every cycle.
        in estimated: SATURATION_BITS;
        /// Saturations of `shear` in this subarray; taken in every cycle.
        in sheared: SATURATION_BITS;
        /// Four parities of p, `vector_bits` each, signed; valid with `sums_valid`.
        out sums: 4 * word;
        /// `sums` holds a quad.
        out sums_valid;
        /// The same as operands, `data_bits` each; valid with `operands_valid`.
        out operands: 4 * data;
        /// `operands` holds a quad.
        out operands_valid;
        /// All saturations of this subarray, 16 bits, stays at the largest count; final four cycles after the last sum.
        out saturations: SATURATION_BITS;
    }
}

impl Relax {
    /// For the network of `model`, if it has one. With a search v_ij are summed by the search.
    pub fn of_model(model: &Model) -> Option<Self> {
        let formats = model.formats();
        model.has_network().then(|| Relax {
            word: formats.vector_bits as usize,
            data: formats.data_bits as usize,
            quads: formats.quads,
            contacts: formats.by_contact(),
        })
    }
}

impl Block for Relax {
    fn build<'k>(&self, k: &'k Builder, io: RelaxPorts<Inside<'k>>) {
        let RelaxPorts { rst, start, words, words_valid: valid, rescaled, estimated, sheared, .. } = io;
        let bit = Type::unsigned(1);
        let quad = k.state("quad", Type::unsigned(count_bits(self.quads)), rst | start, 0);
        let adds = k.state("adds", bit, rst | start, 0);
        let last = k.wire("last", quad.is(self.quads as u64 - 1));
        k.when(valid, || quad.set(last.mux(k.constant(quad.bits(), 0), quad.plus(1))));
        k.when(valid & last, || adds.set(k.constant(1, 1)));
        let memory = k.memory("first", self.quads, 4 * self.word, Contents::Undefined).holds(Holds::FirstProduct);
        memory.write(valid & !*adds, *quad, words);
        let first = k.delay("first_out", k.delay("first_read", memory.read(*quad)));

        let later = |name: &str, value: Expr| {
            let state = k.state(name, bit, rst, 0);
            state.set(value);
            state.get()
        };
        let twice = |name: &str, value| k.delay(&format!("{name}2"), k.delay(&format!("{name}1"), value));
        let (words2, adds2) = (twice("words", words), twice("adds", *adds));
        let valid2 = later("valid2", later("valid1", valid));
        later("sums_valid", valid2);
        later("operands_valid", k.named("sums_valid"));
        let lane = |parity: usize| {
            k.scope(&format!("parity_{parity}"), || {
                let at = parity * self.word;
                let own = words2.slice(at, self.word).signed();
                let sum = own + (first.slice(at, self.word) & adds2.repeat(self.word)).signed();
                let (word, clips) = saturated(k, sum, self.word);
                let word = k.delay("sum", word);
                [word, operand_of(k, word, self.data), clips]
            })
        };
        let lanes: Vec<[Expr; 3]> = (0..4).rev().map(lane).collect();
        let [sums, own, clipped] = [0, 1, 2].map(|n| concat(&lanes.iter().map(|lane| lane[n]).collect::<Vec<_>>()));
        io.sums.set(sums);
        io.operands.set(own);

        let clipped3 = k.delay("clipped3", valid2.mux(clipped, k.constant(4, 0)));
        let relaxed = count_saturations(k, "relaxed", start, clipped3);
        let mut others = saturating_sum(k, "of_layers", rescaled, estimated);
        if self.contacts {
            others = saturating_sum(k, "of_contacts", others, sheared);
        }
        let others = k.delay("others", others);
        io.saturations.delay(saturating_sum(k, "total", others, relaxed));
    }
}

#[cfg(test)]
mod tests {
    use std::collections::VecDeque;

    use dermis_golden::fixed::words::arith::saturate;

    use super::*;
    use crate::language::kernel_of;
    use crate::language::testbench::{check, random_word, Reference};
    use crate::wire::Word;

    const BLOCK: Relax = Relax { word: 22, data: 18, quads: 5, contacts: true };

    /// A sum, and how many of its words were saturated.
    type Sum = ([i64; 4], u32);

    /// Inputs in the order of the block.
    #[derive(Default)]
    struct Sums {
        /// v_00 so far; the words on their way, each as it came in, and how many of the sums before were saturated.
        first: Vec<[i64; 4]>,
        /// Sums of the cycle before, of the one before that, and so on; none before the first reset.
        sums: Option<VecDeque<Option<Sum>>>,
        seen: usize,
        total: u32,
        /// Cycles since the last sum entered or another count changed, and the other counts.
        quiet: usize,
        others: u64,
    }

    fn short(word: i64) -> i64 {
        saturate((word + 8) >> 4, BLOCK.data as u32).0
    }

    impl Reference for Sums {
        fn outputs(&mut self, inputs: &[Word]) -> Vec<Option<Word>> {
            let before = |cycles: usize| Some(self.sums.as_ref()?.get(cycles - 1).copied().flatten());
            let (sum, own) = (before(3), before(4));
            let operands = own.flatten().map(|(sum, _)| Word::of_fields(&sum.map(short), BLOCK.data));
            let others = [4, 5, 6].map(|input| inputs[input].number()).iter().sum();
            self.quiet = if others == self.others { self.quiet } else { 0 };
            self.others = others;
            let total = u64::from(self.total) + others;
            vec![
                sum.map(|sum| sum.is_some().into()),
                own.map(|own| own.is_some().into()),
                sum.flatten().map(|(sum, _)| Word::of_fields(&sum, BLOCK.word)),
                operands,
                (self.sums.is_some() && self.quiet > 8).then(|| total.min(0xffff).into()),
            ]
        }

        fn clock(&mut self, inputs: &[Word]) {
            let [rst, start, valid] = [0, 1, 3].map(|input| inputs[input].number() == 1);
            self.quiet += 1;
            let mut entered = None;
            if valid {
                let words = [0, 1, 2, 3].map(|parity| inputs[2].signed(parity, BLOCK.word));
                let mut clipped = 0;
                let sum = match self.seen < BLOCK.quads {
                    true => {
                        self.first.push(words);
                        words
                    }
                    false => {
                        let first = self.first[self.seen % BLOCK.quads];
                        [0, 1, 2, 3].map(|parity| {
                            let (sum, clips) = saturate(words[parity] + first[parity], BLOCK.word as u32);
                            clipped += u32::from(clips);
                            sum
                        })
                    }
                };
                (self.seen, self.total, self.quiet) = (self.seen + 1, self.total + clipped, 0);
                entered = Some((sum, clipped));
            }
            if let Some(sums) = &mut self.sums {
                sums.push_front(entered);
                sums.truncate(5);
            }
            if start || rst {
                (self.first, self.seen, self.total, self.quiet) = (Vec::new(), 0, 0, 0);
            }
            if rst {
                self.sums = Some(vec![None; 5].into());
            }
        }
    }

    /// Subarrays of v_00 and some steps, with gaps; some are cut off by a reset.
    fn stimulus() -> Vec<Vec<Word>> {
        let mut random = fastrand::Rng::with_seed(31);
        let mut stimulus = Vec::new();
        for frame in 0..60 {
            let counts =
                [(); 3].map(|()| Word::from(if frame % 9 == 8 { random.u64(..0xffff) } else { random.u64(..9) }));
            let mut put = |random: &mut fastrand::Rng, rst: bool, start: bool, valid: bool| {
                let word = random_word(random, 4 * BLOCK.word);
                stimulus.push(vec![rst.into(), start.into(), word, valid.into(), counts[0], counts[1], counts[2]]);
            };
            put(&mut random, frame % 4 == 0, false, false);
            put(&mut random, false, true, false);
            for _ in 0..BLOCK.quads * random.usize(1..5) {
                put(&mut random, false, false, true);
                (0..random.usize(..3)).for_each(|_| put(&mut random, false, false, false));
            }
            (0..20).for_each(|_| put(&mut random, false, false, false));
        }
        stimulus
    }

    #[test]
    fn the_products_of_each_step_are_added_to_v_00() {
        check(&kernel_of(&BLOCK), &stimulus(), &mut Sums::default());
    }
}
