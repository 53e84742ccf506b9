//! Codes of a scan at the end of its frame.

use dermis_golden::fixed::stages::scan::CODES_PER_BEAT;

use crate::block;
use crate::language::{Block, Builder, Contents, Inside, Type};
use crate::primitives::{count_bits, Stream};

block! {
    /// The codes that the engine takes are kept until the frame's forces and status have left, and follow them, as
    /// [`dermis_golden::fixed::stages::scan::beats`] says: a host can compare the forces with the model's for these
    /// codes, and calibrate the array from them.
    ///
    /// Each scan has a slot of its own; one that is broken off leaves its slot to the next. There are slots for those
    /// in the engine, for one that is taken, and for one more, whose scan has begun.
    pub struct ScanCodes {
        taxels: usize,
        code_bits: usize,
    }
    ports ScanCodesPorts {
        clock;
        reset;
        /// A taxel's code, two's complement; valid with `passed`.
        in code: code_bits;
        /// The engine takes the code in this cycle.
        in passed;
        /// It is the last of its scan; with `passed`.
        in complete;
        /// The scan is broken off: its codes are forgotten.
        in broken;
        /// There is a slot for one more scan.
        out room;
        /// A beat of the engine, three words; valid with `s_axis_tvalid`.
        sink<Stream> s_axis: BEAT;
        /// A beat of the engine, or three codes; valid with `m_axis_tvalid`.
        source<Stream> m_axis: BEAT;
    }
}

/// Width of a word of a beat, and of a beat.
const WORD: usize = 32;
const BEAT: usize = CODES_PER_BEAT * WORD;
/// Slots.
const SLOTS: usize = 4;
/// Most scans that wait when one more may begin: with one that is taken, and this one, they fill the slots.
const MOST_WAITING: u64 = SLOTS as u64 - 3;

impl ScanCodes {
    /// For scans of so many taxels with codes of `code_bits`.
    pub fn new(taxels: usize, code_bits: usize) -> Self {
        ScanCodes { taxels, code_bits }
    }
}

impl Block for ScanCodes {
    fn build<'k>(&self, k: &'k Builder, io: ScanCodesPorts<Inside<'k>>) {
        let ScanCodes { taxels, code_bits } = *self;
        // Beyond the last taxel there may be two places of a beat.
        let (t, s) = (count_bits(taxels + CODES_PER_BEAT), count_bits(SLOTS));
        let state = |name: &str, bits: usize| k.state(name, Type::unsigned(bits), io.rst, 0);
        let zero = |bits: usize| k.constant(bits, 0);

        let kept = k.memory("kept", SLOTS << t, code_bits, Contents::Undefined).unchecked();
        let (slot, place) = (state("slot", s), state("place", t).comment("Codes of the scan that is taken, so far."));
        let (waiting, from) = (state("waiting", s + 1), state("from", s));
        kept.write(io.passed, slot.concat(*place), io.code);
        k.when(io.passed, || place.set(place.plus(1)));
        k.when(io.complete | io.broken, || place.set(zero(t)));
        k.when(io.complete, || slot.set(slot.plus(1)));

        let sends = state("sends", 1).comment("The engine's last beat has left, and codes follow.");
        let next = state("next", t).comment("Codes that have been read.");
        let asked = state("asked", 2).comment("Codes of the beat that have been read, and that have come.");
        let held = state("held", 2);
        let word = k.register("word", Type::unsigned(BEAT));
        let whole = CODES_PER_BEAT as u64;
        let reads = k.wire("reads", *sends & !asked.is(whole));
        let beyond = k.wire("beyond", !next.less(k.constant(t, taxels as u64)));
        let came = k.delay("came", kept.read(from.concat(*next)));
        let pads = k.delay("pads", beyond);
        let comes = state("comes", 1);
        comes.set(reads);
        k.when(reads, || {
            next.set(next.plus(1));
            asked.set(asked.plus(1));
        });
        let own = pads.mux(zero(WORD), came.signed().extend(WORD).unsigned());
        k.when(*comes, || {
            held.set(held.plus(1));
            word.set(own.concat(word.slice(WORD, BEAT - WORD)));
        });
        let offered = k.wire("offered", held.is(whole));
        let moves = k.wire("moves", offered & io.m_axis.ready);
        let leaves = k.wire("leaves", moves & beyond);
        k.when(moves, || [&asked, &held].iter().for_each(|count| count.set(zero(2))));
        k.when(leaves, || {
            next.set(zero(t));
            from.set(from.plus(1));
        });
        let accepted = io.s_axis.ready.set(io.m_axis.ready & !*sends);
        sends.set((*sends & !leaves) | (accepted & io.s_axis.valid & io.s_axis.last));
        waiting.set((*waiting + io.complete.extend(s + 1) - leaves.extend(s + 1)).low(s + 1));
        io.room.set(waiting.less(k.constant(s + 1, MOST_WAITING + 1)));
        io.m_axis.valid.set(sends.mux(offered, io.s_axis.valid));
        io.m_axis.data.set(sends.mux(*word, io.s_axis.data));
        io.m_axis.last.set(offered & beyond);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::testbench::{check_with_defects, subject_of, Reference};
    use crate::language::Change;
    use crate::wire::Word;
    use dermis_golden::fixed::stages::scan::beats;
    use std::collections::VecDeque;

