//! Where an answer's words come from.

use dermis_golden::link::Identity;
use rust_hdl::prelude::*;

use super::{COUNTERS, IDENTITY, IDENTITY_WORDS};
use crate::wire::{Wire, Word};

/// Chooses between the identity, which it holds, the counters, and the engine's answer.
#[derive(LogicBlock)]
pub struct Sources {
    /// Clock.
    pub clk: Signal<In, Clock>,
    /// Which.
    pub source: Wire<In>,
    /// An answer begins.
    pub begun: Signal<In, Bit>,
    /// The next word is awaited.
    pub wanted: Signal<In, Bit>,
    /// The counters.
    pub counters: Wire<In>,
    /// A word of the engine's answer.
    pub answer: Wire<In>,
    /// It stands.
    pub answer_valid: Signal<In, Bit>,
    /// It is the last.
    pub answer_last: Signal<In, Bit>,
    /// The engine's answer is awaited.
    pub answer_wanted: Signal<Out, Bit>,
    /// The engine's answer is summed up.
    pub summarise: Signal<Out, Bit>,
    /// The next word.
    pub word: Wire<Out>,
    /// It stands.
    pub word_valid: Signal<Out, Bit>,
    /// It is the last.
    pub word_last: Signal<Out, Bit>,
    _identity: [Word; IDENTITY_WORDS],
    _second: bool,
}

impl Sources {
    /// With `identity` as the answer to whoever asks.
    pub fn new(identity: &Identity) -> Self {
        let bytes = identity.to_bytes();
        let word = |index: usize| {
            let mut word = Word::default();
            let own = &bytes[12 * index..12 * (index + 1)];
            own.iter().enumerate().for_each(|(at, &byte)| word.set(8 * at, 8, u64::from(byte)));
            word
        };
        Sources {
            clk: Default::default(),
            source: Wire::new(2),
            begun: Default::default(),
            wanted: Default::default(),
            counters: Wire::new(96),
            answer: Wire::new(96),
            answer_valid: Default::default(),
            answer_last: Default::default(),
            answer_wanted: Default::default(),
            summarise: Default::default(),
            word: Wire::new(96),
            word_valid: Default::default(),
            word_last: Default::default(),
            _identity: [word(0), word(1)],
            _second: false,
        }
    }
}

impl Logic for Sources {
    fn update(&mut self) {
        let source = self.source.val().number() as usize;
        let own = source == IDENTITY || source == COUNTERS;
        if self.clk.pos_edge() {
            self._second = !self.begun.val() && (self._second || self.wanted.val());
        }
        self.answer_wanted.next = self.wanted.val() && !own;
        self.summarise.next = source & 1 == 0;
        self.word_valid.next = own || self.answer_valid.val();
        (self.word.next, self.word_last.next) = match source {
            IDENTITY => (self._identity[usize::from(self._second)], self._second),
            COUNTERS => (self.counters.val(), true),
            _ => (self.answer.val(), self.answer_last.val()),
        };
    }

    fn connect(&mut self) {
        for bit in [&mut self.answer_wanted, &mut self.summarise, &mut self.word_valid, &mut self.word_last] {
            bit.connect();
        }
        self.word.connect();
    }

    fn hdl(&self) -> Verilog {
        let literal = |word: &Word| format!("96'h{:08x}{:016x}", word.field(64, 32), word.field(0, 64));
        let [first, second] = self._identity.each_ref().map(literal);
        Verilog::Custom(format!(
            "\
reg second;
always @(*) begin
  answer_wanted = wanted && source[1];
  summarise = !source[0];
  word_valid = !source[1] || answer_valid;
  word = source[1] ? answer : source[0] ? counters : second ? {second} : {first};
  word_last = source[1] ? answer_last : source[0] || second;
end
always @(posedge clk) second <= !begun && (second || wanted);"
        ))
    }
}
