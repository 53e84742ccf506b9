use dermis_golden::fixed::stages::load::{beats, image_bytes, Outcome};

use super::*;
use crate::language::testbench::{block_subject, check, check_with_defects, random_words, Pipeline, Reference};
use crate::language::Change;
use crate::scenes::model;
use crate::wire::Word;

const WRITABLE: &str = "[input]\nfull_scale_MPa = 1.0\n[hardware]\ntables = \"writable\"\n";

/// The bytes of an image as they come, and what the bit-true model makes of all of them.
#[derive(Clone)]
struct Loader {
    plan: Plan,
    /// The bytes taken of an image that may still become whole.
    image: Option<Vec<u8>>,
    skipping: bool,
    /// A byte was taken in the cycle before, with this `tlast`.
    took: Option<bool>,
    writing: bool,
    inside: bool,
    rests: u64,
    refused: bool,
    /// What stands in the tables, whole or not.
    floor: i64,
    threshold: u64,
    reset: bool,
}

impl Loader {
    fn new(plan: &Plan) -> Self {
        Loader {
            plan: plan.clone(),
            image: None,
            skipping: false,
            took: None,
            writing: false,
            inside: false,
            rests: 0,
            refused: false,
            floor: plan.noise_floor.into(),
            threshold: plan.threshold as u64,
            reset: false,
        }
    }

    fn bits(&self) -> usize {
        self.plan.formats().code_bits as usize
    }

    /// Whether a byte is taken, and whether a code passes, if the receiver is ready.
    fn moves(&self, inputs: &[Word]) -> [bool; 2] {
        let [rst, valid] = [0, 3].map(|k| inputs[k].number() == 1);
        let busy = self.image.is_some() || self.skipping;
        let free = valid && self.took.is_none() && !rst;
        let is_byte = self.is_byte(inputs);
        [free && is_byte && (busy || self.inside || self.rests == REST), free && !is_byte && !busy]
    }

    fn is_byte(&self, inputs: &[Word]) -> bool {
        let bits = self.bits();
        inputs[2].field(bits, 1) != inputs[2].field(bits - 1, 1)
    }

    /// The word that the last byte taken ended: its number and its content.
    fn ended(&self) -> Option<(usize, u64)> {
        let image = self.image.as_ref().filter(|image| self.took.is_some() && image.len() % WORD_BYTES == 0)?;
        let mut bytes = [0; 8];
        bytes[..WORD_BYTES].copy_from_slice(&image[image.len() - WORD_BYTES..]);
        Some((image.len() / WORD_BYTES - 1, u64::from_le_bytes(bytes)))
    }

    /// The image is over: the tables are what the model makes of its bytes.
    fn ends(&mut self, image: &[u8]) {
        self.refused = self.plan.load(image) != Outcome::Whole;
        (self.image, self.writing) = (None, false);
    }
}

impl Reference for Loader {
    fn outputs(&mut self, inputs: &[Word]) -> Vec<Option<Word>> {
        let [rst, last, ready] = [0, 4, 5].map(|k| inputs[k].number() == 1);
        let bit = |bit: bool| self.reset.then(|| Word::from(bit));
        let [takes, passes] = self.moves(inputs);
        let entries = HEAD_WORDS..HEAD_WORDS + self.plan.scene.sensor.taxels();
        let entry = self.ended().filter(|(number, _)| self.writing && entries.contains(number) && !rst);
        let tables = self.plan.tables().unwrap();
        // While an image is written the tables are not whole.
        let whole = !self.writing && self.plan.tables_outcome != Outcome::Broken;
        let version = if whole { tables.version } else { 0 };
        let spoiled = u64::from(self.refused || !whole);
        vec![
            bit(passes),
            passes.then(|| Word::from(inputs[2].field(0, self.bits()))),
            passes.then(|| last.into()),
            bit(takes || (passes && ready)),
            bit(entry.is_some()),
            entry.map(|(number, _)| Word::from((number - HEAD_WORDS) as u64)),
            entry.map(|(_, word)| Word::from(word & ((1 << (self.bits() + GAIN_BITS as usize)) - 1))),
            bit(rst || self.writing),
            Some(Word::from(self.floor as u64)),
            Some(Word::from(self.threshold)),
            bit(true).map(|_| Word::from(spoiled << VERSION_BITS | u64::from(version))),
            bit(!whole),
        ]
    }

