//! From the words of an answer to the bytes of its packet.

use dermis_golden::wire::link::ANSWER;

use crate::language::{Block, Builder, Inside, Type};
use crate::{block, states};

block! {
    /// Sends SLIP END, header, words of twelve bytes up to the last, CRC, SLIP END.
    ///
    /// An answer starts when one is offered and none is being sent; its source and number are stored. The sources
    /// select each byte themselves, so that no word register is needed here: `index` is the byte of the word that is
    /// needed, and `taken` says that the word has been sent. An offered byte stays until it is accepted; the next one
    /// waits until the CRC has processed it.
    pub struct Packer {
        /// Bytes of the payload, by source.
        lengths: [usize; 4],
    }
    ports PackerPorts {
        clock;
        reset;
        /// An answer can start.
        in offer;
        /// Sequence number of its request; valid with `offer`.
        in number: 8;
        /// Source of its payload, 2 bits; valid with `offer`.
        in offered_source: 2;
        /// The offered answer starts in this cycle.
        out begun;
        /// Source of the answer being sent, 2 bits; valid from the cycle after `begun` until the answer's last byte.
        out source: 2;
        /// Words of the payload are needed.
        out wanted;
        /// Byte of the word, of the header or of the CRC that is next, 4 bits; that of a word while `wanted` is high.
        out index: 4;
        /// That byte of the word, from its source, 8 bits; valid with `word_valid`.
        in octet: 8;
        /// The word is valid.
        in word_valid;
        /// The word is the payload's last; valid with `word_valid`.
        in word_last;
        /// The last byte of the word is accepted in this cycle.
        out taken;
        /// The first byte of two has been sent and the second one is still to be read.
        out halfway;
        /// Resets the CRC for a new packet.
        out crc_restart;
        /// Byte for the CRC: of the packet, or its own lowest one; valid with `crc_load`.
        out crc_octet: 8;
        /// The CRC takes `crc_octet` in this cycle.
        out crc_load;
        /// Lowest byte of the CRC; valid while `crc_busy` is low.
        in crc_low: 8;
        /// The CRC is processing a byte.
        in crc_busy;
        /// A byte of the packet; valid with `valid`, unless `border`.
        out content: 8;
        /// SLIP END between packets, in place of a byte; valid with `valid`.
        out border;
        /// A byte or an END is offered; held until `ready`.
        out valid;
        /// The byte is accepted in this cycle.
        in ready;
    }
}

states! {
    /// The part of a packet that is sent: an END, the header, the words of the payload, the CRC, an END.
    enum Stage { Idle, Open, Header, Words, Sum, Close }
}

/// Index of the last byte of a word; of the header and of the CRC.
const LAST: [u64; 2] = [11, 3];

impl Packer {
    /// `lengths` are the bytes of the payload, by source.
    pub fn new(lengths: [usize; 4]) -> Self {
        Packer { lengths }
    }
}

impl Block for Packer {
    fn build<'k>(&self, k: &'k Builder, io: PackerPorts<Inside<'k>>) {
        let stage = k.machine("stage", io.rst, Stage::Idle);
        let index = io.index.state(io.rst, 0);
        let source = io.source.register();
        let (kept, content) = (k.register("kept", Type::unsigned(8)), io.content.register());
        let valid = io.valid.state(io.rst, 0);

        let idle = k.wire("idle", stage.is(Stage::Idle));
        let words = io.wanted.set(stage.is(Stage::Words));
        let border = io.border.set(stage.is(Stage::Open) | stage.is(Stage::Close));
        let [last_of_word, last] = LAST.map(|last| k.constant(4, last));
        let at_end = k.wire("at_end", index.equals(words.mux(last_of_word, last)));
        let goes = k.wire("goes", *valid & io.ready);
        let of = |at: usize| k.constant(16, self.lengths[at] as u64);
        let high = source.at(1);
        let length = k.wire("length", high.mux(source.at(0).mux(of(3), of(2)), source.at(0).mux(of(1), of(0))));
        let first = k.constant(8, u64::from(ANSWER) + 1);
        let start = index.at(0).mux(*kept, (first + *source).low(8));
        let header = k.wire("header", index.at(1).mux(index.at(0).mux(length.slice(8, 8), length.low(8)), start));
        let begun = io.begun.set(idle & io.offer);
        io.halfway.set(!*valid & index.at(0));
        io.crc_restart.set(stage.is(Stage::Open));
        io.crc_octet.set(stage.is(Stage::Sum).mux(!*content, *content));
        io.taken.set(goes & words & at_end);
        io.crc_load.set(goes & !border);

