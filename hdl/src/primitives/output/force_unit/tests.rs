//! The force unit against the bit-true model's forces, with stalls and resets.

use std::collections::VecDeque;

use dermis_golden::fixed::plan::contents::Plan;
use dermis_golden::fixed::stages::forces::{force, mu_word};
use dermis_golden::result::flags::{StatusField, ZERO_LIMIT};

use super::*;
use crate::language::kernel_of;
use crate::language::testbench::{check, difference, random_word, Reference};
use crate::scenes::{learned, model};
use crate::wire::Word;

/// A request, and its value once it has been read.
#[derive(Clone, Copy, Debug)]
struct Entry {
    beat: u64,
    part: usize,
    lane: usize,
    value: i64,
    /// Label of the taxel.
    label: usize,
}

/// Values stored per subarray.
#[derive(Clone, Copy, Debug, Default)]
struct Part {
    position: [i32; 2],
    normalise: u32,
    rescale: u32,
    condition: bool,
    found: bool,
    damaged: bool,
    score_low: bool,
    frames: u32,
    score: i32,
    saturations: u32,
}

/// Values stored per frame.
#[derive(Clone, Copy, Debug, Default)]
struct Frame {
    cycles: u32,
    saturations: u32,
    contact: bool,
    balance: i64,
    counting: bool,
}

/// Subarrays of the case that has most, or labels.
fn most_parts(model: &Model) -> usize {
    model.cases().iter().map(|case| parts(model, case)).max().unwrap()
}

/// Width of a label.
fn label_bits(model: &Model) -> usize {
    if model.formats().by_contact() {
        count_bits(most_parts(model))
    } else {
        1
    }
}

/// The model's force on every request.
pub(crate) struct Requests {
    model: Model,
    /// Requests of the last cycles, the latest first.
    pipe: VecDeque<Option<Entry>>,
    frame: Frame,
    parts: Vec<Part>,
    output: Option<(bool, Word)>,
    reset: bool,
}

impl Requests {
    pub(crate) fn new(model: Model) -> Self {
        let parts = most_parts(&model);
        let (pipe, parts) = (vec![None; STEPS - 1].into(), vec![Part::default(); parts]);
        Requests { model, pipe, frame: Frame::default(), parts, output: None, reset: false }
    }

    fn keep(&mut self, inputs: &[Word]) {
        let [condition, found, damaged] = [14, 15, 17].map(|k| inputs[k].number() == 1);
        let score = if found { inputs[19].signed(0, self.model.formats().score_bits as usize) as i32 } else { 0 };
        self.parts[inputs[4].number() as usize] = Part {
            score,
            score_low: found && self.model.score_limit.is_some_and(|limit| score > limit),
            position: [10, 11].map(|k| inputs[k].signed(0, position_bits()) as i32),
            normalise: inputs[12].number() as u32,
            rescale: inputs[13].number() as u32,
            condition,
            found,
            damaged: damaged && self.model.has_coefficient_check(),
            frames: if self.model.scene.input.has_memory() { inputs[18].number() as u32 } else { 0 },
            saturations: inputs[20].number() as u32,
        };
    }

    /// The word of what goes with a frame: the number of frames, above it whether a zero is at its limit.
    fn frames(&self, marks: u32) -> u32 {
        let input = &self.model.scene.input;
        let bits = if input.slides() { input.average + 1 } else { 0 };
        let limited = if input.running_zero().is_some() { marks >> bits << ZERO_LIMIT.low } else { 0 };
        limited | (marks & ((1 << bits) - 1)) << FRAMES.low
    }

