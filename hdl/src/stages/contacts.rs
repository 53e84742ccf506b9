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

use crate::language::{concat, Block, Builder, Contents, Expr, Inside, Net, Type};
use crate::primitives::{count_bits, frame_quads, position_bits};
use crate::{block, states};

block! {
    /// Pulses of the stages in, their starts out; the μ of all contacts side by side, and for the status one after the other. The
    /// ports of the frame buffer and of the labels are those of the stage that runs.
    #[derive(Clone, Copy, Debug)]
    pub struct Contacts {
        quads: usize,
        /// Steps of `relax`.
        steps: usize,
        /// Largest number of contacts.
        contacts: usize,
        /// Width of the word of both ln σ.
        score_bits: usize,
        /// A contact needs codes of both signs for a μ.
        both_signs: bool,
        /// Quads of a frame, over all subarrays, and steps in which they are sent.
        frame_quads: usize,
        frame_steps: usize,
    }
    ports ContactsPorts {
        clock;
        reset;
        /// A subarray starts.
        in start;
        /// The products of v_00 may begin.
        in readable;
        /// `unfold` gives a quad of taxels.
        in taxels_valid;
        /// The contacts are known; high for one cycle.
        in segmented;
        /// Number of contacts; valid with `segmented`.
        in count: label_bits(*contacts);
        /// The μ of the contact is known; high for one cycle.
        in known;
        /// A code of the contact is above the noise floor; valid with `known`.
        in positive;
        /// A code of the contact is below minus the noise floor; valid with `known`.
        in negative;
        /// Position of its μ1 in mu_max/384, signed; valid with `known`.
        in position_x: position_bits();
        /// Position of its μ2 in mu_max/384, signed; valid with `known`.
        in position_y: position_bits();
        /// Word of both ln σ; valid with `known`.
        in ln_sigma: score_bits;
        /// The values of a subarray begin; high for one cycle.
        in values_begin;
        /// Address of the quad that `fold` reads from the frame buffer; in every cycle but those of a window.
        in fold_address: count_bits(*frame_quads);
        /// Address of the quad that `window` reads there, and of its labels; from `window_start` to `known`.
        in window_address: count_bits(*quads);
        /// Address of the quad whose labels `shear` reads; in a step.
        in shear_address: count_bits(*quads);
        /// Address of the step whose labels `forces` reads; after the last step.
        in forces_address: count_bits(*frame_steps);
        /// Address of the quad whose labels `label_beats` reads; with `sends_labels`.
        in sent_address: count_bits(*quads);
        /// `label_beats` reads labels.
        in sends_labels;
        /// Section of the passes, 0 for v_00, 1 for the layers, 2 for a step; until the next `pass_start`.
        out section: SECTION_BITS;
        /// The section begins.
        out pass_start;
        /// The frame buffer may be overwritten.
        out free;
        /// Address of the quad to read from the frame buffer; combinational.
        out quad_address: count_bits(*frame_quads);
        /// Address of the quad whose labels are needed; combinational.
        out label_address: count_bits(*quads);
        /// The taxels of `unfold` are those of v_00.
        out fills;
        /// v_00 is filled in: find the contacts.
        out segment_start;
        /// Index of the contact; from the cycle after `segmented`, or after `known` of the contact before.
        out contact: count_bits(*contacts);
        /// Label of its taxels, one more; as `contact`.
        out label: label_bits(*contacts);
        /// Read the window around it; its layers begin.
        out window_start;
        /// The rows of the first layer come next.
        out estimate_start;
        /// μ is wanted, otherwise it is 0.
        out enabled;
        /// Make the operands of a step.
        out shear_start;
        /// Position of μ1 of each contact in mu_max/384, signed, that of label 1 in the low bits; from `known` of the contact on.
        out positions_x: contacts * position_bits();
        /// The same of μ2; as `positions_x`.
        out positions_y: contacts * position_bits();
        /// `status_…` is the status of label `status_label`, 0 for the taxels of no contact.
        out status_valid;
        /// The label; valid with `status_valid`.
        out status_label: label_bits(*contacts);
        /// Position of its μ1, 0 where there is no such contact; valid with `status_valid`.
        out status_x: position_bits();
        /// Position of its μ2; as `status_x`.
        out status_y: position_bits();
        /// Its word of both ln σ, 0 where it does not meet the condition; valid with `status_valid`.
        out status_ln_sigma: score_bits;
        /// Whether it meets the condition; valid with `status_valid`.
        out status_condition;
        /// Beats may be requested: the last status has left; high for one cycle.
        out begins;
        /// The subarray is out of the passes and the search; high for one cycle.
        out ended;
    }
}