        // Stored every cycle while idle: `offer` settles late.
        k.when(idle, || {
            source.set(io.offered_source);
            kept.set(io.number);
        });
        let next = stage.is(Stage::Header).mux(header, stage.is(Stage::Sum).mux(io.crc_low, io.octet));
        k.when(!*valid, || content.set(next));
        let stands = k.wire("stands", border | (!idle & !io.crc_busy & (!words | io.word_valid)));
        valid.set(valid.mux(!io.ready, stands));
        k.when(begun, || stage.goes(Stage::Open));
        k.when(goes, || {
            index.set((border | at_end).mux(k.constant(4, 0), index.plus(1)));
            k.when(border | (at_end & (!words | io.word_last)), || stage.goes_to(stage.following()));
            k.when(stage.is(Stage::Close), || stage.goes(Stage::Idle));
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::kernel_of;
    use crate::language::testbench::{check, Reference};
    use crate::wire::Word;

    const IDLE: u64 = Stage::Idle as u64;
    const OPEN: u64 = Stage::Open as u64;
    const HEADER: u64 = Stage::Header as u64;
    const WORDS: u64 = Stage::Words as u64;
    const SUM: u64 = Stage::Sum as u64;
    const CLOSE: u64 = Stage::Close as u64;
    const LENGTHS: [usize; 4] = [24, 12, 0x234, 0xfeed];

    /// Position in the packet; the byte on offer.
    #[derive(Default)]
    struct Sending {
        stage: u64,
        index: u64,
        source: Option<usize>,
        number: u64,
        offered: Option<u8>,
        reset: bool,
    }

    impl Sending {
        fn border(&self) -> bool {
            matches!(self.stage, OPEN | CLOSE)
        }

        fn at_end(&self) -> bool {
            self.index == LAST[usize::from(self.stage != WORDS)]
        }

        /// The byte that is next, if it is ready.
        fn next(&self, inputs: &[Word]) -> Option<u8> {
            let source = self.source.unwrap_or_default();
            let [low, high] = (LENGTHS[source] as u16).to_le_bytes();
            let header = [ANSWER + 1 + source as u8, self.number as u8, low, high];
            let busy = inputs[8].number() == 1;
            match self.stage {
                IDLE => None,
                OPEN | CLOSE => Some(0),
                _ if busy => None,
                HEADER => Some(header[self.index as usize]),
                WORDS => (inputs[5].number() == 1).then(|| inputs[4].number() as u8),
                _ => Some(inputs[7].number() as u8),
            }
        }
    }

    impl Reference for Sending {
        fn outputs(&mut self, inputs: &[Word]) -> Vec<Option<Word>> {
            if !self.reset {
                return vec![None; 12];
            }
            let (words, goes) = (self.stage == WORDS, self.offered.is_some() && inputs[9].number() == 1);
            let bit = |bit: bool| Some(Word::from(bit));
            let byte = self.offered.filter(|_| !self.border());
            let to_crc = byte.map(|byte| if self.stage == SUM { !byte } else { byte });
            let word = |byte: u8| Word::from(u64::from(byte));
            vec![
                Some(Word::from(self.index)),
                self.source.filter(|_| self.stage != IDLE).map(|source| Word::from(source as u64)),
                byte.map(word),
                bit(self.offered.is_some()),
                bit(words),
                bit(self.border()),
                bit(self.stage == IDLE && inputs[1].number() == 1),
                bit(self.offered.is_none() && self.index % 2 == 1),
                bit(self.stage == OPEN),
                to_crc.map(word),
                bit(goes && words && self.at_end()),
                bit(goes && !self.border()),
            ]
        }

        fn clock(&mut self, inputs: &[Word]) {
            let was_idle = self.stage == IDLE;
            match self.offered {
                None => self.offered = self.next(inputs),
                Some(_) if inputs[9].number() == 1 => {
                    self.offered = None;
                    let ends = self.border() || self.at_end();
                    self.index = if ends { 0 } else { self.index + 1 };
                    let last = self.stage != WORDS || inputs[6].number() == 1;
                    self.stage = (self.stage + u64::from(ends && last)) % (CLOSE + 1);
                }
                Some(_) => {}
            }
            if was_idle && inputs[1].number() == 1 {
                (self.stage, self.number) = (OPEN, inputs[2].number());
                self.source = Some(inputs[3].number() as usize);
            }
            if inputs[0].number() == 1 {
                *self = Sending { reset: true, ..Sending::default() };
            }
        }
    }

    #[test]
    fn packets_have_header_words_and_crc() {
        let mut random = fastrand::Rng::with_seed(17);
        let cycle = |cycle: usize| {
            let bit = |likely: bool| Word::from(likely);
            vec![
                bit(cycle < 2 || random.u16(..700) == 0),
                bit(random.bool()),
                Word::from(u64::from(random.u8(..))),
                Word::from(random.u64(..4)),
                Word::from(u64::from(random.u8(..))),
                bit(random.u8(..4) > 0),
                bit(random.u8(..3) == 0),
                Word::from(u64::from(random.u8(..))),
                bit(random.u8(..4) == 0),
                bit(random.bool()),
            ]
        };
        let all: Vec<Vec<Word>> = (0..20_000).map(cycle).collect();
        check(&kernel_of(&Packer::new(LENGTHS)), &all, &mut Sending::default());
    }
}
