//! Stage `unfold`: words of v_ij back to taxels, coefficient by coefficient into the search memory.

use dermis_golden::fixed::words::schedule::{is_transposed, schedule, EXPONENTS};
use dermis_golden::fixed::Model;

use crate::block;
use crate::language::{Block, Builder, Inside};
use crate::primitives::{count_bits, largest, BitDelay, CaseCounter, Counter, Delay, TransposedPlace, Unfolder};

block! {
    /// Quads of v_ij in, in order; two cycles later four taxels with coefficient index and quad address.
    pub struct Unfold {
        /// Quads of a subarray, by case.
        quads: Vec<usize>,
        /// Coefficients of a taxel.
        vectors: usize,
        /// Width of a word.
        bits: usize,
        unfolder: Unfolder,
        transposed: Option<TransposedPlace>,
    }
    ports UnfoldPorts {
        clock;
        reset;
        /// Index of the case; constant while a frame is computed.
        in case_index: count_bits(quads.len());
        /// A subarray starts: the words of v_00 come next.
        in start;
        /// Four parities of a v_ij, `vector_bits` each, signed; valid with `words_valid`.
        in words: 4 * bits;
        /// `words` holds a quad.
        in words_valid;
        /// One coefficient of four taxels, two bits wider, signed; valid with `taxels_valid`, three cycles after `words`.
        out taxels: 4 * (bits + 2);
        /// `taxels` holds a quad.
        out taxels_valid;
        /// Index of the coefficient; valid with `taxels_valid`.
        out index: count_bits(*vectors);
        /// Address of the quad; valid with `taxels_valid`.
        out address: count_bits(largest(quads));
        /// All coefficients of the subarray have been output; high for one cycle.
        out done;
    }
}

impl Unfold {
    /// With the widths of `model`.
    pub fn new(model: &Model) -> Self {
        let formats = model.formats();
        let across = schedule(formats).iter().enumerate().filter(|(_, p)| is_transposed(p)).map(|(k, _)| k).collect();
        let quads: Vec<usize> = model.cases().iter().map(|case| case.formats.quads).collect();
        let bits = formats.vector_bits as usize;
        let count = formats.vectors();
        // With a network every vector is p itself.
        let degree = |(i, j): (u32, u32)| if formats.has_network() { 0 } else { i + j };
        let degrees: Vec<u32> = EXPONENTS[..count].iter().map(|&exponents| degree(exponents)).collect();
        Unfold {
            quads,
            vectors: count,
            bits,
            unfolder: Unfolder::new(bits, &degrees),
            transposed: TransposedPlace::new(model.layout(), bits + 2, count, across),
        }
    }
}

impl Block for Unfold {
    fn build<'k>(&self, k: &'k Builder, io: UnfoldPorts<Inside<'k>>) {
        let quads = k.instance("quads", CaseCounter::new(&self.quads));
        let vectors = k.instance("vectors", Counter::new(self.vectors));
        let unfolder = k.instance("unfolder", &self.unfolder);
        let transposed = k.instance("transposed", self.transposed.as_ref());
        let index_first = k.instance("index_first", Delay::new(io.index.bits(), 2));
        let index_later = k.instance("index_later", Delay::new(io.index.bits(), 1));
        let address_later = k.instance("address_later", Delay::new(io.address.bits(), 3));
        let valid_later = k.instance("valid_later", BitDelay::new(3));
        let finish = k.instance("finish", BitDelay::new(4));

        let quad_end = k.wire("quad_end", io.words_valid & quads.last);
        quads.case_index.set(io.case_index);
        quads.clear.set(io.start);
        quads.enable.set(io.words_valid);
        vectors.clear.set(io.start);
        vectors.enable.set(quad_end);
        unfolder.quad.set(io.words);
        index_first.d.set(vectors.value);
        unfolder.index.set(index_first.q);
        index_later.d.set(index_first.q);
        address_later.d.set(quads.value);
        valid_later.d.set(io.words_valid);

        let (address, taxels) = match transposed {
            None => (address_later.q, unfolder.taxels),
            Some(transposed) => {
                transposed.index.set(index_later.q);
                transposed.address.set(address_later.q);
                transposed.quad.set(unfolder.taxels);
                (transposed.placed, transposed.taxels)
            }
        };
        io.taxels.set(taxels);
        io.taxels_valid.set(valid_later.q);
        io.index.set(index_later.q);
        io.address.set(address);
        finish.d.set(quad_end & vectors.last);
        io.done.set(finish.q);
    }
}

#[cfg(test)]
mod tests {
    use std::collections::VecDeque;

