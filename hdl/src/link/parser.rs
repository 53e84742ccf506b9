//! From the bytes of packets to requests: checks header, length and CRC.

use dermis_golden::link::{code_bytes, Kind, OVERHEAD};
use rust_hdl::prelude::*;

use super::Shape;
use crate::primitives::count_bits;
use crate::wire::{Wire, Word};

/// Checks each packet at its end: `good` or `bad` is high for one cycle, one cycle after `packet_end`; `kind` and
/// `number` are valid until the header of the next packet. Two ENDs in a row enclose no packet.
///
/// The payload of a frame is passed on while it arrives: `frame_begin` when its header is complete and correct, then
/// `payload` with each byte, in the same cycle.
#[derive(LogicBlock)]
pub struct Parser {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Synchronous reset, active high.
    pub rst: Signal<In, Bit>,
    /// A byte of a packet; valid with `content_valid`.
    pub content: Wire<In>,
    /// `content` holds a byte.
    pub content_valid: Signal<In, Bit>,
    /// END was received: the packet is complete.
    pub packet_end: Signal<In, Bit>,
    /// A byte of the packet was lost.
    pub spoiled: Signal<In, Bit>,
    /// The packet's bytes so far end with their correct CRC.
    pub crc_right: Signal<In, Bit>,
    /// The header of a frame with the right length is complete.
    pub frame_begin: Signal<Out, Bit>,
    /// `content` is a byte of the payload of a frame.
    pub payload: Signal<Out, Bit>,
    /// The packet is correct.
    pub good: Signal<Out, Bit>,
    /// The packet is dropped.
    pub bad: Signal<Out, Bit>,
    /// Cause, one bit each: framing, CRC, unknown type, length; valid with `bad`.
    pub fault: Wire<Out>,
    /// The packet's type; valid with `good`.
    pub kind: Wire<Out>,
    /// The packet's sequence number; valid with `good`.
    pub number: Wire<Out>,
    _frame_bytes: u32,
    _frame_kinds: Vec<u8>,
    _state: State,
}

#[derive(Clone, Copy, Debug)]
struct State {
    count: u32,
    kind: u8,
    number: u8,
    length: u32,
    spoiled: bool,
    streaming: bool,
    good: bool,
    fault: u32,
}

const PLAIN_KINDS: [u8; 2] = [Kind::Identify as u8, Kind::ReadCounters as u8];

impl Parser {
    /// For the frames of `shape`, whose payload has at most 65535 bytes.
    pub fn new(shape: &Shape) -> Self {
        let resultants = shape.resultants.then_some(Kind::FrameForResultants as u8);
        let blank =
            State { count: 0, kind: 0, number: 0, length: 0, spoiled: false, streaming: false, good: false, fault: 0 };
        Parser {
            clk: Default::default(),
            rst: Default::default(),
            content: Wire::new(8),
            content_valid: Default::default(),
            packet_end: Default::default(),
            spoiled: Default::default(),
            crc_right: Default::default(),
            frame_begin: Default::default(),
            payload: Default::default(),
            good: Default::default(),
            bad: Default::default(),
            fault: Wire::new(4),
            kind: Wire::new(8),
            number: Wire::new(8),
            _frame_bytes: (shape.rows * shape.cols * code_bytes(shape.input_bits)) as u32,
            _frame_kinds: resultants.into_iter().chain([Kind::FrameForForces as u8]).collect(),
            _state: blank,
        }
    }

    /// Limit of the byte count: one more than a frame's packet has.
    fn most(&self) -> u32 {
        self._frame_bytes + OVERHEAD as u32 + 1
    }

    /// Index of the first byte after a frame's payload.
    fn payload_end(&self) -> u32 {
        self._frame_bytes + 4
    }

    /// Whether the packet is correct, otherwise the bits of `fault`; `(false, 0)` if there is no packet.
    fn judge(&self) -> (bool, u32) {
        let s = self._state;
        let frame = self._frame_kinds.contains(&s.kind);
        if s.spoiled {
            (false, 0b0001)
        } else if s.count == 0 {
            (false, 0)
        } else if s.count < OVERHEAD as u32 || !self.crc_right.val() {
            (false, 0b0010)
        } else if !frame && !PLAIN_KINDS.contains(&s.kind) {
            (false, 0b0100)
        } else if s.count != s.length + OVERHEAD as u32 || s.length != if frame { self._frame_bytes } else { 0 } {
            (false, 0b1000)
        } else {
            (true, 0)
        }
    }