    const TAXELS: usize = 7;
    const CODE_BITS: usize = 9;

    #[derive(Default)]
    struct Queue {
        /// Codes of the scan that is taken, and of those that wait.
        taken: Vec<i32>,
        waiting: VecDeque<Vec<i32>>,
        /// Beats of codes that are to be sent, and cycles until the next is offered.
        sending: VecDeque<[i32; 3]>,
        late: usize,
        reset: bool,
    }

    impl Queue {
        fn room(&self) -> bool {
            self.waiting.len() as u64 <= MOST_WAITING
        }
    }

    /// Cycles to gather a beat.
    const GATHER: usize = CODES_PER_BEAT + 1;

    impl Reference for Queue {
        fn outputs(&mut self, inputs: &[Word]) -> Vec<Option<Word>> {
            if !self.reset {
                return vec![None; 5];
            }
            let is = |k: usize| inputs[k].number() == 1;
            let bit = |bit: bool| Some(Word::from(bit));
            let sends = !self.sending.is_empty();
            let offered = if sends { self.late == 0 } else { is(6) };
            let data = match self.sending.front() {
                Some(beat) => Word::of_fields(&beat.map(i64::from), WORD),
                None => inputs[5],
            };
            vec![
                bit(self.room()),
                bit(!sends && is(8)),
                offered.then_some(data),
                bit(offered),
                offered.then(|| Word::from(self.sending.len() == 1)),
            ]
        }

        fn clock(&mut self, inputs: &[Word]) {
            let is = |k: usize| inputs[k].number() == 1;
            if !self.sending.is_empty() {
                if self.late > 0 {
                    self.late -= 1;
                } else if is(8) {
                    self.sending.pop_front();
                    self.late = GATHER;
                    if self.sending.is_empty() {
                        self.waiting.pop_front();
                    }
                }
            } else if is(6) && is(7) && is(8) {
                self.sending = self.waiting.front().map(|codes| beats(codes)).unwrap_or_default().into();
                self.late = GATHER;
            }
            if is(2) {
                self.taken.push(inputs[1].signed(0, CODE_BITS) as i32);
            }
            if is(3) {
                self.waiting.push_back(std::mem::take(&mut self.taken));
            }
            if is(4) {
                self.taken.clear();
            }
            if is(0) {
                *self = Queue { reset: true, ..Queue::default() };
            }
        }
    }

    /// Scans that begin while there is room, some broken off; frames of random length for those that are whole.
    fn stimulus(cycles: usize) -> Vec<Vec<Word>> {
        let mut random = fastrand::Rng::with_seed(8);
        let mut queue = Queue::default();
        let (mut scanning, mut left): (bool, Option<usize>) = (false, None);
        let of = |cycle: usize| {
            let rst = cycle < 2;
            scanning |= !rst && queue.room() && random.u8(..8) == 0;
            let broken = scanning && random.u8(..60) == 0 && !queue.taken.is_empty();
            let passed = scanning && !broken && random.bool();
            let complete = passed && queue.taken.len() + 1 == TAXELS;
            scanning &= !(broken || complete);
            if left.is_none() && queue.sending.is_empty() && !queue.waiting.is_empty() && random.u8(..3) == 0 {
                left = Some(random.usize(1..5));
            }
            let (given, last, ready) = (left.is_some(), left == Some(1), random.u8(..4) > 0);
            let mut data = Word::default();
            data.set(0, 64, random.u64(..));
            let bits = [passed, complete, broken].map(Word::from);
            let code = Word::from(random.u64(..1 << CODE_BITS));
            let inputs = [&[Word::from(rst), code], &bits[..], &[data], &[given, last, ready].map(Word::from)].concat();
            if given && ready && queue.sending.is_empty() {
                left = left.map(|left| left - 1).filter(|left| *left > 0);
            }
            queue.clock(&inputs);
            inputs
        };
        (0..cycles).map(of).collect()
    }

    #[test]
    fn codes_follow_their_frame() {
        let subject = |changes: &[Change]| {
            subject_of!(
                ScanCodes::new(TAXELS, CODE_BITS),
                changes,
                inputs [rst, code, passed, complete, broken, s_axis_tdata, s_axis_tvalid, s_axis_tlast, m_axis_tready],
                outputs [room, s_axis_tready, m_axis_tdata, m_axis_tvalid, m_axis_tlast],
            )
        };
        let defects = [
            // Codes of a scan that was broken off.
            Change::within("", "place", |k| [k.named("complete") | k.named("broken"), k.named("complete")]),
            // Those of the scan before.
            Change::within("", "from", |k| [k.constant(2, 1), k.constant(2, 0)]),
            // What is beyond the array.
            Change::value("", "pads", |k| k.constant(1, 0)),
        ];
        check_with_defects(subject, &stimulus(6000), Queue::default, &defects);
    }
}
