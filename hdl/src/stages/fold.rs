//! Stage `fold`: the frame's normalised quads to parities, into the input memory of the passes.
//!
//! One quad per cycle: frame buffer (2 cycles), `normalise` (2), butterfly (1), memory.

use dermis_golden::fixed::plan::resources::Holds;
use dermis_golden::fixed::Model;

use crate::block;
use crate::language::{Block, Builder, Inside};
use crate::primitives::{
    count_bits, frame_quads, largest, BitDelay, Butterfly, CaseCounter, CaseEqual, Counter, Delay, Dff, Ram,
};

block! {
    /// Reads the quads of a subarray from the frame buffer; they pass `normalise` and the butterfly on their way to the
    /// input memory.
    pub struct Fold {
        /// Width of a code in bits.
        bits: usize,
        /// Quads of a subarray, by case.
        quads: Vec<usize>,
        /// Quads of the largest frame.
        frame: usize,
        /// Index of the quad with which the products may begin, by case.
        leads: Vec<usize>,
    }
    ports FoldPorts {
        clock;
        reset;
        /// Index of the case; constant while a frame is computed.
        in case_index: count_bits(quads.len());
        /// A new frame: reading restarts at the frame's first quad.
        in begin_frame;
        /// Fold the next subarray.
        in start;
        /// The subarray is the frame's last.
        in last_part;
        /// Address of the quad to read from the frame buffer, over all subarrays; steps in every cycle after `start` until
        /// the subarray is read.
        out quad_address: count_bits(*frame);
        /// The frame's last quad was read in the cycle before: the frame buffer is free.
        out free;
        /// Four normalised codes, `input_bits` each, signed; four cycles after `quad_address`.
        in normalised: 4 * bits;
        /// `normalised` holds a quad.
        out normalised_valid;
        /// Four parities, two bits wider, signed; valid with `folded_valid`, one cycle after `normalised`.
        out folded: 4 * (bits + 2);
        /// `folded` holds a quad.
        out folded_valid;
        /// The products may begin: what they read next is in the input memory; high for one cycle.
        out readable;
        /// Address of the quad to read from the input memory; sampled in every cycle.
        in read_address: count_bits(largest(quads));
        /// Four parities of that quad, signed; two cycles after `read_address`.
        out read_quad: 4 * (bits + 2);
    }
}

impl Fold {
    /// With the widths of `model`.
    pub fn new(model: &Model) -> Self {
        Fold {
            bits: model.formats().input_bits as usize,
            quads: model.cases().iter().map(|case| case.formats.quads).collect(),
            frame: frame_quads(model.cases()),
            leads: model.cases().iter().map(|case| case.storage.lead).collect(),
        }
    }
}

impl Block for Fold {
    fn build<'k>(&self, k: &'k Builder, io: FoldPorts<Inside<'k>>) {
        let depth = largest(&self.quads);
        let address_bits = count_bits(depth);
        let quads = k.instance("quads", CaseCounter::new(&self.quads));
        let lead = k.instance("lead", CaseEqual::new(&self.leads, address_bits));
        let frame_quads = k.instance("frame_quads", Counter::new(self.frame));
        let running = k.instance("running", Dff {});
        let normalised_later = k.instance("normalised_later", BitDelay::new(4));
        let folded_later = k.instance("folded_later", BitDelay::new(1));
        let begins = k.instance("begins", BitDelay::new(6));
        let frees = k.instance("frees", BitDelay::new(1));
        let address = k.instance("address", Delay::new(address_bits, 5));
        let butterfly = k.instance("butterfly", Butterfly::new(self.bits));
        let folded = Ram::new(depth, 1, 4 * (self.bits + 2)).holding([Holds::Folded]).registered();
        let memory = k.instance("memory", folded);

        quads.case_index.set(io.case_index);
        lead.case_index.set(io.case_index);
        lead.value.set(quads.value);
        quads.clear.set(io.start);
        quads.enable.set(running.q);
        let ending = k.wire("ending", running.q & quads.last);
        running.d.set((io.start | (running.q & !quads.last)) & !io.rst);
        frame_quads.clear.set(io.begin_frame);
        frame_quads.enable.set(running.q);
        io.quad_address.set(frame_quads.value);
        k.comment("Registered: the frame buffer is far away.");
        frees.d.set(ending & io.last_part);
        io.free.set(frees.q);

        normalised_later.d.set(running.q);
        folded_later.d.set(normalised_later.q);
        io.normalised_valid.set(normalised_later.q);
        butterfly.quad.set(io.normalised);
        io.folded.set(butterfly.sums);
        io.folded_valid.set(folded_later.q);

