//! Frame ingress: from the payload bytes of a frame's packet to the engine's input stream, while they arrive.

use dermis_golden::link::code_bytes;
use rust_hdl::prelude::*;

use super::super::primitives::count_bits;
use crate::wire::{Wire, Word};

/// Codes go to the engine as they arrive, except the last two, which are held until the packet has been checked. A good
/// packet releases them, with `tlast` on the last. A bad one ends with an early `tlast`, at which the engine drops the
/// frame. Two codes must be held: after all codes but one, any beat would complete the frame. A code that is already
/// offered when its packet turns out bad stays until it is accepted, as AXI-Stream requires; the early `tlast` follows
/// it.
///
/// The engine accepts no code while its buffer is full. A frame that loses a code because of that, or that starts while
/// the previous one is still held, is dropped too, and counts as an `overrun` if its packet is good.
#[derive(LogicBlock)]
pub struct Feeder {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Synchronous reset, active high.
    pub rst: Signal<In, Bit>,
    /// The header of a frame's packet is complete; high for one cycle.
    pub frame_begin: Signal<In, Bit>,
    /// `content` is a byte of the payload.
    pub payload: Signal<In, Bit>,
    /// A byte of the packet, 8 bits.
    pub content: Wire<In>,
    /// The frame's packet is complete and correct; high for one cycle.
    pub good: Signal<In, Bit>,
    /// The packet is damaged; high for one cycle.
    pub bad: Signal<In, Bit>,
    /// The engine gets the whole frame; with `good`.
    pub taken: Signal<Out, Bit>,
    /// The frame is dropped although its packet is good; with `good`.
    pub overrun: Signal<Out, Bit>,
    /// A taxel's code, two's complement; valid with `valid`.
    pub code: Wire<Out>,
    /// `code` is offered to the engine; held until `ready`.
    pub valid: Signal<Out, Bit>,
    /// The beat has `tlast`; valid with `valid`.
    pub last: Signal<Out, Bit>,
    /// The engine accepts the beat in this cycle.
    pub ready: Signal<In, Bit>,
    _taxels: usize,
    _bytes: usize,
    _state: State,
}

#[derive(Clone, Copy, Debug, Default)]
struct State {
    raw: u32,
    byte_index: usize,
    held: [u32; 2],
    fill: usize,
    delivered: usize,
    within_frame: bool,
    deaf: bool,
    lost: bool,
    released: bool,
    aborting: bool,
}

/// Codes that are held until the end of the packet.
const HELD: usize = 2;

impl Feeder {
    /// For frames of `taxels` codes of `bits` bits each.
    pub fn new(taxels: usize, bits: u32) -> Self {
        Feeder {
            clk: Default::default(),
            rst: Default::default(),
            frame_begin: Default::default(),
            payload: Default::default(),
            content: Wire::new(8),
            good: Default::default(),
            bad: Default::default(),
            taken: Default::default(),
            overrun: Default::default(),
            code: Wire::new(bits as usize),
            valid: Default::default(),
            last: Default::default(),
            ready: Default::default(),
            _taxels: taxels,
            _bytes: code_bytes(bits),
            _state: State::default(),
        }
    }

    fn lag(&self) -> usize {
        self._taxels.saturating_sub(HELD)
    }

    fn offers(&self) -> bool {
        let s = self._state;
        s.aborting || (s.fill > 0 && (s.released || s.delivered < self.lag()))
    }

    /// The offered beat is the early `tlast` of a dropped frame.
    fn ends_early(&self) -> bool {
        self._state.aborting && self._state.fill == 0
    }

    fn next(&self) -> State {
        let mut s = self._state;
        let old = s;
        let moves = self.offers() && self.ready.val();
        let waits = self.offers() && !self.ready.val();
        if moves && self.ends_early() {
            (s.aborting, s.delivered) = (false, 0);
        } else if moves {
            s.held[0] = old.held[1];
            s.fill -= 1;
            let last = old.delivered + 1 == self._taxels;
            s.delivered = if last { 0 } else { old.delivered + 1 };
            s.released &= !last;
        }
        if self.payload.val() && !old.deaf {
            s.raw = old.raw >> 8 | (self.content.val().number() as u32) << (8 * (self._bytes - 1));
            let complete = old.byte_index + 1 == self._bytes;
            s.byte_index = if complete { 0 } else { old.byte_index + 1 };
            if complete && s.fill == HELD {
                s.lost = true;
            } else if complete {
                s.held[s.fill] = s.raw;
                s.fill += 1;
            }
        }
        let drop = old.within_frame && !old.deaf && (self.bad.val() || (self.good.val() && old.lost));
        if drop {
            s.fill = usize::from(waits);
            s.aborting = waits || s.delivered > 0;
        } else if old.within_frame && !old.deaf && self.good.val() {
            s.released = true;
        }
        s.within_frame &= !(self.good.val() || self.bad.val());
        if self.frame_begin.val() {
            s.within_frame = true;
            s.deaf = old.fill > 0 || old.aborting;
            s.lost = false;
            s.byte_index = 0;
        }
        if self.rst.val() {
            s = State { raw: s.raw, held: s.held, ..State::default() };
        }
        s
    }
}

