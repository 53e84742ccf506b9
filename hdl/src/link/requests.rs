//! Queue of the requests that the board has accepted and not answered yet.

use dermis_golden::wire::link::Kind;

use super::{PacketParams, COUNTERS, FORCES, IDENTITY, RESULTANTS};
use crate::block;
use crate::language::{Block, Builder, Contents, Inside, Type};
use crate::primitives::count_bits;

block! {
    /// Holds accepted requests until they are answered: one identification, one reading of the counters, and the frames
    /// in the engine, in order. An image of tables that is in the engine is answered as a reading of the counters; one
    /// that comes before such a reading is answered has no answer of its own.
    ///
    /// `offer` is high when a request can be answered, with the number of the request and the source of the
    /// answer; `begun` removes it.
    ///
    /// The parallel engine holds at most three frames (one being sent, one computed, one received), so a queue of four
    /// never overflows; the serial one holds two. Where the hardware scans its array, a frame is requested without a
    /// payload, and the request is dropped while the queue is full.
    pub struct Requests {
        /// Frames in the queue, a power of two.
        depth: usize,
        /// There are images of tables.
        images: bool,
        /// Types of the requests for frames that the hardware scans.
        scanned: &'static [Kind],
    }
    ports RequestsPorts {
        clock;
        reset;
        /// A correct packet has been received; high for one cycle.
        in good;
        /// Its type; valid with `good`.
        in kind: 8;
        /// Its sequence number; valid with `good`.
        in number: 8;
        /// It is a frame or an image, and the engine gets it; with `good`.
        in taken;
        /// A request without payload is accepted; with `good`.
        out noted;
        /// A request without payload is dropped, because one of its type is not answered yet, or the queue is full;
        /// with `good`.
        out overrun;
        /// The engine offers a beat of an answer.
        in answered;
        /// An answer can start.
        out offer;
        /// The offered answer starts in this cycle.
        in begun;
        /// Sequence number of its request; valid with `offer`.
        out answer_number: 8;
        /// Source of its payload, 2 bits; valid with `offer`.
        out source: 2;
        /// Requests for frames are not answered yet.
        out waiting;
    }
}

impl Requests {
    /// For the requests of `params`.
    pub fn new(params: &PacketParams) -> Self {
        Requests { depth: params.frames, images: params.image_bytes.is_some(), scanned: params.scanned() }
    }
}

impl Block for Requests {
    fn build<'k>(&self, k: &'k Builder, io: RequestsPorts<Inside<'k>>) {
        let Requests { depth, images, scanned } = *self;
        let (bit, byte, at) = (Type::unsigned(1), Type::unsigned(8), count_bits(depth));
        let numbers = ["identity_number", "counters_number"].map(|name| k.register(name, byte));
        let [identity, counters] = ["identity", "counters"].map(|name| k.state(name, bit, io.rst, 0));
        let frames = k.memory("frames", depth, 9, Contents::Undefined);
        let [head, tail] = ["head", "tail"].map(|name| k.state(name, Type::unsigned(at), io.rst, 0));
        let fill = k.state("fill", Type::unsigned(at + 1), io.rst, 0);

        let asks = |name, of: Kind| k.wire(name, io.good & io.kind.is(of as u64));
        let is_scanned = scanned.iter().map(|of| io.kind.is(*of as u64)).reduce(|a, b| a | b);
        let scan = is_scanned.map(|is| {
            let asks = k.wire("asks_scan", io.good & is);
            (asks, k.wire("room", !fill.is(depth as u64)))
        });
        let asked = [asks("asks_identity", Kind::Identify), asks("asks_counters", Kind::ReadCounters)];
        let pending = [*identity, *counters];
        let image = images.then(|| k.wire("image", io.taken & io.kind.is(Kind::Tables as u64)));
        let queued = match (&scan, image) {
            (Some((asks, room)), _) => k.wire("queued", *asks & *room),
            (None, Some(image)) => k.wire("queued", io.taken & !image),
            (None, None) => io.taken,
        };
        let to_answer = [asked[0], image.map_or(asked[1], |image| k.wire("asked_counters", asked[1] | image))];
        let frame = k.wire("frame", frames.read(*head));
        let waiting = io.waiting.set(fill.any());
        let noted = (asked[0] & !pending[0]) | (asked[1] & !pending[1]);
        let overrun = (asked[0] & pending[0]) | (asked[1] & pending[1]);
        io.noted.set(scan.as_ref().map_or(noted, |(asks, room)| noted | (*asks & *room)));
        io.overrun.set(scan.as_ref().map_or(overrun, |(asks, room)| overrun | (*asks & !*room)));
        io.offer.set(*identity | *counters | (waiting & io.answered));
        let from = |source: usize| k.constant(2, source as u64);
        let of_frame = (waiting & frame.top()).mux(from(FORCES), from(RESULTANTS));
        io.source.set(identity.mux(from(IDENTITY), counters.mux(from(COUNTERS), of_frame)));
        io.answer_number.set(identity.mux(*numbers[0], counters.mux(*numbers[1], frame.low(8))));

        for ((kept, asked), pending) in numbers.iter().zip(to_answer).zip(pending) {
            k.when(asked & !pending, || kept.set(io.number));
        }
        frames.write(queued, *tail, io.kind.is(Kind::FrameForForces as u64).concat(io.number));
        identity.set(identity.mux(!io.begun, to_answer[0]));
        counters.set(counters.mux(!io.begun | *identity, to_answer[1]));
        let pop = k.wire("pop", io.begun & !*identity & !*counters);
        k.when(pop, || head.set(head.plus(1)));
        k.when(queued, || tail.set(tail.plus(1)));
        k.when(queued.differs(pop), || fill.set(queued.mux(fill.plus(1), fill.minus(1))));
    }
}

