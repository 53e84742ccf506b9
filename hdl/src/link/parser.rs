//! From the bytes of packets to requests: checks header, length and CRC.

use dermis_golden::wire::link::{code_bytes, Header, Kind, OVERHEAD};

use super::PacketParams;
use crate::block;
use crate::language::{Block, Builder, Expr, Inside, Net, Type};
use crate::primitives::count_bits;

block! {
    /// Checks each packet at its end: `good` or `bad` is high for one cycle, one cycle after `packet_end`; `kind` and
    /// `number` are valid until the header of the next packet. Two ENDs in a row enclose no packet.
    ///
    /// The payload of a frame, or of an image of tables, is passed on while it arrives: `frame_begin` when its header
    /// is complete and correct, then `payload` with each byte, in the same cycle.
    pub struct Parser {
        /// Bytes of the payload of a frame.
        frame_bytes: usize,
        /// Types of the packets with a frame.
        frame_kinds: Vec<u8>,
        /// Bytes of an image of tables; none where they are in the bitstream.
        image_bytes: Option<usize>,
    }
    ports ParserPorts {
        clock;
        reset;
        /// A byte of a packet; valid with `content_valid`.
        in content: 8;
        /// `content` holds a byte.
        in content_valid;
        /// END was received: the packet is complete.
        in packet_end;
        /// A byte of the packet was lost.
        in spoiled;
        /// The packet's bytes so far end with their correct CRC.
        in crc_right;
        /// The header of a frame or image with the right length is complete.
        out frame_begin;
        /// The packet is an image of tables; valid with `frame_begin`.
        out image;
        /// `content` is a byte of the payload of a frame or image.
        out payload;
        /// The packet is correct.
        out good;
        /// The packet is dropped.
        out bad;
        /// Cause, one bit each: framing, CRC, unknown type, length; valid with `bad`.
        out fault: 4;
        /// The packet's type; valid with `good`.
        out kind: 8;
        /// The packet's sequence number; valid with `good`.
        out number: 8;
    }
}

const PLAIN_KINDS: [u8; 2] = [Kind::Identify as u8, Kind::ReadCounters as u8];
/// Bits of `fault`.
const FRAMING: u64 = 1;
const CRC: u64 = 2;
const UNKNOWN: u64 = 4;
const LENGTH: u64 = 8;

impl Parser {
    /// For the frames and images of `params`, whose payloads have at most 65535 bytes.
    pub fn new(params: &PacketParams) -> Self {
        Parser {
            frame_bytes: params.codes() * code_bytes(params.input_bits),
            frame_kinds: params.answers.requests().iter().map(|kind| *kind as u8).collect(),
            image_bytes: params.image_bytes,
        }
    }
}

/// The packets of some types: their payload, and a register.
struct Payload<'k> {
    /// The packet is of these types.
    is: Expr<'k>,
    /// Bytes of the payload.
    bytes: usize,
    /// The length bytes so far are right for it.
    right: Net<'k>,
}

