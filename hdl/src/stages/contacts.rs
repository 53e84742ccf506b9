//! Stage `contacts`: where each contact has a μ of its own, starts the stages one after the other, and keeps the μ of each.
//!
//! ```text
//! v_00 -> segment -> for each contact: window, layers, estimate -> for each step: shear, products, relax -> statuses
//! ```
//! | state | until |
//! |---|---|
//! | `IDLE` | a frame starts |
//! | `FIRST` | all quads of v_00 are there as taxels |
//! | `SEGMENT` | the contacts are known |
//! | `PLACE` | one cycle: the middle of the next contact |
//! | `CONTACT` | its μ is known |
//! | `STEP` | all quads of p are there as taxels |
//! | `RESULT` | the values begin |
//! | `TELL` | one status per cycle, that of the taxels without a contact first |

use dermis_golden::fixed::Model;
use dermis_golden::spec::scene::Condition;
use rust_hdl::prelude::*;

use crate::kernel_block;
use crate::language::{concat, Body, Builder, Contents, Expr, Kernel, Type};
use crate::primitives::{count_bits, frame_quads, position_bits};
use crate::wire::Wire;

/// Pulses of the stages in, their starts out; the μ of all contacts side by side, and for the status one after the other. The
/// ports of the frame buffer and of the labels are those of the stage that runs.
///
/// Without contacts pulses pass on wires, and what only contacts need is constant 0.
#[derive(dermis_hdl_derive::Block)]
pub struct Contacts {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Synchronous reset, active high.
    pub rst: Signal<In, Bit>,
    /// A subarray starts.
    pub start: Signal<In, Bit>,
    /// Index of the case; constant while a frame is computed.
    pub which: Wire<In>,
    /// The products of v_00 may begin.
    pub readable: Signal<In, Bit>,
    /// `fold` has read the frame.
    pub folded: Signal<In, Bit>,
    /// `unfold` gives a quad of taxels.
    pub taxels_valid: Signal<In, Bit>,
    /// The contacts are known; high for one cycle.
    pub segmented: Signal<In, Bit>,
    /// Number of contacts; valid with `segmented`.
    pub count: Wire<In>,
    /// The μ of the contact is known; high for one cycle.
    pub known: Signal<In, Bit>,
    /// The subarray meets the scene's condition.
    pub condition: Signal<In, Bit>,
    /// A code of the contact is above the noise floor; valid with `known`.
    pub positive: Signal<In, Bit>,
    /// A code of the contact is below minus the noise floor; valid with `known`.
    pub negative: Signal<In, Bit>,
    /// Position of its μ1 in mu_max/384, signed; valid with `known`.
    pub position_x: Wire<In>,
    /// Position of its μ2 in mu_max/384, signed; valid with `known`.
    pub position_y: Wire<In>,
    /// Word of both ln σ; valid with `known`.
    pub ln_sigma: Wire<In>,
    /// The values of a subarray begin; high for one cycle.
    pub values_begin: Signal<In, Bit>,
    /// The search of a subarray has ended; high for one cycle.
    pub searched: Signal<In, Bit>,
    /// Address of the quad that `fold` reads from the frame buffer; in every cycle but those of a window.
    pub fold_address: Wire<In>,
    /// Address of the quad that `window` reads there, and of its labels; from `window_start` to `known`.
    pub window_address: Wire<In>,
    /// Address of the quad whose labels `shear` reads; in a step.
    pub shear_address: Wire<In>,
    /// Address of the step whose labels `forces` reads; after the last step.
    pub forces_address: Wire<In>,
    /// Address of the quad whose labels `label_beats` reads; with `sends_labels`.
    pub sent_address: Wire<In>,
    /// `label_beats` reads labels.
    pub sends_labels: Signal<In, Bit>,
    /// Section of the passes: of contacts 0 for v_00, 1 for the layers, 2 for a step; else the case.
    pub section: Wire<Out>,
    /// The section begins.
    pub pass_start: Signal<Out, Bit>,
    /// The frame buffer may be overwritten.
    pub free: Signal<Out, Bit>,
    /// Address of the quad to read from the frame buffer; combinational.
    pub quad_address: Wire<Out>,
    /// Address of the quad whose labels are needed; combinational.
    pub label_address: Wire<Out>,
    /// The taxels of `unfold` are those of v_00.
    pub fills: Signal<Out, Bit>,
    /// v_00 is filled in: find the contacts.
    pub segment_start: Signal<Out, Bit>,
    /// Index of the contact; from the cycle after `segmented`, or after `known` of the contact before.
    pub contact: Wire<Out>,
    /// Label of its taxels, one more; as `contact`.
    pub label: Wire<Out>,
    /// Read the window around it; its layers begin.
    pub window_start: Signal<Out, Bit>,
    /// The rows of the first layer come next.
    pub estimate_start: Signal<Out, Bit>,
    /// μ is wanted, otherwise it is 0.
    pub enabled: Signal<Out, Bit>,
    /// Make the operands of a step.
    pub shear_start: Signal<Out, Bit>,
    /// Position of μ1 of each contact in mu_max/384, signed, that of label 1 in the low bits; from `known` of the contact on.
    pub positions_x: Wire<Out>,
    /// The same of μ2; as `positions_x`.
    pub positions_y: Wire<Out>,
    /// `told_…` is the status of label `told_label`, 0 for the taxels of no contact.
    pub told: Signal<Out, Bit>,
    /// The label; valid with `told`.
    pub told_label: Wire<Out>,
    /// Position of its μ1, 0 where there is no such contact; valid with `told`.
    pub told_x: Wire<Out>,
    /// Position of its μ2; as `told_x`.
    pub told_y: Wire<Out>,
    /// Its word of both ln σ, 0 where it does not meet the condition; valid with `told`.
    pub told_ln_sigma: Wire<Out>,
    /// Whether it meets the condition; valid with `told`.
    pub told_condition: Signal<Out, Bit>,
    /// Beats of a subarray may be requested; of contacts once the last status has been told; high for one cycle.
    pub begins: Signal<Out, Bit>,
    /// The subarray is out of the passes and the search; high for one cycle.
    pub ended: Signal<Out, Bit>,
    kernel: Body,
}