#[cfg(test)]
mod tests {
    use std::collections::VecDeque;

    use super::*;
    use crate::language::kernel_of;
    use crate::language::testbench::{check, Reference};
    use crate::wire::Word;

    const DEPTH: usize = 4;
    const FRAMES: [Kind; 2] = [Kind::FrameForResultants, Kind::FrameForForces];
    const PLAIN: [u8; 2] = [Kind::Identify as u8, Kind::ReadCounters as u8];

    /// Requests in lists.
    #[derive(Default)]
    struct Lists {
        images: bool,
        /// Frames are requested without payload.
        scans: bool,
        /// Numbers of a pending identification and of a pending reading of the counters.
        plain: [Option<u8>; 2],
        /// Numbers of the frames, and whether all forces are requested.
        frames: VecDeque<(u8, bool)>,
        reset: bool,
    }

    impl Lists {
        /// Source and number of the next answer.
        fn next(&self) -> Option<(usize, u8)> {
            let plain = [IDENTITY, COUNTERS].into_iter().find_map(|source| Some((source, self.plain[source]?)));
            let frame = self.frames.front().map(|&(number, forces)| (if forces { FORCES } else { RESULTANTS }, number));
            plain.or(frame)
        }

        fn offers(&self, inputs: &[Word]) -> bool {
            self.plain.iter().any(Option::is_some) || (!self.frames.is_empty() && inputs[5].number() == 1)
        }

        /// Whether a scanned frame is asked for.
        fn asks_scan(&self, inputs: &[Word]) -> bool {
            self.scans && inputs[1].number() == 1 && FRAMES.iter().any(|of| inputs[2].number() == *of as u64)
        }

        fn asked(&self, inputs: &[Word]) -> Option<usize> {
            let kind = inputs[2].number() as u8;
            PLAIN.iter().position(|&plain| plain == kind).filter(|_| inputs[1].number() == 1)
        }
    }

    impl Reference for Lists {
        fn outputs(&mut self, inputs: &[Word]) -> Vec<Option<Word>> {
            if !self.reset {
                return vec![None; 6];
            }
            let bit = |bit: bool| Some(Word::from(bit));
            let asked = self.asked(inputs).map(|asked| self.plain[asked].is_none());
            let next = self.next().filter(|_| self.offers(inputs));
            let scan = self.asks_scan(inputs).then_some(self.frames.len() < DEPTH);
            vec![
                bit(!self.frames.is_empty()),
                bit(asked == Some(true) || scan == Some(true)),
                bit(asked == Some(false) || scan == Some(false)),
                bit(self.offers(inputs)),
                next.map(|(source, _)| Word::from(source as u64)),
                next.map(|(_, number)| Word::from(u64::from(number))),
            ]
        }

        fn clock(&mut self, inputs: &[Word]) {
            let number = inputs[3].number() as u8;
            let image = self.images && inputs[2].number() as u8 == Kind::Tables as u8 && inputs[4].number() == 1;
            let asked = self.asked(inputs).or(image.then_some(COUNTERS)).filter(|&asked| self.plain[asked].is_none());
            let queued = match self.scans {
                true => self.asks_scan(inputs) && self.frames.len() < DEPTH,
                false => inputs[4].number() == 1 && !image,
            };
            match self.next().filter(|_| inputs[6].number() == 1) {
                Some((source @ (IDENTITY | COUNTERS), _)) => self.plain[source] = None,
                Some(_) => drop(self.frames.pop_front()),
                None => {}
            }
            if let Some(asked) = asked {
                self.plain[asked] = Some(number);
            }
            if queued {
                self.frames.push_back((number, inputs[2].number() as u8 == Kind::FrameForForces as u8));
            }
            if inputs[0].number() == 1 {
                *self = Lists { reset: true, images: self.images, scans: self.scans, ..Lists::default() };
            }
        }
    }

    /// Requests of all types, frames with payload only where the queue has room; answers at any time; resets.
    fn stimulus(cycles: usize, images: bool, scans: bool) -> Vec<Vec<Word>> {
        let mut random = fastrand::Rng::with_seed(18);
        let mut lists = Lists { images, scans, ..Lists::default() };
        let kinds = [Kind::Identify, Kind::ReadCounters, Kind::FrameForForces, Kind::FrameForResultants, Kind::Tables];
        let kinds = &kinds.map(|kind| kind as u8)[..if images { 5 } else { 4 }];
        let mut speed = 4;
        let inputs = |cycle: usize| {
            if cycle.is_multiple_of(100) {
                speed = random.u8(1..8);
            }
            let rst = cycle < 2 || random.u16(..500) == 0;
            let good = !rst && random.u8(..4) == 0;
            let kind = kinds[random.usize(..kinds.len())];
            let image = kind == Kind::Tables as u8;
            let taken = good && !PLAIN.contains(&kind) && if scans { image } else { lists.frames.len() < DEPTH };
            let mut inputs = vec![Word::from(rst), Word::from(good), Word::from(u64::from(kind))];
            inputs.extend([Word::from(u64::from(random.u8(..))), Word::from(taken), Word::from(random.bool())]);
            inputs.push(Word::default());
            inputs[6] = Word::from(!rst && lists.offers(&inputs) && random.u8(..8) < speed);
            lists.clock(&inputs);
            inputs
        };
        (0..cycles).map(inputs).collect()
    }

    #[test]
    fn requests_are_answered_in_order() {
        for (images, scans) in [(false, false), (true, false), (true, true)] {
            let mut lists = Lists { images, scans, ..Lists::default() };
            let block = Requests { depth: DEPTH, images, scanned: if scans { &FRAMES } else { &[] } };
            check(&kernel_of(&block), &stimulus(8000, images, scans), &mut lists);
        }
    }
}
