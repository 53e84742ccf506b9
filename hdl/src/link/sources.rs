//! Where an answer's words come from.

use rust_hdl::prelude::*;

use super::{COUNTERS, IDENTITY};
use crate::wire::{Wire, Word};

/// Chooses between the ledger, which holds identity and counters, and the engine's answer, a byte at a time.
///
/// Behind an engine with many lanes the choice ends in a register: the packer looks at a byte five cycles after it asks for
/// it at the soonest. A link whose line is hardly slower than its clock has no cycle to spare, and a smaller choice.
#[derive(LogicBlock)]
pub struct Sources {
    /// Clock.
    pub clk: Signal<In, Clock>,
    /// Which.
    pub source: Wire<In>,
    /// An answer begins.
    pub begun: Signal<In, Bit>,
    /// Words are awaited.
    pub wanted: Signal<In, Bit>,
    /// Which byte of one.
    pub index: Wire<In>,
    /// All bytes of one are out.
    pub taken: Signal<In, Bit>,
    /// Place in the ledger.
    pub address: Wire<Out>,
    /// Two bytes of the ledger.
    pub entry: Wire<In>,
    /// They are those of the place.
    pub entry_valid: Signal<In, Bit>,
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
    /// The byte.
    pub octet: Wire<Out>,
    /// Its word stands.
    pub word_valid: Signal<Out, Bit>,
    /// It is the last.
    pub word_last: Signal<Out, Bit>,
    _registered: bool,
    _second: bool,
}

impl Sources {
    /// With or without a register behind the choice.
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
            _second: false,
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
            self._second = !self.begun.val() && (before || self.taken.val());
        }
        if edge || !self._registered {
            let second = if self._registered { before } else { self._second };
            (self.word_valid.next, self.word_last.next) = match own {
                true => (self.entry_valid.val(), counters || second),
                false => (self.answer_valid.val(), self.answer_last.val()),
            };
            self.octet.next = Word::from(match own {
                true => self.entry.val().field(8 * (index & 1), 8),
                false => self.answer.val().field(8 * index.min(11), 8),
            });
        }
        self.address.next = Word::from(u64::from(counters) << 4 | u64::from(self._second) << 3 | (index as u64) >> 1);
        self.answer_wanted.next = self.wanted.val() && !own;
        self.summarise.next = !counters;
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
        Verilog::Custom(format!(
            "\
reg second;
wire [31:0] answer_word = index[3] ? answer[95:64] : index[2] ? answer[63:32] : answer[31:0];
wire [15:0] answer_half = index[1] ? answer_word[31:16] : answer_word[15:0];
wire [15:0] both = source[1] ? answer_half : entry;
always @(*) begin
  address = {{source[0], second, index[3:1]}};
  answer_wanted = wanted && source[1];
  summarise = !source[0];
end
always @(posedge clk) second <= !begun && (second || taken);
{when} begin
  word_valid {to} source[1] ? answer_valid : entry_valid;
  word_last {to} source[1] ? answer_last : source[0] || second;
  octet {to} index[0] ? both[15:8] : both[7:0];
end"
        ))
    }
}
