//! Marks of a scan in the status of its frame.

use dermis_golden::result::flags::{StatusField, RAIL, STATUS_BEATS, WRONG_CHANNEL};

use crate::block;
use crate::language::{concat, Block, Builder, Expr, Inside, Type};
use crate::primitives::{count_bits, Stream};

block! {
    /// The engine's beats pass through; in the first beat of every status the flags word gets the marks of its scan,
    /// which wait in a queue while the engine computes. Frames leave in the order in which they came.
    pub struct ScanStatus {
        /// Beats of a frame before its status.
        forces: usize,
    }
    ports ScanStatusPorts {
        clock;
        reset;
        /// A scan has given its last code to the engine in this cycle.
        in complete;
        /// A sample of it was at an end of the range; valid with `complete`.
        in rail;
        /// A sample of it named another channel; valid with `complete`.
        in other;
        /// There is room for the marks of one more scan.
        out room;
        /// A beat of the engine, three words; valid with `s_axis_tvalid`.
        sink<Stream> s_axis: BEAT;
        /// The beat with its marks; valid with `m_axis_tvalid`.
        source<Stream> m_axis: BEAT;
    }
}

/// Width of a word of a beat, and of a beat.
const WORD: usize = 32;
const BEAT: usize = 3 * WORD;
/// Scans whose marks can wait: more than the frames that an engine holds.
const CAPACITY: usize = 8;
/// Marks of a scan.
const MARKS: usize = 2;

impl ScanStatus {
    /// For frames of `forces` beats before the status.
    pub fn new(forces: usize) -> Self {
        ScanStatus { forces }
    }
}

impl Block for ScanStatus {
    fn build<'k>(&self, k: &'k Builder, io: ScanStatusPorts<Inside<'k>>) {
        let marks = k
            .state("marks", Type::unsigned(MARKS * CAPACITY), io.rst, 0)
            .comment("Marks that wait, the next in the low bits.");
        let waiting = k.state("waiting", Type::unsigned(count_bits(CAPACITY + 1)), io.rst, 0);
        let beat = k.state("beat", Type::unsigned(count_bits(self.forces + 1)), io.rst, 0);
        let word = k.state("word", Type::unsigned(count_bits(STATUS_BEATS)), io.rst, 0);

        io.room.set(!waiting.is(CAPACITY as u64));
        io.s_axis.ready.set(io.m_axis.ready);
        io.m_axis.valid.set(io.s_axis.valid);
        io.m_axis.last.set(io.s_axis.last);
        let moves = k.wire("moves", io.s_axis.valid & io.m_axis.ready);
        let leaves = k.wire("leaves", moves & io.s_axis.last);
        let in_status = k.wire("in_status", beat.is(self.forces as u64));
        let marked = k.wire("marked", in_status & word.is(0));
        k.when(moves, || {
            k.when(!in_status, || beat.set(beat.plus(1)));
            let at_end = word.is(STATUS_BEATS as u64 - 1);
            k.when(in_status, || word.set(at_end.mux(k.constant(word.bits(), 0), word.plus(1))));
            k.when(io.s_axis.last, || {
                beat.set(k.constant(beat.bits(), 0));
                word.set(k.constant(word.bits(), 0));
            });
        });
        let rest = k.wire("rest", leaves.mux(marks.shift_right(MARKS).extend(marks.bits()), *marks));
        let place = k.wire("place", (*waiting - leaves.extend(waiting.bits())).low(waiting.bits()));
        let added = io.other.concat(io.rail).extend(marks.bits()).shift_left_by(place.concat(k.constant(1, 0)));
        marks.set(io.complete.mux(rest | added, rest));
        waiting.set((place + io.complete.extend(place.bits())).low(place.bits()));

