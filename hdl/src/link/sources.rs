//! Selects the bytes of an answer from its source.

use crate::block;
use crate::language::{concat, Block, Builder, Inside, Output, Type};

block! {
    /// Multiplexer, byte by byte, between the counter RAM, which holds identity and counters, and the engine's answer.
    ///
    /// With many lanes it has four register stages, that of the index first: the packer uses a byte no sooner than five
    /// cycles after it asked for it. A link whose bit rate is close to the clock has no cycle to spare, but a smaller
    /// multiplexer.
    pub struct Sources {
        /// There are the four register stages.
        registered: bool,
    }
    ports SourcesPorts {
        clock;
        /// Source of the answer being sent, 2 bits; valid from the cycle after `begun` until the answer's last byte.
        in source: 2;
        /// An answer starts in this cycle.
        in begun;
        /// Words of the payload are needed.
        in wanted;
        /// Byte of the word that is needed, 4 bits; valid while `wanted` is high.
        in index: 4;
        /// The last byte of a word is accepted in this cycle.
        in taken;
        /// Entry of the counter RAM to read, 5 bits; valid in every cycle, one cycle ahead of `entry`.
        out address: 5;
        /// The entry, two bytes; valid with `entry_valid`.
        in entry: 16;
        /// `entry` is that of `address`.
        in entry_valid;
        /// A word of the engine's answer, 96 bits; valid with `answer_valid`.
        in answer: 96;
        /// `answer` holds a word.
        in answer_valid;
        /// The word is the last of the answer; valid with `answer_valid`.
        in answer_last;
        /// The engine's answer is needed.
        out answer_wanted;
        /// The engine's answer consists of sums and status.
        out summarise;
        /// The byte `index` of the word; valid with `word_valid`.
        out octet: 8;
        /// The word is valid.
        out word_valid;
        /// The word is the payload's last; valid with `word_valid`.
        out word_last;
    }
}

impl Sources {
    /// With the four register stages if `registered`.
    pub fn new(registered: bool) -> Self {
        Sources { registered }
    }
}

impl Block for Sources {
    fn build<'k>(&self, k: &'k Builder, io: SourcesPorts<Inside<'k>>) {
        let second = k.register("second", Type::unsigned(1));
        // A register of `value`, or a wire.
        let stage = |name: &str, value| if self.registered { k.delay(name, value) } else { k.wire(name, value) };
        let shown = |output: Output<'k>, value| if self.registered { output.delay(value) } else { output.set(value) };
        let was_taken = stage("was_taken", io.taken);
        second.set(!io.begun & (*second | was_taken));
        io.address.set(concat(&[io.source.at(0), *second, io.index.slice(1, 3)]));
        let is_answer = io.source.at(1);
        // The packer, which holds the index, is a long way from the engine's answer.
        let chosen = stage("chosen", io.index);
        io.answer_wanted.set(io.wanted & is_answer);
        let [high, middle, low] = [2, 1, 0].map(|word| io.answer.slice(32 * word, 32));
        let word = stage("answer_word", chosen.at(3).mux(high, chosen.at(2).mux(middle, low)));
        let half = chosen.at(1).mux(word.slice(16, 16), word.low(16));
        // The block RAM of the counters is slow and far away: nothing stands between it and its register.
        let both = k.wire("both", is_answer.mux(stage("answer_half", half), stage("kept_entry", io.entry)));
        let valid = stage("valid", is_answer.mux(io.answer_valid, io.entry_valid));
        let last = stage("last", is_answer.mux(io.answer_last, io.source.at(0) | *second));
        shown(io.octet, chosen.at(0).mux(both.slice(8, 8), both.low(8)));
        shown(io.word_valid, stage("half_valid", valid));
        shown(io.word_last, stage("half_last", last));
        shown(io.summarise, !io.source.at(0));
    }
}

#[cfg(test)]
mod tests {
    use super::super::{COUNTERS, IDENTITY};
    use super::*;
    use crate::language::kernel_of;
    use crate::language::testbench::{check, Reference};
    use crate::wire::Word;

