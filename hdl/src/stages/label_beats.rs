//! Stage `label_beats`: the contact of each taxel, on the output stream between forces and statuses.
//!
//! The beats of the forces pass. Then the labels are read row-major, one a cycle, into the next beat, and the stream in front
//! of it waits; then the statuses pass.

use dermis_golden::fixed::stages::send::{LABELS_PER_BEAT, LABEL_BITS};
use dermis_golden::fixed::Model;
use dermis_golden::spec::quads::Quads;

use crate::block;
use crate::language::{Block, Builder, Expr, Inside, Type};
use crate::primitives::{count_bits, lane_of, quad_address_of, Stream, TaxelPlace};
use crate::streams::BEAT_BITS;

block! {
    /// ```text
    /// s_axis --------------------> m_axis
    /// labels --> lane --> beat -----^
    /// ```
    pub struct LabelBeats {
        layout: Quads,
        /// Largest number of contacts.
        contacts: usize,
        /// Beats of labels in a frame.
        beats: usize,
    }
    ports LabelBeatsPorts {
        clock;
        reset;
        /// A beat, 96 bits; valid with `s_axis_tvalid`.
        sink<Stream> s_axis: BEAT_BITS;
        /// The beat, or one of labels; valid with `m_axis_tvalid`.
        source<Stream> m_axis: BEAT_BITS;
        /// LabelBeats are being read.
        out reads;
        /// Address of the quad whose labels are needed; with `reads`.
        out label_address: count_bits(layout.len());
        /// LabelBeats of the four taxels of the quad; two cycles after `label_address`.
        in labels: Quads::LANES * label_bits(*contacts);
    }
}

/// Cycles from the scan of a taxel until its label is in the beat.
const READ: usize = 5;

impl LabelBeats {
    /// For the contacts of `model`, if there are any and not a record of each takes the place of the labels.
    pub fn of_model(model: &Model) -> Option<Self> {
        let (contacts, beats) = (model.contacts(), model.label_beats());
        (beats > 0).then(|| LabelBeats { layout: model.layout(), contacts, beats })
    }
}

/// Width of the label of one of so many contacts.
fn label_bits(contacts: usize) -> usize {
    count_bits(contacts + 1)
}

impl Block for LabelBeats {
    fn build<'k>(&self, k: &'k Builder, io: LabelBeatsPorts<Inside<'k>>) {
        let LabelBeatsPorts { rst, labels, .. } = io;
        let (data, given, last) = (io.s_axis.data, io.s_axis.valid, io.s_axis.last);
        let taken = io.m_axis.ready;
        let (taxels, beats) = (self.layout.rows * self.layout.cols, self.beats);
        let counter = |name: &str, count: usize| k.state(name, Type::unsigned(count_bits(count)), rst, 0);
        let reads = io.reads.state(rst, 0);
        let passed = counter("passed", taxels + 1);
        let passes = k.wire("passes", given & taken & !*reads);
        let all_passed = passes & passed.is(taxels as u64 - 1);
        k.when(passes & !passed.is(taxels as u64), || passed.set(passed.plus(1)));
        k.when(passes & last, || passed.set(k.constant(passed.bits(), 0)));

