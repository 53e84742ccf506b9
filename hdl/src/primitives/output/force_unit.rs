//! Force arithmetic: p(μ*) to force words, and the output beats with their status.

use dermis_golden::fixed::plan::cycles::ACCEPT;
use dermis_golden::fixed::stages::resultants::Summed;
use dermis_golden::fixed::stages::send::{CASE, CONDITION, FOUND, FRAMES, FRAMING, TABLES_VERSION};
use dermis_golden::fixed::words::formats::{force_shift, FORCE_BITS, FORCE_SHIFT_MAX, MULTIPLIER_BITS, MU_ROUND};
use dermis_golden::fixed::{CasePlan, Model};
use dermis_golden::result::flags::{
    CLIPPED, COEFFICIENTS, LINE_FAULT, MORE_CONTACTS, NEGATIVE_PRESSURE, NO_CONTACT, SCORE_LOW, TABLES, ZERO_LIMIT,
};
use dermis_golden::spec::quads::Quads;

use super::balance::Balance;
use crate::block;
use crate::language::{concat, Block, Builder, Contents, Expr, Inside, MemoryPort, Type};
use crate::primitives::address::case_counter::{largest, value_by_case};
use crate::primitives::address::counter::count_bits;
use crate::primitives::address::quad_address::lane_of;
use crate::primitives::arithmetic::half_up::saturate;
use crate::primitives::arithmetic::rescaler::SATURATION_BITS;
use crate::primitives::frame::average::FrameMarks;
use crate::primitives::frame::code_check::FAULT_BITS;
use crate::primitives::frame::load::{THRESHOLD_BITS, VERSION_WORD_BITS};
use crate::primitives::output::frame_cycles::{COUNT_DELAY, CYCLE_BITS};
use crate::primitives::output::status_bits::status_bits;
use crate::primitives::pass::raw_length::shift_bits;
use crate::primitives::search::sweep::position_bits;
use crate::primitives::stream::queue::LATENCY as LEAVING;