impl Logic for Feeder {
    fn update(&mut self) {
        if self.clk.pos_edge() {
            self._state = self.next();
        }
        let s = self._state;
        let refused = s.deaf || s.lost;
        self.taken.next = self.good.val() && s.within_frame && !refused;
        self.overrun.next = self.good.val() && s.within_frame && refused;
        self.code.next = Word::of_fields(&[i64::from(s.held[0])], self.code.width());
        self.valid.next = self.offers();
        self.last.next = self.ends_early() || s.delivered + 1 == self._taxels;
    }

    fn connect(&mut self) {
        for bit in [&mut self.taken, &mut self.overrun, &mut self.valid, &mut self.last] {
            bit.connect();
        }
        self.code.connect();
    }

    fn hdl(&self) -> Verilog {
        let (bits, bytes) = (self.code.width(), self._bytes);
        let (b, d) = (count_bits(bytes), count_bits(self._taxels));
        // Holds the bytes of a code before its last.
        let (assembled, wait) = match bytes {
            1 => ("content".to_string(), String::new()),
            _ => ("{content, raw}".to_string(), format!("reg [{}:0] raw;\n", 8 * bytes - 9)),
        };
        let shift = match bytes {
            1 => String::new(),
            2 => "    raw <= content;\n".to_string(),
            _ => format!("    raw <= {{content, raw[{}:8]}};\n", 8 * bytes - 9),
        };
        let above = if 8 * bytes > bits { "wire unused = &{1'b0, whole};\n" } else { "" };
        Verilog::Custom(format!(
            "\
{wait}wire [{whole_end}:0] whole = {assembled};
{above}wire [{c_end}:0] arrived = whole[{c_end}:0];
reg [{b_end}:0] byte_index;
reg [{c_end}:0] second;
reg [1:0] fill;
reg [{d_end}:0] delivered;
reg within_frame, deaf, lost, released, aborting;
// Codes that may leave before the end of the packet are left.
reg ahead;
wire refused = deaf || lost;
wire at_last = delivered == {d}'d{end};
wire early = aborting && fill == 2'd0;
always @(*) begin
  taken = good && within_frame && !refused;
  overrun = good && within_frame && refused;
  valid = aborting || (fill != 2'd0 && (released || ahead));
  last = early || at_last;
end
wire moves = valid && ready && !early;
wire waits = valid && !ready;
wire complete = payload && !deaf && byte_index == {b}'d{last_byte};
wire [1:0] left = fill - {{1'b0, moves}};
wire push = complete && left != 2'd{HELD};
wire drop = within_frame && !deaf && (bad || (good && lost));
wire [{d_end}:0] after = moves ? (at_last ? {d}'d0 : delivered + {d}'d1) : delivered;
always @(posedge clk) begin
  if (payload && !deaf) begin
{shift}    byte_index <= complete ? {b}'d0 : byte_index + {b}'d1;
  end
  if (push && left == 2'd0) code <= arrived;
  else if (moves) code <= second;
  if (push && left != 2'd0) second <= arrived;
  fill <= drop ? {{1'b0, waits}} : push ? left + 2'd1 : left;
  delivered <= early && ready ? {d}'d0 : after;
  if (early && ready) ahead <= {ahead};
  else if (moves) ahead <= at_last ? {ahead} : ahead && delivered != {d}'d{last_ahead};
  if (taken) released <= 1'b1;
  else if (moves && at_last) released <= 1'b0;
  if (drop) aborting <= waits || (moves ? !at_last : delivered != {d}'d0);
  else if (early && ready) aborting <= 1'b0;
  if (complete && left == 2'd{HELD}) lost <= 1'b1;
  if (good || bad) within_frame <= 1'b0;
  if (frame_begin) begin
    within_frame <= 1'b1;
    deaf <= fill != 2'd0 || aborting;
    lost <= 1'b0;
    byte_index <= {b}'d0;
  end
  if (rst) begin
    byte_index <= {b}'d0;
    fill <= 2'd0;
    delivered <= {d}'d0;
    ahead <= {ahead};
    within_frame <= 1'b0;
    deaf <= 1'b0;
    lost <= 1'b0;
    released <= 1'b0;
    aborting <= 1'b0;
  end
end",
            c_end = bits - 1,
            whole_end = 8 * bytes - 1,
            b_end = b - 1,
            d_end = d - 1,
            end = self._taxels - 1,
            ahead = format_args!("1'b{}", u8::from(self.lag() > 0)),
            last_ahead = self.lag().saturating_sub(1),
            last_byte = bytes - 1,
        ))
    }
}
