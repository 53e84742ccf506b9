use std::ops::Range;

use dermis_golden::fixed::stages::load::{beats, Outcome};
use dermis_golden::fixed::{Intake, Model};

use super::*;
use crate::language::testbench::{check_with_defects, Reference, Subject};
use crate::language::{kernel_of, Change};
use crate::scenes::model;
use crate::wire::Word;

/// Inputs of several arrays.
const OF_ARRAYS: [&str; 4] = ["s_axis_tid", "floor_array", "sent_array", "calibrated_array"];
const WRITABLE: &str = "[input]\nfull_scale_MPa = 1.0\n[hardware]\ntables = \"writable\"\n";

/// The stream as the models of the arrays take it; a byte is taken in one cycle and used in the next.
#[derive(Clone)]
struct Loader {
    plans: Vec<Model>,
    intake: Intake,
    /// A byte was taken in the cycle before; with it, unless it is skipped, the byte and its `tlast`.
    took: Option<Option<(u8, bool)>>,
    in_frame: bool,
    rests: u64,
    /// What stands in the tables of each array, whole or not.
    floors: Vec<u64>,
    thresholds: Vec<u64>,
    /// The threshold of `sent_array` in the cycle before.
    held_threshold: Option<u64>,
    /// Number and content of a word of coefficients that ended in the cycle before.
    pair: Option<(usize, u64)>,
    /// An image ended with its first word in the cycle before.
    ended: bool,
    reset: bool,
}

impl Loader {
    fn new(plan: &Model) -> Self {
        let plans: Vec<Model> = (0..plan.own.len()).map(|array| plan.of_array(array).unwrap()).collect();
        Loader {
            intake: Intake::default(),
            took: None,
            in_frame: false,
            rests: 0,
            floors: plans.iter().map(|plan| plan.noise_floor() as u64).collect(),
            thresholds: plans.iter().map(|plan| plan.threshold() as u64).collect(),
            held_threshold: None,
            plans,
            pair: None,
            ended: false,
            reset: false,
        }
    }

    /// Any of the models, for what they have in common.
    fn plan(&self) -> &Model {
        &self.plans[0]
    }

    /// Outcome and version of the tables of array `array`. While an image is written they are not whole.
    fn state(&self, array: usize) -> (Outcome, u16) {
        match self.writing() && array == self.intake.array() {
            true => (Outcome::Broken, 0),
            false => (self.plans[array].own().outcome, self.plans[array].own().version),
        }
    }

    fn bits(&self) -> usize {
        self.plan().formats().code_bits as usize
    }

    /// Whether a byte is taken, and whether a code passes, if the receiver is ready.
    fn moves(&self, inputs: &[Word]) -> [bool; 2] {
        let [rst, valid] = [0, 3].map(|k| inputs[k].number() == 1);
        let (free, is_byte) = (valid && self.took.is_none() && !rst, self.is_byte(inputs));
        let may_begin = self.in_frame || self.rests == REST;
        [
            free && is_byte && (self.intake.is_busy() || may_begin),
            free && !is_byte && !self.intake.is_busy() && !self.ended,
        ]
    }

    fn is_byte(&self, inputs: &[Word]) -> bool {
        let bits = self.bits();
        inputs[2].field(bits, 1) != inputs[2].field(bits - 1, 1)
    }

    fn first_coefficient(&self) -> usize {
        HEAD_WORDS + self.plan().scene.sensor.taxels()
    }

    /// Numbers of the words with coefficients.
    fn coefficient_words(&self) -> Range<usize> {
        let CoefficientPlaces { words, pairs } = CoefficientPlaces::new(self.plan());
        self.first_coefficient()..self.first_coefficient() + words * pairs
    }

    /// Tables are written: the image's first word was right.
    fn writing(&self) -> bool {
        self.intake.image().len() >= WORD_BYTES
    }