        k.comment("Places of a beat; those beyond the last taxel are 0.");
        let (place, beat) = (counter("place", LABELS_PER_BEAT + 1), counter("beat", beats));
        let (row, col) = (counter("row", self.layout.rows), counter("col", self.layout.cols));
        let beyond = k.state("beyond", Type::unsigned(1), rst, 0);
        let scans = k.wire("scans", *reads & !place.is(LABELS_PER_BEAT as u64));
        let (row_ends, col_ends) = (row.is(self.layout.rows as u64 - 1), col.is(self.layout.cols as u64 - 1));
        k.when(scans, || place.set(place.plus(1)));
        k.when(scans & !*beyond, || {
            col.set(after(k, *col, col_ends));
            k.when(col_ends, || row.set(after(k, *row, row_ends)));
            k.when(col_ends & row_ends, || beyond.set(k.constant(1, 1)));
        });
        let own = TaxelPlace::of(k, self.layout, [*row, *col]);
        let near = [0, 1].map(|axis| k.delay(["near_row", "near_col"][axis], own.near[axis]));
        let first = k.constant(count_bits(self.layout.len()), 0);
        io.label_address.delay(quad_address_of(k, self.layout, near, first));
        let from = later(k, rst, "from", own.lower.concat(own.right));
        let (arrives, empty) = (later(k, rst, "arrives", scans), later(k, rst, "empty", *beyond));
        let label = lane_of(labels, Quads::LANES, from) & (!empty).repeat(label_bits(self.contacts));
        let label = label.extend(LABEL_BITS as usize);
        let word = k.register("word", Type::unsigned(BEAT_BITS));
        k.when(arrives, || word.set(label.concat(word.slice(LABEL_BITS as usize, BEAT_BITS - LABEL_BITS as usize))));
        let arrived = counter("arrived", LABELS_PER_BEAT + 1);
        k.when(arrives, || arrived.set(arrived.plus(1)));
        let full = k.wire("full", arrived.is(LABELS_PER_BEAT as u64));
        let leaves = k.wire("leaves", full & taken);
        let last_beat = beat.is(beats as u64 - 1);
        k.when(leaves, || {
            arrived.set(k.constant(arrived.bits(), 0));
            place.set(k.constant(place.bits(), 0));
            beat.set(after(k, *beat, last_beat));
        });
        k.when(leaves & last_beat, || {
            reads.set(k.constant(1, 0));
            beyond.set(k.constant(1, 0));
            row.set(k.constant(row.bits(), 0));
            col.set(k.constant(col.bits(), 0));
        });
        k.when(all_passed, || reads.set(k.constant(1, 1)));

        io.m_axis.data.set(reads.mux(*word, data));
        io.m_axis.valid.set(reads.mux(full, given));
        io.m_axis.last.set(last & !*reads);
        io.s_axis.ready.set(taken & !*reads);
    }
}

/// The next count, or 0 where it ends.
fn after<'k>(k: &'k Builder, count: Expr<'k>, ends: Expr<'k>) -> Expr<'k> {
    ends.mux(k.constant(count.bits(), 0), count.plus(1))
}

/// `value` of a scanned taxel when its labels are there.
fn later<'k>(k: &'k Builder, rst: Expr<'k>, name: &str, value: Expr<'k>) -> Expr<'k> {
    (1..READ).fold(value, |value, cycle| {
        let own = k.state(&format!("{name}_{cycle}"), Type::unsigned(value.bits()), rst, 0);
        own.set(value);
        *own
    })
}

#[cfg(test)]
mod tests {
    use std::collections::VecDeque;

    use dermis_golden::fixed::stages::send::{label_beats, labels_to_beats};

    use super::*;
    use crate::language::kernel_of;
    use crate::language::testbench::{check, random_word, Reference};
    use crate::wire::Word;

    const BLOCK: LabelBeats = LabelBeats { layout: Quads { rows: 5, cols: 7 }, contacts: 8, beats: 2 };
    const BITS: usize = 4;
    /// Cycles from the beat before to one of labels, at full speed.
    const CYCLES: usize = LABELS_PER_BEAT + READ - 1;

    /// The labels of a frame, and the beats that passed in it; a beat of labels is offered from a cycle on.
    struct Sent {
        labels: Vec<usize>,
        passed: usize,
        cycle: usize,
        /// The next beat of labels and its first cycle.
        next: Option<(usize, usize)>,
        known: bool,
        /// Addresses asked, the last first.
        asked: VecDeque<usize>,
    }

    impl Sent {
        fn new(labels: &[usize]) -> Self {
            let asked = vec![0; 2].into();
            Sent { labels: labels.to_vec(), passed: 0, cycle: 0, next: None, known: false, asked }
        }

        /// The beat of labels that is offered.
        fn offered(&self) -> Option<Word> {
            let (beat, _) = self.next.filter(|(_, from)| *from <= self.cycle)?;
            Some(Word::of_fields(&labels_to_beats(&self.labels)[beat].map(i64::from), 32))
        }