block! {
    /// A pipeline without stalls: memory (3 cycles), lane selection, with contacts the μ of the label, products (2),
    /// shift, rounding and saturation, threshold, output.
    ///
    /// `beat` 0 asks for a force from `quad`, 1 … 3 for a status beat; the beat is on `beat_data` for one cycle, ten
    /// cycles after `offer`, with contacts eleven. `start` stores μ, shift and status of subarray `part`, which are
    /// usable three cycles later; `begin_frame` clears the counts of the frame.
    ///
    /// Where each contact has a μ of its own, the label of a contact stands in the place of a subarray: a status for
    /// each from 1 on, and the μ of a taxel is that of its label; label 0 is that of the taxels of no contact. Where a
    /// record of each contact is sent, the label is above the force.
    pub struct ForceUnit {
        /// Values p(μ*) in a word.
        lanes: usize,
        /// Width of p(μ*) in bits.
        value_bits: usize,
        normalise_bits: usize,
        rescale_bits: usize,
        score_bits: usize,
        /// Without a search, fx and fy are zero.
        searches: bool,
        /// Fraction bits of a μ word.
        fraction: usize,
        /// μ per step of the search.
        mu_step: i64,
        /// Right shift for exponents of zero.
        base_shift: u64,
        /// Forces with a smaller |fz| are zero; `None` where the threshold is written.
        threshold: Option<u64>,
        /// A larger score is that of no clean frame.
        score_limit: Option<i64>,
        /// Sum of the normal forces that tells whether they pull, if it is taken.
        balance: Option<Balance>,
        /// The scene has the coefficient check.
        checks: bool,
        /// The codes of a frame are checked.
        checks_codes: bool,
        /// What goes with a frame.
        marks: FrameMarks,
        /// Subarrays, or labels, of each case.
        counts: Vec<usize>,
        /// Number of each case.
        numbers: Vec<usize>,
        /// Each contact has a μ of its own.
        contacts: bool,
        /// Width of a label in bits; 1 without contacts.
        label_bits: usize,
        /// A force is sent with its label.
        tells_labels: bool,
    }
    ports ForceUnitPorts {
        clock;
        /// Synchronous reset, active high; clears the control pipeline only.
        in rst;
        /// Index of the case of the frame being sent; constant from its first `offer` to its last beat.
        in case_index: count_bits(counts.len());
        /// A new frame: clears its counts, the contact flag and the saturations.
        in begin_frame;
        /// Stores position, exponents and status of subarray `part` in this cycle.
        in start;
        /// Index of the subarray; valid with `start`.
        in part: count_bits(largest(counts));
        /// A beat is requested in this cycle.
        in offer;
        /// 0: a force, 1 … 3: a status beat; valid with `offer`.
        in beat: 2;
        /// Index of the beat's subarray; valid with `offer`.
        in beat_part: count_bits(largest(counts));
        /// Lane of the taxel in its word; valid with `offer`.
        in lane: 2;
        /// `search_width` values p(μ*), `search_bits[0]` each, signed; three cycles after `offer`.
        in quad: lanes * value_bits;
        /// μ1 in grid steps of the last level, signed; valid with `start`.
        in position_x: position_bits();
        /// μ2 in grid steps of the last level, signed; valid with `start`.
        in position_y: position_bits();
        /// Left shift of `normalise`; valid with `start`.
        in normalise: normalise_bits;
        /// Right shift of `rescale`; valid with `start`.
        in rescale: rescale_bits;
        /// The subarray meets the scene's condition; valid with `start`.
        in condition;
        /// The search found a candidate; valid with `start`.
        in found;
        /// `tlast` was early or missing; sampled when the beat with the flags leaves.
        in framing;
        /// The coefficient signature is wrong, 1 bit; valid with `start`.
        in damaged: 1;
        /// Number of frames in a sliding mean, above it whether a running zero is at its limit, without both one bit,
        /// 0; valid with `start`.
        in frames: marks.bits();
        /// Score of the best candidate, signed, 2^−6; valid with `start`.
        in score: score_bits;
        /// Words saturated by `rescale`; valid with `start`.
        in saturations: SATURATION_BITS;
        /// Cycle counter of the frame; sampled when the first beat leaves.
        in cycles: CYCLE_BITS;
        /// Labels of the taxels of `quad`, with it; one bit each without contacts.
        in labels: Quads::LANES * label_bits;
        /// There are more contacts than get a μ; sampled when the beat with the flags leaves.
        in overflow;
        /// Threshold in force LSBs, 32 bits, where it is written; constant between resets, valid from one on.
        in threshold: THRESHOLD_BITS;
        /// Version of the tables and whether the last were refused, where they are written; valid with `offer`.
        in version: VERSION_WORD_BITS;
        /// The tables are not whole, where they are written.
        in incomplete;
        /// The frame's codes are clipped, above it whether a line repeats another; sampled when the beat with the flags
        /// leaves.
        in faults: FAULT_BITS;
        /// `beat_data` holds a beat in this cycle.
        out valid;
        /// The beat is the frame's last; valid with `valid`.
        out last;
        /// `{fz, fy, fx}`, 32 bits signed each, above them the label where a record of each contact is sent, or three
        /// status words; valid with `valid`.
        out beat_data: 3 * WORD + if *tells_labels { *label_bits } else { 0 };
    }
}

/// Cycles from `offer` to `valid`.
pub const STEPS: usize = 12;
/// Cycles from `offer` to `quad`.
const READ_STEPS: usize = 3;
/// Cycles from `quad` to the lane selected, before its μ is read.
const SELECT_STEPS: usize = 1;
/// Cycles from a value to its products.
const PRODUCT_STEPS: usize = 2;
/// Bits of the unsigned low part of p: a multiplier operand without its sign bit.
const LOW: usize = MULTIPLIER_BITS as usize - 1;
/// Cycles of a frame outside its counter: before it counts, one cycle and its delay after the frame starts, and from
/// its sampling to the first beat behind the queue.
const UNCOUNTED: u32 = ACCEPT as u32 + 2 + COUNT_DELAY as u32 - 1 + LEAVING as u32;

/// Width of a word of a beat, in bits.
const WORD: usize = FORCE_BITS as usize;
/// Width of a μ word, in bits.
const MU_BITS: usize = MULTIPLIER_BITS as usize;
/// Width of a right shift, in bits.
const SHIFT_BITS: usize = 6;

/// Number of subarrays of a case, or where each contact has a μ of its own, of labels: each has a μ, from which all
/// statuses but that of label 0 are told.
fn parts(model: &Model, case: &CasePlan) -> usize {
    match model.contacts() {
        0 => case.parts.len(),
        most => 1 + most,
    }
}

