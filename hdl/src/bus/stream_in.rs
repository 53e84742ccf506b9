//! Codes from a stream of 32-bit words.

use dermis_golden::fixed::plan::resources::count_bits;
use rust_hdl::prelude::*;

use super::ID_BITS;
use crate::kernel_block;
use crate::language::{concat, Body, Builder, Kernel, Type};
use crate::wire::Wire;

/// Bytes of a word of the input.
pub const WORD_BYTES: usize = 4;

/// Takes one taxel's code from each beat, as a signed number of 32 bits, into a register. A code that the engine's codes
/// cannot hold is clipped. With the last taxel the label of the frame is given away: its identifier and whether a code was
/// clipped or a beat was incomplete. A `tlast` that comes early begins the count anew, as in the engine; the next frame is then
/// the engine's next one too.
#[derive(dermis_hdl_derive::Block)]
pub struct StreamIn {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Synchronous reset, active high.
    pub rst: Signal<In, Bit>,
    /// A taxel's code, 32 bits signed; valid with `s_axis_tvalid`.
    pub s_axis_tdata: Wire<In>,
    /// Bytes of the beat that are there, all of them; valid with `s_axis_tvalid`.
    pub s_axis_tkeep: Wire<In>,
    /// Identifier of the frame, that of its first beat counts; valid with `s_axis_tvalid`.
    pub s_axis_tid: Wire<In>,
    /// A beat is offered on `s_axis_tdata`; the sender holds it until `s_axis_tready`.
    pub s_axis_tvalid: Signal<In, Bit>,
    /// The block accepts a beat in this cycle.
    pub s_axis_tready: Signal<Out, Bit>,
    /// The beat is the last of its frame; valid with `s_axis_tvalid`.
    pub s_axis_tlast: Signal<In, Bit>,
    /// There is room for one more label.
    pub room: Signal<In, Bit>,
    /// The taxel's code, `code_bits` wide, signed; valid with `m_axis_tvalid`.
    pub m_axis_tdata: Wire<Out>,
    /// A beat is offered on `m_axis_tdata`; it is held until `m_axis_tready`.
    pub m_axis_tvalid: Signal<Out, Bit>,
    /// The receiver accepts a beat in this cycle.
    pub m_axis_tready: Signal<In, Bit>,
    /// The beat is the last of its frame, as the sender says; valid with `m_axis_tvalid`.
    pub m_axis_tlast: Signal<Out, Bit>,
    /// Label of the frame: its identifier, and above it whether it is spoiled; valid with `complete`.
    pub label: Wire<Out>,
    /// The last taxel of a frame is accepted in this cycle.
    pub complete: Signal<Out, Bit>,
    /// A code is clipped in this cycle.
    pub clipped: Signal<Out, Bit>,
    /// An incomplete beat is accepted in this cycle.
    pub partial: Signal<Out, Bit>,
    /// A `tlast` too early, or none where it should be, is accepted in this cycle.
    pub misframed: Signal<Out, Bit>,
    kernel: Body,
}

kernel_block!(
    StreamIn,
    clock clk,
    inputs [rst, s_axis_tdata, s_axis_tkeep, s_axis_tid, s_axis_tvalid, s_axis_tlast, room, m_axis_tready],
    outputs [s_axis_tready, m_axis_tdata, m_axis_tvalid, m_axis_tlast, label, complete, clipped, partial, misframed]
);

impl StreamIn {
    /// For frames of `taxels` codes of `code_bits` bits, 2 to 32.
    pub fn new(taxels: usize, code_bits: usize) -> Self {
        let block = StreamIn {
            clk: Default::default(),
            rst: Default::default(),
            s_axis_tdata: Wire::new(8 * WORD_BYTES),
            s_axis_tkeep: Wire::new(WORD_BYTES),
            s_axis_tid: Wire::new(ID_BITS),
            s_axis_tvalid: Default::default(),
            s_axis_tready: Default::default(),
            s_axis_tlast: Default::default(),
            room: Default::default(),
            m_axis_tdata: Wire::new(code_bits),
            m_axis_tvalid: Default::default(),
            m_axis_tready: Default::default(),
            m_axis_tlast: Default::default(),
            label: Wire::new(ID_BITS + 1),
            complete: Default::default(),
            clipped: Default::default(),
            partial: Default::default(),
            misframed: Default::default(),
            kernel: Body::default(),
        };
        block.bind(kernel(taxels, code_bits))
    }
}

