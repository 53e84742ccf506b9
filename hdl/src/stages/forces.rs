//! Stage `forces`: p(μ*) by step of the search into a memory; from there, force words by taxel into the output queue.

use dermis_golden::fixed::plan::resources::Holds;
use dermis_golden::fixed::Model;

use crate::block;
use crate::language::{Block, Builder, Inside};
use crate::primitives::{
    count_bits, frame_quads, position_bits, shift_bits, Counter, Delay, ForceUnit, Queue, Ram, Stream, CYCLE_BITS,
    SATURATION_BITS, THRESHOLD_BITS, VERSION_WORD_BITS,
};

block! {
    /// Values in by step, a quad or a part of it; beats out in the order in which `send` requests them.
    pub struct Forces {
        /// Words of the force memory.
        words: usize,
        shift_bits: usize,
        score_bits: usize,
        store: Ram,
        unit: ForceUnit,
    }
    ports ForcesPorts {
        clock;
        reset;
        /// Index of the case of the frame being sent; constant until its last beat.
        in case_index: unit.widths().case_index;
        /// `search_width` values p(μ*), `search_bits[0]` each, signed; valid with `values_valid`.
        in values: store.widths().write_data;
        /// `values` holds a step.
        in values_valid;
        /// A new frame: its first values come next.
        in begin_frame;
        /// Stores position, exponents and status of subarray `part` in this cycle.
        in start;
        /// Index of the subarray; valid with `start`.
        in part: unit.widths().part;
        /// A beat may be requested in this cycle.
        out room;
        /// A beat is requested; only with `room`.
        in offer;
        /// 0: a force, 1 … 3: a status beat; valid with `offer`.
        in beat: 2;
        /// Index of the beat's subarray; valid with `offer`.
        in beat_part: unit.widths().part;
        /// Address of the memory word with the taxel; valid with `offer`.
        in address: count_bits(*words);
        /// Lane of the taxel in the word; valid with `offer`.
        in lane: 2;
        /// μ1 in grid steps of the last level, signed; valid with `start`.
        in position_x: position_bits();
        /// μ2 in grid steps of the last level, signed; valid with `start`.
        in position_y: position_bits();
        /// Left shift of `normalise`; valid with `start`.
        in normalise: unit.widths().normalise;
        /// Right shift of `rescale`; valid with `start`.
        in rescale: shift_bits;
        /// The subarray meets the scene's condition; valid with `start`.
        in condition;
        /// The search found a candidate; valid with `start`.
        in found;
        /// `tlast` was early or missing; valid while the frame is sent.
        in framing;
        /// The coefficient signature is wrong, 1 bit; valid with `start`.
        in damaged: 1;
        /// Number of frames in a sliding mean, in an adaptive one with the number of its window above, otherwise one bit, 0; valid with `start`.
        in frames: unit.widths().frames;
        /// Score of the best candidate, signed, 2^−6; valid with `start`.
        in score: score_bits;
        /// Words saturated by `rescale`; valid with `start`.
        in saturations: SATURATION_BITS;
        /// Cycle counter of the frame; sampled for its first beat.
        in cycles: CYCLE_BITS;
        /// Address of the word whose labels are needed; one cycle after `address`.
        out label_address: count_bits(*words);
        /// Labels of that quad, two cycles after `label_address`; one bit each without contacts.
        in labels: unit.widths().labels;
        /// There are more contacts than get a μ; constant while the frame is sent.
        in overflow;
        /// Threshold in force LSBs, 32 bits, where it is written; constant between resets, valid from one on.
        in threshold: THRESHOLD_BITS;
        /// Version of the tables and whether the last were refused, where they are written; valid with `offer`.
        in version: VERSION_WORD_BITS;
        /// The tables are not whole, where they are written.
        in incomplete;
        /// The frame's codes are clipped, above it whether a line repeats another; valid while the frame is sent.
        in faults: unit.widths().faults;
        /// `{fz, fy, fx}`, 32 bits signed each, above them the label where a record of each contact is sent, or a status beat; valid
        /// with `m_axis_tvalid`.
        source<Stream> m_axis: unit.widths().beat_data;
    }
}

impl Forces {
    /// With the widths of `model`.
    pub fn new(model: &Model) -> Self {
        let formats = model.formats();
        let words = formats.sweep_steps(frame_quads(model.cases()));
        let value = formats.search_width * formats.search_bits[0] as usize;
        Forces {
            words,
            shift_bits: shift_bits(formats),
            score_bits: formats.score_bits as usize,
            store: Ram::new(words, 1, value).holding([Holds::Values]).registered(),
            unit: ForceUnit::new(model),
        }
    }
}