    use dermis_golden::fixed::stages::unfold::unfold;

    use super::*;
    use crate::language::testbench::{check_with_defects, random_word, subject_of, Reference};
    use crate::language::Change;
    use crate::scenes::model;
    use crate::wire::Word;

    /// What becomes of a quad.
    #[derive(Clone, Copy)]
    struct Quad {
        vector: usize,
        address: usize,
        taxels: [i64; 4],
        last: bool,
    }

    struct Unfolding<'a> {
        model: &'a Model,
        /// Number of the next quad of the subarray.
        next: usize,
        /// The quad of the cycle before, that of the cycle before it, and so on; none before the first reset.
        quads: VecDeque<Option<Quad>>,
    }

    impl<'a> Unfolding<'a> {
        fn new(model: &'a Model) -> Self {
            Unfolding { model, next: 0, quads: VecDeque::new() }
        }

        /// The quad of these words, the next of the subarray.
        fn quad(&self, case_index: usize, words: [i64; 4]) -> Quad {
            let formats = &self.model.cases()[case_index].formats;
            let (vector, address) = (self.next / formats.quads, self.next % formats.quads);
            let [a, b, c, d] = unfold(&[words], EXPONENTS[vector].0 + EXPONENTS[vector].1)[0];
            let last = self.next + 1 == formats.vectors() * formats.quads;
            match is_transposed(&schedule(formats)[vector]) {
                false => Quad { vector, address, taxels: [a, b, c, d], last },
                true => {
                    let address = self.model.layout().transposed(address);
                    Quad { vector, address, taxels: [a, c, b, d], last }
                }
            }
        }
    }

    impl Reference for Unfolding<'_> {
        fn outputs(&mut self, _: &[Word]) -> Vec<Option<Word>> {
            let bits = self.model.formats().vector_bits as usize + 2;
            let [now, before] = [2, 3].map(|cycles| self.quads.get(cycles).copied());
            let quad = now.flatten();
            vec![
                quad.map(|quad| Word::of_fields(&quad.taxels, bits)),
                now.map(|now| now.is_some().into()),
                quad.map(|quad| Word::from(quad.vector as u64)),
                quad.map(|quad| Word::from(quad.address as u64)),
                before.map(|before| before.is_some_and(|quad| quad.last).into()),
            ]
        }

        fn clock(&mut self, inputs: &[Word]) {
            let [rst, case_index, start, _, valid] = [0, 1, 2, 3, 4].map(|input| inputs[input].number() as usize);
            let formats = &self.model.cases()[case_index].formats;
            let words = [0, 1, 2, 3].map(|parity| inputs[3].signed(parity, formats.vector_bits as usize));
            self.quads.push_front((valid == 1).then(|| self.quad(case_index, words)));
            self.quads.truncate(4);
            let all = formats.vectors() * formats.quads;
            self.next = if start == 1 { 0 } else { (self.next + valid) % all };
            if rst == 1 {
                self.quads = vec![None; 4].into();
            }
        }
    }

    #[test]
    fn quads_of_all_vectors_become_coefficients_of_taxels() {
        let shared = model(6, 6, "[search]\nmu_max = 0.005\n");
        assert!(shared.formats().shared_a);
        for model in [shared, model(8, 8, "[partition]\ncases = [0, 1]\n")] {
            let bits = 4 * model.formats().vector_bits as usize;
            let mut random = fastrand::Rng::with_seed(11);
            let mut case_index = 0;
            let cycle = |cycle: usize| {
                let rst = cycle == 0 || random.u16(..500) == 0;
                let start = cycle == 1 || random.u16(..150) == 0;
                if start {
                    case_index = random.usize(..model.cases().len());
                }
                let valid = cycle > 1 && !start && random.u8(..5) > 0;
                let words = random_word(&mut random, bits);
                vec![rst.into(), Word::from(case_index as u64), start.into(), words, valid.into()]
            };
            let stimulus: Vec<Vec<Word>> = (0..4000).map(cycle).collect();
            let subject = |changes: &[Change]| {
                subject_of!(
                    Unfold::new(&model),
                    changes,
                    inputs [rst, case_index, start, words, words_valid],
                    outputs [taxels, taxels_valid, index, address, done],
                )
            };
            let defects = [
                Change::value("", "transposed__index", |k| k.named("index_first__q")),
                Change::value("", "finish__d", |k| k.named("quad_end")),
            ];
            let defects = if model.formats().shared_a { &defects[..] } else { &[] };
            check_with_defects(subject, &stimulus, || Unfolding::new(&model), defects);
        }
    }
}
