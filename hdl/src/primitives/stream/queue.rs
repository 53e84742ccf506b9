//! Output queue, in which beats wait for the receiver, so that the pipeline before it never stalls.

use crate::block;
use crate::language::{Block, Builder, Contents, Inside, Type};
use crate::primitives::stream::beats::Stream;

block! {
    /// ```text
    /// reserve ... later write, word --> queue --> m_axis, two cycles after write
    /// room <-- places that are neither reserved nor occupied
    /// ```
    /// `reserve` is allowed only with `room`; each is followed by one `write` at any later time, in order. A place is free
    /// again one cycle after its beat was accepted.
    pub struct Queue {
        /// Width of a beat in bits.
        bits: usize,
    }
    ports QueuePorts {
        clock;
        reset;
        /// Reserves a place for a beat to be written later; only with `room`.
        in reserve;
        /// A place can be reserved in this cycle.
        out room;
        /// Writes a reserved beat in this cycle.
        in write;
        /// The beat is the last of its frame; valid with `write`.
        in last;
        /// Data of the beat; valid with `write`.
        in word: bits;
        /// Data of the beat; valid with `m_axis_tvalid`.
        source<Stream> m_axis: bits;
    }
}

const PLACE_BITS: usize = 4;
/// Beats that fit the queue: the depth of one distributed RAM cell.
pub const CAPACITY: usize = 1 << PLACE_BITS;
/// Cycles from `write` to `m_axis_tvalid`, if the queue is empty.
pub const LATENCY: usize = 2;

impl Queue {
    /// A queue of beats of `bits` bits.
    pub fn new(bits: usize) -> Self {
        Queue { bits }
    }
}

impl Block for Queue {
    fn build<'k>(&self, k: &'k Builder, io: QueuePorts<Inside<'k>>) {
        let count = Type::unsigned(PLACE_BITS + 1);
        let places = k.memory("places", CAPACITY, self.bits + 1, Contents::Undefined);
        let [written, read, reserved] = ["written", "read", "reserved"].map(|name| k.state(name, count, io.rst, 0));
        let room = io.room.state(io.rst, 1);
        let valid = io.m_axis.valid.state(io.rst, 0);
        let tlast = io.m_axis.last.state(io.rst, 0);
        let tdata = io.m_axis.data.register();

        let taken = k.wire("taken", *valid & io.m_axis.ready);
        let moves = k.wire("moves", !*valid | io.m_axis.ready);
        let waits = k.wire("waits", written.differs(*read));
        k.comment("Both counts are at hand when reserve arrives, which is late.");
        let kept = k.wire("kept", (*reserved - taken).low(PLACE_BITS + 1));
        let grown = k.wire("grown", (*reserved + k.constant(1, 1) - taken).low(PLACE_BITS + 1));
        let head = k.wire("head", places.read(read.low(PLACE_BITS)));
        places.write(io.write, written.low(PLACE_BITS), io.last.concat(io.word));
        k.when(moves & waits, || {
            tlast.set(head.top());
            tdata.set(head.low(self.bits));
            read.set(read.plus(1));
        });
        k.when(io.write, || written.set(written.plus(1)));
        reserved.set(k.wire("now_reserved", io.reserve.mux(grown, kept)));
        room.set(io.reserve.mux(!grown.is(CAPACITY as u64), !kept.is(CAPACITY as u64)));
        k.when(moves, || valid.set(waits));
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use std::collections::VecDeque;

    use super::*;
    use crate::language::kernel_of;
    use crate::language::testbench::{check, Reference};
    use crate::wire::Word;

    const BITS: usize = 70;

    /// A list of beats, the number of places promised, the beat on the output.
    #[derive(Default)]
    pub(crate) struct List {
        reserved: usize,
        waiting: VecDeque<(Word, bool)>,
        offered: Option<(Word, bool)>,
        reset: bool,
    }

    impl Reference for List {
        fn outputs(&mut self, _: &[Word]) -> Vec<Option<Word>> {
            let bit = |bit: bool| self.reset.then(|| Word::from(bit));
            vec![
                bit(self.reserved < CAPACITY),
                bit(self.offered.is_some()),
                self.offered.map(|(_, last)| Word::from(last)),
                self.offered.map(|(word, _)| word),
            ]
        }

        fn clock(&mut self, inputs: &[Word]) {
            let [rst, reserve, write, last] = [0, 1, 2, 3].map(|k| inputs[k].number() == 1);
            let taken = self.offered.is_some() && inputs[5].number() == 1;
            self.reserved = self.reserved + usize::from(reserve) - usize::from(taken && self.reset);
            if taken || self.offered.is_none() {
                self.offered = self.waiting.pop_front();
            }
            if write {
                self.waiting.push_back((inputs[4], last));
            }
            if rst {
                *self = List { reset: true, ..List::default() };
            }
        }
    }

    /// Reserves only with room and writes only what is reserved, as the reference counts; stalls, resets.
    fn stimulus(cycles: usize) -> Vec<Vec<Word>> {
        let mut random = fastrand::Rng::with_seed(3);
        let mut list = List::default();
        let (mut unwritten, mut speed) = (0usize, [4, 4, 4]);
        let mut all = Vec::new();
        for cycle in 0..cycles {
            if cycle % 64 == 0 {
                // Mostly full, mostly empty, or balanced.
                speed = [(); 3].map(|()| random.u8(1..8));
            }
            let rst = cycle < 2 || random.u16(..200) == 0;
            let reserve = !rst && list.reserved < CAPACITY && random.u8(..8) < speed[0];
            let write = !rst && unwritten > 0 && random.u8(..8) < speed[1];
            let mut word = Word::default();
            word.set_limbs(&[random.u64(..), random.u64(..64)]);
            let ready = random.u8(..8) < speed[2];
            let inputs = vec![
                Word::from(rst),
                Word::from(reserve),
                Word::from(write),
                Word::from(random.bool()),
                word,
                Word::from(ready),
            ];
            list.clock(&inputs);
            unwritten = if rst { 0 } else { unwritten + usize::from(reserve) - usize::from(write) };
            all.push(inputs);
        }
        all
    }

    #[test]
    fn beats_leave_in_order_and_no_place_is_promised_twice() {
        let queue = Queue::new(BITS);
        check(&kernel_of(&queue), &stimulus(5000), &mut List::default());
    }
}