/// Width of the number of a section.
const SECTION_BITS: usize = 2;

states! {
    /// What the stage waits for, or does.
    enum State { Idle, First, Segment, Place, Contact, Step, Result, Status }
}

impl Contacts {
    /// For the contacts of `model`, if it has any.
    pub fn of_model(model: &Model) -> Option<Self> {
        let formats = model.formats();
        let frame_quads = frame_quads(model.cases());
        model.by_contact.as_ref().map(|_| Contacts {
            quads: formats.quads,
            steps: formats.degree,
            contacts: model.contacts(),
            score_bits: formats.score_bits as usize,
            both_signs: model.scene.partition.condition == Condition::BothSigns,
            frame_quads,
            frame_steps: formats.sweep_steps(frame_quads),
        })
    }

    /// What `of` gives for the contact of a label, 0 for label 0.
    fn of_label<'k>(self, k: &'k Builder, label: Expr<'k>, of: impl Fn(usize) -> Expr<'k>) -> Expr<'k> {
        let arms: Vec<(u64, Expr<'k>)> = (0..self.contacts).map(|at| (at as u64 + 1, of(at))).collect();
        label.case(&arms, k.constant(of(0).bits(), 0))
    }
}

/// Width of a label, and of a number of contacts.
fn label_bits(contacts: usize) -> usize {
    count_bits(contacts + 1)
}

impl Block for Contacts {
    fn build<'k>(&self, k: &'k Builder, io: ContactsPorts<Inside<'k>>) {
        let (rst, label_bits) = (io.rst, label_bits(self.contacts));
        let state = k.machine("state", rst, State::Idle);
        let (is, goes) = (|wanted: State| state.is(wanted), |next: State| state.goes(next));

        let contact = io.contact.register();
        let label = io.label.set(contact.extend(label_bits).plus(1));
        let found = k.register("found", Type::unsigned(label_bits));
        let section = io.section.register();
        let step = k.register("step", Type::unsigned(count_bits(self.steps)));
        let quad = k.register("quad", Type::unsigned(count_bits(self.quads)));
        let last_quad = quad.is(self.quads as u64 - 1);
        let complete = k.wire("complete", io.taxels_valid & last_quad);
        k.when(io.taxels_valid, || quad.set(last_quad.mux(k.constant(quad.bits(), 0), quad.plus(1))));
        let pulse = |name: &str, value: Expr<'_>| k.state(name, Type::unsigned(1), rst, 0).set(value);

        k.comment("A state ends with the pulse of the stage it waits for.");
        let segments = k.wire("segments", is(State::First) & complete);
        let segmented = k.wire("has_segments", is(State::Segment) & io.segmented);
        let known = k.wire("has_mu", is(State::Contact) & io.known);
        let last_contact = label.equals(*found);
        let next_contact = k.wire("next_contact", (segmented & io.count.any()) | (known & !last_contact));
        let stepped = k.wire("stepped", is(State::Step) & complete);
        let last_step = step.is(self.steps as u64 - 1);
        let steps = k.wire("steps", (segmented & !io.count.any()) | (known & last_contact) | (stepped & !last_step));
        let status_begins = k.wire("status_begins", is(State::Result) & io.values_begin);
        let status_of = k.register("status_of", Type::unsigned(label_bits));
        let ends = k.wire("ends", is(State::Status) & status_of.is(self.contacts as u64));

