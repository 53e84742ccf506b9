//! From an answer's words to the bytes of its packet.

use dermis_golden::link::ANSWER;
use rust_hdl::prelude::*;

use crate::wire::{Wire, Word};

/// Border, header, words of twelve bytes until the last, CRC, border.
///
/// An answer begins when one is offered and none is on its way; its source and number are kept. Each byte is chosen where it
/// stands, so that words need no register here: `index` says which one of the word is awaited, and `taken` that the word is
/// out. A byte that is offered stays; the next one waits until the CRC has taken it in.
#[derive(LogicBlock)]
pub struct Packer {
    /// Clock.
    pub clk: Signal<In, Clock>,
    /// Reset.
    pub rst: Signal<In, Bit>,
    /// An answer can begin.
    pub offer: Signal<In, Bit>,
    /// Sequence number of its request.
    pub number: Wire<In>,
    /// Where its words come from.
    pub offered_source: Wire<In>,
    /// It begins.
    pub begun: Signal<Out, Bit>,
    /// The source of the answer on its way.
    pub source: Wire<Out>,
    /// Its words are awaited.
    pub wanted: Signal<Out, Bit>,
    /// Which byte of the word, or of header or CRC.
    pub index: Wire<Out>,
    /// The byte.
    pub octet: Wire<In>,
    /// Its word stands.
    pub word_valid: Signal<In, Bit>,
    /// It is the last.
    pub word_last: Signal<In, Bit>,
    /// All of its bytes are out.
    pub taken: Signal<Out, Bit>,
    /// The second byte of two is not chosen yet, and the first one is out.
    pub halfway: Signal<Out, Bit>,
    /// The CRC begins.
    pub crc_restart: Signal<Out, Bit>,
    /// A byte for it, or its own lowest one.
    pub crc_octet: Wire<Out>,
    /// There is one.
    pub crc_load: Signal<Out, Bit>,
    /// The CRC's lowest byte.
    pub crc_low: Wire<In>,
    /// It works a byte in.
    pub crc_busy: Signal<In, Bit>,
    /// A byte of the packet.
    pub content: Wire<Out>,
    /// A border between packets in its place.
    pub border: Signal<Out, Bit>,
    /// It is offered.
    pub valid: Signal<Out, Bit>,
    /// It is taken.
    pub ready: Signal<In, Bit>,
    _lengths: [usize; 4],
    _state: State,
}

#[derive(Clone, Copy, Debug, Default)]
struct State {
    stage: u64,
    index: u64,
    source: usize,
    number: u64,
    octet: u64,
    offered: bool,
}

const IDLE: u64 = 0;
const OPEN: u64 = 1;
const HEADER: u64 = 2;
const WORDS: u64 = 3;
const SUM: u64 = 4;
const CLOSE: u64 = 5;

impl Packer {
    /// For payloads of these `lengths` in bytes, by source.
    pub fn new(lengths: [usize; 4]) -> Self {
        Packer {
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
            _lengths: lengths,
            _state: State::default(),
        }
    }

    /// Last index of the stage.
    fn at_end(&self) -> bool {
        let s = self._state;
        s.index == if s.stage == WORDS { 11 } else { 3 }
    }

    fn goes(&self) -> bool {
        self._state.offered && self.ready.val()
    }

    fn next(&self) -> State {
        let s = self._state;
        let mut next = s;
        if s.stage == IDLE {
            next.source = self.offered_source.val().number() as usize;
            next.number = self.number.val().number();
            next.stage = if self.offer.val() { OPEN } else { IDLE };
        }
        if !s.offered {
            let length = self._lengths[s.source] as u64;
            let header = [u64::from(ANSWER) + s.source as u64 + 1, s.number, length & 0xff, length >> 8];
            next.octet = match s.stage {
                HEADER => header[(s.index & 3) as usize],
                SUM => self.crc_low.val().number(),
                _ => self.octet.val().number(),
            };
            next.offered = match s.stage {
                IDLE => false,
                OPEN | CLOSE => true,
                WORDS => !self.crc_busy.val() && self.word_valid.val(),
                _ => !self.crc_busy.val(),
            };
        } else if self.ready.val() {
            next.offered = false;
            let border = s.stage == OPEN || s.stage == CLOSE;
            next.index = if border || self.at_end() { 0 } else { s.index + 1 };
            next.stage = match s.stage {
                CLOSE => IDLE,
                WORDS if self.at_end() && !self.word_last.val() => WORDS,
                stage if border || self.at_end() => stage + 1,
                stage => stage,
            };
        }
        if self.rst.val() {
            (next.stage, next.index, next.offered) = (IDLE, 0, false);
        }
        next
    }
}