    fn answer(&mut self, entry: Entry, inputs: &[Word]) -> [i32; 3] {
        let f = self.model.formats();
        let (frame, part) = (&mut self.frame, self.parts[entry.part]);
        match entry.beat {
            0 => {
                let shift = force_shift(f, part.normalise, part.rescale);
                let own = if f.by_contact() { self.parts[entry.label] } else { part };
                let mu = own.position.map(|x| mu_word(f, x));
                let threshold = match self.model.has_writable_tables() {
                    true => inputs[24].number() as i64,
                    false => self.model.threshold(),
                };
                let result = force(f, entry.value, mu, shift, threshold);
                frame.saturations = (frame.saturations + result.saturations).min((1 << SATURATION_BITS) - 1);
                frame.contact |= result.words[2] != 0;
                if let Some(balance) = Balance::of_model(&self.model) {
                    let z = i64::from(result.words[2]);
                    // More requests than a frame has taxels go around.
                    let unused = 64 - balance.ty().bits;
                    frame.balance += if z < 0 { z * i64::from(balance.push) } else { z };
                    frame.balance = frame.balance << unused >> unused;
                }
                result.words
            }
            1 => {
                let flag = |set: bool, bit: StatusField| if set { bit.mask() } else { 0 };
                let case = &self.model.cases()[inputs[1].number() as usize];
                let number = if self.model.chooses() { case.number() } else { 0 };
                let flags = flag(part.condition, CONDITION)
                    | flag(part.found, FOUND)
                    | flag(!frame.contact, NO_CONTACT)
                    | flag(inputs[16].number() == 1, FRAMING)
                    | flag(part.damaged, COEFFICIENTS)
                    | flag(part.score_low, SCORE_LOW)
                    | flag(frame.balance < 0, NEGATIVE_PRESSURE)
                    | flag(self.model.has_writable_tables() && inputs[26].number() == 1, TABLES)
                    | flag(f.by_contact() && inputs[23].number() == 1, MORE_CONTACTS)
                    | flag(self.model.prepare.check.is_some() && inputs[27].field(0, 1) == 1, CLIPPED)
                    | flag(self.model.prepare.check.is_some() && inputs[27].field(1, 1) == 1, LINE_FAULT)
                    | number << CASE.low
                    | self.frames(part.frames);
                let position = if f.degree > 0 { part.position } else { [0; 2] };
                [position[0], position[1], flags as i32]
            }
            2 => {
                let version = if self.model.has_writable_tables() { inputs[25].number() as u32 } else { 0 };
                [part.score, part.rescale as i32, (version << TABLES_VERSION.low | part.normalise) as i32]
            }
            _ => [part.saturations as i32, frame.saturations as i32, frame.cycles as i32],
        }
    }
}

impl Reference for Requests {
    fn outputs(&mut self, _: &[Word]) -> Vec<Option<Word>> {
        let bit = |bit: bool| self.reset.then(|| Word::from(bit));
        vec![
            self.output.map(|(_, word)| word),
            bit(self.output.is_some()),
            bit(self.output.is_some_and(|(last, _)| last)),
        ]
    }

    fn clock(&mut self, inputs: &[Word]) {
        let [rst, begin_frame, start, offer] = [0, 2, 3, 5].map(|k| inputs[k].number() == 1);
        if let Some(entry) = &mut self.pipe[READ_STEPS - 1] {
            entry.value = inputs[9].signed(entry.lane, self.model.formats().search_bits[0] as usize);
            entry.label = inputs[22].field(entry.lane * label_bits(&self.model), label_bits(&self.model)) as usize;
        }
        self.output = self.pipe.pop_back().unwrap().map(|entry| {
            if std::mem::take(&mut self.frame.counting) {
                self.frame.cycles = (inputs[21].number() as u32 + UNCOUNTED) % (1 << CYCLE_BITS);
            }
            let mut words = self.answer(entry, inputs).map(i64::from).to_vec();
            if self.model.summed() == Some(Summed::Label) {
                words.push(entry.label as i64);
            }
            let ends = parts(&self.model, &self.model.cases()[inputs[1].number() as usize]);
            (entry.beat == 3 && entry.part + 1 == ends, Word::of_fields(&words, WORD))
        });
        let [beat, part, lane] = [6, 7, 8].map(|k| inputs[k].number());
        self.pipe.push_front(offer.then_some(Entry {
            beat,
            part: part as usize,
            lane: lane as usize,
            value: 0,
            label: 0,
        }));
        if begin_frame {
            self.frame = Frame { counting: true, ..Frame::default() };
        }
        if start {
            self.keep(inputs);
        }
        if rst {
            self.pipe.iter_mut().for_each(|entry| *entry = None);
            (self.output, self.reset) = (None, true);
        }
    }
}

