//! Images of tables between the codes of scans.

use crate::block;
use crate::language::{Block, Builder, Inside, Type};
use crate::primitives::Stream;

block! {
    /// The engine takes an image between frames only, and a scan takes much longer than a frame does otherwise: an
    /// image does not wait for the end of a scan. It breaks the scan off: the frame ends early, at which the engine
    /// drops it, and the rest of the scan's codes are taken and dropped, as those of scans that begin while the image
    /// comes. The sequencer goes on.
    pub struct ScanTables {
        code_bits: usize,
    }
    ports ScanTablesPorts {
        clock;
        reset;
        /// A taxel's code, two's complement; valid with `code_valid`.
        in code: code_bits;
        /// A code is offered; it is held until `code_ready`.
        in code_valid;
        /// The code is taken in this cycle.
        out code_ready;
        /// The code is the last of its scan; valid with `code_valid`.
        in code_last;
        /// A byte of an image, as a beat of the engine's stream; valid with `s_axis_tvalid`.
        sink<Stream> s_axis: code_bits + 1;
        /// A code, sign-extended, or a byte; valid with `m_axis_tvalid`.
        source<Stream> m_axis: code_bits + 1;
        /// The engine takes a code in this cycle.
        out passed;
        /// It is the last of a whole scan; with `passed`.
        out complete;
        /// The engine takes the early end of a frame in this cycle.
        out broken;
    }
}

impl ScanTables {
    /// For codes of `code_bits`.
    pub fn new(code_bits: usize) -> Self {
        ScanTables { code_bits }
    }
}

impl Block for ScanTables {
    fn build<'k>(&self, k: &'k Builder, io: ScanTablesPorts<Inside<'k>>) {
        let flag = |name, about| k.state(name, Type::unsigned(1), io.rst, 0).comment(about);
        let image = flag("image", "Between the first and the last byte of an image.");
        let offered = flag("offered", "A code is offered to the engine, which has not taken it yet.");
        let begun = flag("begun", "Codes of this scan have been taken.");
        let dropped = flag("dropped", "This scan is not passed on, or no further.");
        let open = flag("open", "The engine has got codes of a frame, and not its last beat.");

        let in_image = k.wire("in_image", *image | (io.s_axis.valid & !*offered));
        let passes = k.wire("passes", io.code_valid & !in_image & !*dropped);
        k.comment("The early end of a frame goes before the image.");
        let ends_early = k.wire("ends_early", in_image & *open);
        let byte_passes = k.wire("byte_passes", in_image & !*open & io.s_axis.valid);
        io.m_axis.valid.set(passes | ends_early | byte_passes);
        let of_code = io.code.signed().extend(self.code_bits + 1).unsigned();
        io.m_axis.data.set(byte_passes.mux(io.s_axis.data, of_code));
        io.m_axis.last.set(ends_early | byte_passes.mux(io.s_axis.last, io.code_last));
        let byte_ready = io.s_axis.ready.set(byte_passes & io.m_axis.ready);
        let code_taken = io.code_ready.set(io.m_axis.ready | !passes);
        let passed = io.passed.set(passes & io.m_axis.ready);
        let complete = io.complete.set(passed & io.code_last);
        let broken = io.broken.set(ends_early & io.m_axis.ready);

        image.set(byte_ready.mux(!io.s_axis.last, *image));
        offered.set(passes & !io.m_axis.ready);
        let taken = k.wire("taken", io.code_valid & code_taken);
        begun.set(taken.mux(!io.code_last, *begun));
        let breaks = k.wire("breaks", in_image & (*begun | io.code_valid));
        dropped.set((*dropped | breaks) & !(taken & io.code_last));
        open.set((*open | passed) & !(complete | broken));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::testbench::{check_with_defects, subject_of, Reference};
    use crate::language::Change;
    use crate::wire::Word;

    const CODE_BITS: usize = 6;

    /// What the two streams and the engine have seen, beat by beat.
    #[derive(Default)]
    struct Streams {
        /// A byte of an image has been taken, not its last.
        image: bool,
        /// The code on offer was on offer in the cycle before.
        offered: bool,
        /// Codes of the scan so far, and whether the engine gets it.
        begun: bool,
        dropped: bool,
        /// Codes of the frame that the engine has so far.
        frame: usize,
        reset: bool,
    }

    /// What is offered to the engine.
    #[derive(Clone, Copy, PartialEq)]
    enum Offer {
        Nothing,
        Code,
        EarlyEnd,
        Byte,
    }

    impl Streams {
        fn offer(&self, inputs: &[Word]) -> Offer {
            let [code, byte] = [2, 5].map(|k| inputs[k].number() == 1);
            match (self.image || (byte && !self.offered), self.frame > 0) {
                (true, true) => Offer::EarlyEnd,
                (true, false) if byte => Offer::Byte,
                (false, _) if code && !self.dropped => Offer::Code,
                _ => Offer::Nothing,
            }
        }
    }