kernel_block!(
    Contacts,
    clock clk,
    inputs [
        rst, start, which, readable, folded, taxels_valid, segmented, count, known, condition, positive, negative,
        position_x, position_y, ln_sigma, values_begin, searched, fold_address, window_address, shear_address,
        forces_address, sent_address, sends_labels
    ],
    outputs [
        section, pass_start, free, quad_address, label_address, fills, segment_start, contact, label, window_start,
        estimate_start, enabled, shear_start, positions_x, positions_y, told, told_label, told_x, told_y, told_ln_sigma,
        told_condition, begins, ended
    ]
);

/// Width of the number of a section.
const SECTION_BITS: usize = 2;

/// What decides the circuit.
#[derive(Clone, Copy, Debug)]
struct Shape {
    quads: usize,
    /// Steps of `relax`.
    steps: usize,
    /// Largest number of contacts; 0 without contacts.
    contacts: usize,
    /// Width of the word of both ln σ.
    score_bits: usize,
    /// A contact needs codes of both signs for a μ.
    both_signs: bool,
    cases: usize,
    /// Quads of a frame, over all subarrays, and steps in which they are sent.
    frame_quads: usize,
    frame_steps: usize,
}

#[derive(Clone, Copy)]
enum State {
    Idle,
    First,
    Segment,
    Place,
    Contact,
    Step,
    Result,
    Tell,
}

impl Contacts {
    /// For the contacts of `model`.
    pub fn new(model: &Model) -> Self {
        let formats = model.formats();
        let frame_quads = frame_quads(model.cases());
        Contacts::of(Shape {
            quads: formats.quads,
            steps: formats.degree,
            contacts: model.contacts(),
            score_bits: formats.score_bits as usize,
            both_signs: model.scene.partition.condition == Condition::BothSigns,
            cases: model.cases().len(),
            frame_quads,
            frame_steps: formats.sweep_steps(frame_quads),
        })
    }

    /// Whether each contact has a μ of its own.
    pub(crate) fn are_wanted(&self) -> bool {
        !self.kernel.kernel().memories().is_empty()
    }