    /// The word that the last byte taken ends, if it is written: its number and its content.
    fn written(&self) -> Option<(usize, u64)> {
        let (byte, _) = self.took.flatten().filter(|_| self.writing())?;
        let image = [self.intake.image(), &[byte]].concat();
        let mut bytes = [0; 8];
        bytes[..WORD_BYTES].copy_from_slice(&image[image.len() - WORD_BYTES..]);
        image.len().is_multiple_of(WORD_BYTES).then(|| (image.len() / WORD_BYTES - 1, u64::from_le_bytes(bytes)))
    }
}

/// The array that input `number` of [`OF_ARRAYS`] names; the only one where there are none.
fn array_of(inputs: &[Word], number: usize) -> usize {
    inputs.get(6 + number).map_or(0, |array| array.number() as usize)
}

/// The low `bits` bits.
fn low(word: u64, bits: usize) -> u64 {
    word & ((1 << bits) - 1)
}

impl Reference for Loader {
    fn outputs(&mut self, inputs: &[Word]) -> Vec<Option<Word>> {
        let [rst, last, ready] = [0, 4, 5].map(|k| inputs[k].number() == 1);
        let bit = |bit: bool| self.reset.then(|| Word::from(bit));
        let [takes, passes] = self.moves(inputs);
        let entries = HEAD_WORDS..self.first_coefficient();
        let pair = self.pair.filter(|_| !rst);
        let pairs = CoefficientPlaces::new(self.plan()).pairs;
        let entry = self.written().filter(|(number, _)| entries.contains(number) && !rst);
        let [floor_array, sent_array, calibrated_array] = [1, 2, 3].map(|k| array_of(inputs, k));
        let (outcome, version) = self.state(sent_array);
        let own = (self.plans.len() > 1).then(|| self.intake.array() as u64);
        let writing = self.writing() || self.ended;
        let threshold = match own {
            None => Some(self.thresholds[0]),
            Some(_) => self.held_threshold,
        };
        let spoiled = u64::from(outcome != Outcome::Whole);
        vec![
            bit(passes),
            passes.then(|| Word::from(inputs[2].field(0, self.bits()))),
            passes.then(|| last.into()),
            bit(takes || (passes && ready)),
            bit(entry.is_some()),
            entry.map(|(number, _)| Word::from((number - HEAD_WORDS) as u64)),
            entry.map(|(_, word)| Word::from(low(word, self.bits() + GAIN_BITS as usize))),
            bit(pair.is_some()),
            pair.map(|(number, _)| Word::from((number / pairs) as u64)),
            pair.map(|(number, _)| Word::from((number % pairs) as u64)),
            pair.map(|(_, word)| Word::from(low(word, PAIR_BITS))),
            bit(rst || (writing && own.is_none())),
            Some(Word::from(self.floors[floor_array])),
            threshold.map(Word::from),
            bit(true).map(|_| Word::from(spoiled << VERSION_BITS | u64::from(version))),
            bit(outcome == Outcome::Broken),
            bit(self.state(calibrated_array).0 == Outcome::Broken),
        ]
        .into_iter()
        .chain(own.into_iter().flat_map(|own| {
            let anew = if writing { 1 << own } else { 0 };
            [self.reset.then(|| Word::from(anew as u64)), entry.map(|_| Word::from(own))]
        }))
        .collect()
    }

