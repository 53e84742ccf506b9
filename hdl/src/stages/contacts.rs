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
//! | `RESULT` | the search's place is asked to send: its values are p |
//! | `TELL` | one status per cycle, that of the taxels without a contact first |

use dermis_golden::fixed::Model;
use rust_hdl::prelude::*;

use crate::kernel_block;
use crate::language::{concat, Body, Builder, Contents, Expr, Kernel, Type};
use crate::primitives::{count_bits, position_bits};
use crate::wire::Wire;

/// Pulses of the stages in, their starts out; the μ of all contacts side by side, and for the status one after the other.
///
/// Without contacts all outputs are constant 0.
#[derive(LogicBlock)]
pub struct Contacts {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Synchronous reset, active high.
    pub rst: Signal<In, Bit>,
    /// A frame starts.
    pub start: Signal<In, Bit>,
    /// The products of v_00 may begin.
    pub readable: Signal<In, Bit>,
    /// `unfold` gives a quad of taxels.
    pub taxels_valid: Signal<In, Bit>,
    /// The contacts are known; high for one cycle.
    pub segmented: Signal<In, Bit>,
    /// Number of contacts; valid with `segmented`.
    pub count: Wire<In>,
    /// The μ of the contact is known; high for one cycle.
    pub known: Signal<In, Bit>,
    /// Whether the contact meets the scene's condition; valid with `known`.
    pub condition: Signal<In, Bit>,
    /// Position of its μ1 in mu_max/384, signed; valid with `known`.
    pub position_x: Wire<In>,
    /// Position of its μ2 in mu_max/384, signed; valid with `known`.
    pub position_y: Wire<In>,
    /// Word of both ln σ; valid with `known`.
    pub ln_sigma: Wire<In>,
    /// Statuses may be told; high for one cycle.
    pub tell: Signal<In, Bit>,
    /// Section of the passes: 0 for v_00, 1 for the layers, 2 for a step.
    pub section: Wire<Out>,
    /// The section begins.
    pub pass_start: Signal<Out, Bit>,
    /// v_00 is filled in: find the contacts.
    pub segment_start: Signal<Out, Bit>,
    /// Index of the contact.
    pub contact: Wire<Out>,
    /// Label of its taxels: one more.
    pub label: Wire<Out>,
    /// Read the window around it; its layers begin.
    pub window_start: Signal<Out, Bit>,
    /// Make the operands of a step.
    pub shear_start: Signal<Out, Bit>,
    /// Position of μ1 of each contact in mu_max/384, signed, that of label 1 in the low bits.
    pub positions_x: Wire<Out>,
    /// The same of μ2.
    pub positions_y: Wire<Out>,
    /// All steps are done, p is complete; high for one cycle.
    pub done: Signal<Out, Bit>,
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
    /// The last status has been told; high for one cycle.
    pub ended: Signal<Out, Bit>,
    kernel: Body,
}