impl ForceUnit {
    /// With the widths, subarrays and case numbers of `model`.
    pub fn new(model: &Model) -> Self {
        let f = model.formats();
        // The status names the case only where it is chosen per frame.
        let number = |case: &CasePlan| if model.chooses() { case.number() as usize } else { 0 };
        let counts: Vec<usize> = model.cases().iter().map(|case| parts(model, case)).collect();
        ForceUnit {
            lanes: f.search_width,
            value_bits: f.search_bits[0] as usize,
            normalise_bits: count_bits(f.input_bits as usize),
            rescale_bits: shift_bits(f),
            score_bits: f.score_bits as usize,
            searches: f.degree > 0,
            fraction: f.mu_fraction as usize,
            mu_step: f.mu_step,
            base_shift: force_shift(f, 0, 0).into(),
            threshold: model.built_in_threshold().map(|threshold| threshold.clamp(0, 1 << WORD) as u64),
            score_limit: model.score_limit.map(i64::from),
            balance: Balance::of_model(model),
            checks: model.has_coefficient_check(),
            checks_codes: model.prepare.check.is_some(),
            marks: FrameMarks::new(model),
            contacts: f.by_contact(),
            label_bits: if f.by_contact() { count_bits(largest(&counts)) } else { 1 },
            counts,
            tells_labels: model.summed() == Some(Summed::Label),
            numbers: model.cases().iter().map(number).collect(),
        }
    }