        /// The address of the label memory in this cycle, while labels are read: that of the place scanned two cycles ago.
        fn address(&self) -> Option<usize> {
            let (beat, from) = self.next?;
            let place = (self.cycle + CYCLES).checked_sub(from + 2)?;
            let taxel = LABELS_PER_BEAT * beat + place;
            let (rows, cols) = (BLOCK.layout.rows, BLOCK.layout.cols);
            let inside = place < LABELS_PER_BEAT && taxel < rows * cols;
            inside.then(|| BLOCK.layout.locate(taxel / cols, taxel % cols).address)
        }
    }

    impl Reference for Sent {
        fn outputs(&mut self, inputs: &[Word]) -> Vec<Option<Word>> {
            let [valid, last, ready] = [2, 3, 4].map(|input| inputs[input].number() == 1);
            let known = |value: bool| self.known.then(|| value.into());
            let reads = self.next.is_some();
            let offered = self.offered();
            vec![
                known(reads),
                self.address().map(|address| Word::from(address as u64)),
                match reads {
                    true => offered,
                    false => self.known.then_some(inputs[1]),
                },
                known(if reads { offered.is_some() } else { valid }),
                known(last && !reads),
                known(ready && !reads),
            ]
        }

        fn clock(&mut self, inputs: &[Word]) {
            let [rst, valid, last, ready] = [0, 2, 3, 4].map(|input| inputs[input].number() == 1);
            self.asked.push_front(self.address().unwrap_or(0));
            self.asked.pop_back();
            let taxels = self.labels.len();
            match self.next {
                None if valid && ready => {
                    self.passed += 1;
                    if self.passed == taxels {
                        self.next = Some((0, self.cycle + 1 + CYCLES));
                    }
                    if last {
                        self.passed = 0;
                    }
                }
                Some((beat, _)) if ready && self.offered().is_some() => {
                    let more = beat + 1 < label_beats(taxels);
                    self.next = more.then_some((beat + 1, self.cycle + 1 + CYCLES));
                }
                _ => {}
            }
            self.cycle += 1;
            if rst {
                (self.passed, self.next, self.known) = (0, None, true);
            }
        }
    }

    /// Frames of forces and statuses with gaps on both sides; the label memory answers two cycles after its address.
    fn stimulus(labels: &[usize]) -> Vec<Vec<Word>> {
        let mut random = fastrand::Rng::with_seed(3);
        let mut sent = Sent::new(labels);
        let (taxels, mut all) = (labels.len(), Vec::new());
        // Beats of the frame so far.
        let mut beats = 0;
        for cycle in 0..6000 {
            let rst = cycle == 0 || random.u16(..900) == 0;
            let valid = random.u8(..4) > 0;
            let last = beats + 1 == taxels + 6;
            let mut quad = [0i64; 4];
            for (taxel, label) in labels.iter().enumerate() {
                let place = BLOCK.layout.locate(taxel / BLOCK.layout.cols, taxel % BLOCK.layout.cols);
                if place.address == sent.asked[1] {
                    (0..4).filter(|lane| place.mask >> lane & 1 == 1).for_each(|lane| quad[lane] = *label as i64);
                }
            }
            let inputs: Vec<Word> = vec![
                rst.into(),
                random_word(&mut random, BEAT_BITS),
                valid.into(),
                (last && valid).into(),
                (random.u8(..5) > 0).into(),
                Word::of_fields(&quad, BITS),
            ];
            let passes = sent.outputs(&inputs)[5].is_some_and(|ready| ready.number() == 1) && valid;
            beats = if rst || (passes && last) { 0 } else { beats + usize::from(passes) };
            sent.clock(&inputs);
            all.push(inputs);
        }
        all
    }

    #[test]
    fn labels_follow_the_forces() {
        let mut random = fastrand::Rng::with_seed(4);
        let labels: Vec<usize> = (0..35).map(|_| random.usize(..=BLOCK.contacts)).collect();
        check(&kernel_of(&BLOCK), &stimulus(&labels), &mut Sent::new(&labels));
    }
}
