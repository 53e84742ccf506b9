use std::collections::VecDeque;

use dermis_golden::estimate::segment::Segmenter;
use dermis_golden::fixed::plan::contents::ContactPlan;
use dermis_golden::fixed::stages::receive::Received;
use dermis_golden::fixed::stages::window::{cycles, window, Array, WindowWords};
use dermis_golden::fixed::words::network::MASKED;
use dermis_golden::fixed::Plan;
use dermis_golden::spec::window::WindowPosition;

use super::*;
use crate::language::testbench::{check, check_with_defects, random_word, subject_of, Reference, Subject};
use crate::language::Change;
use crate::scenes::model;
use crate::wire::Word;

/// A model of an array with so many contacts, `own` rows and columns in a window; `more` is the rest of the scene file.
fn with_contacts([rows, cols]: [usize; 2], own: [usize; 2], contacts: usize, more: &str) -> Model {
    let change = |plan: &mut Plan| {
        (plan.scene.partition.max_contacts, plan.own_mut().noise_floor) = (contacts, 100);
        let segmenter = Segmenter::new(&plan.scene.sensor, 1.0);
        let window = window::Window { place: WindowPosition::Contact, rows: own[0], cols: own[1] };
        plan.by_contact = Some(ContactPlan { segmenter, window });
    };
    model(rows, cols, more).with_changed_plan(change).unwrap()
}

/// Input `floor`.
fn floor_word(model: &Model) -> Word {
    Word::from(model.built_in_floor().map_or(model.noise_floor(), |_| 0) as u64)
}

fn window_of(model: &Model) -> window::Window {
    model.by_contact.as_ref().unwrap().window
}

/// A contact of a frame.
#[derive(Clone)]
struct Contact {
    codes: Vec<i32>,
    labels: Vec<usize>,
    middle: [usize; 2],
    label: usize,
}

impl Contact {
    /// In a frame of random codes and labels; every few contacts in a corner.
    fn random(model: &Model, random: &mut fastrand::Rng) -> Contact {
        let layout = model.layout();
        let bits = model.formats().input_bits;
        let small = random.u32(..bits);
        let contacts = random.usize(1..=model.scene.partition.max_contacts);
        let mut line = |lines: usize| match random.u8(..3) {
            0 => 0,
            1 => lines - 1,
            _ => random.usize(..lines),
        };
        let middle = [line(layout.rows), line(layout.cols)];
        let taxels = 0..layout.rows * layout.cols;
        Contact {
            codes: taxels.clone().map(|_| (random.i64(..) >> (64 - bits) >> random.u32(small..=bits)) as i32).collect(),
            labels: taxels.map(|_| random.usize(..=contacts)).collect(),
            middle,
            label: random.usize(1..=contacts),
        }
    }

    /// The taxel of the array in the window's place that is read so many cycles after the first.
    fn taxel(&self, model: &Model, read: usize) -> Option<usize> {
        let (own, layout) = (window_of(model), model.layout());
        let read = read % (4 * own.quads().len());
        let at = own.quads().taxel(read / 4, read % 4);
        let place = [at / own.cols, at % own.cols];
        let [row, col] = [0, 1].map(|axis| {
            let half = [own.rows, own.cols][axis] / 2;
            (self.middle[axis] + place[axis]).checked_sub(half).filter(|&line| line < [layout.rows, layout.cols][axis])
        });
        Some(row? * layout.cols + col?)
    }

    /// Codes and labels at the address of this taxel.
    fn read(&self, model: &Model, taxel: usize) -> [[i64; 4]; 2] {
        let layout = model.layout();
        let address = layout.locate(taxel / layout.cols, taxel % layout.cols).address;
        let at = [0, 1, 2, 3].map(|lane| layout.taxel(address, lane));
        [at.map(|taxel| self.codes[taxel].into()), at.map(|taxel| self.labels[taxel] as i64)]
    }

    /// What the bit-true model reads.
    fn words(&self, model: &Model) -> WindowWords {
        let array =
            Array { sensor: &model.scene.sensor, codes: &self.codes, dead: &model.dead, floor: model.noise_floor() };
        let is_own = |taxel: usize| self.labels[taxel] == self.label;
        window(model.formats(), &window_of(model), &array, self.middle, &is_own)
    }

    /// Inputs of the cycle so many cycles after the start: what is not read is anything.
    fn inputs(&self, model: &Model, random: &mut fastrand::Rng, since: usize) -> Vec<Word> {
        let layout = model.layout();
        let (bits, label_bits) =
            (model.formats().input_bits as usize, count_bits(model.scene.partition.max_contacts + 1));
        let read = since.checked_sub(CODE).filter(|read| *read < 8 * window_of(model).quads().len());
        let taxel = read.and_then(|read| self.taxel(model, read));
        let [quad, labels] = match taxel.map(|taxel| self.read(model, taxel)) {
            Some([codes, labels]) => [Word::of_fields(&codes, bits), Word::of_fields(&labels, label_bits)],
            None => [random_word(random, 4 * bits), random_word(random, 4 * label_bits)],
        };
        let [row, col, label] = match since {
            0 => [self.middle[0], self.middle[1], self.label],
            _ => [random.usize(..layout.rows), random.usize(..layout.cols), random.usize(..1 << label_bits)],
        };
        let control = [false.into(), (since == 0).into()];
        control
            .into_iter()
            .chain([row, col, label].map(|number| Word::from(number as u64)))
            .chain([quad, labels, floor_word(model)])
            .collect()
    }
}