    fn of(shape: Shape) -> Self {
        let label = shape.label_bits();
        let positions = shape.contacts.max(1) * position_bits();
        let block = Contacts {
            clk: Default::default(),
            rst: Default::default(),
            start: Default::default(),
            which: Wire::new(count_bits(shape.cases)),
            folded: Default::default(),
            readable: Default::default(),
            taxels_valid: Default::default(),
            segmented: Default::default(),
            count: Wire::new(label),
            known: Default::default(),
            condition: Default::default(),
            positive: Default::default(),
            negative: Default::default(),
            position_x: Wire::new(position_bits()),
            position_y: Wire::new(position_bits()),
            ln_sigma: Wire::new(shape.score_bits),
            values_begin: Default::default(),
            searched: Default::default(),
            fold_address: Wire::new(count_bits(shape.frame_quads)),
            window_address: Wire::new(count_bits(shape.quads)),
            shear_address: Wire::new(count_bits(shape.quads)),
            forces_address: Wire::new(count_bits(shape.frame_steps)),
            sent_address: Wire::new(count_bits(shape.quads)),
            sends_labels: Default::default(),
            section: Wire::new(shape.section_bits()),
            free: Default::default(),
            quad_address: Wire::new(count_bits(shape.frame_quads)),
            label_address: Wire::new(count_bits(shape.quads)),
            fills: Default::default(),
            estimate_start: Default::default(),
            enabled: Default::default(),
            pass_start: Default::default(),
            segment_start: Default::default(),
            contact: Wire::new(shape.contact_bits()),
            label: Wire::new(label),
            window_start: Default::default(),
            shear_start: Default::default(),
            positions_x: Wire::new(positions),
            positions_y: Wire::new(positions),
            told: Default::default(),
            told_label: Wire::new(label),
            told_x: Wire::new(position_bits()),
            told_y: Wire::new(position_bits()),
            told_ln_sigma: Wire::new(shape.score_bits),
            told_condition: Default::default(),
            begins: Default::default(),
            ended: Default::default(),
            kernel: Body::default(),
        };
        let kernel = match shape.contacts {
            0 => block.nothing(shape),
            _ => shape.kernel(),
        };
        block.bind(kernel)
    }

    /// The kernel of a scene without contacts.
    fn nothing(&self, shape: Shape) -> Kernel {
        let k = Builder::new("contacts");
        let own = shape.inputs(&k);
        k.comment("There are no contacts.");
        for (name, value) in [
            ("section", own.which),
            ("pass_start", own.readable),
            ("free", own.folded),
            ("quad_address", own.fold_address),
            ("estimate_start", own.start),
            ("enabled", own.condition),
            ("begins", own.values_begin),
            ("ended", own.searched),
        ] {
            k.wire(name, value);
        }
        let words = [
            ("label_address", self.label_address.width()),
            ("contact", self.contact.width()),
            ("label", self.label.width()),
            ("positions_x", self.positions_x.width()),
            ("positions_y", self.positions_y.width()),
            ("told_label", self.told_label.width()),
            ("told_x", self.told_x.width()),
            ("told_y", self.told_y.width()),
            ("told_ln_sigma", self.told_ln_sigma.width()),
        ];
        let bits = ["fills", "segment_start", "window_start", "shear_start", "told", "told_condition"];
        for (name, width) in words.into_iter().chain(bits.map(|name| (name, 1))) {
            k.wire(name, k.constant(width, 0));
        }
        k.finish()
    }
}

/// Inputs of the kernel.
struct Inputs<'k> {
    rst: Expr<'k>,
    start: Expr<'k>,
    which: Expr<'k>,
    readable: Expr<'k>,
    folded: Expr<'k>,
    taxels_valid: Expr<'k>,
    segmented: Expr<'k>,
    count: Expr<'k>,
    known: Expr<'k>,
    condition: Expr<'k>,
    positive: Expr<'k>,
    negative: Expr<'k>,
    position: [Expr<'k>; 2],
    ln_sigma: Expr<'k>,
    values_begin: Expr<'k>,
    searched: Expr<'k>,
    fold_address: Expr<'k>,
    window_address: Expr<'k>,
    shear_address: Expr<'k>,
    forces_address: Expr<'k>,
    sent_address: Expr<'k>,
    sends_labels: Expr<'k>,
}

impl Shape {
    /// Width of a label, and of a number of contacts.
    fn label_bits(self) -> usize {
        count_bits(self.contacts + 1)
    }

