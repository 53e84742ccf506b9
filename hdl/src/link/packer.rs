//! From the words of an answer to the bytes of its packet.

use dermis_golden::wire::link::ANSWER;
use rust_hdl::prelude::*;

use crate::kernel_block;
use crate::language::{Body, Builder, Kernel, Type};
use crate::wire::Wire;

/// Sends SLIP END, header, words of twelve bytes up to the last, CRC, SLIP END.
///
/// An answer starts when one is offered and none is being sent; its source and number are stored. The sources select
/// each byte themselves, so that no word register is needed here: `index` is the byte of the word that is needed, and
/// `taken` says that the word has been sent. An offered byte stays until it is accepted; the next one waits until the
/// CRC has processed it.
#[derive(dermis_hdl_derive::Block)]
pub struct Packer {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Synchronous reset, active high.
    pub rst: Signal<In, Bit>,
    /// An answer can start.
    pub offer: Signal<In, Bit>,
    /// Sequence number of its request; valid with `offer`.
    pub number: Wire<In>,
    /// Source of its payload, 2 bits; valid with `offer`.
    pub offered_source: Wire<In>,
    /// The offered answer starts in this cycle.
    pub begun: Signal<Out, Bit>,
    /// Source of the answer being sent, 2 bits; valid from the cycle after `begun` until the answer's last byte.
    pub source: Wire<Out>,
    /// Words of the payload are needed.
    pub wanted: Signal<Out, Bit>,
    /// Byte of the word, of the header or of the CRC that is next, 4 bits; that of a word while `wanted` is high.
    pub index: Wire<Out>,
    /// That byte of the word, from its source, 8 bits; valid with `word_valid`.
    pub octet: Wire<In>,
    /// The word is valid.
    pub word_valid: Signal<In, Bit>,
    /// The word is the payload's last; valid with `word_valid`.
    pub word_last: Signal<In, Bit>,
    /// The last byte of the word is accepted in this cycle.
    pub taken: Signal<Out, Bit>,
    /// The first byte of two has been sent and the second one is still to be read.
    pub halfway: Signal<Out, Bit>,
    /// Resets the CRC for a new packet.
    pub crc_restart: Signal<Out, Bit>,
    /// Byte for the CRC: of the packet, or its own lowest one; valid with `crc_load`.
    pub crc_octet: Wire<Out>,
    /// The CRC takes `crc_octet` in this cycle.
    pub crc_load: Signal<Out, Bit>,
    /// Lowest byte of the CRC; valid while `crc_busy` is low.
    pub crc_low: Wire<In>,
    /// The CRC is processing a byte.
    pub crc_busy: Signal<In, Bit>,
    /// A byte of the packet; valid with `valid`, unless `border`.
    pub content: Wire<Out>,
    /// SLIP END between packets, in place of a byte; valid with `valid`.
    pub border: Signal<Out, Bit>,
    /// A byte or an END is offered; held until `ready`.
    pub valid: Signal<Out, Bit>,
    /// The byte is accepted in this cycle.
    pub ready: Signal<In, Bit>,
    kernel: Body,
}

kernel_block!(
    Packer,
    clock clk,
    inputs [rst, offer, number, offered_source, octet, word_valid, word_last, crc_low, crc_busy, ready],
    outputs [
        begun, source, wanted, index, taken, halfway, crc_restart, crc_octet, crc_load, content, border, valid
    ]
);

const IDLE: u64 = 0;
const OPEN: u64 = 1;
const HEADER: u64 = 2;
const WORDS: u64 = 3;
const SUM: u64 = 4;
const CLOSE: u64 = 5;
/// Index of the last byte of a word; of the header and of the CRC.
const LAST: [u64; 2] = [11, 3];

