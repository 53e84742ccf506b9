//! Selects the bytes of an answer from its source.

use rust_hdl::prelude::*;

use crate::kernel_block;
use crate::language::{concat, Body, Builder, Expr, Kernel, Type};
use crate::wire::Wire;

/// Multiplexer, byte by byte, between the counter RAM, which holds identity and counters, and the engine's answer.
///
/// With many lanes it has four register stages, that of the index first: the packer uses a byte no sooner than five cycles
/// after it asked for it.
/// A link whose bit rate is close to the clock has no cycle to spare, but a smaller multiplexer.
#[derive(dermis_hdl_derive::Block)]
pub struct Sources {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Source of the answer being sent, 2 bits; valid from the cycle after `begun` until the answer's last byte.
    pub source: Wire<In>,
    /// An answer starts in this cycle.
    pub begun: Signal<In, Bit>,
    /// Words of the payload are needed.
    pub wanted: Signal<In, Bit>,
    /// Byte of the word that is needed, 4 bits; valid while `wanted` is high.
    pub index: Wire<In>,
    /// The last byte of a word is accepted in this cycle.
    pub taken: Signal<In, Bit>,
    /// Entry of the counter RAM to read, 5 bits; valid in every cycle, one cycle ahead of `entry`.
    pub address: Wire<Out>,
    /// The entry, two bytes; valid with `entry_valid`.
    pub entry: Wire<In>,
    /// `entry` is that of `address`.
    pub entry_valid: Signal<In, Bit>,
    /// A word of the engine's answer, 96 bits; valid with `answer_valid`.
    pub answer: Wire<In>,
    /// `answer` holds a word.
    pub answer_valid: Signal<In, Bit>,
    /// The word is the last of the answer; valid with `answer_valid`.
    pub answer_last: Signal<In, Bit>,
    /// The engine's answer is needed.
    pub answer_wanted: Signal<Out, Bit>,
    /// The engine's answer consists of sums and status.
    pub summarise: Signal<Out, Bit>,
    /// The byte `index` of the word; valid with `word_valid`.
    pub octet: Wire<Out>,
    /// The word is valid.
    pub word_valid: Signal<Out, Bit>,
    /// The word is the payload's last; valid with `word_valid`.
    pub word_last: Signal<Out, Bit>,
    kernel: Body,
}

kernel_block!(
    Sources,
    clock clk,
    inputs [source, begun, wanted, index, taken, entry, entry_valid, answer, answer_valid, answer_last],
    outputs [address, answer_wanted, summarise, octet, word_valid, word_last]
);

impl Sources {
    /// With the four register stages if `registered`.
    pub fn new(registered: bool) -> Self {
        let block = Sources {
            clk: Default::default(),
            source: Wire::new(2),
            begun: Default::default(),
            wanted: Default::default(),
            index: Wire::new(4),
            taken: Default::default(),
            address: Wire::new(5),
            entry: Wire::new(16),
            entry_valid: Default::default(),
            answer: Wire::new(96),
            answer_valid: Default::default(),
            answer_last: Default::default(),
            answer_wanted: Default::default(),
            summarise: Default::default(),
            octet: Wire::new(8),
            word_valid: Default::default(),
            word_last: Default::default(),
            kernel: Body::default(),
        };
        block.bind(kernel(registered))
    }
}

/// A register of `value`, or a wire.
fn stage<'k>(k: &'k Builder, registered: bool, name: &str, value: Expr<'k>) -> Expr<'k> {
    if registered {
        k.delay(name, value)
    } else {
        k.wire(name, value)
    }
}

fn kernel(registered: bool) -> Kernel {
    let k = Builder::new("sources");
    let (source, begun, wanted) = (k.input("source", 2), k.input("begun", 1), k.input("wanted", 1));
    let (index, taken) = (k.input("index", 4), k.input("taken", 1));
    let (entry, entry_valid) = (k.input("entry", 16), k.input("entry_valid", 1));
    let (answer, answer_valid, answer_last) =
        (k.input("answer", 96), k.input("answer_valid", 1), k.input("answer_last", 1));
    let second = k.register("second", Type::unsigned(1));
    let stage = |name: &str, value| stage(&k, registered, name, value);
    let was_taken = stage("was_taken", taken);
    second.set(!begun & (*second | was_taken));
    k.wire("address", concat(&[source.at(0), *second, index.slice(1, 3)]));
    let is_answer = source.at(1);
    // The packer, which holds the index, is a long way from the engine's answer.
    let chosen = stage("chosen", index);
    k.wire("answer_wanted", wanted & is_answer);
    let [high, middle, low] = [2, 1, 0].map(|word| answer.slice(32 * word, 32));
    let word = stage("answer_word", chosen.at(3).mux(high, chosen.at(2).mux(middle, low)));
    let half = chosen.at(1).mux(word.slice(16, 16), word.low(16));
    // The block RAM of the counters is slow and far away: nothing stands between it and its register.
    let both = k.wire("both", is_answer.mux(stage("answer_half", half), stage("kept_entry", entry)));
    let valid = stage("valid", is_answer.mux(answer_valid, entry_valid));
    let last = stage("last", is_answer.mux(answer_last, source.at(0) | *second));
    stage("octet", chosen.at(0).mux(both.slice(8, 8), both.low(8)));
    stage("word_valid", stage("half_valid", valid));
    stage("word_last", stage("half_last", last));
    stage("summarise", !source.at(0));
    k.finish()
}

#[cfg(test)]
mod tests {
    use super::super::{COUNTERS, IDENTITY};
    use super::*;
    use crate::language::testbench::{check, Reference};
    use crate::wire::Word;

    /// Selects from whole words; with registers, the index of the cycle before selects a word, then two bytes, then one.
    #[derive(Default)]
    struct Selection {
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
            check(Sources::new(registered).kernel.kernel(), &all, &mut selection);
        }
    }
}