        k.when(segments, || goes(State::Segment));
        k.when(segmented, || {
            found.set(io.count);
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
        k.when(status_begins, || {
            goes(State::Status);
            status_of.set(k.constant(label_bits, 0));
        });
        k.when(is(State::Status), || status_of.set(status_of.plus(1)));
        k.when(ends, || goes(State::Idle));
        k.when(io.start, || {
            goes(State::First);
            section.set(k.constant(SECTION_BITS, 0));
            quad.set(k.constant(quad.bits(), 0));
        });
        pulse("segment_start", segments);
        pulse("window_start", is(State::Place));
        pulse("shear_start", steps);
        pulse("ended", ends);
        io.begins.set(k.named("ended"));
        k.comment("All windows have been read when the first step begins.");
        pulse("free", steps & !is(State::Step));
        io.fills.set(io.taxels_valid & is(State::First));
        io.estimate_start.set(k.named("window_start"));
        let enabled = if self.both_signs { io.positive & io.negative } else { io.positive | io.negative };
        let enabled = io.enabled.set(enabled);
        let reads = is(State::Contact);
        io.quad_address.set(reads.mux(io.window_address.resize(io.fold_address.bits()), io.fold_address));
        let sent = io.sends_labels.mux(io.sent_address, io.forces_address.resize(io.sent_address.bits()));
        let label_address = reads.mux(io.window_address, is(State::Step).mux(io.shear_address, sent));
        io.label_address.set(label_address);
        io.pass_start.set(io.readable | k.named("window_start") | k.named("shear_start"));

        self.store_contacts(k, &io, (known, *contact), enabled, (is(State::Status), status_of));
    }
}

impl Contacts {
    /// Stores condition, μ and σ of each contact, of `contact` once it is `known`, and sends it as status while `is_status`.
    fn store_contacts<'k>(
        &self,
        k: &'k Builder,
        io: &ContactsPorts<Inside<'k>>,
        (known, contact): (Expr<'k>, Expr<'k>),
        enabled: Expr<'k>,
        (is_status, status_of): (Expr<'k>, Net<'k>),
    ) {
        k.comment("What is known of each contact.");
        let conditions = k.register("conditions", Type::unsigned(self.contacts));
        let index = |contact: usize| contact * position_bits();
        let positions = ["positions_x", "positions_y"]
            .map(|name| k.register(name, Type::unsigned(self.contacts * position_bits())));
        let position = [io.position_x, io.position_y];
        for axis in [0, 1] {
            let stored = |at: usize| positions[axis].slice(index(at), position_bits());
            let new_position = |at: usize| (known & contact.is(at as u64)).mux(position[axis], stored(at));
            let all: Vec<Expr<'_>> = (0..self.contacts).rev().map(new_position).collect();
            positions[axis].set(concat(&all));
        }
        let new_condition = |at: usize| (known & contact.is(at as u64)).mux(enabled, conditions.at(at)) & !io.start;
        conditions.set(concat(&(0..self.contacts).rev().map(new_condition).collect::<Vec<_>>()));
        let ln_sigma = k.memory("ln_sigma_of", self.contacts, self.score_bits, Contents::Undefined);
        ln_sigma.write(known, contact, io.ln_sigma);

        k.comment("Contacts that there are not have no condition, and what has no condition has no μ.");
        k.state("status_valid", Type::unsigned(1), io.rst, 0).set(is_status);
        io.status_label.delay(*status_of);
        let condition = k.wire("condition_of", self.of_label(k, *status_of, |at| conditions.at(at)));
        io.status_condition.delay(condition);
        for (axis, name) in ["status_x", "status_y"].into_iter().enumerate() {
            let position = self.of_label(k, *status_of, |at| positions[axis].slice(index(at), position_bits()));
            k.delay(name, position & condition.repeat(position_bits()));
        }
        let word = ln_sigma.read(status_of.minus(1).low(contact.bits()));
        io.status_ln_sigma.delay(word & condition.repeat(self.score_bits));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::kernel_of;
    use crate::language::testbench::{check, random_word, Reference};
    use crate::wire::Word;

    const BLOCK: Contacts =
        Contacts { quads: 5, steps: 3, contacts: 6, score_bits: 32, both_signs: true, frame_quads: 5, frame_steps: 5 };

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
        Values,
        /// The status of this label leaves.
        Status(usize),
    }

    /// Place of each input that is more than a pulse.
    const COUNT: usize = 5;
    const SIGNS: [usize; 2] = [7, 8];
    const MU: usize = 9;
    const FOLD: usize = 13;

    /// What the status of a contact has: whether it has a μ, the position of μ, ln σ.
    type ContactStatus = (bool, [Word; 2], Word);

    /// Inputs in the order of the block. What pulses next follows from what was waited for.
    struct Sequence {
        waits: Option<Waits>,
        quads: usize,
        count: usize,
        section: Option<u64>,
        contact: Option<usize>,
        /// The contacts that are known.
        all: Vec<ContactStatus>,
        /// The pulses of this cycle: segment, window, shear, end, free.
        pulses: [bool; 5],
        /// The label whose status leaves in this cycle, and what that has if there is a μ.
        status: Option<(usize, Option<ContactStatus>)>,
    }