    /// The right shift of the subarray `at`, with the value of a taxel.
    fn shift<'k>(&self, io: &ForceUnitPorts<Inside<'k>>, store: &PartStore<'k>, at: Expr<'k>) -> Shift<'k> {
        let k = store.k;
        let exponents = [("normalise_held", io.normalise), ("rescale_held", io.rescale)];
        let [normalise_held, rescale_held] = exponents.map(|(name, value)| k.delay(name, value));
        let raw_shift = k.wire("raw_shift", (k.constant(8, self.base_shift) + normalise_held - rescale_held).low(8));
        let most = k.constant(SHIFT_BITS, FORCE_SHIFT_MAX.into());
        let limited = most.less(raw_shift).mux(most, raw_shift.low(SHIFT_BITS));
        let shift = k.delay("shift_now", raw_shift.top().mux(k.constant(SHIFT_BITS, 0), limited));
        let shifts = store.memory("shifts", SHIFT_BITS);
        shifts.write(store.start_2, store.part_2, shift);
        let shift = k.delay("shift", shifts.read(at));
        Shift { by: shift, rest: k.delay("shift_rest", shift.low(FINE)) }
    }

    /// One component of the shear: `value` times the μ of the subarray or label `at`; `position` is that to store.
    fn shear<'k>(
        &self,
        store: &PartStore<'k>,
        shift: Shift<'k>,
        value: Expr<'k>,
        [position, at]: [Expr<'k>; 2],
    ) -> Component<'k> {
        let k = store.k;
        let words = store.memory("mu", MU_BITS);
        words.write(store.start_2, store.part_2, self.mu_word(k, position));
        let mu = k.delay("mu_value", words.read(at).signed());
        Component::new(k, shift.moved(k, "moved", product(k, value, mu).shift_left(1)))
    }

    /// Whether the force word `z` is below the threshold, a cycle later, where there is a threshold.
    fn below<'k>(&self, k: &'k Builder, io: &ForceUnitPorts<Inside<'k>>, z: Expr<'k>) -> Option<Expr<'k>> {
        let limit = match self.threshold {
            None => Some(io.threshold.extend(WORD + 1)),
            Some(0) => None,
            Some(own) => Some(k.constant(WORD + 1, own)),
        };
        limit.map(|limit| {
            let wide = z.extend(WORD + 1).unsigned();
            let magnitude = wide.top().mux((k.constant(WORD + 1, 0) - wide).low(WORD + 1), wide);
            k.comment("The result of the threshold is registered beside the words.");
            k.delay("below", magnitude.less(limit))
        })
    }

    /// The word of flags of the beat that leaves.
    fn flags<'k>(
        &self,
        io: &ForceUnitPorts<Inside<'k>>,
        store: &PartStore<'k>,
        contact: Expr<'k>,
        balance: Option<Expr<'k>>,
    ) -> Expr<'k> {
        let k = store.k;
        let FrameMarks { frames_bits, limited } = self.marks;
        let marks = (self.marks != FrameMarks::default()).then(|| store.status("frames_held", io.frames));
        let mut bits = Vec::new();
        bits.extend(self.threshold.is_none().then_some((TABLES, io.incomplete)));
        bits.extend(self.contacts.then_some((MORE_CONTACTS, io.overflow)));
        bits.extend(self.checks.then(|| (COEFFICIENTS, store.status("damages", io.damaged))));
        bits.extend([
            (FRAMING, io.framing),
            (NO_CONTACT, !contact),
            (FOUND, store.status("founds", io.found)),
            (CONDITION, store.status("conditions", io.condition)),
        ]);
        bits.extend(self.score_limit.map(|limit| {
            let low = io.found & k.signed_constant(self.score_bits, limit).less(io.score.signed());
            (SCORE_LOW, store.status("scores_low", low))
        }));
        bits.extend(balance.map(|balance| (NEGATIVE_PRESSURE, balance.top())));
        bits.extend(marks.filter(|_| limited).map(|marks| (ZERO_LIMIT, marks.top())));
        bits.extend(
            self.checks_codes
                .then_some([(CLIPPED, io.faults.low(1)), (LINE_FAULT, io.faults.top())])
                .into_iter()
                .flatten(),
        );
        // Above the bits, the highest first, stands the number of frames, between them that of the case.
        let mut all = status_bits(k, &bits, FRAMES.low);
        let above_case = (FRAMES.low - CASE.low - CASE.bits) as usize;
        all.splice(
            above_case..above_case + CASE.bits as usize,
            [value_by_case(k, io.case_index, &self.numbers, CASE.bits as usize)],
        );
        let frames = marks.filter(|_| frames_bits > 0).map_or(k.constant(1, 0), |marks| marks.low(frames_bits));
        concat(&[vec![frames.extend(WORD - FRAMES.low as usize)], all].concat())
    }

    /// The words of status beat `beat`.
    fn status<'k>(
        &self,
        io: &ForceUnitPorts<Inside<'k>>,
        store: &PartStore<'k>,
        beat: Expr<'k>,
        [flags, cycles, force_saturations]: [Expr<'k>; 3],
    ) -> Expr<'k> {
        let k = store.k;
        let position = |name: &str, position| match self.searches {
            true => word(store.status(name, position).signed()),
            false => k.constant(WORD, 0),
        };
        let score = io.found.mux(io.score.signed().extend(WORD), k.signed_constant(WORD, 0));
        let [x, y] = [position("positions_x", io.position_x), position("positions_y", io.position_y)];
        let [normalise, rescale] = [store.status("normalises", io.normalise), store.status("rescales", io.rescale)];
        let rescale_saturations = store.status("rescale_saturations", io.saturations);
        let first = concat(&[flags, y, x]);
        let normalise = match self.threshold {
            None => {
                let low = TABLES_VERSION.low as usize;
                io.version.extend(WORD - low).concat(normalise.extend(low))
            }
            Some(_) => word(normalise),
        };
        let second = concat(&[normalise, word(rescale), store.status("scores", score)]);
        let third = concat(&[word(cycles), word(force_saturations), word(rescale_saturations)]);
        k.wire("status", beat.case(&[(1, first), (2, second)], third))
    }

    /// The μ word of a position, two cycles later.
    fn mu_word<'k>(&self, k: &'k Builder, position: Expr<'k>) -> Expr<'k> {
        let position = k.delay("position", position);
        let scaled = k.delay("scaled", position * k.signed_constant(MU_BITS, self.mu_step));
        scaled.round_shift(MU_ROUND as usize).resize(MU_BITS).unsigned()
    }
}

/// A register of the last `steps` values of a signal, the latest lowest.
fn travel<'k>(k: &'k Builder, name: &str, value: Expr<'k>, steps: usize) -> Expr<'k> {
    let register = k.register(name, Type::unsigned(value.bits() * steps));
    register.set(register.low(value.bits() * (steps - 1)).concat(value));
    *register
}

/// One word of a beat, with the sign of a signed `value`.
fn word(value: Expr<'_>) -> Expr<'_> {
    value.extend(WORD).unsigned()
}

/// The memories of a word per subarray, which is stored with `start`.
struct PartStore<'k> {
    k: &'k Builder,
    start: Expr<'k>,
    part: Expr<'k>,
    /// `start` and `part` two cycles later, with shift and μ.
    start_2: Expr<'k>,
    part_2: Expr<'k>,
    parts: usize,
    /// Subarray of the beat that leaves.
    at_out: Expr<'k>,
}

