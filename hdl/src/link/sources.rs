//! Selects the bytes of an answer from its source.

use rust_hdl::prelude::*;

use super::{COUNTERS, IDENTITY};
use crate::wire::{Wire, Word};

/// Multiplexer, byte by byte, between the ledger, which holds identity and counters, and the engine's answer.
///
/// With many lanes it has two register stages: the packer uses a byte no sooner than five cycles after it asked for it.
/// A link whose bit rate is close to the clock has no cycle to spare, but a smaller multiplexer.
#[derive(LogicBlock)]
pub struct Sources {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Source of the answer being sent, 2 bits.
    pub source: Wire<In>,
    /// An answer starts in this cycle.
    pub begun: Signal<In, Bit>,
    /// Words of the payload are needed.
    pub wanted: Signal<In, Bit>,
    /// Byte of the word that is needed.
    pub index: Wire<In>,
    /// The last byte of a word is accepted in this cycle.
    pub taken: Signal<In, Bit>,
    /// Entry of the ledger to read.
    pub address: Wire<Out>,
    /// The entry, two bytes.
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
    _registered: bool,
    _taken: bool,
    _second: bool,
    _half: Half,
}

/// Content of the first register stage: two bytes, whether their word is valid, whether it is the last.
type Half = (u64, bool, bool);

impl Sources {
    /// With the two register stages if `registered`.
    pub fn new(registered: bool) -> Self {
        Sources {
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
            _registered: registered,
            _taken: false,
            _second: false,
            _half: Half::default(),
        }
    }
}

impl Logic for Sources {
    fn update(&mut self) {
        let source = self.source.val().number() as usize;
        let own = source == IDENTITY || source == COUNTERS;
        let index = self.index.val().number() as usize;
        let counters = source & 1 == 1;
        let edge = self.clk.pos_edge();
        let before = self._second;
        if edge {
            let taken = if self._registered { self._taken } else { self.taken.val() };
            self._second = !self.begun.val() && (before || taken);
            self._taken = self.taken.val();
        }
        let second = if self._registered { before } else { self._second };
        let half = match own {
            true => (self.entry.val().field(0, 16), self.entry_valid.val(), counters || second),
            false => {
                let low = 16 * (index / 2).min(5);
                (self.answer.val().field(low, 16), self.answer_valid.val(), self.answer_last.val())
            }
        };
        if edge || !self._registered {
            let (both, valid, last) = if self._registered { self._half } else { half };
            self.octet.next = Word::from(both >> (8 * (index & 1)) & 0xff);
            (self.word_valid.next, self.word_last.next) = (valid, last);
            self.summarise.next = !counters;
            self._half = half;
        }
        self.address.next = Word::from(u64::from(counters) << 4 | u64::from(self._second) << 3 | (index as u64) >> 1);
        self.answer_wanted.next = self.wanted.val() && !own;
    }

    fn connect(&mut self) {
        for bit in [&mut self.answer_wanted, &mut self.summarise, &mut self.word_valid, &mut self.word_last] {
            bit.connect();
        }
        self.address.connect();
        self.octet.connect();
    }

    fn hdl(&self) -> Verilog {
        let (when, to) = if self._registered { ("always @(posedge clk)", "<=") } else { ("always @(*)", "=") };
        let taken = match self._registered {
            true => "reg was_taken;\nalways @(posedge clk) was_taken <= taken;\n",
            false => "wire was_taken = taken;\n",
        };
        Verilog::Custom(format!(
            "\
reg second, valid, last;
reg [15:0] both;
wire [31:0] answer_word = index[3] ? answer[95:64] : index[2] ? answer[63:32] : answer[31:0];
wire [15:0] answer_half = index[1] ? answer_word[31:16] : answer_word[15:0];
always @(*) begin
  address = {{source[0], second, index[3:1]}};
  answer_wanted = wanted && source[1];
end
{taken}always @(posedge clk) second <= !begun && (second || was_taken);
{when} begin
  both {to} source[1] ? answer_half : entry;
  valid {to} source[1] ? answer_valid : entry_valid;
  last {to} source[1] ? answer_last : source[0] || second;
end
{when} begin
  octet {to} index[0] ? both[15:8] : both[7:0];
  word_valid {to} valid;
  word_last {to} last;
  summarise {to} !source[0];
end"
        ))
    }
}