    fn clock(&mut self, inputs: &[Word]) {
        let [rst, idle, valid, last, ready] = [0, 1, 3, 4, 5].map(|k| inputs[k].number() == 1);
        let [takes, passes] = self.moves(inputs);
        let written = self.written();
        let coefficients = self.coefficient_words();
        self.pair = written.filter(|(number, _)| coefficients.contains(number));
        self.pair = self.pair.map(|(number, word)| (number - coefficients.start, word));
        self.held_threshold = Some(self.thresholds[array_of(inputs, 2)]);
        let own = self.intake.array();
        let Loader { plans, intake, .. } = self;
        if rst {
            // The byte taken last has not been used.
            intake.reset(&mut plans[own], 0);
            plans.iter_mut().for_each(Model::forget_refusal);
            let (took, in_frame, rests, pair, ended, reset) = (None, false, 0, None, false, true);
            *self = Loader { took, in_frame, rests, pair, ended, reset, ..self.clone() };
            return;
        }
        self.ended = false;
        match self.took.take() {
            Some(Some((byte, last))) => {
                let is_first = intake.image().len() + 1 == WORD_BYTES;
                match written {
                    Some((1, word)) => self.thresholds[own] = low(word, THRESHOLD_BITS),
                    Some((2, word)) => self.floors[own] = low(word, plans[own].floor_bits() as usize),
                    _ => {}
                }
                self.ended = intake.byte(&mut plans[own], byte, last, false) == Some(Outcome::Broken) && is_first;
            }
            None if valid && !self.is_byte(inputs) => {
                self.intake.code(&mut self.plans[own]);
            }
            _ => {}
        }
        let moved = passes && ready;
        self.rests = if !idle || moved { 0 } else { (self.rests + 1).min(REST) };
        if takes {
            let byte = inputs[2].field(0, 8) as u8;
            let begins = !self.intake.is_busy();
            let own = self.intake.array_of_byte(array_of(inputs, 0));
            if self.intake.is_skipping() || (begins && self.in_frame) {
                // An image between the codes of a frame is refused at once.
                self.intake.byte(&mut self.plans[own], byte, last, self.in_frame);
                self.took = Some(None);
            } else {
                self.took = Some(Some((byte, last)));
            }
        }
        if moved {
            self.in_frame = !last;
        }
    }
}

/// Frames and images, whole, damaged, cut short and too long; a code in an image and an image in a frame; pauses and resets.
fn stimulus(plan: &Model, cycles: usize) -> Vec<Vec<Word>> {
    let mut random = fastrand::Rng::with_seed(3);
    let (bits, taxels) = (plan.formats().code_bits, plan.scene.sensor.taxels());
    let mut loader = Loader::new(plan);
    let mut beats_left: Vec<(i32, bool)> = Vec::new();
    (0..cycles)
        .map(|cycle| {
            if beats_left.is_empty() {
                let of_frame = |random: &mut fastrand::Rng| {
                    let half = 1 << (bits - 1);
                    (0..taxels).map(|_| random.i32(-half..half)).collect::<Vec<i32>>()
                };
                let mut all = match random.bool() {
                    true => of_frame(&mut random),
                    false => {
                        let entries = |random: &mut fastrand::Rng, bits: u32| {
                            (0..taxels).map(|_| random.i32(-(1 << (bits - 1))..1 << (bits - 1))).collect::<Vec<i32>>()
                        };
                        let tables = Tables {
                            version: random.u16(1..1 << VERSION_BITS),
                            threshold: random.u32(..),
                            noise_floor: random.i32(..1 << 8),
                            zero: entries(&mut random, bits),
                            gain: entries(&mut random, GAIN_BITS),
                            coefficients: (0..COEFFICIENTS_PER_WORD * loader.coefficient_words().len())
                                .map(|_| random.i64(-(1 << 17)..1 << 17))
                                .collect(),
                        };
                        let mut image = tables.image(plan.table_layout(), bits);
                        if random.u8(..3) == 0 {
                            let at = random.usize(..image.len());
                            image[at] ^= 1 << random.u8(..8);
                        }
                        let mut all = beats(&image, bits);
                        match random.u8(..12) {
                            0 => all.truncate(random.usize(1..all.len())),
                            1 => all.push(all[0]),
                            2 => all.extend(of_frame(&mut random)),
                            3 => all.truncate(WORD_BYTES),
                            4 => all.truncate(WORD_BYTES * random.usize(1..all.len() / WORD_BYTES)),
                            _ => {}
                        }
                        all
                    }
                };
                if random.u8(..10) == 0 {
                    // Without an end: what follows is in the middle of it.
                    all.truncate(random.usize(1..all.len()));
                    beats_left = all.into_iter().map(|beat| (beat, false)).rev().collect();
                } else {
                    let count = all.len();
                    beats_left = all.into_iter().enumerate().map(|(at, beat)| (beat, at + 1 == count)).rev().collect();
                }
            }
            let rst = cycle < 2 || random.u16(..2000) == 0;
            let idle = cycle % 97 > 3;
            let &(beat, last) = beats_left.last().unwrap();
            let [valid, ready] = [(); 2].map(|()| Word::from(random.u8(..8) > 0));
            let data = Word::of_fields(&[beat.into()], plan.stream_bits() as usize);
            let mut inputs = vec![rst.into(), idle.into(), data, valid, last.into(), ready];
            if plan.own.len() > 1 {
                inputs.extend(OF_ARRAYS.map(|_| Word::from(random.u64(..plan.own.len() as u64))));
            }
            let [takes, passes] = loader.moves(&inputs);
            if takes || (passes && ready.number() == 1) {
                beats_left.pop();
            }
            loader.clock(&inputs);
            inputs
        })
        .collect()
}