impl<'k> PartStore<'k> {
    fn new(k: &'k Builder, io: &ForceUnitPorts<Inside<'k>>, parts: usize, at_out: Expr<'k>) -> Self {
        let ForceUnitPorts { start, part, .. } = *io;
        k.comment("Shift and μ of a subarray follow their inputs by two cycles.");
        let start_2 = k.delay("start_2", k.delay("start_1", start));
        let part_2 = k.delay("part_2", k.delay("part_1", part));
        PartStore { k, start, part, start_2, part_2, parts, at_out }
    }

    /// A memory with one word per subarray.
    fn memory(&self, name: &str, bits: usize) -> MemoryPort<'k> {
        self.k.memory(name, self.parts, bits, Contents::Undefined)
    }

    /// `value` at the `start` of the subarray of the beat that leaves.
    fn status(&self, name: &str, value: Expr<'k>) -> Expr<'k> {
        let memory = self.memory(name, value.bits());
        memory.write(self.start, self.part, value.unsigned());
        memory.read(self.at_out)
    }
}

impl Block for ForceUnit {
    fn build<'k>(&self, k: &'k Builder, io: ForceUnitPorts<Inside<'k>>) {
        let (part_bits, bit, steps) = (io.part.bits(), Type::unsigned(1), STEPS - 1);
        k.comment("The request travels along the pipeline: to the lane selection, the shift, the output.");
        let offers = k.state("offers", Type::unsigned(steps), io.rst, 0);
        offers.set(offers.low(steps - 1).concat(io.offer));
        let leaves = k.wire("leaves", offers.top());
        let beats = travel(k, "beats", io.beat, steps);
        let lanes = travel(k, "lanes", io.lane, READ_STEPS);
        let parts = travel(k, "parts", io.beat_part, steps);
        let part_after = |steps: usize| parts.slice(part_bits * (steps - 1), part_bits);
        let beat_out = k.wire("beat_out", beats.slice(2 * (steps - 1), 2));
        let lane_value = lanes.slice(2 * (READ_STEPS - 1), 2);
        let at_out = k.wire("at_out", part_after(steps));
        let store = PartStore::new(k, &io, largest(&self.counts), at_out);

        let shift = self.shift(&io, &store, part_after(READ_STEPS + SELECT_STEPS + PRODUCT_STEPS));
        let label = lane_of(io.labels, Quads::LANES, lane_value);
        // Two registers: block RAM and multiplier are far apart, and so are the selection of a label and its μ.
        let value = k.delay("selected", lane_of(io.quad, self.lanes, lane_value).signed());
        let value = k.delay("value", value);
        let later = k.delay("value_2", k.delay("value_1", value));
        let doubled = later.shift_left(self.fraction + 1).extend(self.value_bits + MU_BITS + 1);
        let moved = shift.moved(k, "moved_z", doubled);
        let z = k.scope("z", || Component::new(k, moved));
        let [x, y] = match self.searches {
            false => [None, None],
            true => {
                let at_value =
                    if self.contacts { k.delay("label", label) } else { part_after(READ_STEPS + SELECT_STEPS) };
                let shear = |(name, position): (_, Expr<'k>)| {
                    Some(k.scope(name, || self.shear(&store, shift, value, [position.signed(), at_value])))
                };
                [("x", io.position_x), ("y", io.position_y)].map(shear)
            }
        };
        let all = [Some(z), y, x];
        let force = concat(&all.map(|one| one.map_or(k.constant(WORD, 0), |one| one.force)));
        let below = self.below(k, &io, z.word);
        let presses = k.delay("presses", z.word.any());

