//! Codes from a stream of 32-bit words.

use dermis_golden::fixed::plan::resources::count_bits;

use super::bundles::{id_bits, CoreStream, WORD_BYTES};
use crate::block;
use crate::language::{concat, Block, Builder, Inside, Type};
use crate::primitives::{Arrays, Stream};

block! {
    /// Takes one taxel's code from each beat, as a signed number of 32 bits, into a register. A code that the engine's
    /// codes cannot hold is clipped. With the last taxel the label of the frame is given away: its identifier and
    /// whether a code was clipped, a beat was incomplete, or one had another identifier than the first. A `tlast` that comes
    /// early begins the count anew, as in the engine; the next frame is then the engine's next one too.
    pub struct StreamIn {
        /// Codes of a frame.
        taxels: usize,
        /// Width of a code, 2 to 32.
        code_bits: usize,
        arrays: Arrays,
    }
    ports StreamInPorts {
        clock;
        reset;
        /// A taxel's code, 32 bits signed; valid with `s_axis_tvalid`.
        sink<CoreStream> s_axis: CoreStream::of_codes(*arrays);
        /// There is room for one more label.
        in room;
        /// The taxel's code, `code_bits` wide, signed; valid with `m_axis_tvalid`.
        source<Stream> m_axis: (*code_bits, arrays.bits);
        /// Label of the frame: its identifier, and above it whether it is spoiled; valid with `complete`.
        out label: id_bits(*arrays) + 1;
        /// The last taxel of a frame is accepted in this cycle.
        out complete;
        /// A code is clipped in this cycle.
        out clipped;
        /// An incomplete beat is accepted in this cycle.
        out partial;
        /// A `tlast` too early, none where it should be, or the first beat of another identifier in a frame is accepted in this
        /// cycle.
        out misframed;
    }
}

impl StreamIn {
    /// For frames of `taxels` codes of `code_bits` bits, 2 to 32, of one of the `arrays`.
    pub fn new(taxels: usize, code_bits: usize, arrays: Arrays) -> Self {
        StreamIn { taxels, code_bits, arrays }
    }
}

impl Block for StreamIn {
    fn build<'k>(&self, k: &'k Builder, io: StreamInPorts<Inside<'k>>) {
        let StreamIn { taxels, code_bits, arrays } = *self;
        let bit = Type::unsigned(1);
        let count = k.state("count", Type::unsigned(count_bits(taxels)), io.rst, 0);
        let spoiled = k.state("spoiled", bit, io.rst, 0);
        let mixed = k.state("mixed", bit, io.rst, 0).comment("The frame has beats of several identifiers.");
        let frame = k.register("frame", Type::unsigned(id_bits(arrays))).comment("Identifier of the frame.");
        let code = io.m_axis.data.register();
        let valid = io.m_axis.valid.state(io.rst, 0);
        let tlast = io.m_axis.last.register();

        let moves = k.wire("moves", !*valid | io.m_axis.ready);
        let takes = io.s_axis.ready.set(moves & io.room);
        let taken = k.wire("taken", io.s_axis.valid & takes);
        let begins = k.wire("begins", count.is(0));
        let ends = k.wire("ends", count.is(taxels as u64 - 1));
        // A code fits if all bits above its sign are copies of it.
        let above = io.s_axis.data.slice(code_bits - 1, 8 * WORD_BYTES + 1 - code_bits);
        let fits = k.wire("fits", above.all() | !above.any());
        let limit = concat(&[io.s_axis.data.top(), (!io.s_axis.data.top()).repeat(code_bits - 1)]);
        let clipped = io.clipped.set(taken & !fits);
        let partial = io.partial.set(taken & !io.s_axis.keep.all());
        let foreign = k.wire("foreign", taken & !begins & io.s_axis.id.differs(*frame));
        io.misframed.set((taken & io.s_axis.last.differs(ends)) | (foreign & !*mixed));
        io.complete.set(taken & ends);
        let now_spoiled = k.wire("now_spoiled", clipped | partial | foreign | (*spoiled & !begins));
        io.label.set(now_spoiled.concat(begins.mux(io.s_axis.id, *frame)));
        k.when(moves, || {
            code.set(fits.mux(io.s_axis.data.low(code_bits), limit));
            tlast.set(io.s_axis.last);
            valid.set(io.s_axis.valid & io.room);
        });
        if arrays.bits > 0 {
            // The engine takes that of the first beat.
            let array = io.m_axis.array.register();
            k.when(moves, || array.set(io.s_axis.id.low(arrays.bits)));
        }
        k.when(taken, || {
            count.set((io.s_axis.last | ends).mux(k.constant(count_bits(taxels), 0), count.plus(1)));
            spoiled.set(now_spoiled);
            mixed.set(foreign | (*mixed & !begins));
        });
        k.when(taken & begins, || frame.set(io.s_axis.id));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::kernel_of;
    use crate::language::testbench::{check, Reference};
    use crate::wire::Word;