impl Block for Forces {
    fn build<'k>(&self, k: &'k Builder, io: ForcesPorts<Inside<'k>>) {
        let quads = k.instance("quads", Counter::new(self.words));
        let asked = k.instance("asked", Delay::new(io.address.bits(), 1));
        let store = k.instance("store", &self.store);
        let unit = k.instance("unit", &self.unit);
        let leaving = k.instance("leaving", Queue::new(unit.beat_data.bits()));

        store.write.set(io.values_valid);
        quads.clear.set(io.begin_frame);
        quads.enable.set(io.values_valid);
        store.write_address.set(quads.value);
        store.write_data.set(io.values);
        store.read.set(k.constant(1, 1));
        asked.d.set(io.address);
        store.read_address.set(asked.q);

        unit.case_index.set(io.case_index);
        unit.begin_frame.set(io.begin_frame);
        unit.part.set(io.part);
        unit.beat_part.set(io.beat_part);
        unit.start.set(io.start);
        unit.offer.set(io.offer);
        unit.beat.set(io.beat);
        unit.lane.set(io.lane);
        unit.quad.set(store.read_data);
        unit.position_x.set(io.position_x);
        unit.position_y.set(io.position_y);
        unit.normalise.set(io.normalise);
        unit.rescale.set(io.rescale);
        unit.condition.set(io.condition);
        unit.found.set(io.found);
        unit.framing.set(io.framing);
        unit.faults.set(io.faults);
        unit.damaged.set(io.damaged);
        unit.frames.set(io.frames);
        unit.score.set(io.score);
        unit.saturations.set(io.saturations);
        unit.cycles.set(io.cycles);
        io.label_address.set(asked.q);
        unit.labels.set(io.labels);
        unit.overflow.set(io.overflow);
        unit.threshold.set(io.threshold);
        unit.version.set(io.version);
        unit.incomplete.set(io.incomplete);

        leaving.reserve.set(io.offer);
        io.room.set(leaving.room);
        leaving.write.set(unit.valid);
        leaving.last.set(unit.last);
        leaving.word.set(unit.beat_data);
        leaving.m_axis.ready.set(io.m_axis.ready);
        io.m_axis.valid.set(leaving.m_axis.valid);
        io.m_axis.last.set(leaving.m_axis.last);
        io.m_axis.data.set(leaving.m_axis.data);
        k.unused([quads.last]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::testbench::{check_with_defects, random_word, subject_of, MemoryReference, Reference};
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
            let [valid, address, ready] = [28, 29, 30].map(|input| inputs[input]);
            let mut of_unit = inputs[..28].to_vec();
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
                random.u64(..1 << block.shift_bits).into(),
                random.bool().into(),
                random.bool().into(),
                random.bool().into(),
                random.bool().into(),
                Word::default(),
                random_word(&mut random, block.score_bits),
                random_word(&mut random, SATURATION_BITS),
                random_word(&mut random, CYCLE_BITS),
                Word::default(),
                random.bool().into(),
                random.u64(..1 << 32).into(),
                Word::default(),
                random.bool().into(),
                random.u64(..4).into(),
                (2..2 + steps).contains(&at).into(),
                random.u64(..steps as u64).into(),
                random.bool().into(),
            ];
            forces.clock(&inputs);
            inputs
        };
        let reset = [vec![Word::from(true)], vec![Word::default(); 30]].concat();
        let all = (0..frames).flat_map(|_| 0..offers + 230).map(&mut cycle);
        [reset.clone(), reset].into_iter().chain(all).collect()
    }

    #[test]
    fn values_are_stored_and_beats_leave_as_they_were_requested() {
        let model = model(4, 4, "[search]\nmu_max = 0.05\n[partition]\nrows = 2\ncols = 1\n");
        let model = model.with_changed_plan(|plan| plan.own_mut().threshold = 1000).unwrap();
        let stimulus = stimulus(&model, 20);
        let subject = |changes: &[Change]| {
            subject_of!(
                Forces::new(&model),
                changes,
                inputs [
                    rst, case_index, begin_frame, start, part, offer, beat, beat_part, lane, values, position_x, position_y,
                    normalise, rescale, condition, found, framing, damaged, frames, score, saturations, cycles, labels,
                    overflow, threshold, version, incomplete, faults, values_valid, address, m_axis_tready,
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
