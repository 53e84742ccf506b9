//! Output queue, in which beats wait for the receiver, so that the pipeline before it never stalls.

use rust_hdl::prelude::*;

use crate::kernel_block;
use crate::language::{Body, Builder, Contents, Kernel, Type};
use crate::wire::Wire;

/// ```text
/// reserve ... later write, word --> queue --> m_axis, two cycles after write
/// room <-- places that are neither reserved nor occupied
/// ```
/// `reserve` is allowed only with `room`; each is followed by one `write` at any later time, in order. A place is free
/// again one cycle after its beat was accepted.
#[derive(dermis_hdl_derive::Block)]
pub struct Queue {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Synchronous reset, active high.
    pub rst: Signal<In, Bit>,
    /// Reserves a place for a beat to be written later; only with `room`.
    pub reserve: Signal<In, Bit>,
    /// A place can be reserved in this cycle.
    pub room: Signal<Out, Bit>,
    /// Writes a reserved beat in this cycle.
    pub write: Signal<In, Bit>,
    /// The beat is the last of its frame; valid with `write`.
    pub last: Signal<In, Bit>,
    /// Data of the beat; valid with `write`.
    pub word: Wire<In>,
    /// A beat is offered on `m_axis_tdata`; it is held until `m_axis_tready`.
    pub m_axis_tvalid: Signal<Out, Bit>,
    /// The receiver accepts a beat in this cycle.
    pub m_axis_tready: Signal<In, Bit>,
    /// The beat is the last of its frame; valid with `m_axis_tvalid`.
    pub m_axis_tlast: Signal<Out, Bit>,
    /// Data of the beat; valid with `m_axis_tvalid`.
    pub m_axis_tdata: Wire<Out>,
    kernel: Body,
}

const PLACE_BITS: usize = 4;
/// Places in the queue: the depth of one distributed RAM cell.
pub const PLACES: usize = 1 << PLACE_BITS;
/// Cycles from `write` to `m_axis_tvalid`, if the queue is empty.
pub const LATENCY: usize = 2;

kernel_block!(
    Queue,
    clock clk,
    inputs [rst, reserve, write, last, word, m_axis_tready],
    outputs [room, m_axis_tvalid, m_axis_tlast, m_axis_tdata]
);

impl Queue {
    /// A queue of beats of `bits` bits.
    pub fn new(bits: usize) -> Self {
        let block = Queue {
            clk: Default::default(),
            rst: Default::default(),
            reserve: Default::default(),
            room: Default::default(),
            write: Default::default(),
            last: Default::default(),
            word: Wire::new(bits),
            m_axis_tvalid: Default::default(),
            m_axis_tready: Default::default(),
            m_axis_tlast: Default::default(),
            m_axis_tdata: Wire::new(bits),
            kernel: Body::default(),
        };
        block.bind(kernel(bits))
    }
}

fn kernel(bits: usize) -> Kernel {
    let k = Builder::new("queue");
    let (rst, reserve) = (k.input("rst", 1), k.input("reserve", 1));
    let (write, last, word) = (k.input("write", 1), k.input("last", 1), k.input("word", bits));
    let ready = k.input("m_axis_tready", 1);
    let (bit, count) = (Type::unsigned(1), Type::unsigned(PLACE_BITS + 1));
    let places = k.memory("places", PLACES, bits + 1, Contents::Undefined);
    let [written, read, reserved] = ["written", "read", "reserved"].map(|name| k.state(name, count, rst, 0));
    let room = k.state("room", bit, rst, 1);
    let valid = k.state("m_axis_tvalid", bit, rst, 0);
    let tlast = k.state("m_axis_tlast", bit, rst, 0);
    let tdata = k.register("m_axis_tdata", Type::unsigned(bits));

    let taken = k.wire("taken", *valid & ready);
    let moves = k.wire("moves", !*valid | ready);
    let waits = k.wire("waits", written.differs(*read));
    k.comment("Both counts are at hand when reserve arrives, which is late.");
    let kept = k.wire("kept", (*reserved - taken).low(PLACE_BITS + 1));
    let grown = k.wire("grown", (*reserved + k.constant(1, 1) - taken).low(PLACE_BITS + 1));
    let head = k.wire("head", places.read(read.low(PLACE_BITS)));
    places.write(write, written.low(PLACE_BITS), last.concat(word));
    k.when(moves & waits, || {
        tlast.set(head.top());
        tdata.set(head.low(bits));
        read.set(read.plus(1));
    });
    k.when(write, || written.set(written.plus(1)));
    reserved.set(k.wire("now_reserved", reserve.mux(grown, kept)));
    room.set(reserve.mux(!grown.is(PLACES as u64), !kept.is(PLACES as u64)));
    k.when(moves, || valid.set(waits));
    k.finish()
}

#[cfg(test)]
pub(crate) mod tests {
    use std::collections::VecDeque;

    use super::*;
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
                bit(self.reserved < PLACES),
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
            let reserve = !rst && list.reserved < PLACES && random.u8(..8) < speed[0];
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
        check(queue.kernel.kernel(), &stimulus(5000), &mut List::default());
    }
}