    impl Sequence {
        fn new() -> Self {
            let (waits, section, contact) = (None, None, None);
            Sequence { waits, quads: 0, count: 0, section, contact, all: Vec::new(), pulses: [false; 5], status: None }
        }

        /// The positions on an axis, once those of all contacts are known.
        fn positions(&self, axis: usize) -> Option<Word> {
            let all: Vec<i64> = self.all.iter().map(|own| own.1[axis].signed(0, position_bits())).collect();
            (all.len() == BLOCK.contacts).then(|| Word::of_fields(&all, position_bits()))
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
            let own = self.status.as_ref().map(|status| &status.1);
            let word = |of: &dyn Fn(&ContactStatus) -> Word| own.map(|own| own.as_ref().map_or(Word::default(), of));
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
                bit(high(3) && self.waits == Some(Waits::First)),
                bit(window),
                Some((positive && negative).into()),
                known.then_some(if reads { at_window } else { fold }),
                known.then_some(labels),
                bit(window || shear || high(2)),
                self.positions(0),
                self.positions(1),
                bit(self.status.is_some()),
                self.status.as_ref().map(|status| Word::from(status.0 as u64)),
                own.map(|own| own.is_some().into()),
                word(&|own| own.1[0]),
                word(&|own| own.1[1]),
                word(&|own| own.2),
            ]
        }

        fn clock(&mut self, inputs: &[Word]) {
            let high = |input: usize| inputs[input].number() == 1;
            let (rst, start, taxels, segmented) = (high(0), high(1), high(3), high(4));
            let (known, begins) = (high(6), high(12));
            self.pulses = [false; 5];
            self.status = match self.waits {
                Some(Waits::Status(label)) => {
                    Some((label, label.checked_sub(1).and_then(|at| self.all.get(at)).filter(|own| own.0).copied()))
                }
                _ => None,
            };
            self.quads += usize::from(taxels);
            let complete = taxels && self.quads == BLOCK.quads;
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
                    let last = step + 1 == BLOCK.steps;
                    next = Some(if last { Waits::Values } else { Waits::Step(step + 1) });
                    self.pulses[2] = !last;
                }
                Some(Waits::Values) if begins => next = Some(Waits::Status(0)),
                Some(Waits::Status(label)) => {
                    self.pulses[3] = label == BLOCK.contacts;
                    next = Some(if self.pulses[3] { Waits::Start } else { Waits::Status(label + 1) });
                }
                _ => {}
            }
            self.waits = next;
            if start {
                (self.quads, self.section, self.all) = (0, Some(0), Vec::new());
                self.waits = self.waits.map(|_| Waits::First);
            }
            if rst {
                (self.waits, self.pulses, self.status) = (Some(Waits::Start), [false; 5], None);
            }
        }
    }

    /// Frames of no contact up to all that there may be; each stage answers after a random time, some frames are cut by a reset.
    fn stimulus() -> Vec<Vec<Word>> {
        let mut random = fastrand::Rng::with_seed(17);
        let mut model = Sequence::new();
        let mut all: Vec<Vec<Word>> = Vec::new();
        for frame in 0..60 {
            let count = frame % (BLOCK.contacts + 1);
            let mut left = if frame % 9 == 8 { random.usize(..60) } else { usize::MAX };
            let mut put = |random: &mut fastrand::Rng, model: &mut Sequence, [rst, start, answers]: [bool; 3]| {
                let waits = model.waits;
                let answer = |wanted: bool| Word::from(answers && wanted);
                let mut inputs = vec![
                    rst.into(),
                    start.into(),
                    answer(waits == Some(Waits::First)),
                    answer(matches!(waits, Some(Waits::First | Waits::Step(_)))),
                    answer(waits == Some(Waits::Segments)),
                    Word::from(count as u64),
                    answer(matches!(waits, Some(Waits::Mu(_)))),
                    random.bool().into(),
                    random.bool().into(),
                    Word::of_fields(&[random.i64(-384..=384)], position_bits()),
                    Word::of_fields(&[random.i64(-384..=384)], position_bits()),
                    random_word(random, BLOCK.score_bits),
                    answer(waits == Some(Waits::Values)),
                ];
                inputs.extend((0..5).map(|_| Word::from(random.u64(..BLOCK.quads as u64))));
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
    fn stages_start_one_after_the_other_and_every_contact_has_its_status() {
        check(&kernel_of(&BLOCK), &stimulus(), &mut Sequence::new());
    }
}