    /// Width of the section.
    fn section_bits(self) -> usize {
        if self.contacts > 0 {
            SECTION_BITS
        } else {
            count_bits(self.cases)
        }
    }

    /// Width of the index of a contact.
    fn contact_bits(self) -> usize {
        count_bits(self.contacts.max(1))
    }

    fn inputs(self, k: &Builder) -> Inputs<'_> {
        let bit = |name: &str| k.input(name, 1);
        Inputs {
            rst: bit("rst"),
            start: bit("start"),
            which: k.input("which", count_bits(self.cases)),
            readable: bit("readable"),
            folded: bit("folded"),
            taxels_valid: bit("taxels_valid"),
            segmented: bit("segmented"),
            count: k.input("count", self.label_bits()),
            known: bit("known"),
            condition: bit("condition"),
            positive: bit("positive"),
            negative: bit("negative"),
            position: ["position_x", "position_y"].map(|name| k.input(name, position_bits())),
            ln_sigma: k.input("ln_sigma", self.score_bits),
            values_begin: bit("values_begin"),
            searched: bit("searched"),
            fold_address: k.input("fold_address", count_bits(self.frame_quads)),
            window_address: k.input("window_address", count_bits(self.quads)),
            shear_address: k.input("shear_address", count_bits(self.quads)),
            forces_address: k.input("forces_address", count_bits(self.frame_steps)),
            sent_address: k.input("sent_address", count_bits(self.quads)),
            sends_labels: bit("sends_labels"),
        }
    }

    fn kernel(self) -> Kernel {
        let k = Builder::new("contacts");
        let own = self.inputs(&k);
        let (rst, label_bits, bit) = (own.rst, self.label_bits(), Type::unsigned(1));
        let state = k.state("state", Type::unsigned(3), rst, State::Idle as u64);
        let is = |wanted: State| state.is(wanted as u64);
        let goes = |next: State| state.set(k.constant(3, next as u64));

        let contact = k.register("contact", Type::unsigned(self.contact_bits()));
        let label = k.wire("label", contact.extend(label_bits).plus(1));
        let found = k.register("found", Type::unsigned(label_bits));
        let section = k.register("section", Type::unsigned(SECTION_BITS));
        let step = k.register("step", Type::unsigned(count_bits(self.steps)));
        let quad = k.register("quad", Type::unsigned(count_bits(self.quads)));
        let last_quad = quad.is(self.quads as u64 - 1);
        let complete = k.wire("complete", own.taxels_valid & last_quad);
        k.when(own.taxels_valid, || quad.set(last_quad.mux(k.constant(quad.bits(), 0), quad.plus(1))));
        let pulse = |name: &str, value: Expr<'_>| {
            let own = k.state(name, bit, rst, 0);
            own.set(value);
        };

        k.comment("A state ends with the pulse of the stage it waits for.");
        let segments = k.wire("segments", is(State::First) & complete);
        let segmented = k.wire("has_segments", is(State::Segment) & own.segmented);
        let known = k.wire("has_mu", is(State::Contact) & own.known);
        let last_contact = label.equals(*found);
        let next_contact = k.wire("next_contact", (segmented & own.count.any()) | (known & !last_contact));
        let stepped = k.wire("stepped", is(State::Step) & complete);
        let last_step = step.is(self.steps as u64 - 1);
        let steps = k.wire("steps", (segmented & !own.count.any()) | (known & last_contact) | (stepped & !last_step));
        let tells = k.wire("tells", is(State::Result) & own.values_begin);
        let tells_of = k.register("tells_of", Type::unsigned(label_bits));
        let ends = k.wire("ends", is(State::Tell) & tells_of.is(self.contacts as u64));

        k.when(segments, || goes(State::Segment));
        k.when(segmented, || {
            found.set(own.count);
            contact.set(k.constant(contact.bits(), 0));
            step.set(k.constant(step.bits(), 0));
        });
        k.when(known & !last_contact, || contact.set(contact.plus(1)));
        k.when(next_contact, || goes(State::Place));
        k.when(is(State::Place), || {
            goes(State::Contact);
            section.set(k.constant(SECTION_BITS, 1));
        });
        k.when(steps, || {
            goes(State::Step);
            section.set(k.constant(SECTION_BITS, 2));
        });
        k.when(stepped & !last_step, || step.set(step.plus(1)));
        k.when(stepped & last_step, || goes(State::Result));
        k.when(tells, || {
            goes(State::Tell);
            tells_of.set(k.constant(label_bits, 0));
        });
        k.when(is(State::Tell), || tells_of.set(tells_of.plus(1)));
        k.when(ends, || goes(State::Idle));
        k.when(own.start, || {
            goes(State::First);
            section.set(k.constant(SECTION_BITS, 0));
            quad.set(k.constant(quad.bits(), 0));
        });
        pulse("segment_start", segments);
        pulse("window_start", is(State::Place));
        pulse("shear_start", steps);
        pulse("ended", ends);
        k.wire("begins", k.named("ended"));
        k.comment("All windows have been read when the first step begins.");
        pulse("free", steps & !is(State::Step));
        k.wire("fills", own.taxels_valid & is(State::First));
        k.wire("estimate_start", k.named("window_start"));
        let enabled = if self.both_signs { own.positive & own.negative } else { own.positive | own.negative };
        let enabled = k.wire("enabled", enabled);
        let reads = is(State::Contact);
        k.wire("quad_address", reads.mux(own.window_address.resize(own.fold_address.bits()), own.fold_address));
        let sent = own.sends_labels.mux(own.sent_address, own.forces_address.resize(own.sent_address.bits()));
        let label_address = reads.mux(own.window_address, is(State::Step).mux(own.shear_address, sent));
        k.wire("label_address", label_address);
        k.wire("pass_start", own.readable | k.named("window_start") | k.named("shear_start"));

        k.comment("What is known of each contact.");
        let conditions = k.register("conditions", Type::unsigned(self.contacts));
        let index = |contact: usize| contact * position_bits();
        let positions = ["positions_x", "positions_y"]
            .map(|name| k.register(name, Type::unsigned(self.contacts * position_bits())));
        for axis in [0, 1] {
            let kept = |at: usize| positions[axis].slice(index(at), position_bits());
            let own_now = |at: usize| (known & contact.is(at as u64)).mux(own.position[axis], kept(at));
            let all: Vec<Expr<'_>> = (0..self.contacts).rev().map(own_now).collect();
            positions[axis].set(concat(&all));
        }
        let own_condition = |at: usize| (known & contact.is(at as u64)).mux(enabled, conditions.at(at)) & !own.start;
        conditions.set(concat(&(0..self.contacts).rev().map(own_condition).collect::<Vec<_>>()));
        let ln_sigma = k.memory("ln_sigma_of", self.contacts, self.score_bits, Contents::Undefined);
        ln_sigma.write(known, *contact, own.ln_sigma);

        k.comment("Contacts that there are not have no condition, and what has no condition has no μ.");
        pulse("told", is(State::Tell));
        k.delay("told_label", *tells_of);
        let condition = k.wire("condition_of", self.of_label(&k, *tells_of, |at| conditions.at(at)));
        k.delay("told_condition", condition);
        for (axis, name) in ["told_x", "told_y"].into_iter().enumerate() {
            let position = self.of_label(&k, *tells_of, |at| positions[axis].slice(index(at), position_bits()));
            k.delay(name, position & condition.repeat(position_bits()));
        }
        let word = ln_sigma.read(tells_of.minus(1).low(self.contact_bits()));
        k.delay("told_ln_sigma", word & condition.repeat(self.score_bits));
        k.finish()
    }

    /// What `of` gives for the contact of a label, 0 for label 0.
    fn of_label<'k>(self, k: &'k Builder, label: Expr<'k>, of: impl Fn(usize) -> Expr<'k>) -> Expr<'k> {
        let arms: Vec<(u64, Expr<'k>)> = (0..self.contacts).map(|at| (at as u64 + 1, of(at))).collect();
        label.case(&arms, k.constant(of(0).bits(), 0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::testbench::{check, random_word, Reference};
    use crate::wire::Word;

    const SHAPE: Shape = Shape {
        quads: 5,
        steps: 3,
        contacts: 6,
        score_bits: 32,
        both_signs: true,
        cases: 1,
        frame_quads: 5,
        frame_steps: 5,
    };

    /// What is waited for.
    #[derive(Clone, Copy, Debug, PartialEq)]
    enum Waits {
        Start,
        First,
        Segments,
        /// The cycle in which the middle of the contact of this index is asked, and its μ.
        Middle(usize),
        Mu(usize),
        /// The step of this index.
        Step(usize),
        Tell,
        /// The status of this label is told.
        Telling(usize),
    }

    /// Place of each input that is more than a pulse.
    const COUNT: usize = 7;
    const SIGNS: [usize; 2] = [10, 11];
    const MU: usize = 12;
    const FOLD: usize = 17;

    /// What is told of a contact: whether it has a μ, the position of μ, ln σ.
    type Told = (bool, [Word; 2], Word);

    /// Inputs in the order of the block. What pulses next follows from what was waited for.
    struct Sequence {
        waits: Option<Waits>,
        quads: usize,
        count: usize,
        section: Option<u64>,
        contact: Option<usize>,
        /// The contacts that are known.
        all: Vec<Told>,
        /// The pulses of this cycle: segment, window, shear, end, free.
        pulses: [bool; 5],
        /// The label that is told in this cycle, and what is told if it has a μ.
        told: Option<(usize, Option<Told>)>,
    }

    impl Sequence {
        fn new() -> Self {
            let (waits, section, contact) = (None, None, None);
            Sequence { waits, quads: 0, count: 0, section, contact, all: Vec::new(), pulses: [false; 5], told: None }
        }

        /// The positions on an axis, once those of all contacts are known.
        fn positions(&self, axis: usize) -> Option<Word> {
            let all: Vec<i64> = self.all.iter().map(|own| own.1[axis].signed(0, position_bits())).collect();
            (all.len() == SHAPE.contacts).then(|| Word::of_fields(&all, position_bits()))
        }

        /// The first step begins.
        fn step(&mut self) -> Option<Waits> {
            (self.pulses[2], self.pulses[4], self.section) = (true, true, Some(2));
            Some(Waits::Step(0))
        }
    }

    impl Reference for Sequence {
        fn outputs(&mut self, inputs: &[Word]) -> Vec<Option<Word>> {
            let known = self.waits.is_some();
            let bit = |value: bool| known.then(|| value.into());
            let high = |input: usize| inputs[input].number() == 1;
            let [segment, window, shear, ended, free] = self.pulses;
            let own = self.told.as_ref().map(|told| &told.1);
            let word = |of: &dyn Fn(&Told) -> Word| own.map(|own| own.as_ref().map_or(Word::default(), of));
            let reads = matches!(self.waits, Some(Waits::Mu(_)));
            let [fold, at_window, at_shear, at_forces, at_sent] = [0, 1, 2, 3, 4].map(|own| inputs[FOLD + own]);
            let labels = match self.waits {
                Some(Waits::Mu(_)) => at_window,
                Some(Waits::Step(_)) => at_shear,
                _ if high(FOLD + 5) => at_sent,
                _ => at_forces,
            };
            let [positive, negative] = SIGNS.map(high);
            vec![
                self.contact.map(|contact| Word::from(contact as u64)),
                self.contact.map(|contact| Word::from(contact as u64 + 1)),
                self.section.map(Word::from),
                bit(segment),
                bit(window),
                bit(shear),
                bit(ended),
                bit(ended),
                bit(free),
                bit(high(5) && self.waits == Some(Waits::First)),
                bit(window),
                Some((positive && negative).into()),
                known.then_some(if reads { at_window } else { fold }),
                known.then_some(labels),
                bit(window || shear || high(3)),
                self.positions(0),
                self.positions(1),
                bit(self.told.is_some()),
                self.told.as_ref().map(|told| Word::from(told.0 as u64)),
                own.map(|own| own.is_some().into()),
                word(&|own| own.1[0]),
                word(&|own| own.1[1]),
                word(&|own| own.2),
            ]
        }

        fn clock(&mut self, inputs: &[Word]) {
            let high = |input: usize| inputs[input].number() == 1;
            let (rst, start, taxels, segmented) = (high(0), high(1), high(5), high(6));
            let (known, begins) = (high(8), high(15));
            self.pulses = [false; 5];
            self.told = match self.waits {
                Some(Waits::Telling(label)) => {
                    Some((label, label.checked_sub(1).and_then(|at| self.all.get(at)).filter(|own| own.0).copied()))
                }
                _ => None,
            };
            self.quads += usize::from(taxels);
            let complete = taxels && self.quads == SHAPE.quads;
            if complete {
                self.quads = 0;
            }
            let mut next = self.waits;
            match self.waits {
                Some(Waits::First) if complete => (next, self.pulses[0]) = (Some(Waits::Segments), true),
                Some(Waits::Segments) if segmented => {
                    (self.count, self.contact) = (inputs[COUNT].number() as usize, Some(0));
                    next = if self.count == 0 { self.step() } else { Some(Waits::Middle(0)) };
                }
                Some(Waits::Middle(contact)) => {
                    (next, self.pulses[1], self.section) = (Some(Waits::Mu(contact)), true, Some(1));
                }
                Some(Waits::Mu(contact)) if known => {
                    let condition = SIGNS.iter().all(|input| high(*input));
                    self.all.push((condition, [inputs[MU], inputs[MU + 1]], inputs[MU + 2]));
                    if contact + 1 < self.count {
                        (next, self.contact) = (Some(Waits::Middle(contact + 1)), Some(contact + 1));
                    } else {
                        next = self.step();
                    }
                }
                Some(Waits::Step(step)) if complete => {
                    let last = step + 1 == SHAPE.steps;
                    next = Some(if last { Waits::Tell } else { Waits::Step(step + 1) });
                    self.pulses[2] = !last;
                }
                Some(Waits::Tell) if begins => next = Some(Waits::Telling(0)),
                Some(Waits::Telling(label)) => {
                    self.pulses[3] = label == SHAPE.contacts;
                    next = Some(if self.pulses[3] { Waits::Start } else { Waits::Telling(label + 1) });
                }
                _ => {}
            }
            self.waits = next;
            if start {
                (self.quads, self.section, self.all) = (0, Some(0), Vec::new());
                self.waits = self.waits.map(|_| Waits::First);
            }
            if rst {
                (self.waits, self.pulses, self.told) = (Some(Waits::Start), [false; 5], None);
            }
        }
    }

    /// Frames of no contact up to all that there may be; each stage answers after a random time, some frames are cut by a reset.
    fn stimulus() -> Vec<Vec<Word>> {
        let mut random = fastrand::Rng::with_seed(17);
        let mut model = Sequence::new();
        let mut all: Vec<Vec<Word>> = Vec::new();
        for frame in 0..60 {
            let count = frame % (SHAPE.contacts + 1);
            let mut left = if frame % 9 == 8 { random.usize(..60) } else { usize::MAX };
            let mut put = |random: &mut fastrand::Rng, model: &mut Sequence, [rst, start, answers]: [bool; 3]| {
                let waits = model.waits;
                let answer = |wanted: bool| Word::from(answers && wanted);
                let mut inputs = vec![
                    rst.into(),
                    start.into(),
                    Word::default(),
                    answer(waits == Some(Waits::First)),
                    random.bool().into(),
                    answer(matches!(waits, Some(Waits::First | Waits::Step(_)))),
                    answer(waits == Some(Waits::Segments)),
                    Word::from(count as u64),
                    answer(matches!(waits, Some(Waits::Mu(_)))),
                    random.bool().into(),
                    random.bool().into(),
                    random.bool().into(),
                    Word::of_fields(&[random.i64(-384..=384)], position_bits()),
                    Word::of_fields(&[random.i64(-384..=384)], position_bits()),
                    random_word(random, SHAPE.score_bits),
                    answer(waits == Some(Waits::Tell)),
                    random.bool().into(),
                ];
                inputs.extend((0..5).map(|_| Word::from(random.u64(..SHAPE.quads as u64))));
                inputs.push(random.bool().into());
                model.clock(&inputs);
                all.push(inputs);
            };
            put(&mut random, &mut model, [frame % 5 == 0, false, false]);
            put(&mut random, &mut model, [false, true, false]);
            while model.waits != Some(Waits::Start) && left > 0 {
                let answers = random.u8(..3) == 0;
                put(&mut random, &mut model, [false, false, answers]);
                left -= 1;
            }
            if left == 0 {
                put(&mut random, &mut model, [true, false, false]);
            }
        }
        all
    }

    #[test]
    fn stages_start_one_after_the_other_and_every_contact_is_told() {
        check(Contacts::of(SHAPE).kernel.kernel(), &stimulus(), &mut Sequence::new());
    }
}