kernel_block!(
    Contacts,
    clock clk,
    inputs [
        rst, start, readable, taxels_valid, segmented, count, known, condition, position_x, position_y, ln_sigma, tell
    ],
    outputs [
        section, pass_start, segment_start, contact, label, window_start, shear_start, positions_x, positions_y, done,
        told, told_label, told_x, told_y, told_ln_sigma, told_condition, ended
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
        let contacts = if formats.by_contact() { model.scene.partition.max_contacts } else { 0 };
        let (quads, steps, score_bits) = (formats.quads, formats.degree, formats.score_bits as usize);
        Contacts::of(Shape { quads, steps, contacts, score_bits })
    }

    fn of(shape: Shape) -> Self {
        let label = shape.label_bits();
        let positions = shape.contacts.max(1) * position_bits();
        let block = Contacts {
            clk: Default::default(),
            rst: Default::default(),
            start: Default::default(),
            readable: Default::default(),
            taxels_valid: Default::default(),
            segmented: Default::default(),
            count: Wire::new(label),
            known: Default::default(),
            condition: Default::default(),
            position_x: Wire::new(position_bits()),
            position_y: Wire::new(position_bits()),
            ln_sigma: Wire::new(shape.score_bits),
            tell: Default::default(),
            section: Wire::new(SECTION_BITS),
            pass_start: Default::default(),
            segment_start: Default::default(),
            contact: Wire::new(shape.contact_bits()),
            label: Wire::new(label),
            window_start: Default::default(),
            shear_start: Default::default(),
            positions_x: Wire::new(positions),
            positions_y: Wire::new(positions),
            done: Default::default(),
            told: Default::default(),
            told_label: Wire::new(label),
            told_x: Wire::new(position_bits()),
            told_y: Wire::new(position_bits()),
            told_ln_sigma: Wire::new(shape.score_bits),
            told_condition: Default::default(),
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
        shape.inputs(&k);
        k.comment("There are no contacts.");
        let words = [
            ("section", self.section.width()),
            ("contact", self.contact.width()),
            ("label", self.label.width()),
            ("positions_x", self.positions_x.width()),
            ("positions_y", self.positions_y.width()),
            ("told_label", self.told_label.width()),
            ("told_x", self.told_x.width()),
            ("told_y", self.told_y.width()),
            ("told_ln_sigma", self.told_ln_sigma.width()),
        ];
        let bits =
            ["pass_start", "segment_start", "window_start", "shear_start", "done", "told", "told_condition", "ended"];
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
    readable: Expr<'k>,
    taxels_valid: Expr<'k>,
    segmented: Expr<'k>,
    count: Expr<'k>,
    known: Expr<'k>,
    condition: Expr<'k>,
    position: [Expr<'k>; 2],
    ln_sigma: Expr<'k>,
    tell: Expr<'k>,
}

impl Shape {
    /// Width of a label, and of a number of contacts.
    fn label_bits(self) -> usize {
        count_bits(self.contacts + 1)
    }

    fn contact_bits(self) -> usize {
        count_bits(self.contacts.max(1))
    }

    fn inputs(self, k: &Builder) -> Inputs<'_> {
        let bit = |name: &str| k.input(name, 1);
        Inputs {
            rst: bit("rst"),
            start: bit("start"),
            readable: bit("readable"),
            taxels_valid: bit("taxels_valid"),
            segmented: bit("segmented"),
            count: k.input("count", self.label_bits()),
            known: bit("known"),
            condition: bit("condition"),
            position: ["position_x", "position_y"].map(|name| k.input(name, position_bits())),
            ln_sigma: k.input("ln_sigma", self.score_bits),
            tell: bit("tell"),
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
        let finishes = k.wire("finishes", stepped & last_step);
        let tells = k.wire("tells", is(State::Result) & own.tell);
        let told_label = k.register("told_label", Type::unsigned(label_bits));
        let ends = k.wire("ends", is(State::Tell) & told_label.is(self.contacts as u64));

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
        k.when(finishes, || goes(State::Result));
        k.when(tells, || {
            goes(State::Tell);
            told_label.set(k.constant(label_bits, 0));
        });
        k.when(is(State::Tell), || told_label.set(told_label.plus(1)));
        k.when(ends, || goes(State::Idle));
        k.when(own.start, || {
            goes(State::First);
            section.set(k.constant(SECTION_BITS, 0));
            quad.set(k.constant(quad.bits(), 0));
        });
        pulse("segment_start", segments);
        pulse("window_start", is(State::Place));
        pulse("shear_start", steps);
        pulse("done", finishes);
        pulse("ended", ends);
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
        let own_condition =
            |at: usize| (known & contact.is(at as u64)).mux(own.condition, conditions.at(at)) & !own.start;
        conditions.set(concat(&(0..self.contacts).rev().map(own_condition).collect::<Vec<_>>()));
        let ln_sigma = k.memory("ln_sigma_of", self.contacts, self.score_bits, Contents::Undefined);
        ln_sigma.write(known, *contact, own.ln_sigma);

        k.comment("Contacts that there are not have no condition, and what has no condition has no μ.");
        let telling = k.wire("told", is(State::Tell));
        let condition = self.of_label(&k, *told_label, |at| conditions.at(at)) & telling;
        let condition = k.wire("told_condition", condition);
        for (axis, name) in ["told_x", "told_y"].into_iter().enumerate() {
            let position = self.of_label(&k, *told_label, |at| positions[axis].slice(index(at), position_bits()));
            k.wire(name, position & condition.repeat(position_bits()));
        }
        let word = ln_sigma.read(told_label.minus(1).low(self.contact_bits()));
        k.wire("told_ln_sigma", word & condition.repeat(self.score_bits));
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

    const SHAPE: Shape = Shape { quads: 5, steps: 3, contacts: 6, score_bits: 32 };

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

    /// Inputs in the order of the block. What pulses next follows from what was waited for.
    struct Sequence {
        waits: Option<Waits>,
        quads: usize,
        count: usize,
        section: Option<u64>,
        contact: Option<usize>,
        /// Condition, position and ln σ of each contact that is known.
        all: Vec<(bool, [Word; 2], Word)>,
        /// The pulses of this cycle: segment, window, shear, done, ended.
        pulses: [bool; 5],
    }

    impl Sequence {
        fn new() -> Self {
            let (waits, section, contact) = (None, None, None);
            Sequence { waits, quads: 0, count: 0, section, contact, all: Vec::new(), pulses: [false; 5] }
        }

        /// The positions on an axis of the contacts known, with what was kept of others: not compared.
        fn positions(&self, axis: usize) -> Option<Word> {
            let all: Vec<i64> = self.all.iter().map(|own| own.1[axis].signed(0, position_bits())).collect();
            (all.len() == SHAPE.contacts).then(|| Word::of_fields(&all, position_bits()))
        }
    }

    impl Reference for Sequence {
        fn outputs(&mut self, inputs: &[Word]) -> Vec<Option<Word>> {
            let known = self.waits.is_some();
            let bit = |value: bool| known.then(|| value.into());
            let [segment, window, shear, done, ended] = self.pulses;
            let telling = match self.waits {
                Some(Waits::Telling(label)) => Some(label),
                _ => None,
            };
            let own = telling.map(|label| label.checked_sub(1).and_then(|at| self.all.get(at)).filter(|own| own.0));
            let word = |of: &dyn Fn(&(bool, [Word; 2], Word)) -> Word| own.map(|own| own.map_or(Word::default(), of));
            let contact = self.contact.map(|contact| Word::from(contact as u64));
            vec![
                contact,
                self.contact.map(|contact| Word::from(contact as u64 + 1)),
                self.section.map(Word::from),
                telling.map(|label| Word::from(label as u64)),
                bit(segment),
                bit(window),
                bit(shear),
                bit(done),
                bit(ended),
                bit(window || shear || inputs[2].number() == 1),
                self.positions(0),
                self.positions(1),
                bit(telling.is_some()),
                bit(own.flatten().is_some()),
                word(&|own| own.1[0]),
                word(&|own| own.1[1]),
                word(&|own| own.2),
            ]
        }

        fn clock(&mut self, inputs: &[Word]) {
            let [rst, start, _, taxels, segmented] = [0, 1, 2, 3, 4].map(|input| inputs[input].number() == 1);
            let [known, condition, tell] = [6, 7, 11].map(|input| inputs[input].number() == 1);
            self.pulses = [false; 5];
            self.quads += usize::from(taxels);
            let complete = taxels && self.quads == SHAPE.quads;
            if complete {
                self.quads = 0;
            }
            let mut next = self.waits;
            match self.waits {
                Some(Waits::First) if complete => (next, self.pulses[0]) = (Some(Waits::Segments), true),
                Some(Waits::Segments) if segmented => {
                    self.count = inputs[5].number() as usize;
                    (next, self.contact) = (Some(Waits::Middle(0)), Some(0));
                    if self.count == 0 {
                        (next, self.pulses[2], self.section) = (Some(Waits::Step(0)), true, Some(2));
                    }
                }
                Some(Waits::Middle(contact)) => {
                    (next, self.pulses[1], self.section) = (Some(Waits::Mu(contact)), true, Some(1));
                }
                Some(Waits::Mu(contact)) if known => {
                    self.all.push((condition, [inputs[8], inputs[9]], inputs[10]));
                    if contact + 1 < self.count {
                        (next, self.contact) = (Some(Waits::Middle(contact + 1)), Some(contact + 1));
                    } else {
                        (next, self.pulses[2], self.section) = (Some(Waits::Step(0)), true, Some(2));
                    }
                }
                Some(Waits::Step(step)) if complete => {
                    let last = step + 1 == SHAPE.steps;
                    next = Some(if last { Waits::Tell } else { Waits::Step(step + 1) });
                    self.pulses[if last { 3 } else { 2 }] = true;
                }
                Some(Waits::Tell) if tell => next = Some(Waits::Telling(0)),
                Some(Waits::Telling(label)) => {
                    self.pulses[4] = label == SHAPE.contacts;
                    next = Some(if self.pulses[4] { Waits::Start } else { Waits::Telling(label + 1) });
                }
                _ => {}
            }
            self.waits = next;
            if start {
                (self.quads, self.section, self.all) = (0, Some(0), Vec::new());
                self.waits = self.waits.map(|_| Waits::First);
            }
            if rst {
                (self.waits, self.pulses) = (Some(Waits::Start), [false; 5]);
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
                let inputs = vec![
                    rst.into(),
                    start.into(),
                    answer(waits == Some(Waits::First)),
                    answer(matches!(waits, Some(Waits::First | Waits::Step(_)))),
                    answer(waits == Some(Waits::Segments)),
                    Word::from(count as u64),
                    answer(matches!(waits, Some(Waits::Mu(_)))),
                    random.bool().into(),
                    Word::of_fields(&[random.i64(-384..=384)], position_bits()),
                    Word::of_fields(&[random.i64(-384..=384)], position_bits()),
                    random_word(random, SHAPE.score_bits),
                    answer(waits == Some(Waits::Tell)),
                ];
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