    /// The byte of this cycle completes the header of a frame.
    fn begins(&self) -> bool {
        let s = self._state;
        let length = s.length | (self.content.val().number() as u32) << 8;
        let whole = self.content_valid.val() && s.count == 3;
        whole && self._frame_kinds.contains(&s.kind) && length == self._frame_bytes
    }

    fn next(&self) -> State {
        let mut s = State { good: false, fault: 0, ..self._state };
        let data = self.content.val().number() as u8;
        s.spoiled |= self.spoiled.val();
        if self.packet_end.val() {
            (s.good, s.fault) = self.judge();
            (s.count, s.spoiled, s.streaming) = (0, false, false);
        } else if self.content_valid.val() {
            match s.count {
                0 => s.kind = data,
                1 => s.number = data,
                2 => s.length = u32::from(data),
                3 => s.length |= u32::from(data) << 8,
                _ => (),
            }
            s.streaming = s.streaming && s.count + 1 != self.payload_end() || self.begins();
            s.count = (s.count + 1).min(self.most());
        }
        if self.rst.val() {
            (s.count, s.spoiled, s.streaming, s.good, s.fault) = (0, false, false, false, 0);
        }
        s
    }
}

impl Logic for Parser {
    fn update(&mut self) {
        if self.clk.pos_edge() {
            self._state = self.next();
        }
        let s = &self._state;
        self.frame_begin.next = self.begins();
        self.payload.next = self.content_valid.val() && s.streaming;
        self.good.next = s.good;
        self.bad.next = s.fault != 0;
        self.fault.next = Word::from(u64::from(s.fault));
        self.kind.next = Word::from(u64::from(s.kind));
        self.number.next = Word::from(u64::from(s.number));
    }

    fn connect(&mut self) {
        for bit in [&mut self.frame_begin, &mut self.payload, &mut self.good, &mut self.bad] {
            bit.connect();
        }
        for wire in [&mut self.fault, &mut self.kind, &mut self.number] {
            wire.connect();
        }
    }

    fn hdl(&self) -> Verilog {
        let c = count_bits(self.most() as usize + 1);
        let frames: Vec<String> = self._frame_kinds.iter().map(|kind| format!("kind == 8'd{kind}")).collect();
        let [plain_0, plain_1] = PLAIN_KINDS;
        Verilog::Custom(format!(
            "\
reg [{c_end}:0] count;
// The length bytes so far match a frame's length, or zero.
reg frame_length, no_length;
reg lost, streaming;
wire frame = {frame};
wire plain = kind == 8'd{plain_0} || kind == 8'd{plain_1};
wire wrong_crc = count < {c}'d{OVERHEAD} || !crc_right;
wire wrong_length = frame ? count != {c}'d{frame_end} || !frame_length : count != {c}'d{OVERHEAD} || !no_length;
wire empty = count == {c}'d0 && !lost;
always @(*) begin
  frame_begin = content_valid && count == {c}'d3 && frame && frame_length && content == 8'd{high};
  payload = content_valid && streaming;
  bad = fault != 4'd0;
end
always @(posedge clk) begin
  good <= !rst && packet_end && !empty && !lost && !wrong_crc && (frame || plain) && !wrong_length;
  fault <= rst || !packet_end || empty ? 4'd0 : lost ? 4'd1 : wrong_crc ? 4'd2 : !frame && !plain ? 4'd4
    : wrong_length ? 4'd8 : 4'd0;
  if (rst || packet_end) begin
    count <= {c}'d0;
    lost <= 1'b0;
    streaming <= 1'b0;
  end else begin
    if (spoiled) lost <= 1'b1;
    if (content_valid) begin
      if (count == {c}'d0) kind <= content;
      if (count == {c}'d1) number <= content;
      if (count == {c}'d2 || count == {c}'d3) begin
        frame_length <= count[0] ? frame_length && content == 8'd{high} : content == 8'd{low};
        no_length <= (no_length || !count[0]) && content == 8'd0;
      end
      if (frame_begin) streaming <= 1'b1;
      else if (count == {c}'d{payload_last}) streaming <= 1'b0;
      if (count != {c}'d{most}) count <= count + {c}'d1;
    end
  end
end",
            c_end = c - 1,
            frame = frames.join(" || "),
            frame_end = self._frame_bytes + OVERHEAD as u32,
            most = self.most(),
            high = self._frame_bytes >> 8,
            low = self._frame_bytes & 0xff,
            payload_last = self.payload_end() - 1,
        ))
    }
}
