//! Stage `unfold`: words of v_ij back to taxels, coefficient by coefficient into the search memory.

use dermis_golden::fixed::words::schedule::{is_transposed, schedule, EXPONENTS};
use dermis_golden::fixed::Model;
use rust_hdl::prelude::*;

use crate::language::RustHdl;
use crate::primitives::{count_bits, BitDelay, CaseCounter, Counter, Delay, TransposedPlace, Unfolder};
use crate::wire::Wire;

/// Quads of v_ij in, in order; two cycles later four taxels with coefficient index and quad address.
#[derive(dermis_hdl_derive::Block)]
pub struct Unfold {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Synchronous reset, active high.
    pub rst: Signal<In, Bit>,
    /// Index of the case; constant while a frame is computed.
    pub which: Wire<In>,
    /// A subarray starts: the words of v_00 come next.
    pub start: Signal<In, Bit>,
    /// Four parities of a v_ij, `vector_bits` each, signed; valid with `words_valid`.
    pub words: Wire<In>,
    /// `words` holds a quad.
    pub words_valid: Signal<In, Bit>,
    /// One coefficient of four taxels, two bits wider, signed; valid with `taxels_valid`, three cycles after `words`.
    pub taxels: Wire<Out>,
    /// `taxels` holds a quad.
    pub taxels_valid: Signal<Out, Bit>,
    /// Index of the coefficient; valid with `taxels_valid`.
    pub index: Wire<Out>,
    /// Address of the quad; valid with `taxels_valid`.
    pub address: Wire<Out>,
    /// All coefficients of the subarray have been output; high for one cycle.
    pub done: Signal<Out, Bit>,
    quads: RustHdl<CaseCounter>,
    vectors: RustHdl<Counter>,
    unfolder: RustHdl<Unfolder>,
    transposed: RustHdl<TransposedPlace>,
    index_first: RustHdl<Delay>,
    index_later: RustHdl<Delay>,
    address_later: RustHdl<Delay>,
    valid_later: RustHdl<BitDelay>,
    finish: RustHdl<BitDelay>,
    quad_end: Signal<Local, Bit>,
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
        let (index, address) = (count_bits(count), count_bits(formats.quads));
        Unfold {
            clk: Default::default(),
            rst: Default::default(),
            which: Wire::new(count_bits(quads.len())),
            start: Default::default(),
            words: Wire::new(4 * bits),
            words_valid: Default::default(),
            taxels: Wire::new(4 * (bits + 2)),
            taxels_valid: Default::default(),
            index: Wire::new(index),
            address: Wire::new(address),
            done: Default::default(),
            quads: RustHdl::new(CaseCounter::new(&quads)),
            vectors: RustHdl::new(Counter::new(count)),
            unfolder: RustHdl::new(Unfolder::new(bits, &degrees)),
            transposed: RustHdl::new(TransposedPlace::new(model.layout(), bits + 2, count, across)),
            index_first: RustHdl::new(Delay::new(index, 2)),
            index_later: RustHdl::new(Delay::new(index, 1)),
            address_later: RustHdl::new(Delay::new(address, 3)),
            valid_later: RustHdl::new(BitDelay::new(3)),
            finish: RustHdl::new(BitDelay::new(4)),
            quad_end: Default::default(),
        }
    }
}

impl Logic for Unfold {
    #[hdl_gen]
    fn update(&mut self) {
        self.quads.clk.next = self.clk.val();
        self.vectors.clk.next = self.clk.val();
        self.unfolder.clk.next = self.clk.val();
        self.index_first.clk.next = self.clk.val();
        self.index_later.clk.next = self.clk.val();
        self.address_later.clk.next = self.clk.val();
        self.valid_later.clk.next = self.clk.val();
        self.finish.clk.next = self.clk.val();
        self.valid_later.rst.next = self.rst.val();
        self.finish.rst.next = self.rst.val();

        self.quad_end.next = self.words_valid.val() & self.quads.last.val();
        self.quads.which.next = self.which.val();
        self.quads.clear.next = self.start.val();
        self.quads.enable.next = self.words_valid.val();
        self.vectors.clear.next = self.start.val();
        self.vectors.enable.next = self.quad_end.val();
        self.unfolder.quad.next = self.words.val();
        self.index_first.d.next = self.vectors.value.val();
        self.unfolder.index.next = self.index_first.q.val();
        self.index_later.d.next = self.index_first.q.val();
        self.address_later.d.next = self.quads.value.val();
        self.valid_later.d.next = self.words_valid.val();

        self.transposed.index.next = self.index_later.q.val();
        self.transposed.address.next = self.address_later.q.val();
        self.transposed.quad.next = self.unfolder.taxels.val();
        self.taxels.next = self.transposed.taxels.val();
        self.taxels_valid.next = self.valid_later.q.val();
        self.index.next = self.index_later.q.val();
        self.address.next = self.transposed.placed.val();
        self.finish.d.next = self.quad_end.val() & self.vectors.last.val();
        self.done.next = self.finish.q.val();
    }
}

#[cfg(test)]
mod tests {
    use std::collections::VecDeque;

    use dermis_golden::fixed::stages::unfold::unfold;

    use super::*;
    use crate::language::testbench::{block_subject, check_with_defects, random_word, Reference};
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
        fn quad(&self, which: usize, words: [i64; 4]) -> Quad {
            let formats = &self.model.cases()[which].formats;
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
            let [rst, which, start, _, valid] = [0, 1, 2, 3, 4].map(|input| inputs[input].number() as usize);
            let formats = &self.model.cases()[which].formats;
            let words = [0, 1, 2, 3].map(|parity| inputs[3].signed(parity, formats.vector_bits as usize));
            self.quads.push_front((valid == 1).then(|| self.quad(which, words)));
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
            let mut which = 0;
            let cycle = |cycle: usize| {
                let rst = cycle == 0 || random.u16(..500) == 0;
                let start = cycle == 1 || random.u16(..150) == 0;
                if start {
                    which = random.usize(..model.cases().len());
                }
                let valid = cycle > 1 && !start && random.u8(..5) > 0;
                let words = random_word(&mut random, bits);
                vec![rst.into(), Word::from(which as u64), start.into(), words, valid.into()]
            };
            let stimulus: Vec<Vec<Word>> = (0..4000).map(cycle).collect();
            let subject = |changes: &[Change]| {
                block_subject!(
                    Unfold::new(&model),
                    changes,
                    inputs [rst, which, start, words, words_valid],
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