#[test]
fn an_image_is_taken_as_the_model_takes_it() {
    is_taken(&model(2, 3, WRITABLE));
    is_taken(&model(2, 3, &WRITABLE.replace("[hardware]", "[hardware]\narrays = 4")));
    is_taken(&model(2, 3, &format!("{WRITABLE}[hardware.table_range]\nthickness_mm = [1.0, 4.0]\n")));
}

fn is_taken(model: &Model) {
    let stimulus = stimulus(model, 60_000);
    let (mut seen, mut ends_with_pair) = ([false; 4], false);
    let mut loader = Loader::new(model);
    for inputs in &stimulus {
        loader.clock(inputs);
        seen[3] |= loader.ended;
        ends_with_pair |= loader.pair.is_some() && loader.intake.image().is_empty();
        for own in loader.plans.iter().map(|plan| plan.own()) {
            match own.outcome {
                Outcome::Whole => seen[0] |= own.version > 0,
                Outcome::Refused => seen[1] = true,
                Outcome::Broken => seen[2] = true,
            }
        }
    }
    assert_eq!(seen, [true; 4], "images are taken, refused, broken, and broken after their first word");
    let writes_coefficients = !loader.coefficient_words().is_empty();
    assert_eq!(ends_with_pair, writes_coefficients, "a short image ends with two coefficients");
    let mut inputs = vec!["rst", "idle", "s_axis_tdata", "s_axis_tvalid", "s_axis_tlast", "m_axis_tready"];
    let mut outputs = vec![
        "m_axis_tvalid",
        "m_axis_tdata",
        "m_axis_tlast",
        "s_axis_tready",
        "write",
        "taxel",
        "entry",
        "coefficient_write",
        "coefficient_word",
        "coefficient_pair",
        "coefficient_data",
        "restart",
        "noise_floor",
        "threshold",
        "version",
        "incomplete",
        "calibrates_nothing",
    ];
    if model.own.len() > 1 {
        inputs.extend(OF_ARRAYS);
        outputs.extend(["anew", "array"]);
    }
    let load = Load::of_plan(model).unwrap();
    let subject = |changes: &[Change]| Subject::of(kernel_of(&load), changes, &inputs, &outputs);
    let defects = [
        // A wrong CRC does not count.
        Change::value("", "wrong_crc", |k| k.constant(1, 0)),
        // An image may begin while codes are on their way.
        Change::value("", "rested", |k| k.constant(1, 1)),
        // A short image is whole.
        Change::value("", "wrong_length", |k| k.constant(1, 0)),
        // An image may begin in a frame.
        Change::value("", "broken_off", |k| k.constant(1, 0)),
    ];
    check_with_defects(subject, &stimulus, || Loader::new(model), &defects);
    if writes_coefficients {
        let defects = [
            // The next image begins a pair late after one that ended with two coefficients.
            Change::within("", "pair", |k| [!k.named("image"), k.named("over")]),
            // All coefficients go to the first word.
            Change::value("", "address", |k| k.named("address")),
        ];
        check_with_defects(subject, &stimulus, || Loader::new(model), &defects);
    }
    if model.own.len() > 1 {
        let defects = [
            // All images are of the first array; all arrays begin anew.
            Change::value("", "own", |k| k.constant(2, 0)),
            Change::value("", "anew", |k| k.named("writing").repeat(4)),
        ];
        check_with_defects(subject, &stimulus, || Loader::new(model), &defects);
    }
}
