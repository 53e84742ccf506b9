//! Frame ingress: from the payload bytes of a frame's packet to the engine's input stream, while they arrive.

use dermis_golden::wire::link::code_bytes;

use super::PacketParams;
use crate::block;
use crate::language::{Block, Builder, Expr, Inside, Type};
use crate::primitives::{count_bits, table_beat};

block! {
    /// Codes go to the engine as they arrive, except the last two, which are held until the packet has been checked. A
    /// good packet releases them, with `tlast` on the last. A bad one ends with an early `tlast`, at which the engine
    /// drops the frame. Two codes must be held: after all codes but one, any beat would complete the frame. A code that
    /// is already offered when its packet turns out bad stays until it is accepted, as AXI-Stream requires; the early
    /// `tlast` follows it.
    ///
    /// The bytes of an image of tables are beats like codes ([`Load`](crate::primitives::Load)), and wait for their
    /// packet's end as well: an image that is not whole ends early.
    ///
    /// The engine accepts no code while its buffer is full, and no byte of an image while it solves a frame. What loses
    /// a code or byte because of that, or starts while the frame or image before is still held, is dropped too, and
    /// counts as an `overrun` if its packet is good.
    pub struct FrameIngress {
        /// Codes of a frame.
        taxels: usize,
        /// Width of a code.
        bits: usize,
        /// Bytes of an image of tables; none where they are in the bitstream.
        image_bytes: Option<usize>,
    }
    ports FrameIngressPorts {
        clock;
        reset;
        /// The header of a packet with a frame or an image is complete; high for one cycle.
        in frame_begin;
        /// The packet holds an image; valid with `frame_begin`.
        in image;
        /// `content` is a byte of the payload.
        in payload;
        /// A byte of the packet, 8 bits; valid with `payload`.
        in content: 8;
        /// The frame's packet is complete and correct; high for one cycle.
        in good;
        /// The packet is damaged; high for one cycle.
        in bad;
        /// The engine gets the whole frame; with `good`.
        out taken;
        /// The frame is dropped although its packet is good; with `good`.
        out overrun;
        /// A taxel's code, two's complement, or a byte of an image, `stream_bits` wide; valid with `valid`.
        out code: bits + usize::from(image_bytes.is_some());
        /// `code` is offered to the engine; held until `ready`.
        out valid;
        /// The beat has `tlast`; valid with `valid`.
        out last;
        /// The engine accepts the beat in this cycle.
        in ready;
    }
}

/// Codes that are held until the end of the packet.
const HELD: usize = 2;

impl FrameIngress {
    /// For the frames and images of `params`.
    pub fn new(params: &PacketParams) -> Self {
        FrameIngress { taxels: params.codes(), bits: params.input_bits as usize, image_bytes: params.image_bytes }
    }
}

/// The code of the bytes before `content`, which is its last, most significant byte.
fn assemble<'k>(k: &'k Builder, content: Expr<'k>, enable: Expr<'k>, bits: usize, bytes: usize) -> Expr<'k> {
    if bytes == 1 {
        return content.low(bits);
    }
    let before = 8 * (bytes - 1);
    let raw = k.register("raw", Type::unsigned(before));
    let shifted = if before == 8 { content } else { content.concat(raw.slice(8, before - 8)) };
    k.when(enable, || raw.set(shifted));
    content.low(bits - before).concat(*raw)
}

impl Block for FrameIngress {
    fn build<'k>(&self, k: &'k Builder, io: FrameIngressPorts<Inside<'k>>) {
        let FrameIngress { taxels, bits, image_bytes } = *self;
        let bytes = code_bytes(bits as u32);
        let (bit, one, zero) = (Type::unsigned(1), k.constant(1, 1), k.constant(1, 0));
        let (b, d) = (count_bits(bytes), count_bits(taxels.max(image_bytes.unwrap_or_default())));
        let beat_bits = io.code.bits();
        // Codes that leave before the end of the packet.
        let early_codes = taxels.saturating_sub(HELD);
        let byte_index = k.state("byte_index", Type::unsigned(b), io.rst, 0);
        let (code, second) = (io.code.register(), k.register("second", Type::unsigned(beat_bits)));
        let fill = k.state("fill", Type::unsigned(2), io.rst, 0);
        let delivered = k.state("delivered", Type::unsigned(d), io.rst, 0);
        let flag = |name| k.state(name, bit, io.rst, 0);
        let (within_frame, deaf, lost) = (flag("within_frame"), flag("deaf"), flag("lost"));
        let (released, aborting) = (flag("released"), flag("aborting"));
        let some_ahead = u64::from(early_codes > 0);
        let ahead = k.state("ahead", bit, io.rst, some_ahead);
        let ahead = ahead.comment("Codes that may leave before the end of the packet are left.");