        let (contact, counting) = (k.register("contact", bit), k.register("counting", bit));
        let force_saturations = k.register("force_saturations", Type::unsigned(SATURATION_BITS));
        let cycles_held = k.register("cycles_held", Type::unsigned(CYCLE_BITS));
        let clips = all.iter().flatten().map(|one| one.clips);
        let start_count = force_saturations.extend(SATURATION_BITS + 1);
        let count = clips.fold(start_count, |count, clips| (count + clips).low(SATURATION_BITS + 1));
        let count = k.wire("count", count);
        k.comment("What a force adds to the sum of all is registered beside the result of the threshold.");
        let balance =
            self.balance.map(|rule| (rule, k.register("balance", rule.ty()), k.delay("weighed", rule.weighed(z.word))));
        let flags = self.flags(&io, &store, *contact, balance.as_ref().map(|(_, sum, _)| **sum));
        let status = self.status(&io, &store, beat_out, [flags, *cycles_held, *force_saturations]);
        let force = below.map_or(force, |below| below.mux(k.constant(3 * WORD, 0), force));
        let words = beat_out.is(0).mux(force, status);
        let steps = steps - READ_STEPS;
        let sent = self.tells_labels.then(|| travel(k, "labels_sent", label, steps));
        let sent = sent.map(|sent| sent.slice(self.label_bits * (steps - 1), self.label_bits));
        io.beat_data.delay(sent.map_or(words, |label| label.concat(words)));
        let valid = io.valid.state(io.rst, 0);
        valid.set(leaves);
        let ends: Vec<usize> = self.counts.iter().map(|count| count - 1).collect();
        let last = io.last.state(io.rst, 0);
        last.set(leaves & beat_out.is(3) & at_out.equals(value_by_case(k, io.case_index, &ends, part_bits)));

        let (zero, one) = (k.constant(1, 0), k.constant(1, 1));
        k.when(leaves, || {
            counting.set(zero);
            k.when(*counting & !io.begin_frame, || cycles_held.set(io.cycles.plus(UNCOUNTED.into())));
            k.when(beat_out.is(0), || {
                let most = one.repeat(SATURATION_BITS);
                force_saturations.set(count.top().mux(most, count.low(SATURATION_BITS)));
                k.when(below.map_or(presses, |below| presses & !below), || {
                    contact.set(one);
                    balance.iter().for_each(|(rule, sum, weighed)| sum.set(rule.sum(**sum, *weighed)));
                });
            });
        });
        k.when(io.begin_frame, || {
            counting.set(one);
            contact.set(zero);
            balance.iter().for_each(|(rule, sum, _)| sum.set(k.signed_constant(rule.ty().bits, 0)));
            force_saturations.set(k.constant(SATURATION_BITS, 0));
        });
    }
}

/// p times a μ word, two cycles later: p as an unsigned low part that fits a multiplier and the signed rest, whose
/// products are added a cycle later.
fn product<'k>(k: &'k Builder, value: Expr<'k>, mu: Expr<'k>) -> Expr<'k> {
    let (bits, more) = (value.bits() + MU_BITS, value.bits() - LOW);
    let low = k.delay("low", value.low(LOW).extend(LOW + 1).signed() * mu);
    let high = k.delay("high", value.slice(LOW, more).signed() * mu);
    k.delay("product", (high.shift_left(LOW) + low).resize(bits))
}

/// Low bits of a shift amount, which the second step of the shift takes.
const FINE: usize = 3;

/// A right shift of `SHIFT_BITS` bits in two steps, a cycle each: over all its bits it would be a longest path.
#[derive(Clone, Copy)]
struct Shift<'k> {
    /// Shift amount; valid with the value.
    by: Expr<'k>,
    /// Its low [`FINE`] bits, delayed by a cycle for the second step.
    rest: Expr<'k>,
}

impl<'k> Shift<'k> {
    /// `value` moved, two cycles later.
    fn moved(self, k: &'k Builder, name: &str, value: Expr<'k>) -> Expr<'k> {
        let coarse = self.by.slice(FINE, SHIFT_BITS - FINE).concat(k.constant(FINE, 0));
        k.delay(name, k.delay(&format!("{name}_coarse"), value.shift_right_by(coarse)).shift_right_by(self.rest))
    }
}

/// One component of a force: rounded and saturated, and a cycle later beside the result of the threshold.
#[derive(Clone, Copy)]
struct Component<'k> {
    word: Expr<'k>,
    force: Expr<'k>,
    clips: Expr<'k>,
}

impl<'k> Component<'k> {
    fn new(k: &'k Builder, moved: Expr<'k>) -> Self {
        let (word, clips) = saturate(k, moved, WORD);
        let (word, clips) = (k.delay("word", word.signed()), k.delay("clipped", clips));
        Component { word, force: k.delay("force", word), clips: k.delay("force_clips", clips) }
    }
}

#[cfg(test)]
pub(crate) mod tests;