fn kernel(taxels: usize, code_bits: usize) -> Kernel {
    let k = Builder::new("stream_in");
    let (rst, data, keep) =
        (k.input("rst", 1), k.input("s_axis_tdata", 8 * WORD_BYTES), k.input("s_axis_tkeep", WORD_BYTES));
    let (id, given, last) = (k.input("s_axis_tid", ID_BITS), k.input("s_axis_tvalid", 1), k.input("s_axis_tlast", 1));
    let (room, ready) = (k.input("room", 1), k.input("m_axis_tready", 1));
    let bit = Type::unsigned(1);
    let count = k.state("count", Type::unsigned(count_bits(taxels)), rst, 0);
    let spoiled = k.state("spoiled", bit, rst, 0);
    let frame = k.register("frame", Type::unsigned(ID_BITS));
    let code = k.register("m_axis_tdata", Type::unsigned(code_bits));
    let valid = k.state("m_axis_tvalid", bit, rst, 0);
    let tlast = k.register("m_axis_tlast", bit);

    let moves = k.wire("moves", !*valid | ready);
    let takes = k.wire("s_axis_tready", moves & room);
    let taken = k.wire("taken", given & takes);
    let begins = k.wire("begins", count.is(0));
    let ends = k.wire("ends", count.is(taxels as u64 - 1));
    // A code fits if all bits above its sign are copies of it.
    let above = data.slice(code_bits - 1, 8 * WORD_BYTES + 1 - code_bits);
    let fits = k.wire("fits", above.all() | !above.any());
    let limit = concat(&[data.top(), (!data.top()).repeat(code_bits - 1)]);
    let clipped = k.wire("clipped", taken & !fits);
    let partial = k.wire("partial", taken & !keep.all());
    k.wire("misframed", taken & last.differs(ends));
    k.wire("complete", taken & ends);
    let now_spoiled = k.wire("now_spoiled", clipped | partial | (*spoiled & !begins));
    k.wire("label", now_spoiled.concat(begins.mux(id, *frame)));
    k.when(moves, || {
        code.set(fits.mux(data.low(code_bits), limit));
        tlast.set(last);
        valid.set(given & room);
    });
    k.when(taken, || {
        count.set((last | ends).mux(k.constant(count_bits(taxels), 0), count.plus(1)));
        spoiled.set(now_spoiled);
    });
    k.when(taken & begins, || frame.set(id));
    k.finish()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::testbench::{check, Reference};
    use crate::wire::Word;

    const TAXELS: usize = 5;
    const CODE_BITS: usize = 12;

    /// Taxels since the frame began, its identifier, whether it is spoiled; the beat in the register.
    #[derive(Default)]
    struct Frames {
        count: usize,
        id: u64,
        spoiled: bool,
        beat: Option<(u64, u64)>,
        reset: bool,
    }

    struct Event {
        taken: bool,
        clipped: bool,
        partial: bool,
        misframed: bool,
        complete: bool,
        id: u64,
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
            Event {
                taken,
                clipped,
                partial,
                misframed: taken && (last == 1) != end,
                complete: taken && end,
                id: if self.count == 0 { id } else { self.id },
                spoiled: clipped || partial || (self.spoiled && self.count > 0),
                code: code as u64 & ((1 << CODE_BITS) - 1),
            }
        }
    }

    impl Reference for Frames {
        fn outputs(&mut self, inputs: &[Word]) -> Vec<Option<Word>> {
            let event = self.event(inputs);
            let bit = |bit: bool| self.reset.then(|| Word::from(bit));
            let ready = inputs[6].number() == 1 && (self.beat.is_none() || inputs[7].number() == 1);
            let label = Word::from(u64::from(event.spoiled) << ID_BITS | event.id);
            vec![
                self.beat.map(|(code, _)| Word::from(code)),
                bit(self.beat.is_some()),
                self.beat.map(|(_, last)| Word::from(last)),
                bit(ready),
                bit(event.clipped),
                bit(event.partial),
                bit(event.misframed),
                bit(event.complete),
                (self.reset && event.complete).then_some(label),
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
                self.beat = Some((event.code, last));
                (self.id, self.spoiled) = (event.id, event.spoiled);
                self.count = if last == 1 || event.complete { 0 } else { self.count + 1 };
            } else if inputs[7].number() == 1 {
                self.beat = None;
            }
        }
    }

    #[test]
    fn codes_are_clipped_and_frames_counted_as_in_the_engine() {
        let mut random = fastrand::Rng::with_seed(21);
        let mut taxel = 0;
        let stimulus = (0..20_000).map(|cycle| {
            // Mostly right frames of small codes.
            let last = if random.u8(..40) == 0 { random.bool() } else { taxel == TAXELS - 1 };
            taxel = if last { 0 } else { (taxel + 1) % TAXELS };
            let word = if random.u8(..8) == 0 { random.u32(..) } else { random.i32(-2048..2048) as u32 };
            vec![
                Word::from(cycle < 2 || random.u16(..500) == 0),
                Word::from(u64::from(word)),
                Word::from(if random.u8(..30) == 0 { random.u64(..16) } else { 15 }),
                Word::from(random.u64(..1 << ID_BITS)),
                Word::from(random.u8(..8) > 0),
                Word::from(last),
                Word::from(random.u8(..8) > 0),
                Word::from(random.bool()),
            ]
        });
        let stimulus: Vec<_> = stimulus.collect();
        check(StreamIn::new(TAXELS, CODE_BITS).kernel.kernel(), &stimulus, &mut Frames::default());
    }
}