        let refused = k.wire("refused", *deaf | *lost);
        let empty = fill.is(0);
        let in_image = image_bytes.map(|bytes| (bytes, flag("in_image")));
        // Of the packet's beats all but `left` are delivered.
        let all_but = |left: usize| {
            let frame = delivered.is(taxels.saturating_sub(left) as u64);
            let of_image = |bytes: usize| delivered.is((bytes - left) as u64);
            in_image.as_ref().map_or(frame, |(bytes, within)| within.mux(of_image(*bytes), frame))
        };
        let at_last = k.wire("at_last", all_but(1));
        let early = k.wire("early", *aborting & empty);
        let accepted = io.good & *within_frame;
        let taken = io.taken.set(accepted & !refused);
        io.overrun.set(accepted & refused);
        let valid = io.valid.set(*aborting | (!empty & (*released | *ahead)));
        io.last.set(early | at_last);
        let moves = k.wire("moves", valid & io.ready & !early);
        let aborts = k.wire("aborts", early & io.ready);
        let waits = k.wire("waits", valid & !io.ready);
        let hears = k.wire("hears", io.payload & !*deaf);
        let arrived = assemble(k, io.content, hears, bits, bytes);
        let ends_code = byte_index.is(bytes as u64 - 1);
        let (arrived, ends_code) = match &in_image {
            None => (arrived, ends_code),
            Some((_, within)) => {
                let code = arrived.signed().extend(beat_bits).unsigned();
                (within.mux(table_beat(k, io.content, bits), code), **within | ends_code)
            }
        };
        let arrived = k.wire("arrived", arrived);
        let complete = k.wire("complete", hears & ends_code);
        let left = k.wire("left", (*fill - moves).low(2));
        let full = left.is(HELD as u64);
        let push = k.wire("push", complete & !full);
        let drop = k.wire("drop", *within_frame & !*deaf & (io.bad | (io.good & *lost)));

        k.when(hears, || byte_index.set(complete.mux(k.constant(b, 0), byte_index.plus(1))));
        k.when(moves, || code.set(*second));
        k.when(push & left.is(0), || code.set(arrived));
        k.when(push & left.any(), || second.set(arrived));
        fill.set(drop.mux(waits.extend(2), push.mux(left.plus(1), left)));
        k.when(moves, || {
            delivered.set(at_last.mux(k.constant(d, 0), delivered.plus(1)));
            ahead.set(at_last.mux(k.constant(1, some_ahead), *ahead & !all_but(HELD + 1)));
            k.when(at_last, || released.set(zero));
        });
        k.when(aborts, || {
            delivered.set(k.constant(d, 0));
            ahead.set(k.constant(1, some_ahead));
            aborting.set(zero);
        });
        k.when(taken, || released.set(one));
        k.when(drop, || aborting.set(waits | moves.mux(!at_last, delivered.any())));
        k.when(complete & full, || lost.set(one));
        k.when(io.good | io.bad, || within_frame.set(zero));
        k.when(io.frame_begin, || {
            within_frame.set(one);
            deaf.set(!empty | *aborting);
            lost.set(zero);
            byte_index.set(k.constant(b, 0));
        });
        if let Some((_, within)) = &in_image {
            let heard = k.wire("heard", io.frame_begin & empty & !*aborting);
            k.when(heard, || {
                within.set(io.image);
                ahead.set(io.image | k.constant(1, some_ahead));
            });
            k.comment("What is held at an early end is a byte too.");
            let no_byte = table_beat(k, k.constant(8, 0), bits);
            k.when(heard & io.image, || [code, second].iter().for_each(|held| held.set(no_byte)));
        }
    }
}

#[cfg(test)]
mod tests {
    use dermis_golden::fixed::stages::load;

    use super::*;
    use crate::language::kernel_of;
    use crate::language::testbench::{check, Reference};
    use crate::wire::Word;

    /// The codes of the frame in lists, as the block's documentation says.
    #[derive(Clone, Default)]
    struct Frames {
        taxels: usize,
        bits: usize,
        image_bytes: Option<usize>,
        in_image: bool,
        code: Vec<u8>,
        held: Vec<u64>,
        /// What is in the places of the held ones.
        registers: [u64; HELD],
        delivered: usize,
        within_frame: bool,
        deaf: bool,
        lost: bool,
        released: bool,
        aborting: bool,
        reset: bool,
    }

    impl Frames {
        fn new(taxels: usize, bits: usize, image_bytes: Option<usize>) -> Self {
            Frames { taxels, bits, image_bytes, ..Frames::default() }
        }

        /// Beats of the frame or image.
        fn beats(&self) -> usize {
            self.image_bytes.filter(|_| self.in_image).unwrap_or(self.taxels)
        }

        /// Bytes of a beat.
        fn bytes(&self) -> usize {
            if self.in_image {
                1
            } else {
                code_bytes(self.bits as u32)
            }
        }

        fn offers(&self) -> bool {
            let ahead = self.delivered < self.beats().saturating_sub(HELD);
            self.aborting || (!self.held.is_empty() && (self.released || ahead))
        }

        fn ends_early(&self) -> bool {
            self.aborting && self.held.is_empty()
        }

