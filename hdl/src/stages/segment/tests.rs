//! The block against the segmentation of the bit-true model: every output, and the cycle of its end.

use std::collections::VecDeque;

use dermis_golden::estimate::segment::{Segmenter, WIDTH, WORD_BITS};
use dermis_golden::fixed::plan::resources::{segment_memories, segment_multipliers};
use dermis_golden::fixed::stages::segment::cycles::MOST;
use dermis_golden::fixed::stages::segment::{segment, Segmented};
use dermis_golden::spec::board::Board;
use dermis_golden::spec::quads::Quads;
use dermis_golden::spec::sensor::Sensor;

use super::*;
use crate::language::testbench::{check, check_with_defects, random_word, subject_of, Reference, Subject};
use crate::language::{kernel_of, Change};
use crate::wire::Word;

/// Width of a lane and lowest bit of a word in it.
const LANE: usize = 21;
const LOW: usize = 3;

/// An array with its segmentation.
struct Array {
    sensor: Sensor,
    segmenter: Segmenter,
    most: usize,
}

impl Array {
    fn new(rows: usize, cols: usize, most: usize) -> Self {
        let sensor = Sensor { rows, cols, pitch_x_mm: 2.0, pitch_y_mm: 2.5, thickness_mm: 2.0 };
        Array { segmenter: Segmenter::new(&sensor, WIDTH), sensor, most }
    }

    /// Hardly smoothed, so that there are many maxima.
    fn sharp(rows: usize, cols: usize) -> Self {
        let sensor = Sensor { rows, cols, pitch_x_mm: 4.0, pitch_y_mm: 4.0, thickness_mm: 0.5 };
        Array { segmenter: Segmenter::new(&sensor, 0.3), sensor, most: MOST }
    }

    fn segmentation(&self) -> Segmentation<'_> {
        Segmentation { sensor: &self.sensor, segmenter: &self.segmenter, most: self.most }
    }

    fn layout(&self) -> Quads {
        self.segmentation().quads()
    }

    /// The quads of p.
    fn quads(&self, p: &[i64]) -> Vec<Word> {
        let layout = self.layout();
        let quad = |address: usize| Word::of_fields(&[0, 1, 2, 3].map(|lane| p[layout.taxel(address, lane)]), LANE);
        (0..layout.len()).map(quad).collect()
    }
}

/// p of a kind of frame.
fn frame(sensor: &Sensor, kind: usize, random: &mut fastrand::Rng) -> Vec<i64> {
    let most = 1i64 << (WORD_BITS as usize + LOW);
    let full = (most - 1) as f64;
    let size = sensor.rows.max(sensor.cols) as f64;
    let place = |random: &mut fastrand::Rng| [sensor.rows, sensor.cols].map(|lines| random.f64() * lines as f64);
    let contacts: Vec<([f64; 2], f64, f64)> = (0..random.usize(1..12))
        .map(|_| (place(random), (0.08 + 0.25 * random.f64()) * size, full * random.f64().powi(2)))
        .collect();
    let rings = kind == 1;
    let shape = |row: usize, col: usize| {
        let one = |([y, x], radius, top): &([f64; 2], f64, f64)| {
            let distance = (row as f64 - y).hypot(col as f64 - x) / radius;
            top * (1.0 - if rings { 3.0 * (distance - 1.0).abs() } else { distance }).max(0.0)
        };
        contacts.iter().map(one).sum::<f64>().min(full) as i64
    };
    let mut at = |taxel: usize| {
        let (row, col) = (taxel / sensor.cols, taxel % sensor.cols);
        match kind {
            0 | 1 => shape(row, col) + random.i64(-300..300),
            2 => random.i64(-most..most),
            3 => -random.i64(0..most),
            4 => most - 1,
            5 => [0, most / 2][random.usize(..2)],
            6 if row % 2 == 0 && col % 2 == 0 => most / 2 - 1000 * random.i64(0..3),
            7 => most / 64 * (row + col) as i64 / 2,
            8 => (shape(row, col) >> LOW >> 10) << LOW << 10,
            _ => 0,
        }
    };
    let taxels = 0..sensor.taxels();
    taxels.map(|taxel| at(taxel).clamp(-most, most - 1)).collect()
}
/// Number of kinds.
const KINDS: usize = 10;