impl<'k> Payload<'k> {
    /// A packet of `count` bytes has this length.
    fn is_right(&self, count: Expr<'k>) -> Expr<'k> {
        self.is & count.is((self.bytes + OVERHEAD) as u64) & *self.right
    }

    /// `content` is right as the second length byte.
    fn ends_header(&self, content: Expr<'k>) -> Expr<'k> {
        *self.right & content.is((self.bytes >> 8) as u64)
    }

    /// The byte of index `count` is the payload's last.
    fn ends(&self, count: Expr<'k>) -> Expr<'k> {
        self.is & count.is((self.bytes + Header::BYTES - 1) as u64)
    }

    /// Takes the first length byte, or the `second`.
    fn take(&self, content: Expr<'k>, second: Expr<'k>) {
        self.right.set(second.mux(self.ends_header(content), content.is((self.bytes & 0xff) as u64)));
    }
}

/// Whether one of these holds; `none` without any.
fn any<'k>(none: Expr<'k>, conditions: impl Iterator<Item = Expr<'k>>) -> Expr<'k> {
    conditions.reduce(|a, b| a | b).unwrap_or(none)
}

impl Block for Parser {
    fn build<'k>(&self, k: &'k Builder, io: ParserPorts<Inside<'k>>) {
        // The count stops at one more byte than the longest packet has.
        let most = self.frame_bytes.max(self.image_bytes.unwrap_or_default()) + OVERHEAD + 1;
        let (bit, c) = (Type::unsigned(1), count_bits(most + 1));
        let clears = k.wire("clears", io.rst | io.packet_end);
        let count = k.state("count", Type::unsigned(c), clears, 0);
        let [lost, streaming] = ["lost", "streaming"].map(|name| k.state(name, bit, clears, 0));
        let good = io.good.state(io.rst, 0);
        let fault = io.fault.state(io.rst, 0);
        let (kind, number) = (io.kind.register(), io.number.register());

        let at = |index: usize| count.is(index as u64);
        let never = k.constant(1, 0);
        let payload = |name: &str, kinds: &[u8], bytes: usize| {
            let is = any(never, kinds.iter().map(|&payload_kind| kind.is(payload_kind.into())));
            let right = k.register(&format!("{name}_length"), bit);
            Payload {
                is: k.wire(name, is),
                bytes,
                right: right.comment("The length bytes so far are right for such a packet."),
            }
        };
        let of_image = self.image_bytes.map(|bytes| payload("tables", &[Kind::Tables as u8], bytes));
        io.image.set(of_image.as_ref().map_or(never, |payload_kind| payload_kind.is));
        let payloads = [payload("frame", &self.frame_kinds, self.frame_bytes), payload("plain", &PLAIN_KINDS, 0)];
        let payloads: Vec<Payload<'_>> = payloads.into_iter().chain(of_image).collect();
        let too_short = count.less(k.constant(c, OVERHEAD as u64));
        let wrong_crc = k.wire("wrong_crc", too_short | !io.crc_right);
        let all = || payloads.iter();
        // Those of which the bytes are passed on.
        let passed = || all().filter(|payload_kind| payload_kind.bytes > 0);
        let right_length = any(never, all().map(|payload_kind| payload_kind.is_right(*count)));
        let wrong_length = k.wire("wrong_length", !right_length);
        let empty = k.wire("empty", at(0) & !*lost);
        let known = any(never, all().map(|payload_kind| payload_kind.is));
        let cause = |cause: u64| k.constant(4, cause);
        let later = (!known).mux(cause(UNKNOWN), wrong_length.mux(cause(LENGTH), cause(0)));
        let found = lost.mux(cause(FRAMING), wrong_crc.mux(cause(CRC), later));
        fault.set((io.packet_end & !empty).mux(found, cause(0)));
        good.set(io.packet_end & !empty & !*lost & !wrong_crc & !wrong_length);
        io.bad.set(fault.any());

        let begins = any(never, passed().map(|payload_kind| payload_kind.is & payload_kind.ends_header(io.content)));
        let ends = any(never, passed().map(|payload_kind| payload_kind.ends(*count)));
        let frame_begin = io.frame_begin.set(io.content_valid & at(Header::BYTES - 1) & begins);
        io.payload.set(io.content_valid & *streaming);
        k.when(io.spoiled, || lost.set(k.constant(1, 1)));
        k.when(io.content_valid & !at(most), || count.set(count.plus(1)));
        k.when(io.content_valid & ends, || streaming.set(never));
        k.when(frame_begin, || streaming.set(k.constant(1, 1)));
        let takes = k.wire("takes", io.content_valid & !clears);
        k.when(takes & at(0), || kind.set(io.content));
        k.when(takes & at(1), || number.set(io.content));
        k.when(takes & (at(2) | at(3)), || all().for_each(|payload_kind| payload_kind.take(io.content, count.at(0))));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::kernel_of;
    use crate::language::testbench::{check, Reference, Subject};
    use crate::wire::Word;

    /// Collects a packet and checks it as a whole.
    #[derive(Default)]
    struct Packet {
        frame_bytes: usize,
        image_bytes: Option<usize>,
        bytes: Vec<u8>,
        lost: bool,
        /// Type and number of the packet last begun.
        header: [Option<u8>; 2],
        verdict: Option<u64>,
        reset: bool,
    }

    const TABLES: u8 = Kind::Tables as u8;
    const FRAMES: [u8; 2] = [Kind::FrameForResultants as u8, Kind::FrameForForces as u8];

    impl Packet {
        fn of(frame_bytes: usize, image_bytes: Option<usize>) -> Self {
            Packet { frame_bytes, image_bytes, ..Packet::default() }
        }

        /// Bytes of the payload of a packet of this type; none if there is no such.
        fn payload_of(&self, kind: u8) -> Option<usize> {
            match kind {
                kind if FRAMES.contains(&kind) => Some(self.frame_bytes),
                kind if PLAIN_KINDS.contains(&kind) => Some(0),
                TABLES => self.image_bytes,
                _ => None,
            }
        }

        /// The payload that the byte `content`, the last of its header, begins; none if there is none.
        fn begins(&self, content: u8) -> Option<usize> {
            let &[kind, _, low] = &self.bytes[..] else { return None };
            let length = usize::from(u16::from_le_bytes([low, content]));
            self.payload_of(kind).filter(|&bytes| bytes == length && bytes > 0)
        }

        /// 0 if the packet is correct, else the bit of its fault; none without a packet.
        fn verdict_of(&self, crc_right: bool) -> Option<u64> {
            let whole = self.bytes.len();
            if self.lost {
                return Some(FRAMING);
            }
            let &[kind, _, low, high, ..] = &self.bytes[..] else { return (whole > 0).then_some(CRC) };
            if whole < OVERHEAD || !crc_right {
                return Some(CRC);
            }
            let Some(wanted) = self.payload_of(kind) else { return Some(UNKNOWN) };
            let right = whole == wanted + OVERHEAD && usize::from(u16::from_le_bytes([low, high])) == wanted;
            Some(if right { 0 } else { LENGTH })
        }
    }

    impl Reference for Packet {
        fn outputs(&mut self, inputs: &[Word]) -> Vec<Option<Word>> {
            if !self.reset {
                return vec![None; 8];
            }
            let (content, valid) = (inputs[1].number() as u8, inputs[2].number() == 1);
            let count = self.bytes.len();
            let begun = (count >= 4).then(|| Packet { bytes: self.bytes[..3].to_vec(), ..*self }.begins(self.bytes[3]));
            let payload = valid && begun.flatten().is_some_and(|bytes| count < bytes + 4);
            let header = self.header.map(|byte| byte.map(|byte| Word::from(u64::from(byte))));
            let image = self.header[0].map(|kind| Word::from(kind == TABLES && self.image_bytes.is_some()));
            // Without images it is constant.
            let image = if self.image_bytes.is_some() { image } else { Some(Word::default()) };
            let fault = self.verdict.unwrap_or(0);
            vec![
                Some(Word::from(self.verdict == Some(0))),
                Some(Word::from(fault)),
                header[0],
                header[1],
                image,
                Some(Word::from(fault != 0)),
                Some(Word::from(valid && self.begins(content).is_some())),
                Some(Word::from(payload)),
            ]
        }

        fn clock(&mut self, inputs: &[Word]) {
            let [rst, _, valid, ends, spoiled, right] = [0, 1, 2, 3, 4, 5].map(|k| inputs[k].number() == 1);
            self.verdict = None;
            if ends {
                self.verdict = self.verdict_of(right);
            } else {
                self.lost |= spoiled;
                if valid {
                    self.bytes.push(inputs[1].number() as u8);
                }
                // A header appears byte by byte.
                let from = self.bytes.len().saturating_sub(usize::from(valid));
                (from..self.bytes.len().min(2)).filter(|_| !rst).for_each(|at| self.header[at] = Some(self.bytes[at]));
            }
            if ends || rst {
                (self.bytes, self.lost) = (Vec::new(), false);
            }
            if rst {
                (self.verdict, self.reset) = (None, true);
            }
        }
    }

    /// Packets that are mostly right: of any type, length, with lost bytes, wrong CRCs, two ENDs in a row, resets.
    fn stimulus(packets: usize, of: &Packet) -> Vec<Vec<Word>> {
        let mut random = fastrand::Rng::with_seed(16);
        let cycle = |bits: [bool; 5], content: u8| {
            let [rst, valid, ends, spoiled, right] = bits.map(Word::from);
            vec![rst, Word::from(u64::from(content)), valid, ends, spoiled, right]
        };
        let mut all = vec![cycle([true, false, false, false, false], 0); 2];
        for _ in 0..packets {
            let kind = match random.u8(..8) {
                0 => random.u8(..),
                1 => TABLES,
                2..=3 => PLAIN_KINDS[random.usize(..2)],
                _ => FRAMES[random.usize(..2)],
            };
            let own = of.payload_of(kind).unwrap_or_default();
            let named = if random.u8(..8) == 0 { random.usize(..0x10000) } else { own };
            let count = own + OVERHEAD;
            let count = match random.u8(..8) {
                0 => random.usize(..count),
                1 => count + random.usize(1..9),
                _ => count,
            };
            for at in 0..count {
                let content = match at {
                    0 => kind,
                    2 => named as u8,
                    3 => (named >> 8) as u8,
                    _ => random.u8(..),
                };
                let [rst, spoiled] = [random.u16(..4000) == 0, random.u16(..400) == 0];
                all.push(cycle([rst, true, false, spoiled, random.bool()], content));
                (0..random.u8(..3)).for_each(|_| all.push(cycle([false; 5], content)));
            }
            let right = random.u8(..8) > 0;
            all.push(cycle([false, false, true, false, right], random.u8(..)));
        }
        all
    }

    #[test]
    fn packets_are_checked_as_a_whole() {
        for (frame_bytes, image_bytes) in [(6, None), (300, None), (6, Some(14)), (300, Some(270)), (0, Some(20))] {
            let mut packet = Packet::of(frame_bytes, image_bytes);
            let all = stimulus(if frame_bytes > 100 { 80 } else { 800 }, &packet);
            let kernel = kernel_of(&Parser { frame_bytes, frame_kinds: FRAMES.to_vec(), image_bytes });
            check(&kernel, &all, &mut packet);
            let faults: Vec<u64> =
                Subject::from(&kernel).simulated(&all).iter().map(|outputs| outputs[1].number()).collect();
            assert!([FRAMING, CRC, UNKNOWN, LENGTH].iter().all(|fault| faults.contains(fault)));
        }
    }
}