        fn code_of(&self) -> u64 {
            let beat = match self.in_image {
                true => load::beats(&self.code, self.bits as u32)[0],
                false => {
                    let number = self.code.iter().rev().fold(0, |number, &byte| number << 8 | i32::from(byte));
                    number << (32 - self.bits) >> (32 - self.bits)
                }
            };
            beat as u32 as u64 & ((1 << (self.bits + usize::from(self.image_bytes.is_some()))) - 1)
        }
    }

    impl Reference for Frames {
        fn outputs(&mut self, inputs: &[Word]) -> Vec<Option<Word>> {
            if !self.reset {
                return vec![None; 5];
            }
            let accepted = inputs[5].number() == 1 && self.within_frame;
            let refused = self.deaf || self.lost;
            // At its early end an image has one more byte.
            let end = Some(&self.registers[0]).filter(|_| self.ends_early() && self.in_image);
            let code = self.held.first().filter(|_| self.offers()).or(end).map(|&code| Word::from(code));
            let last = self.ends_early() || self.delivered + 1 == self.beats();
            let bits =
                [accepted && !refused, accepted && refused, self.offers(), last].map(|bit| Some(Word::from(bit)));
            [code].into_iter().chain(bits).collect()
        }

        fn clock(&mut self, inputs: &[Word]) {
            let [rst, begin, image, payload, _, good, bad, ready] =
                [0, 1, 2, 3, 4, 5, 6, 7].map(|k| inputs[k].number() == 1);
            let before = self.clone();
            let waits = self.offers() && !ready;
            if self.offers() && ready {
                if self.ends_early() {
                    (self.aborting, self.delivered) = (false, 0);
                } else {
                    self.held.remove(0);
                    self.registers[0] = self.registers[1];
                    self.delivered = (self.delivered + 1) % self.beats();
                    self.released &= self.delivered != 0;
                }
            }
            if payload && !before.deaf {
                self.code.push(inputs[4].number() as u8);
                if self.code.len() == self.bytes() {
                    match self.held.len() {
                        HELD => self.lost = true,
                        place => {
                            self.registers[place] = self.code_of();
                            self.held.push(self.registers[place]);
                        }
                    }
                    self.code.clear();
                }
            }
            if before.within_frame && !before.deaf {
                if bad || (good && before.lost) {
                    self.held.truncate(usize::from(waits));
                    self.aborting = waits || self.delivered > 0;
                } else if good {
                    self.released = true;
                }
            }
            self.within_frame &= !(good || bad);
            if begin {
                (self.within_frame, self.deaf, self.lost) = (true, !before.held.is_empty() || before.aborting, false);
                self.code.clear();
                if !self.deaf {
                    self.in_image = image && self.image_bytes.is_some();
                }
                if !self.deaf && self.in_image {
                    self.registers = [load::beats(&[0], self.bits as u32)[0] as u64; HELD];
                }
            }
            if rst {
                *self = Frames { reset: true, ..Frames::new(self.taxels, self.bits, self.image_bytes) };
            }
        }
    }

    /// Packets of a frame's bytes, of which some are too short or bad, against a receiver that stalls; resets.
    fn stimulus(cycles: usize, frames: &Frames) -> Vec<Vec<Word>> {
        let mut random = fastrand::Rng::with_seed(14);
        let (mut left, mut pause, mut speed) = (None, 3, [4, 4]);
        let inputs = |cycle: usize| {
            if cycle.is_multiple_of(200) {
                speed = [(); 2].map(|()| random.u8(1..9));
            }
            let rst = cycle < 2 || random.u16(..900) == 0;
            let acts = !rst && random.u8(..8) < speed[0];
            let [mut begin, mut payload, mut good, mut bad] = [false; 4];
            let image = frames.image_bytes.is_some() && random.u8(..3) == 0;
            match left {
                _ if !acts => {}
                None if pause > 0 => pause -= 1,
                None => {
                    let of_frame = frames.taxels * code_bytes(frames.bits as u32);
                    (begin, left) = (true, frames.image_bytes.filter(|_| image).or(Some(of_frame)));
                }
                Some(bytes) if bytes > 0 && random.u8(..40) > 0 => {
                    (payload, left) = (true, Some(bytes - 1));
                }
                Some(bytes) => {
                    good = bytes == 0 && random.u8(..4) > 0;
                    (bad, left, pause) = (!good, None, random.u8(1..12));
                }
            }
            if rst {
                left = None;
            }
            let bits = |bits: [bool; 3]| bits.map(Word::from);
            let ready = random.u8(..8) < speed[1];
            let content = Word::from(u64::from(random.u8(..)));
            [&bits([rst, begin, image])[..], &[payload.into(), content], &bits([good, bad, ready])[..]].concat()
        };
        (0..cycles).map(inputs).collect()
    }

    #[test]
    fn good_packets_and_no_others_become_whole_frames() {
        for (taxels, bits, image) in
            [(5, 12, None), (2, 8, None), (7, 8, None), (4, 20, None), (2, 12, Some(20)), (7, 16, Some(9))]
        {
            let mut frames = Frames::new(taxels, bits, image);
            let block = FrameIngress { taxels, bits, image_bytes: image };
            check(&kernel_of(&block), &stimulus(8000, &frames), &mut frames);
        }
    }
}