impl Logic for Packer {
    fn update(&mut self) {
        if self.clk.pos_edge() {
            self._state = self.next();
        }
        let s = self._state;
        let border = s.stage == OPEN || s.stage == CLOSE;
        self.begun.next = s.stage == IDLE && self.offer.val();
        self.source.next = Word::from(s.source as u64);
        self.wanted.next = s.stage == WORDS;
        self.index.next = Word::from(s.index);
        self.taken.next = self.goes() && s.stage == WORDS && self.at_end();
        self.halfway.next = !s.offered && s.index & 1 == 1;
        self.crc_restart.next = s.stage == OPEN;
        self.crc_octet.next = Word::from(if s.stage == SUM { !s.octet & 0xff } else { s.octet });
        self.crc_load.next = self.goes() && !border;
        self.content.next = Word::from(s.octet);
        self.border.next = border;
        self.valid.next = s.offered;
    }

    fn connect(&mut self) {
        let bits = [
            &mut self.begun,
            &mut self.wanted,
            &mut self.taken,
            &mut self.halfway,
            &mut self.crc_restart,
            &mut self.crc_load,
            &mut self.border,
            &mut self.valid,
        ];
        bits.into_iter().for_each(Signal::connect);
        let wires = [&mut self.source, &mut self.index, &mut self.crc_octet, &mut self.content];
        wires.into_iter().for_each(Wire::connect);
    }

    fn hdl(&self) -> Verilog {
        let [identity, counters, resultants, forces] = self._lengths;
        Verilog::Custom(format!(
            "\
reg [2:0] stage;
reg [7:0] kept;
wire words = stage == 3'd{WORDS};
wire at_end = index == (words ? 4'd11 : 4'd3);
wire goes = valid && ready;
wire [15:0] length = source[1] ? (source[0] ? 16'd{forces} : 16'd{resultants})
  : (source[0] ? 16'd{counters} : 16'd{identity});
wire [7:0] header = index[1] ? (index[0] ? length[15:8] : length[7:0])
  : (index[0] ? kept : 8'd{first_kind} + {{6'd0, source}});
always @(*) begin
  begun = stage == 3'd{IDLE} && offer;
  wanted = words;
  halfway = !valid && index[0];
  border = stage == 3'd{OPEN} || stage == 3'd{CLOSE};
  crc_restart = stage == 3'd{OPEN};
  crc_octet = stage == 3'd{SUM} ? ~content : content;
end
// Apart from the others: what is `ready` follows from them.
always @(*) begin
  taken = goes && words && at_end;
  crc_load = goes && !border;
end
always @(posedge clk) begin
  // Whether there is an offer comes late.
  if (stage == 3'd{IDLE}) begin
    source <= offered_source;
    kept <= number;
  end
  if (!valid) content <= stage == 3'd{HEADER} ? header : stage == 3'd{SUM} ? crc_low : octet;
  if (rst) begin
    stage <= 3'd{IDLE};
    index <= 4'd0;
    valid <= 1'b0;
  end else begin
    valid <= valid ? !ready : border || (stage != 3'd{IDLE} && !crc_busy && (!words || word_valid));
    if (begun) stage <= 3'd{OPEN};
    if (goes) begin
      index <= border || at_end ? 4'd0 : index + 4'd1;
      if (stage == 3'd{CLOSE}) stage <= 3'd{IDLE};
      else if (border || (at_end && (!words || word_last))) stage <= stage + 3'd1;
    end
  end
end",
            first_kind = ANSWER + 1,
        ))
    }
}