    fn clock(&mut self, inputs: &[Word]) {
        let [rst, idle, valid, last, ready] = [0, 1, 3, 4, 5].map(|k| inputs[k].number() == 1);
        let [takes, passes] = self.moves(inputs);
        let (ended, took) = (self.ended(), self.took.take());
        if rst {
            // The byte taken last is not used, and the bytes before it are no image.
            if let Some(mut image) = self.image.take().filter(|_| self.writing) {
                image.truncate(image.len() - usize::from(took.is_some()));
                self.plan.load(&image);
            }
            let (plan, floor, threshold) = (self.plan.clone(), self.floor, self.threshold);
            *self = Loader { floor, threshold, reset: true, ..Loader::new(&plan) };
            return;
        }
        let full = image_bytes(self.plan.scene.sensor.taxels());
        // A frame interrupts an image that has begun.
        let broken_off = valid && !self.is_byte(inputs) && took.is_none();
        match (self.image.clone(), took) {
            (Some(image), Some(last)) => {
                let head = self.plan.image()[..WORD_BYTES] != image[..image.len().min(WORD_BYTES)];
                if let (Some((1, word)), true) = (ended, self.writing) {
                    self.threshold = word & u64::from(u32::MAX);
                }
                if let (Some((2, word)), true) = (ended, self.writing) {
                    self.floor = word as i64 & ((1 << self.plan.formats().input_bits) - 1);
                }
                self.writing |= matches!(ended, Some((0, _))) && !head;
                if (image.len() == WORD_BYTES && head) || last != (image.len() == full) || image.len() == full {
                    // Without its end the image is longer than it may be.
                    let more = usize::from(image.len() == full && !last);
                    self.ends(&[image, vec![0; more]].concat());
                    self.skipping = self.refused && !last;
                }
            }
            (Some(image), None) if broken_off => self.ends(&image),
            (None, Some(true)) => self.skipping = false,
            (None, None) if broken_off => self.skipping = false,
            _ => {}
        }
        let moved = passes && ready;
        self.rests = if !idle || moved { 0 } else { (self.rests + 1).min(REST) };
        if takes {
            let byte = inputs[2].field(0, 8) as u8;
            self.took = Some(last);
            match &mut self.image {
                Some(image) => image.push(byte),
                None if self.skipping => {}
                None if self.inside => (self.skipping, self.refused) = (true, true),
                None => self.image = Some(vec![byte]),
            }
        }
        if moved {
            self.inside = !last;
        }
    }
}

/// Frames and images, whole, damaged, cut short and too long; a code in an image and an image in a frame; pauses and resets.
fn stimulus(plan: &Plan, cycles: usize) -> Vec<Vec<Word>> {
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
            let inputs = vec![rst.into(), idle.into(), data, valid, last.into(), ready];
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
    let model = model(2, 3, WRITABLE);
    let stimulus = stimulus(&model, 40_000);
    let mut whole = [false; 2];
    let mut loader = Loader::new(&model);
    for inputs in &stimulus {
        loader.clock(inputs);
        whole[usize::from(loader.plan.tables_outcome == Outcome::Broken)] |=
            loader.plan.tables_version > 0 || loader.refused;
    }
    assert_eq!(whole, [true; 2], "images are taken, and are broken");
    let subject = |changes: &[Change]| {
        block_subject!(
            Load::new(&model),
            changes,
            inputs [rst, idle, s_axis_tdata, s_axis_tvalid, s_axis_tlast, m_axis_tready],
            outputs [
                m_axis_tvalid, m_axis_tdata, m_axis_tlast, s_axis_tready, write, taxel, entry, restart, noise_floor,
                threshold, version, incomplete,
            ],
        )
    };
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
    check_with_defects(subject, &stimulus, || Loader::new(&model), &defects);
}

#[test]
fn without_writable_tables_the_stream_passes() {
    let model = model(2, 3, "");
    let stimulus = random_words(500, &[1, model.formats().code_bits as usize, 1, 1, 1, 1]);
    let of = |inputs: &[Word]| {
        let stream = [1, 2, 3, 4, 0].map(|input| Some(inputs[input]));
        stream.into_iter().chain([Some(Word::default()); 7]).collect()
    };
    check(Load::new(&model).kernel.kernel(), &stimulus, &mut Pipeline::new(0, 12, of));
}