    const TAXELS: usize = 5;
    const CODE_BITS: usize = 12;
    const ARRAYS: Arrays = Arrays { bits: 3 };

    /// Taxels since the frame began, its identifier, whether it is spoiled; the beat in the register.
    #[derive(Default)]
    struct Frames {
        count: usize,
        id: u64,
        mixed: bool,
        spoiled: bool,
        beat: Option<(u64, u64, u64)>,
        reset: bool,
    }

    struct Event {
        taken: bool,
        clipped: bool,
        partial: bool,
        misframed: bool,
        complete: bool,
        id: u64,
        foreign: bool,
        spoiled: bool,
        code: u64,
    }

    impl Frames {
        fn event(&self, inputs: &[Word]) -> Event {
            let [keep, id, valid, last, room, ready] = [2, 3, 4, 5, 6, 7].map(|k| inputs[k].number());
            let taken = valid == 1 && room == 1 && (self.beat.is_none() || ready == 1);
            let (word, most) = (inputs[1].number() as u32 as i32, 1 << (CODE_BITS - 1));
            let code = word.clamp(-most, most - 1);
            let (clipped, partial) = (taken && code != word, taken && keep != 15);
            let end = self.count == TAXELS - 1;
            let foreign = taken && self.count > 0 && id != self.id;
            Event {
                taken,
                clipped,
                partial,
                misframed: taken && (last == 1) != end || foreign && !self.mixed,
                complete: taken && end,
                id: if self.count == 0 { id } else { self.id },
                foreign,
                spoiled: clipped || partial || foreign || (self.spoiled && self.count > 0),
                code: code as u64 & ((1 << CODE_BITS) - 1),
            }
        }
    }

    impl Reference for Frames {
        fn outputs(&mut self, inputs: &[Word]) -> Vec<Option<Word>> {
            let event = self.event(inputs);
            let bit = |bit: bool| self.reset.then(|| Word::from(bit));
            let ready = inputs[6].number() == 1 && (self.beat.is_none() || inputs[7].number() == 1);
            let label = Word::from(u64::from(event.spoiled) << id_bits(ARRAYS) | event.id);
            vec![
                self.beat.map(|(code, ..)| Word::from(code)),
                bit(self.beat.is_some()),
                self.beat.map(|(_, last, _)| Word::from(last)),
                bit(ready),
                bit(event.clipped),
                bit(event.partial),
                bit(event.misframed),
                bit(event.complete),
                (self.reset && event.complete).then_some(label),
                self.beat.map(|(.., array)| Word::from(array)),
            ]
        }

        fn clock(&mut self, inputs: &[Word]) {
            if inputs[0].number() == 1 {
                *self = Frames { reset: true, ..Frames::default() };
                return;
            }
            let event = self.event(inputs);
            let last = inputs[5].number();
            if event.taken {
                self.beat = Some((event.code, last, inputs[3].number() % ARRAYS.count() as u64));
                (self.id, self.spoiled) = (event.id, event.spoiled);
                self.mixed = event.foreign || self.mixed && self.count > 0;
                self.count = if last == 1 || event.complete { 0 } else { self.count + 1 };
            } else if inputs[7].number() == 1 {
                self.beat = None;
            }
        }
    }

    #[test]
    fn codes_are_clipped_and_frames_counted_as_in_the_engine() {
        let mut random = fastrand::Rng::with_seed(21);
        let (mut taxel, mut id) = (0, 0);
        let stimulus = (0..20_000).map(|cycle| {
            // Mostly right frames of small codes.
            let last = if random.u8(..40) == 0 { random.bool() } else { taxel == TAXELS - 1 };
            taxel = if last { 0 } else { (taxel + 1) % TAXELS };
            // And mostly of one identifier.
            if taxel == 1 || random.u8(..20) == 0 {
                id = random.u64(..1 << id_bits(ARRAYS));
            }
            let word = if random.u8(..8) == 0 { random.u32(..) } else { random.i32(-2048..2048) as u32 };
            vec![
                Word::from(cycle < 2 || random.u16(..500) == 0),
                Word::from(u64::from(word)),
                Word::from(if random.u8(..30) == 0 { random.u64(..16) } else { 15 }),
                Word::from(id),
                Word::from(random.u8(..8) > 0),
                Word::from(last),
                Word::from(random.u8(..8) > 0),
                Word::from(random.bool()),
            ]
        });
        let stimulus: Vec<_> = stimulus.collect();
        check(&kernel_of(&StreamIn::new(TAXELS, CODE_BITS, ARRAYS)), &stimulus, &mut Frames::default());
    }
}
