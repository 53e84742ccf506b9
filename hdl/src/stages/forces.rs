//! Stage `forces`: p(μ*) by step of the search into a memory; from there, force words by taxel into the output queue.

use dermis_golden::fixed::plan::resources::Holds;
use dermis_golden::fixed::Model;
use rust_hdl::prelude::*;

use crate::language::RustHdl;
use crate::primitives::{
    count_bits, frame_quads, position_bits, shift_bits, Counter, Delay, ForceUnit, Queue, Ram, CYCLE_BITS,
    SATURATION_BITS, THRESHOLD_BITS, VERSION_WORD_BITS,
};
use crate::wire::Wire;

/// Values in by step, a quad or a part of it; beats out in the order in which `send` requests them.
#[derive(dermis_hdl_derive::Block)]
pub struct Forces {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Synchronous reset, active high.
    pub rst: Signal<In, Bit>,
    /// Index of the case of the frame being sent; constant until its last beat.
    pub which: Wire<In>,
    /// `search_width` values p(μ*), `search_bits[0]` each, signed; valid with `values_valid`.
    pub values: Wire<In>,
    /// `values` holds a step.
    pub values_valid: Signal<In, Bit>,
    /// A new frame: its first values come next.
    pub begin_frame: Signal<In, Bit>,
    /// Stores position, exponents and status of subarray `part` in this cycle.
    pub start: Signal<In, Bit>,
    /// Index of the subarray; valid with `start`.
    pub part: Wire<In>,
    /// A beat may be requested in this cycle.
    pub room: Signal<Out, Bit>,
    /// A beat is requested; only with `room`.
    pub offer: Signal<In, Bit>,
    /// 0: a force, 1 … 3: a status beat; valid with `offer`.
    pub beat: Wire<In>,
    /// Index of the beat's subarray; valid with `offer`.
    pub beat_part: Wire<In>,
    /// Address of the memory word with the taxel; valid with `offer`.
    pub address: Wire<In>,
    /// Lane of the taxel in the word; valid with `offer`.
    pub lane: Wire<In>,
    /// μ1 in grid steps of the last level, signed; valid with `start`.
    pub position_x: Wire<In>,
    /// μ2 in grid steps of the last level, signed; valid with `start`.
    pub position_y: Wire<In>,
    /// Left shift of `normalise`; valid with `start`.
    pub normalise: Wire<In>,
    /// Right shift of `rescale`; valid with `start`.
    pub rescale: Wire<In>,
    /// The subarray meets the scene's condition; valid with `start`.
    pub condition: Signal<In, Bit>,
    /// The search found a candidate; valid with `start`.
    pub found: Signal<In, Bit>,
    /// `tlast` was early or missing; valid while the frame is sent.
    pub framing: Signal<In, Bit>,
    /// The coefficient signature is wrong, 1 bit; valid with `start`.
    pub damaged: Wire<In>,
    /// Number of frames in a sliding mean, otherwise one bit, 0; valid with `start`.
    pub frames: Wire<In>,
    /// Score of the best candidate, signed, 2^−6; valid with `start`.
    pub score: Wire<In>,
    /// Words saturated by `rescale`; valid with `start`.
    pub saturations: Wire<In>,
    /// Cycle counter of the frame; sampled for its first beat.
    pub cycles: Wire<In>,
    /// Address of the word whose labels are needed; one cycle after `address`.
    pub label_address: Wire<Out>,
    /// Labels of that quad, two cycles after `label_address`; one bit each without contacts.
    pub labels: Wire<In>,
    /// There are more contacts than get a μ; constant while the frame is sent.
    pub overflow: Signal<In, Bit>,
    /// Threshold in force LSBs, 32 bits, where it is written; constant between resets, valid from one on.
    pub threshold: Wire<In>,
    /// Version of the tables and whether the last were refused, where they are written; valid with `offer`.
    pub version: Wire<In>,
    /// The tables are not whole, where they are written.
    pub incomplete: Signal<In, Bit>,
    /// A beat is offered on `m_axis_tdata`; it is held until `m_axis_tready`.
    pub m_axis_tvalid: Signal<Out, Bit>,
    /// The receiver accepts a beat in this cycle.
    pub m_axis_tready: Signal<In, Bit>,
    /// The beat is the last of its frame; valid with `m_axis_tvalid`.
    pub m_axis_tlast: Signal<Out, Bit>,
    /// `{fz, fy, fx}`, 32 bits signed each, above them the label where a record of each contact is sent, or a status beat; valid
    /// with `m_axis_tvalid`.
    pub m_axis_tdata: Wire<Out>,
    quads: RustHdl<Counter>,
    asked: RustHdl<Delay>,
    store: RustHdl<Ram>,
    unit: ForceUnit,
    leaving: RustHdl<Queue>,
}