    /// Selects from whole words; with registers, the index of the cycle before selects a word, then two bytes, then one.
    #[derive(Default)]
    struct Selection {
        /// There are the four register stages.
        registered: bool,
        second: Option<bool>,
        was_taken: Option<bool>,
        index: Option<usize>,
        /// Four bytes of the answer, two of them; two of the entry.
        word: Option<u64>,
        half: Option<u64>,
        entry: Option<u64>,
        /// Whether the words of the last cycles are valid, whether they are the last; the latest first.
        flags: [Option<(bool, bool)>; 3],
        byte: Option<u64>,
        sums: Option<bool>,
    }

    impl Selection {
        fn flags(&self, inputs: &[Word]) -> Option<(bool, bool)> {
            let entry_valid = inputs[6].number() == 1;
            match inputs[0].number() as usize {
                IDENTITY => Some((entry_valid, self.second?)),
                COUNTERS => Some((entry_valid, true)),
                _ => Some((inputs[8].number() == 1, inputs[9].number() == 1)),
            }
        }

        /// Byte `index` of a word of so many bytes, at most four of them.
        fn bytes(word: u64, index: usize, of: usize) -> u64 {
            word >> (8 * (index % of))
        }

        fn byte(inputs: &[Word], half: u64, entry: u64, index: usize) -> u64 {
            Selection::bytes(if inputs[0].number() >= 2 { half } else { entry }, index, 2) & 0xff
        }
    }

    impl Reference for Selection {
        fn outputs(&mut self, inputs: &[Word]) -> Vec<Option<Word>> {
            let (source, index) = (inputs[0].number(), inputs[3].number());
            let address = self.second.map(|second| Word::from((source & 1) << 4 | u64::from(second) << 3 | index >> 1));
            let at = index as usize;
            let (byte, flags, sums) = match self.registered {
                true => (self.byte, self.flags[2], self.sums),
                false => {
                    let half = inputs[7].field(16 * (at / 2), 16);
                    let byte = Selection::byte(inputs, half, inputs[5].number(), at);
                    (Some(byte), self.flags(inputs), Some(source & 1 == 0))
                }
            };
            vec![
                address,
                Some(Word::from(inputs[2].number() == 1 && source >= 2)),
                byte.map(Word::from),
                flags.map(|(valid, _)| Word::from(valid)),
                flags.map(|(_, last)| Word::from(last)),
                sums.map(Word::from),
            ]
        }

        fn clock(&mut self, inputs: &[Word]) {
            let both = self.half.zip(self.entry).zip(self.index);
            self.byte = both.map(|((half, entry), index)| Selection::byte(inputs, half, entry, index));
            self.half = self.word.zip(self.index).map(|(word, index)| Selection::bytes(word, index & 2, 4) & 0xffff);
            self.word = self.index.map(|index| inputs[7].field(32 * (index / 4), 32));
            self.index = Some(inputs[3].number() as usize);
            self.entry = Some(inputs[5].number());
            self.flags = [self.flags(inputs), self.flags[0], self.flags[1]];
            self.sums = Some(inputs[0].number() & 1 == 0);
            let taken = inputs[4].number() == 1;
            let counts = if self.registered { self.was_taken } else { Some(taken) };
            self.was_taken = Some(taken);
            self.second = match inputs[1].number() {
                1 => Some(false),
                _ => self.second.zip(counts).map(|(second, taken)| second || taken),
            };
        }
    }

    #[test]
    fn the_byte_is_that_of_the_source() {
        let mut random = fastrand::Rng::with_seed(19);
        let (mut source, mut index) = (0, 0);
        let cycle = |cycle: usize| {
            let begun = cycle == 0 || random.u8(..40) == 0;
            if begun {
                source = random.u64(..4);
            }
            // The packer keeps the index for some cycles.
            if random.u8(..3) == 0 {
                index = random.u64(..12);
            }
            let mut answer = Word::default();
            answer.set_limbs(&[random.u64(..), random.u64(..1 << 32)]);
            vec![
                Word::from(source),
                Word::from(begun),
                Word::from(random.bool()),
                Word::from(index),
                Word::from(random.u8(..12) == 0),
                Word::from(random.u64(..0x10000)),
                Word::from(random.bool()),
                answer,
                Word::from(random.bool()),
                Word::from(random.bool()),
            ]
        };
        let all: Vec<Vec<Word>> = (0..5000).map(cycle).collect();
        for registered in [false, true] {
            let mut selection = Selection { registered, ..Selection::default() };
            check(&kernel_of(&Sources::new(registered)), &all, &mut selection);
        }
    }
}