/// The words of p.
fn words(p: &[i64]) -> Vec<i64> {
    p.iter().map(|p| (*p).max(0) >> LOW).collect()
}

fn subject(array: &Array, changes: &[Change]) -> Subject<'static> {
    subject_of!(
        Segment::new(&array.segmentation(), LANE, LOW),
        changes,
        inputs [rst, start, fill, fill_address, fill_quad, contact, label_address],
        outputs [count, overflow, done, middle_row, middle_col, labelled, labelled_quad, labels],
    )
}

/// Inputs in the order of the subject.
const RST: usize = 0;
const START: usize = 1;
const FILL: usize = 2;
const ADDRESS: usize = 3;
const QUAD: usize = 4;
const CONTACT: usize = 5;
const LABELS: usize = 6;

struct Segmenting<'a> {
    array: &'a Array,
    p: Vec<i64>,
    reset: bool,
    found: Option<Segmented>,
    /// Cycles to the end, while there are some.
    left: u64,
    labels: VecDeque<Option<usize>>,
    contact: Option<usize>,
}

impl<'a> Segmenting<'a> {
    fn new(array: &'a Array) -> Self {
        let p = vec![0; array.sensor.taxels()];
        Segmenting { array, p, reset: false, found: None, left: 0, labels: vec![None; 2].into(), contact: None }
    }

    /// The quad whose labels are written: the last one five cycles before the middles, each twenty cycles before the next.
    fn labelled(&self) -> Option<usize> {
        let middles = &self.found.as_ref()?.middles;
        let after: usize = middles.iter().map(|[row, col]| 2 * (row + col) + 9).sum();
        let left = (self.left as usize).checked_sub(after + 6)?;
        let quad = self.array.layout().len().checked_sub(left / 20 + 1)?;
        left.is_multiple_of(20).then_some(quad)
    }

    fn runs(&self) -> bool {
        self.left > 1
    }
}

impl Reference for Segmenting<'_> {
    fn outputs(&mut self, _: &[Word]) -> Vec<Option<Word>> {
        let found = self.found.as_ref().filter(|_| self.left <= 1);
        let layout = self.array.layout();
        let bits = count_bits(self.array.most + 1);
        let word = |found: &Segmented, quad: usize, bits: usize| {
            Word::of_fields(&[0, 1, 2, 3].map(|lane| found.labels[layout.taxel(quad, lane)] as i64), bits)
        };
        let labels = found.zip(self.labels[0]).map(|(found, quad)| word(found, quad, bits));
        let labelled = self.labelled();
        let middle = found.zip(self.contact).and_then(|(found, contact)| found.middles.get(contact));
        let number = |number: usize| Word::from(number as u64);
        vec![
            found.map(|found| number(found.middles.len())),
            found.map(|found| found.overflow.into()),
            self.reset.then(|| (self.left == 1).into()),
            middle.map(|middle| number(middle[0])),
            middle.map(|middle| number(middle[1])),
            self.reset.then(|| labelled.is_some().into()),
            labelled.zip(self.found.as_ref()).map(|(quad, found)| word(found, quad, bits + 1)),
            labels,
        ]
    }

    fn clock(&mut self, inputs: &[Word]) {
        let number = |input: usize| inputs[input].number() as usize;
        let layout = self.array.layout();
        if number(FILL) == 1 {
            let of_lane = |lane: usize| inputs[QUAD].signed(lane, LANE);
            (0..4).for_each(|lane| self.p[layout.taxel(number(ADDRESS), lane)] = of_lane(lane));
        }
        self.left = self.left.saturating_sub(1);
        if number(START) == 1 && self.left == 0 {
            let Array { sensor, segmenter, most } = self.array;
            let found = segment(sensor, segmenter, &words(&self.p), *most);
            self.left = found.cycles;
            self.found = Some(found);
        }
        self.labels.pop_front();
        self.labels.push_back(Some(number(LABELS)).filter(|quad| *quad < layout.len() && !self.runs()));
        self.contact = Some(number(CONTACT)).filter(|_| !self.runs());
        if number(RST) == 1 {
            (self.reset, self.left, self.found) = (true, 0, None);
        }
    }
}