impl Forces {
    /// With the widths of `model`.
    pub fn new(model: &Model) -> Self {
        let formats = model.formats();
        let words = formats.sweep_steps(frame_quads(model.cases()));
        let (address, value) = (count_bits(words), formats.search_width * formats.search_bits[0] as usize);
        let unit = ForceUnit::new(model);
        Forces {
            clk: Default::default(),
            rst: Default::default(),
            which: Wire::new(unit.which.width()),
            values: Wire::new(value),
            values_valid: Default::default(),
            begin_frame: Default::default(),
            start: Default::default(),
            part: Wire::new(unit.part.width()),
            beat_part: Wire::new(unit.part.width()),
            room: Default::default(),
            offer: Default::default(),
            beat: Wire::new(2),
            address: Wire::new(address),
            lane: Wire::new(2),
            position_x: Wire::new(position_bits()),
            position_y: Wire::new(position_bits()),
            normalise: Wire::new(unit.normalise.width()),
            rescale: Wire::new(shift_bits(formats)),
            condition: Default::default(),
            found: Default::default(),
            framing: Default::default(),
            damaged: Wire::new(1),
            frames: Wire::new(unit.frames.width()),
            score: Wire::new(formats.score_bits as usize),
            saturations: Wire::new(SATURATION_BITS),
            cycles: Wire::new(CYCLE_BITS),
            label_address: Wire::new(address),
            labels: Wire::new(unit.labels.width()),
            overflow: Default::default(),
            threshold: Wire::new(THRESHOLD_BITS),
            version: Wire::new(VERSION_WORD_BITS),
            incomplete: Default::default(),
            m_axis_tvalid: Default::default(),
            m_axis_tready: Default::default(),
            m_axis_tlast: Default::default(),
            m_axis_tdata: Wire::new(unit.beat_data.width()),
            quads: RustHdl::new(Counter::new(words)),
            asked: RustHdl::new(Delay::new(address, 1)),
            store: RustHdl::new(Ram::new(words, 1, value).holding([Holds::Values]).registered()),
            leaving: RustHdl::new(Queue::new(unit.beat_data.width())),
            unit,
        }
    }
}

