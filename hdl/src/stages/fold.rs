//! Stage `fold`: the frame's normalised quads to parities, into the input memory of the passes.
//!
//! One quad per cycle: frame buffer (2 cycles), `normalise` (2), butterfly (1), memory.

use dermis_golden::fixed::plan::resources::Holds;
use dermis_golden::fixed::Model;
use rust_hdl::prelude::*;

use crate::primitives::{
    count_bits, frame_quads, largest, BitDelay, Butterfly, CaseCounter, CaseEqual, Counter, Delay, Dff, Ram,
};
use crate::wire::Wire;

/// Reads the quads of a subarray from the frame buffer; they pass `normalise` and the butterfly on their way to the
/// input memory.
#[derive(dermis_hdl_derive::Block)]
pub struct Fold {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Synchronous reset, active high.
    pub rst: Signal<In, Bit>,
    /// Index of the case; constant while a frame is computed.
    pub which: Wire<In>,
    /// A new frame: reading restarts at the frame's first quad.
    pub begin_frame: Signal<In, Bit>,
    /// Fold the next subarray.
    pub start: Signal<In, Bit>,
    /// The subarray is the frame's last.
    pub last_part: Signal<In, Bit>,
    /// Address of the quad to read from the frame buffer, over all subarrays; steps in every cycle after `start` until
    /// the subarray is read.
    pub quad_address: Wire<Out>,
    /// The frame's last quad was read in the cycle before: the frame buffer is free.
    pub free: Signal<Out, Bit>,
    /// Four normalised codes, `input_bits` each, signed; four cycles after `quad_address`.
    pub normalised: Wire<In>,
    /// `normalised` holds a quad.
    pub normalised_valid: Signal<Out, Bit>,
    /// Four parities, two bits wider, signed; valid with `folded_valid`, one cycle after `normalised`.
    pub folded: Wire<Out>,
    /// `folded` holds a quad.
    pub folded_valid: Signal<Out, Bit>,
    /// The products may begin: what they read next is in the input memory; high for one cycle.
    pub readable: Signal<Out, Bit>,
    /// Address of the quad to read from the input memory; sampled in every cycle.
    pub read_address: Wire<In>,
    /// Four parities of that quad, signed; two cycles after `read_address`.
    pub read_quad: Wire<Out>,
    quads: CaseCounter,
    lead: CaseEqual,
    frame_quads: Counter,
    running: Dff,
    normalised_later: BitDelay,
    folded_later: BitDelay,
    begins: BitDelay,
    frees: BitDelay,
    address: Delay,
    butterfly: Butterfly,
    memory: Ram,
    ending: Signal<Local, Bit>,
}

impl Fold {
    /// With the widths of `model`.
    pub fn new(model: &Model) -> Self {
        let bits = model.formats().input_bits as usize;
        let limits: Vec<usize> = model.cases().iter().map(|case| case.formats.quads).collect();
        let frame_quads = frame_quads(model.cases());
        let leads: Vec<usize> = model.cases().iter().map(|case| case.storage.lead).collect();
        let quads = largest(&limits);
        let address = count_bits(quads);
        Fold {
            clk: Default::default(),
            rst: Default::default(),
            which: Wire::new(count_bits(limits.len())),
            begin_frame: Default::default(),
            start: Default::default(),
            last_part: Default::default(),
            quad_address: Wire::new(count_bits(frame_quads)),
            free: Default::default(),
            normalised: Wire::new(4 * bits),
            normalised_valid: Default::default(),
            folded: Wire::new(4 * (bits + 2)),
            folded_valid: Default::default(),
            readable: Default::default(),
            read_address: Wire::new(address),
            read_quad: Wire::new(4 * (bits + 2)),
            quads: CaseCounter::new(&limits),
            lead: CaseEqual::new(&leads, address),
            frame_quads: Counter::new(frame_quads),
            running: Default::default(),
            normalised_later: BitDelay::new(4),
            folded_later: BitDelay::new(1),
            begins: BitDelay::new(6),
            frees: BitDelay::new(1),
            address: Delay::new(address, 5),
            butterfly: Butterfly::new(bits),
            memory: Ram::new(quads, 1, 4 * (bits + 2)).holding([Holds::Folded]).registered(),
            ending: Default::default(),
        }
    }
}