    impl Reference for Streams {
        fn outputs(&mut self, inputs: &[Word]) -> Vec<Option<Word>> {
            if !self.reset {
                return vec![None; 8];
            }
            let is = |k: usize| inputs[k].number() == 1;
            let (offer, ready) = (self.offer(inputs), is(7));
            let bit = |bit: bool| Some(Word::from(bit));
            let code = inputs[1].signed(0, CODE_BITS);
            let (data, last) = match offer {
                Offer::Nothing => (None, None),
                Offer::Code => (Some(Word::of_fields(&[code], CODE_BITS + 1)), bit(is(3))),
                Offer::EarlyEnd => (None, bit(true)),
                Offer::Byte => (Some(inputs[4]), bit(is(6))),
            };
            vec![
                bit(offer != Offer::Code || ready),
                bit(offer == Offer::Byte && ready),
                data,
                bit(offer != Offer::Nothing),
                last,
                bit(offer == Offer::Code && ready),
                bit(offer == Offer::Code && ready && is(3)),
                bit(offer == Offer::EarlyEnd && ready),
            ]
        }

        fn clock(&mut self, inputs: &[Word]) {
            let is = |k: usize| inputs[k].number() == 1;
            let (offer, ready) = (self.offer(inputs), is(7));
            let in_image = self.image || (is(5) && !self.offered);
            self.dropped |= in_image && (self.begun || is(2));
            self.offered = offer == Offer::Code && !ready;
            if is(2) && !self.offered {
                self.begun = !is(3);
                self.dropped &= !is(3);
            }
            match offer {
                Offer::Code if ready => self.frame = if is(3) { 0 } else { self.frame + 1 },
                Offer::EarlyEnd if ready => self.frame = 0,
                Offer::Byte if ready => self.image = !is(6),
                _ => {}
            }
            if is(0) {
                *self = Streams { reset: true, ..Streams::default() };
            }
        }
    }

    /// Scans of random length with images of random length in between, which hold what they offer until it is taken.
    fn stimulus(cycles: usize) -> Vec<Vec<Word>> {
        let mut random = fastrand::Rng::with_seed(5);
        let mut plan = Streams::default();
        let [mut code, mut byte]: [Option<(u64, bool)>; 2] = [None, None];
        let mut bytes_left = 0;
        let of = |cycle: usize| {
            if code.is_none() && random.u8(..3) == 0 {
                code = Some((random.u64(..1 << CODE_BITS), random.u8(..12) == 0));
            }
            if bytes_left == 0 && random.u8(..40) == 0 {
                bytes_left = random.usize(1..15);
            }
            if byte.is_none() && bytes_left > 0 && random.u8(..2) == 0 {
                byte = Some((random.u64(..2 << CODE_BITS), bytes_left == 1));
            }
            let ready = random.u8(..3) > 0;
            let words = [
                u64::from(cycle < 2),
                code.map_or(0, |of| of.0),
                code.is_some().into(),
                code.is_some_and(|of| of.1).into(),
                byte.map_or(0, |of| of.0),
                byte.is_some().into(),
                byte.is_some_and(|of| of.1).into(),
                ready.into(),
            ];
            let words: Vec<Word> = words.into_iter().map(Word::from).collect();
            if cycle >= 2 {
                let offer = plan.offer(&words);
                if offer == Offer::Byte && ready {
                    (byte, bytes_left) = (None, bytes_left - 1);
                }
                if offer != Offer::Code || ready {
                    code = None;
                }
            }
            plan.clock(&words);
            words
        };
        (0..cycles).map(of).collect()
    }

    #[test]
    fn an_image_breaks_a_scan_off_and_the_next_whole_one_passes() {
        let subject = |changes: &[Change]| {
            subject_of!(
                ScanTables::new(CODE_BITS),
                changes,
                inputs [rst, code, code_valid, code_last, s_axis_tdata, s_axis_tvalid, s_axis_tlast, m_axis_tready],
                outputs [code_ready, s_axis_tready, m_axis_tdata, m_axis_tvalid, m_axis_tlast, passed, complete, broken],
            )
        };
        let defects = [
            // An image between the codes of a frame.
            Change::value("", "ends_early", |k| k.constant(1, 0)),
            // A code that is withdrawn.
            Change::value("", "offered", |k| k.constant(1, 0)),
            // The rest of a scan as a frame.
            Change::value("", "breaks", |k| k.constant(1, 0)),
        ];
        check_with_defects(subject, &stimulus(6000), Streams::default, &defects);
    }
}