impl Logic for Forces {
    #[hdl_gen]
    fn update(&mut self) {
        self.quads.clk.next = self.clk.val();
        self.asked.clk.next = self.clk.val();
        self.store.clk.next = self.clk.val();
        self.unit.clk.next = self.clk.val();
        self.unit.rst.next = self.rst.val();
        self.leaving.clk.next = self.clk.val();
        self.leaving.rst.next = self.rst.val();
        self.store.write.next = self.values_valid.val().into();
        self.quads.clear.next = self.begin_frame.val();
        self.quads.enable.next = self.values_valid.val();
        self.store.write_address.next = self.quads.value.val();
        self.store.write_data.next = self.values.val();
        self.store.read.next = true;
        self.asked.d.next = self.address.val();
        self.store.read_address.next = self.asked.q.val();

        self.unit.which.next = self.which.val();
        self.unit.begin_frame.next = self.begin_frame.val();
        self.unit.part.next = self.part.val();
        self.unit.beat_part.next = self.beat_part.val();
        self.unit.start.next = self.start.val();
        self.unit.offer.next = self.offer.val();
        self.unit.beat.next = self.beat.val();
        self.unit.lane.next = self.lane.val();
        self.unit.quad.next = self.store.read_data.val();
        self.unit.position_x.next = self.position_x.val();
        self.unit.position_y.next = self.position_y.val();
        self.unit.normalise.next = self.normalise.val();
        self.unit.rescale.next = self.rescale.val();
        self.unit.condition.next = self.condition.val();
        self.unit.found.next = self.found.val();
        self.unit.framing.next = self.framing.val();
        self.unit.damaged.next = self.damaged.val();
        self.unit.frames.next = self.frames.val();
        self.unit.score.next = self.score.val();
        self.unit.saturations.next = self.saturations.val();
        self.unit.cycles.next = self.cycles.val();
        self.label_address.next = self.asked.q.val();
        self.unit.labels.next = self.labels.val();
        self.unit.overflow.next = self.overflow.val();
        self.unit.threshold.next = self.threshold.val();
        self.unit.version.next = self.version.val();
        self.unit.incomplete.next = self.incomplete.val();

        self.leaving.reserve.next = self.offer.val();
        self.room.next = self.leaving.room.val();
        self.leaving.write.next = self.unit.valid.val();
        self.leaving.last.next = self.unit.last.val();
        self.leaving.word.next = self.unit.beat_data.val();
        self.leaving.m_axis_tready.next = self.m_axis_tready.val();
        self.m_axis_tvalid.next = self.leaving.m_axis_tvalid.val();
        self.m_axis_tlast.next = self.leaving.m_axis_tlast.val();
        self.m_axis_tdata.next = self.leaving.m_axis_tdata.val();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::testbench::{block_subject, check_with_defects, random_word, MemoryReference, Reference};
    use crate::language::Change;
    use crate::primitives::{List, Requests};
    use crate::scenes::model;
    use crate::wire::Word;

    /// Memory, force unit and queue. Inputs: those of the force unit with values in place of its quad, then whether they
    /// are valid, address, ready.
    struct Integers {
        values: MemoryReference<Word>,
        /// Step of the next values.
        step: usize,
        asked: Option<usize>,
        unit: Requests,
        leaving: List,
    }

    /// Place of the values among the inputs.
    const VALUES: usize = 9;

    impl Integers {
        fn new(model: &Model) -> Self {
            Integers {
                values: MemoryReference::new(steps(model), 2),
                step: 0,
                asked: None,
                unit: Requests::new(model.clone()),
                leaving: List::default(),
            }
        }

        /// The queue has room for another beat.
        fn has_room(&mut self) -> bool {
            self.leaving.outputs(&[])[0].is_some_and(|room| room.number() == 1)
        }
    }

    fn steps(model: &Model) -> usize {
        model.formats().sweep_steps(frame_quads(model.cases()))
    }

    impl Reference for Integers {
        fn outputs(&mut self, _: &[Word]) -> Vec<Option<Word>> {
            let mut all = self.leaving.outputs(&[]);
            all.push(self.asked.map(|asked| Word::from(asked as u64)));
            all
        }

        fn clock(&mut self, inputs: &[Word]) {
            let [valid, address, ready] = [27, 28, 29].map(|input| inputs[input]);
            let mut of_unit = inputs[..27].to_vec();
            of_unit[VALUES] = self.values.shown().unwrap_or_default();
            let [beat, written, last] = [0, 1, 2].map(|output| self.unit.outputs(&of_unit)[output].unwrap_or_default());
            self.leaving.clock(&[inputs[0], inputs[5], written, last, beat, ready]);
            self.unit.clock(&of_unit);
            let write = (valid.number() == 1).then_some((self.step, inputs[VALUES]));
            self.values.clock(Some(self.asked.unwrap_or(0)), write);
            self.asked = Some(address.number() as usize);
            self.step = if inputs[2].number() == 1 { 0 } else { self.step + valid.number() as usize };
        }
    }

    /// Frames: all values and subarrays are stored, then beats requested at random, first forces, as far
    /// as there is room.
    fn stimulus(model: &Model, frames: usize) -> Vec<Vec<Word>> {
        let block = Forces::new(model);
        let mut random = fastrand::Rng::with_seed(15);
        let mut forces = Integers::new(model);
        let (parts, steps) = (model.parts().len(), steps(model));
        let offers = 2 + steps + parts + 4;
        let mut cycle = |at: usize| {
            let offer = (offers..offers + 200).contains(&at) && random.u8(..8) > 0 && forces.has_room();
            // Small values are below the threshold or round to zero, large ones saturate.
            let v = model.formats().search_bits[0] as usize;
            let values: Vec<i64> =
                (0..model.formats().search_width).map(|_| random.i64(..) >> random.usize(64 - v..64)).collect();
            let inputs = vec![
                (at == 0 && random.bool()).into(),
                Word::default(),
                (at == 1).into(),
                (2 + steps..2 + steps + parts).contains(&at).into(),
                (at.saturating_sub(2 + steps) as u64 % parts as u64).into(),
                offer.into(),
                if at < offers + 20 || random.bool() { Word::default() } else { random.u64(..4).into() },
                random.u64(..parts as u64).into(),
                random.u64(..model.formats().search_width as u64).into(),
                Word::of_fields(&values, v),
                random_word(&mut random, position_bits()),
                random_word(&mut random, position_bits()),
                random.u64(..u64::from(model.formats().input_bits)).into(),
                random.u64(..1 << block.rescale.width()).into(),
                random.bool().into(),
                random.bool().into(),
                random.bool().into(),
                random.bool().into(),
                Word::default(),
                random_word(&mut random, block.score.width()),
                random_word(&mut random, SATURATION_BITS),
                random_word(&mut random, CYCLE_BITS),
                Word::default(),
                random.bool().into(),
                random.u64(..1 << 32).into(),
                Word::default(),
                random.bool().into(),
                (2..2 + steps).contains(&at).into(),
                random.u64(..steps as u64).into(),
                random.bool().into(),
            ];
            forces.clock(&inputs);
            inputs
        };
        let reset = [vec![Word::from(true)], vec![Word::default(); 29]].concat();
        let all = (0..frames).flat_map(|_| 0..offers + 230).map(&mut cycle);
        [reset.clone(), reset].into_iter().chain(all).collect()
    }

    #[test]
    fn values_are_stored_and_beats_leave_as_they_were_requested() {
        let model = model(4, 4, "[search]\nmu_max = 0.05\n[partition]\nrows = 2\ncols = 1\n");
        let model = model.with_changed_plan(|plan| plan.threshold = 1000).unwrap();
        let stimulus = stimulus(&model, 20);
        let subject = |changes: &[Change]| {
            block_subject!(
                Forces::new(&model),
                changes,
                inputs [
                    rst, which, begin_frame, start, part, offer, beat, beat_part, lane, values, position_x, position_y,
                    normalise, rescale, condition, found, framing, damaged, frames, score, saturations, cycles, labels,
                    overflow, threshold, version, incomplete, values_valid, address, m_axis_tready,
                ],
                outputs [room, m_axis_tvalid, m_axis_tlast, m_axis_tdata, label_address],
            )
        };
        let defects = [
            Change::value("", "store__read_address", |k| k.named("address")),
            Change::value("", "leaving__reserve", |k| k.named("unit__valid")),
        ];
        check_with_defects(subject, &stimulus, || Integers::new(&model), &defects);
    }
}