/// Frames: all subarrays are stored, then beats requested at random, first forces.
fn stimulus(model: &Model, block: &ForceUnit, cycles: usize) -> Vec<Vec<Word>> {
    let mut random = fastrand::Rng::with_seed(11);
    let cases = model.cases().len() as u64;
    let parts = most_parts(model);
    let mut case_index = 0;
    let mut threshold = 0;
    let inputs = |cycle: usize| {
        // 40 cycles of a frame begin it and store the subarrays, the rest request beats.
        let at = cycle % 300;
        if at == 0 {
            case_index = random.u64(..cases);
            threshold = random.u64(..1 << 32) >> random.u8(..32);
        }
        let offer = (40..280).contains(&at) && random.u8(..4) > 0;
        // Small values are below the threshold or round to zero, large ones saturate.
        let v = block.lanes * block.value_bits / 4;
        let value = |_| random.i64(..) >> random.usize(64 - v..64);
        let quad: Vec<i64> = (0..4).map(value).collect();
        vec![
            (cycle < 2 || (at == 290 && random.bool())).into(),
            case_index.into(),
            (at == 20).into(),
            (21..21 + parts).contains(&at).into(),
            (at.saturating_sub(21) as u64 % parts as u64).into(),
            offer.into(),
            if at < 60 || random.bool() { Word::default() } else { random.u64(..4).into() },
            random.u64(..parts as u64).into(),
            random.u64(..4).into(),
            Word::of_fields(&quad, v),
            random_word(&mut random, position_bits()),
            random_word(&mut random, position_bits()),
            random.u64(..u64::from(model.formats().input_bits)).into(),
            random.u64(..1 << block.rescale_bits).into(),
            random.bool().into(),
            random.bool().into(),
            random.bool().into(),
            random.bool().into(),
            random_word(&mut random, block.marks.bits()),
            random_word(&mut random, block.score_bits),
            random_word(&mut random, SATURATION_BITS),
            random_word(&mut random, CYCLE_BITS),
            Word::of_fields(&[(); 4].map(|()| random.i64(0..parts as i64)), label_bits(model)),
            random.bool().into(),
            threshold.into(),
            random_word(&mut random, VERSION_WORD_BITS),
            random.bool().into(),
            random.u64(..4).into(),
        ]
    };
    (0..cycles).map(inputs).collect()
}

fn is_the_model_s(side: usize, more: &str, threshold: i64) {
    check_forces(model(side, side, more).with_changed_plan(|plan| plan.own_mut().threshold = threshold).unwrap());
}

fn check_forces(model: Model) {
    let block = ForceUnit::new(&model);
    check(&kernel_of(&block), &stimulus(&model, &block, 6000), &mut Requests::new(model));
}

#[test]
fn beats_are_those_of_the_model() {
    is_the_model_s(4, "[search]\nmu_max = 0.05\n[partition]\nrows = 2\ncols = 1\n", 1000);
    is_the_model_s(4, "[search]\nmu_max = 0.0\n", 0);
    let written = "[search]\nmu_max = 0.05\n[input]\nfull_scale_MPa = 1.0\n[hardware]\ntables = \"writable\"\n";
    is_the_model_s(4, written, 0);
    for (limit, more) in [(-1000, ""), (0, "[input]\naverage = 3\nmean = \"sliding\"\n"), (77_000, "")] {
        let searched = model(4, 4, &format!("[search]\nmu_max = 0.05\n{more}"));
        check_forces(searched.with_changed_plan(|plan| plan.score_limit = Some(limit)).unwrap());
    }
    let weighed = |push: u32| {
        let change = |plan: &mut Plan| (plan.push_limit, plan.own_mut().threshold) = (Some(push), 1 << 20);
        model(4, 4, "[search]\nmu_max = 0.05\n").with_changed_plan(change).unwrap()
    };
    [1, 5, 14].into_iter().for_each(|push| check_forces(weighed(push)));
    // A wrong weight is found.
    let (block, wrong) = (ForceUnit::new(&weighed(5)), weighed(4));
    let found = difference(&kernel_of(&block), &stimulus(&wrong, &block, 6000), &mut Requests::new(wrong));
    assert!(found.is_some());
    let sliding = "[input]\naverage = 3\nmean = \"sliding\"\n";
    is_the_model_s(4, &format!("[search]\nmu_max = 0.05\n{sliding}[partition]\nrows = 2\ncols = 1\n"), 1000);
    let running = "zero = \"running\"\nfull_scale_MPa = 1.0\n";
    for input in [format!("{sliding}{running}"), format!("[input]\n{running}")] {
        is_the_model_s(4, &format!("[search]\nmu_max = 0.05\n{input}[partition]\nrows = 2\ncols = 1\n"), 1000);
    }
    let cases = "[search]\nmu_max = 0.1\ndegree = 1\n[partition]\ncases = [0, 1, 3]\n";
    is_the_model_s(8, &format!("{cases}[hardware]\ncoefficient_check = \"signature\"\n"), 1 << 20);
    for more in ["", "[output]\nforces = \"resultants\"\n"] {
        check_forces(learned(6, 5, &[7], &format!("mu_max = 0.3\n[partition]\ncase = \"contacts\"\n{more}")));
    }
}