/// Windows one after the other, some of them ended by a reset or by the next start; and their stimulus.
fn stimulus(model: &Model, windows: usize) -> (Vec<Contact>, Vec<Vec<Word>>) {
    let mut random = fastrand::Rng::with_seed(7);
    let contacts: Vec<Contact> = (0..windows).map(|_| Contact::random(model, &mut random)).collect();
    let whole = cycles(&window_of(model)) as usize + 1;
    let mut inputs = vec![contacts[0].inputs(model, &mut random, 1)];
    inputs[0][0] = true.into();
    for contact in &contacts {
        let length = if random.u8(..5) == 0 { random.usize(1..whole) } else { whole + random.usize(..12) };
        inputs.extend((0..length).map(|since| contact.inputs(model, &mut random, since)));
        if random.u8(..4) == 0 {
            inputs.push(contact.inputs(model, &mut random, length));
            inputs.last_mut().unwrap()[0] = true.into();
        }
    }
    (contacts, inputs)
}

/// The window that is being read, if there is one, and those that come.
struct Windows<'a> {
    model: &'a Model,
    next: VecDeque<Contact>,
    reset: bool,
    /// The contact, what is read of its window, cycles since its start.
    now: Option<(Contact, WindowWords, usize)>,
}

impl Reference for Windows<'_> {
    fn outputs(&mut self, _: &[Word]) -> Vec<Option<Word>> {
        let (formats, own) = (self.model.formats(), window_of(self.model));
        let known = |bit: bool| self.reset.then(|| Word::from(bit));
        let Some((contact, words, since)) = &self.now else {
            return [vec![None, known(false)], vec![None; 4]].concat();
        };
        let (layout, quads) = (self.model.layout(), own.quads().len());
        let address = since.checked_sub(5).filter(|read| *read < 8 * quads).map(|read| {
            let taxel = contact.taxel(self.model, read);
            let address = taxel.map_or(0, |taxel| layout.locate(taxel / layout.cols, taxel % layout.cols).address);
            Word::from(address as u64)
        });
        // The scan begins a cycle after the start; a quad is written in the cycle after the sums have taken its last taxel.
        let read =
            since.checked_sub(1 + SUM + 1).filter(|read| *read >= 4 * quads && *read < 8 * quads && read % 4 == 3);
        let quad = read.map(|read| read / 4 - quads);
        let word = |quad: [i64; 4], bits: u32| Word::of_fields(&quad, bits as usize);
        let is_over = *since >= cycles(&own) as usize;
        let Received { positive, negative, .. } = words.own;
        vec![
            address,
            known(quad.is_some()),
            quad.map(|quad| word(words.input[quad], formats.fold_bits - formats.input_low_bits)),
            quad.map(|quad| word(words.mask[quad].map(|mask| mask / MASKED), MASK_BITS as u32)),
            is_over.then(|| positive.into()),
            is_over.then(|| negative.into()),
        ]
    }

    fn clock(&mut self, inputs: &[Word]) {
        if let Some((_, _, since)) = &mut self.now {
            *since += 1;
        }
        if inputs[1].number() == 1 {
            let contact = self.next.pop_front().unwrap();
            let words = contact.words(self.model);
            self.now = Some((contact, words, 1));
        }
        if inputs[0].number() == 1 {
            (self.reset, self.now) = (true, None);
        }
    }
}

fn subject(model: &Model, changes: &[Change]) -> Subject<'static> {
    subject_of!(
        Window::of_model(model).unwrap(),
        changes,
        inputs [rst, start, middle_row, middle_col, label, quad, labels, floor],
        outputs [quad_address, write, write_quad, mask_quad, positive, negative],
    )
}

fn reference<'a>(model: &'a Model, contacts: &[Contact]) -> Windows<'a> {
    Windows { model, next: contacts.to_vec().into(), reset: false, now: None }
}

/// Windows and arrays of even and odd sizes, either of them the larger one.
#[test]
fn windows_are_those_of_the_model() {
    for (array, own, contacts, more) in [
        ([5, 8], [11, 10], 8, "[fixed]\ninput_bits = 12\n[input]\ndead = [[4, 7]]\n"),
        ([3, 2], [3, 11], 8, ""),
        ([10, 7], [1, 2], 1, "[input]\nfull_scale_MPa = 1.0\n[hardware]\ntables = \"writable\"\n"),
    ] {
        let model = with_contacts(array, own, contacts, more);
        let (contacts, inputs) = stimulus(&model, 60);
        check(subject(&model, &[]), &inputs, &mut reference(&model, &contacts));
    }
}

#[test]
fn a_window_that_differs_is_found() {
    let dead = "[input]\ndead = [[0, 0], [3, 3], [3, 4], [7, 8]]\n";
    let model = with_contacts([8, 9], [5, 4], 3, dead);
    let (contacts, inputs) = stimulus(&model, 100);
    let defects = [
        Change::value("", "masked_0", |k| k.named("outside")),
        Change::value("", "on_array", |k| k.constant(1, 1)),
        Change::value("", "own", |k| k.constant(1, 1)),
        Change::value("", "shift", |k| k.constant(5, 3)),
        Change::value("", "valid_6", |k| k.constant(1, 1)),
        Change::value("", "ends_quad_0", |k| k.named("quad_ends")),
    ];
    check_with_defects(|changes| subject(&model, changes), &inputs, || reference(&model, &contacts), &defects);
}