impl Logic for Fold {
    #[hdl_gen]
    fn update(&mut self) {
        self.quads.clk.next = self.clk.val();
        self.frame_quads.clk.next = self.clk.val();
        self.running.clk.next = self.clk.val();
        self.normalised_later.clk.next = self.clk.val();
        self.folded_later.clk.next = self.clk.val();
        self.begins.clk.next = self.clk.val();
        self.frees.clk.next = self.clk.val();
        self.address.clk.next = self.clk.val();
        self.butterfly.clk.next = self.clk.val();
        self.memory.clk.next = self.clk.val();
        self.normalised_later.rst.next = self.rst.val();
        self.folded_later.rst.next = self.rst.val();
        self.begins.rst.next = self.rst.val();
        self.frees.rst.next = self.rst.val();

        self.quads.which.next = self.which.val();
        self.lead.which.next = self.which.val();
        self.lead.value.next = self.quads.value.val();
        self.quads.clear.next = self.start.val();
        self.quads.enable.next = self.running.q.val();
        self.ending.next = self.running.q.val() & self.quads.last.val();
        self.running.d.next = (self.start.val() | (self.running.q.val() & !self.quads.last.val())) & !self.rst.val();
        self.frame_quads.clear.next = self.begin_frame.val();
        self.frame_quads.enable.next = self.running.q.val();
        self.quad_address.next = self.frame_quads.value.val();
        comment!("Registered: the frame buffer is far away");
        self.frees.d.next = self.ending.val() & self.last_part.val();
        self.free.next = self.frees.q.val();

        self.normalised_later.d.next = self.running.q.val();
        self.folded_later.d.next = self.normalised_later.q.val();
        self.normalised_valid.next = self.normalised_later.q.val();
        self.butterfly.quad.next = self.normalised.val();
        self.folded.next = self.butterfly.sums.val();
        self.folded_valid.next = self.folded_later.q.val();

        self.address.d.next = self.quads.value.val();
        self.memory.write.next = self.folded_later.q.val().into();
        self.memory.write_address.next = self.address.q.val();
        self.memory.write_data.next = self.butterfly.sums.val();
        self.memory.read.next = true;
        self.memory.read_address.next = self.read_address.val();
        self.read_quad.next = self.memory.read_data.val();
        comment!("Products read the input while it is written");
        self.begins.d.next = self.running.q.val() & self.lead.equal.val();
        self.readable.next = self.begins.q.val();
    }
}

#[cfg(test)]
mod tests {
    use std::collections::VecDeque;

    use dermis_golden::fixed::stages::fold::fold;

    use super::*;
    use crate::language::testbench::{block_subject, check_with_defects, random_word, MemoryReference, Reference};
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
            let [rst, which, begin_frame, start, last_part, _, read] =
                [0, 1, 2, 3, 4, 5, 6].map(|input| inputs[input].number() as usize);
            let (formats, count) = (self.model.formats(), self.model.cases()[which].formats.quads);
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
        let mut which = 0;
        let cycle = |cycle: usize| {
            let rst = cycle == 0 || random.u8(..250) == 0;
            if rst {
                which = random.u64(..2);
            }
            let begin_frame = cycle == 1 || random.u8(..60) == 0;
            let bits = [rst.into(), which, begin_frame.into(), (random.u8(..25) == 0).into(), random.bool().into()];
            let normalised = random_word(&mut random, 4 * formats.input_bits as usize);
            bits.map(Word::from).into_iter().chain([normalised, random.u64(..formats.quads as u64).into()]).collect()
        };
        let stimulus: Vec<Vec<Word>> = (0..5000).map(cycle).collect();
        let subject = |changes: &[Change]| {
            block_subject!(
                Fold::new(&model),
                changes,
                inputs [rst, which, begin_frame, start, last_part, normalised, read_address],
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