        address.d.set(quads.value);
        memory.write.set(folded_later.q);
        memory.write_address.set(address.q);
        memory.write_data.set(butterfly.sums);
        memory.read.set(k.constant(1, 1));
        memory.read_address.set(io.read_address);
        io.read_quad.set(memory.read_data);
        k.comment("Products read the input while it is written.");
        begins.d.set(running.q & lead.equal);
        io.readable.set(begins.q);
        k.unused([frame_quads.last]);
    }
}

#[cfg(test)]
mod tests {
    use std::collections::VecDeque;

    use dermis_golden::fixed::stages::fold::fold;

    use super::*;
    use crate::language::testbench::{check_with_defects, random_word, subject_of, MemoryReference, Reference};
    use crate::language::Change;
    use crate::scenes::model;
    use crate::wire::Word;

    /// The quads of a subarray on their way.
    struct Folding<'a> {
        model: &'a Model,
        /// Index in its subarray of the quad that is read in this cycle, and of those of the cycles before; none before
        /// the first reset.
        quads: VecDeque<Option<usize>>,
        /// Address in the frame of the quad that is read.
        frame: Option<usize>,
        freed: bool,
        folded: Option<Word>,
        memory: MemoryReference<Word>,
    }

    impl<'a> Folding<'a> {
        fn new(model: &'a Model) -> Self {
            let quads = model.cases().iter().map(|case| case.formats.quads).max().unwrap();
            let memory = MemoryReference::new(quads, 2);
            Folding { model, quads: VecDeque::new(), frame: None, freed: false, folded: None, memory }
        }

        /// The quad that was read so many cycles earlier.
        fn earlier(&self, cycles: usize) -> Option<usize> {
            self.quads.get(cycles).copied().flatten()
        }
    }

    impl Reference for Folding<'_> {
        fn outputs(&mut self, inputs: &[Word]) -> Vec<Option<Word>> {
            let case = &self.model.cases()[inputs[1].number() as usize];
            let known = |bit: bool| (!self.quads.is_empty()).then(|| bit.into());
            vec![
                self.frame.map(|at| Word::from(at as u64)),
                known(self.freed),
                known(self.earlier(4).is_some()),
                self.folded,
                known(self.earlier(5).is_some()),
                known(self.earlier(6) == Some(case.storage.lead)),
                self.memory.shown(),
            ]
        }

        fn clock(&mut self, inputs: &[Word]) {
            let [rst, case_index, begin_frame, start, last_part, _, read] =
                [0, 1, 2, 3, 4, 5, 6].map(|input| inputs[input].number() as usize);
            let (formats, count) = (self.model.formats(), self.model.cases()[case_index].formats.quads);
            let now = self.earlier(0);
            self.memory.clock(Some(read), self.earlier(5).zip(self.folded));
            let codes = [0, 1, 2, 3].map(|lane| inputs[5].signed(lane, formats.input_bits as usize));
            self.folded = Some(Word::of_fields(&fold(&[codes])[0], formats.input_bits as usize + 2));
            self.frame = match begin_frame {
                1 => Some(0),
                _ => self.frame.map(|at| (at + usize::from(now.is_some())) % frame_quads(self.model.cases())),
            };
            self.freed = now == Some(count - 1) && last_part == 1;
            self.quads.push_front(if start == 1 { Some(0) } else { now.map(|at| at + 1).filter(|&at| at < count) });
            self.quads.truncate(7);
            if rst == 1 {
                (self.quads, self.freed) = (vec![None; 7].into(), false);
            }
        }
    }

    #[test]
    fn quads_are_read_folded_and_written() {
        let model = model(8, 8, "[partition]\ncases = [0, 1]\n");
        let formats = model.formats();
        let mut random = fastrand::Rng::with_seed(6);
        let mut case_index = 0;
        let cycle = |cycle: usize| {
            let rst = cycle == 0 || random.u8(..250) == 0;
            if rst {
                case_index = random.u64(..2);
            }
            let begin_frame = cycle == 1 || random.u8(..60) == 0;
            let bits =
                [rst.into(), case_index, begin_frame.into(), (random.u8(..25) == 0).into(), random.bool().into()];
            let normalised = random_word(&mut random, 4 * formats.input_bits as usize);
            bits.map(Word::from).into_iter().chain([normalised, random.u64(..formats.quads as u64).into()]).collect()
        };
        let stimulus: Vec<Vec<Word>> = (0..5000).map(cycle).collect();
        let subject = |changes: &[Change]| {
            subject_of!(
                Fold::new(&model),
                changes,
                inputs [rst, case_index, begin_frame, start, last_part, normalised, read_address],
                outputs [quad_address, free, normalised_valid, folded, folded_valid, readable, read_quad],
            )
        };
        let defects = [
            Change::value("", "memory__write", |k| k.named("normalised_later__q")),
            Change::value("", "frees__d", |k| k.named("ending")),
        ];
        check_with_defects(subject, &stimulus, || Folding::new(&model), &defects);
    }
}
