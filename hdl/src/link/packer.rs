//! From an answer's words to the bytes of its packet.

use rust_hdl::prelude::*;

use super::crc::{step, FUNCTION, START};
use crate::wire::{Wire, Word};

/// Border, header, words of twelve bytes until the last, CRC, border.
///
/// An answer begins when one is offered and none is on its way; its source and header are kept. A word is taken in the
/// cycle in which it is `wanted` and valid.
#[derive(LogicBlock)]
pub struct Packer {
    /// Clock.
    pub clk: Signal<In, Clock>,
    /// Reset.
    pub rst: Signal<In, Bit>,
    /// An answer can begin.
    pub offer: Signal<In, Bit>,
    /// Its header, four bytes.
    pub header: Wire<In>,
    /// Where its words come from.
    pub offered_source: Wire<In>,
    /// It begins.
    pub begun: Signal<Out, Bit>,
    /// The source of the answer on its way.
    pub source: Wire<Out>,
    /// The next word is awaited.
    pub wanted: Signal<Out, Bit>,
    /// The word.
    pub word: Wire<In>,
    /// It stands.
    pub word_valid: Signal<In, Bit>,
    /// It is the last.
    pub word_last: Signal<In, Bit>,
    /// A byte of the packet.
    pub content: Wire<Out>,
    /// A border between packets in its place.
    pub border: Signal<Out, Bit>,
    /// It is offered.
    pub valid: Signal<Out, Bit>,
    /// It is taken.
    pub ready: Signal<In, Bit>,
    _state: State,
}

#[derive(Clone, Copy, Debug, Default)]
struct State {
    stage: usize,
    shift: Word,
    left: u32,
    last: bool,
    crc: u32,
    source: Word,
}

const IDLE: usize = 0;
const OPEN: usize = 1;
const BYTES: usize = 2;
const WANT: usize = 3;
const SUM: usize = 4;
const CRC: usize = 5;
const CLOSE: usize = 6;

impl Default for Packer {
    fn default() -> Self {
        Packer {
            clk: Default::default(),
            rst: Default::default(),
            offer: Default::default(),
            header: Wire::new(32),
            offered_source: Wire::new(2),
            begun: Default::default(),
            source: Wire::new(2),
            wanted: Default::default(),
            word: Wire::new(96),
            word_valid: Default::default(),
            word_last: Default::default(),
            content: Wire::new(8),
            border: Default::default(),
            valid: Default::default(),
            ready: Default::default(),
            _state: State::default(),
        }
    }
}

impl Packer {
    fn next(&self) -> State {
        let mut s = self._state;
        match s.stage {
            IDLE if self.offer.val() => {
                (s.stage, s.shift, s.left, s.last) = (OPEN, self.header.val(), 4, false);
                (s.crc, s.source) = (START, self.offered_source.val());
            }
            OPEN if self.ready.val() => s.stage = BYTES,
            BYTES | CRC if self.ready.val() => {
                s.crc = step(s.crc, s.shift.number() as u8);
                let mut shift = Word::default();
                shift.set(0, 64, s.shift.field(8, 64));
                shift.set(64, 24, s.shift.field(72, 24));
                (s.shift, s.left) = (shift, s.left - 1);
                s.stage = match (s.left, s.stage) {
                    (0, CRC) => CLOSE,
                    (0, _) if s.last => SUM,
                    (0, _) => WANT,
                    _ => s.stage,
                };
            }
            WANT if self.word_valid.val() => {
                (s.stage, s.shift, s.left, s.last) = (BYTES, self.word.val(), 12, self.word_last.val());
            }
            SUM => (s.stage, s.shift, s.left) = (CRC, Word::from(u64::from(!s.crc)), 4),
            CLOSE if self.ready.val() => s.stage = IDLE,
            _ => (),
        }
        if self.rst.val() {
            s.stage = IDLE;
        }
        s
    }
}

impl Logic for Packer {
    fn update(&mut self) {
        if self.clk.pos_edge() {
            self._state = self.next();
        }
        let s = self._state;
        self.begun.next = s.stage == IDLE && self.offer.val();
        self.source.next = s.source;
        self.wanted.next = s.stage == WANT;
        self.content.next = Word::from(s.shift.field(0, 8));
        self.border.next = s.stage == OPEN || s.stage == CLOSE;
        self.valid.next = matches!(s.stage, OPEN | BYTES | CRC | CLOSE);
    }

    fn connect(&mut self) {
        for bit in [&mut self.begun, &mut self.wanted, &mut self.border, &mut self.valid] {
            bit.connect();
        }
        self.source.connect();
        self.content.connect();
    }

    fn hdl(&self) -> Verilog {
        Verilog::Custom(format!(
            "\
{FUNCTION}reg [2:0] stage;
reg [95:0] shift;
reg [3:0] left;
reg last;
reg [31:0] crc;
wire bytes = stage == 3'd{BYTES} || stage == 3'd{CRC};
always @(*) begin
  begun = stage == 3'd{IDLE} && offer;
  wanted = stage == 3'd{WANT};
  content = shift[7:0];
  border = stage == 3'd{OPEN} || stage == 3'd{CLOSE};
  valid = bytes || border;
end
always @(posedge clk) begin
  case (stage)
    3'd{IDLE}: begin
      shift <= {{64'd0, header}};
      left <= 4'd4;
      last <= 1'b0;
      crc <= 32'h{START:x};
      if (offer) begin
        source <= offered_source;
        stage <= 3'd{OPEN};
      end
    end
    3'd{OPEN}: if (ready) stage <= 3'd{BYTES};
    3'd{BYTES}, 3'd{CRC}: if (ready) begin
      crc <= step(crc, content);
      shift <= {{8'd0, shift[95:8]}};
      left <= left - 4'd1;
      if (left == 4'd1) stage <= stage == 3'd{CRC} ? 3'd{CLOSE} : last ? 3'd{SUM} : 3'd{WANT};
    end
    3'd{WANT}: if (word_valid) begin
      shift <= word;
      left <= 4'd12;
      last <= word_last;
      stage <= 3'd{BYTES};
    end
    3'd{SUM}: begin
      shift <= {{64'd0, ~crc}};
      left <= 4'd4;
      stage <= 3'd{CRC};
    end
    default: if (ready) stage <= 3'd{IDLE};
  endcase
  if (rst) stage <= 3'd{IDLE};
end"
        ))
    }
}