impl Packer {
    /// `lengths` are the bytes of the payload, by source.
    pub fn new(lengths: [usize; 4]) -> Self {
        let block = Packer {
            clk: Default::default(),
            rst: Default::default(),
            offer: Default::default(),
            number: Wire::new(8),
            offered_source: Wire::new(2),
            begun: Default::default(),
            source: Wire::new(2),
            wanted: Default::default(),
            index: Wire::new(4),
            octet: Wire::new(8),
            word_valid: Default::default(),
            word_last: Default::default(),
            taken: Default::default(),
            halfway: Default::default(),
            crc_restart: Default::default(),
            crc_octet: Wire::new(8),
            crc_load: Default::default(),
            crc_low: Wire::new(8),
            crc_busy: Default::default(),
            content: Wire::new(8),
            border: Default::default(),
            valid: Default::default(),
            ready: Default::default(),
            kernel: Body::default(),
        };
        block.bind(kernel(lengths))
    }
}

fn kernel(lengths: [usize; 4]) -> Kernel {
    let k = Builder::new("packer");
    let (rst, offer, number) = (k.input("rst", 1), k.input("offer", 1), k.input("number", 8));
    let (offered_source, octet) = (k.input("offered_source", 2), k.input("octet", 8));
    let (word_valid, word_last) = (k.input("word_valid", 1), k.input("word_last", 1));
    let (crc_low, crc_busy, ready) = (k.input("crc_low", 8), k.input("crc_busy", 1), k.input("ready", 1));
    let stage = k.state("stage", Type::unsigned(3), rst, IDLE);
    let index = k.state("index", Type::unsigned(4), rst, 0);
    let source = k.register("source", Type::unsigned(2));
    let [kept, content] = ["kept", "content"].map(|name| k.register(name, Type::unsigned(8)));
    let valid = k.state("valid", Type::unsigned(1), rst, 0);

    let idle = k.wire("idle", stage.is(IDLE));
    let words = k.wire("wanted", stage.is(WORDS));
    let border = k.wire("border", stage.is(OPEN) | stage.is(CLOSE));
    let [last_of_word, last] = LAST.map(|last| k.constant(4, last));
    let at_end = k.wire("at_end", index.equals(words.mux(last_of_word, last)));
    let goes = k.wire("goes", *valid & ready);
    let of = |at: usize| k.constant(16, lengths[at] as u64);
    let high = source.at(1);
    let length = k.wire("length", high.mux(source.at(0).mux(of(3), of(2)), source.at(0).mux(of(1), of(0))));
    let first = k.constant(8, u64::from(ANSWER) + 1);
    let start = index.at(0).mux(*kept, (first + *source).low(8));
    let header = k.wire("header", index.at(1).mux(index.at(0).mux(length.slice(8, 8), length.low(8)), start));
    let begun = k.wire("begun", idle & offer);
    k.wire("halfway", !*valid & index.at(0));
    k.wire("crc_restart", stage.is(OPEN));
    k.wire("crc_octet", stage.is(SUM).mux(!*content, *content));
    k.wire("taken", goes & words & at_end);
    k.wire("crc_load", goes & !border);

    // Stored every cycle while idle: `offer` settles late.
    k.when(idle, || {
        source.set(offered_source);
        kept.set(number);
    });
    let next = stage.is(HEADER).mux(header, stage.is(SUM).mux(crc_low, octet));
    k.when(!*valid, || content.set(next));
    let stands = k.wire("stands", border | (!idle & !crc_busy & (!words | word_valid)));
    valid.set(valid.mux(!ready, stands));
    k.when(begun, || stage.set(k.constant(3, OPEN)));
    k.when(goes, || {
        index.set((border | at_end).mux(k.constant(4, 0), index.plus(1)));
        k.when(border | (at_end & (!words | word_last)), || stage.set(stage.plus(1)));
        k.when(stage.is(CLOSE), || stage.set(k.constant(3, IDLE)));
    });
    k.finish()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::testbench::{check, Reference};
    use crate::wire::Word;

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
        check(Packer::new(LENGTHS).kernel.kernel(), &all, &mut Sending::default());
    }
}
