//! From the words of an answer to the bytes of its packet.

use dermis_golden::link::ANSWER;
use rust_hdl::prelude::*;

use crate::wire::{Wire, Word};

/// Sends SLIP END, header, words of twelve bytes up to the last, CRC, SLIP END.
///
/// An answer starts when one is offered and none is being sent; its source and number are stored. The sources select
/// each byte themselves, so that no word register is needed here: `index` is the byte of the word that is needed, and
/// `taken` says that the word has been sent. An offered byte stays until it is accepted; the next one waits until the
/// CRC has processed it.
#[derive(LogicBlock)]
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
    /// Source of the answer being sent.
    pub source: Wire<Out>,
    /// Words of the payload are needed.
    pub wanted: Signal<Out, Bit>,
    /// Byte of the word, of the header or of the CRC that is next.
    pub index: Wire<Out>,
    /// That byte of the word, from its source.
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
    /// Lowest byte of the CRC.
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
    /// `lengths` are the bytes of the payload, by source.
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

    /// `index` is the last of the stage.
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
// In a block of their own: `ready` depends on the outputs above.
always @(*) begin
  taken = goes && words && at_end;
  crc_load = goes && !border;
end
always @(posedge clk) begin
  // Stored every cycle while idle: `offer` settles late.
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