/// Frames of these kinds; some are cut by a reset.
fn stimulus(array: &Array, kinds: &[usize], seed: u64) -> Vec<Vec<Word>> {
    let mut random = fastrand::Rng::with_seed(seed);
    let layout = array.layout();
    let mut all = Vec::new();
    let mut cycle = |random: &mut fastrand::Rng, flags: [bool; 3], fill: (usize, Word)| {
        let [rst, start, fills] = flags.map(Word::from);
        let asked = [random.usize(..array.most), random.usize(..layout.len())].map(|asked| Word::from(asked as u64));
        all.push([&[rst, start, fills, Word::from(fill.0 as u64), fill.1], &asked[..]].concat());
    };
    for (index, kind) in kinds.iter().enumerate() {
        if index % 5 == 0 {
            cycle(&mut random, [true, false, false], (0, Word::default()));
        }
        let p = frame(&array.sensor, *kind, &mut random);
        for fill in array.quads(&p).into_iter().enumerate() {
            cycle(&mut random, [false, false, true], fill);
        }
        cycle(&mut random, [false, true, false], (0, Word::default()));
        let Array { sensor, segmenter, most } = array;
        let found = segment(sensor, segmenter, &words(&p), *most);
        assert!(found.cycles <= array.segmentation().longest(), "{}", found.cycles);
        let end = if index % 5 == 4 { random.u64(..found.cycles) } else { found.cycles + 2 * layout.len() as u64 + 20 };
        for at in 0..end {
            let quad = random_word(&mut random, 4 * LANE);
            // A start while it runs is ignored.
            let starts = at + 1 < end && at + 2 < found.cycles && random.u8(..100) == 0;
            cycle(&mut random, [false, starts, false], (0, quad));
        }
    }
    all
}

#[test]
fn contacts_are_those_of_the_model() {
    let all: Vec<usize> = (0..3 * KINDS).map(|index| index % KINDS).collect();
    let arrays = [
        (Array::new(2, 3, MOST), &all[..]),
        (Array::new(8, 8, 2), &all[..2 * KINDS]),
        (Array::new(7, 12, MOST), &all[..2 * KINDS]),
        (Array::new(10, 10, MOST), &all[..KINDS]),
        (Array::sharp(16, 16), &all[..KINDS]),
        (Array::new(20, 20, MOST), &all[..KINDS]),
    ];
    for (array, kinds) in arrays {
        check(subject(&array, &[]), &stimulus(&array, kinds, 5), &mut Segmenting::new(&array));
    }
}

/// Defects that the frames find.
#[test]
fn defects_are_found() {
    let array = Array::new(6, 7, 3);
    let defects = [
        Change::value("", "larger", |k| k.constant(1, 1)),
        Change::value("", "turned", |k| k.constant(1, 0)),
        Change::value("", "unlinks", |k| k.constant(1, 0)),
        Change::value("", "diagonal", |k| k.constant(1, 1)),
        Change::value("", "line_found", |k| k.constant(1, 1)),
    ];
    let kinds: Vec<usize> = (0..2 * KINDS).map(|index| index % KINDS).collect();
    check_with_defects(
        |changes| subject(&array, changes),
        &stimulus(&array, &kinds, 7),
        || Segmenting::new(&array),
        &defects,
    );
}

/// The plan lists every memory of the block.
#[test]
fn memories_are_those_of_the_plan() {
    let board = Board::load("ulx3s-85f").unwrap();
    for array in [Array::new(20, 20, MOST), Array::new(7, 12, 3)] {
        let kernel = kernel_of(&Segment::new(&array.segmentation(), LANE, LOW));
        let memories = kernel.memories();
        let mut own: Vec<_> = memories.iter().map(|m| (m.label.clone().unwrap(), m.words, m.bits)).collect();
        let planned = segment_memories(&array.segmentation(), &board, board.distributed_words[0]);
        let mut planned: Vec<_> = planned.iter().map(|m| (m.holds.to_string(), m.words, m.bits)).collect();
        own.sort();
        planned.sort();
        assert_eq!(own, planned);
    }
    assert_eq!(segment_multipliers(&Array::new(20, 20, MOST).segmentation(), &board), 1);
}