        let flag = |at: usize| -> Expr {
            let of = |field: StatusField| at == field.word * WORD + field.low as usize;
            match at {
                _ if of(RAIL) => marked & marks.at(0),
                _ if of(WRONG_CHANNEL) => marked & marks.at(1),
                _ => k.constant(1, 0),
            }
        };
        let flags: Vec<Expr> = (0..BEAT).rev().map(flag).collect();
        io.m_axis.data.set(io.s_axis.data | concat(&flags));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::testbench::{check_with_defects, subject_of, Reference};
    use crate::language::Change;
    use crate::wire::Word;
    use std::collections::VecDeque;

    const FORCES: usize = 4;

    #[derive(Default)]
    struct Marks {
        waiting: VecDeque<u32>,
        beat: usize,
        reset: bool,
    }

    impl Reference for Marks {
        fn outputs(&mut self, inputs: &[Word]) -> Vec<Option<Word>> {
            if !self.reset {
                return vec![None; 5];
            }
            let bit = |k: usize| Some(Word::from(inputs[k].number() == 1));
            let mut data = inputs[4];
            if self.beat >= FORCES && (self.beat - FORCES).is_multiple_of(STATUS_BEATS) {
                let flags = data.field(2 * WORD, WORD) as u32 | self.waiting.front().copied().unwrap_or(0);
                data.set(2 * WORD, WORD, flags.into());
            }
            vec![Some(Word::from(self.waiting.len() < CAPACITY)), bit(7), Some(data), bit(5), bit(6)]
        }

        fn clock(&mut self, inputs: &[Word]) {
            let of = |k: usize| inputs[k].number() == 1;
            if of(5) && of(7) {
                self.beat += 1;
                if of(6) {
                    self.beat = 0;
                    self.waiting.pop_front();
                }
            }
            if of(1) {
                self.waiting
                    .push_back(if of(2) { RAIL.mask() } else { 0 } | if of(3) { WRONG_CHANNEL.mask() } else { 0 });
            }
            if of(0) {
                *self = Marks { reset: true, ..Marks::default() };
            }
        }
    }

    /// Frames of one or two statuses, up to eight under way.
    fn stimulus(cycles: usize) -> Vec<Vec<Word>> {
        let mut random = fastrand::Rng::with_seed(3);
        let (mut under_way, mut beat, mut length) = (0, 0, FORCES + STATUS_BEATS);
        let of = |cycle: usize| {
            let rst = cycle < 2;
            let complete = !rst && under_way < CAPACITY && random.u8(..9) == 0;
            let given = !rst && under_way > 0 && random.u8(..3) > 0;
            let ready = random.u8(..4) > 0;
            let last = beat + 1 == length;
            let mut data = Word::default();
            data.set(0, 64, random.u64(..));
            data.set(64, 32, u64::from(random.u32(..) & !(RAIL.mask() | WRONG_CHANNEL.mask())));
            under_way += usize::from(complete);
            if given && ready {
                beat += 1;
                if last {
                    (under_way, beat) = (under_way - 1, 0);
                    length = FORCES + STATUS_BEATS * random.usize(1..3);
                }
            }
            let bits = [rst, complete, random.bool(), random.bool()].map(Word::from);
            [&bits[..], &[data], &[given, last, ready].map(Word::from)].concat()
        };
        (0..cycles).map(of).collect()
    }

    #[test]
    fn marks_come_with_their_frame() {
        let subject = |changes: &[Change]| {
            subject_of!(
                ScanStatus::new(FORCES),
                changes,
                inputs [rst, complete, rail, other, s_axis_tdata, s_axis_tvalid, s_axis_tlast, m_axis_tready],
                outputs [room, s_axis_tready, m_axis_tdata, m_axis_tvalid, m_axis_tlast],
            )
        };
        let defects = [
            // Marks of the frame before.
            Change::value("", "rest", |k| k.named("marks")),
            Change::value("", "marked", |k| k.named("in_status")),
        ];
        check_with_defects(subject, &stimulus(4000), Marks::default, &defects);
    }
}
