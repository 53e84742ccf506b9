//! Output queue, in which beats wait for the receiver, so that the pipeline before it never stalls.

use std::collections::VecDeque;

use rust_hdl::prelude::*;

use crate::wire::{Wire, Word};

/// ```text
/// reserve ... later write, word --> queue --> m_axis, two cycles after write
/// room <-- places that are neither reserved nor occupied
/// ```
/// `reserve` is allowed only with `room`; each is followed by one `write` at any later time, in order. A place is free
/// again one cycle after its beat was accepted.
#[derive(LogicBlock)]
pub struct Queue {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Synchronous reset, active high.
    pub rst: Signal<In, Bit>,
    /// Reserves a place for a beat to be written later; only with `room`.
    pub reserve: Signal<In, Bit>,
    /// A place can be reserved in this cycle.
    pub room: Signal<Out, Bit>,
    /// Writes a reserved beat in this cycle.
    pub write: Signal<In, Bit>,
    /// The beat is the last of its frame; valid with `write`.
    pub last: Signal<In, Bit>,
    /// Data of the beat; valid with `write`.
    pub word: Wire<In>,
    /// A beat is offered on `m_axis_tdata`; it is held until `m_axis_tready`.
    pub m_axis_tvalid: Signal<Out, Bit>,
    /// The receiver accepts a beat in this cycle.
    pub m_axis_tready: Signal<In, Bit>,
    /// The beat is the last of its frame; valid with `m_axis_tvalid`.
    pub m_axis_tlast: Signal<Out, Bit>,
    /// Data of the beat; valid with `m_axis_tvalid`.
    pub m_axis_tdata: Wire<Out>,
    _reserved: usize,
    _waiting: VecDeque<(Word, bool)>,
    _standing: bool,
}

const PLACE_BITS: usize = 4;
/// Places in the queue: the depth of one distributed RAM cell.
pub const PLACES: usize = 1 << PLACE_BITS;
/// Cycles from `write` to `m_axis_tvalid`, if the queue is empty.
pub const LATENCY: usize = 2;

impl Queue {
    /// A queue of beats of `bits` bits.
    pub fn new(bits: usize) -> Self {
        Queue {
            clk: Default::default(),
            rst: Default::default(),
            reserve: Default::default(),
            room: Default::default(),
            write: Default::default(),
            last: Default::default(),
            word: Wire::new(bits),
            m_axis_tvalid: Default::default(),
            m_axis_tready: Default::default(),
            m_axis_tlast: Default::default(),
            m_axis_tdata: Wire::new(bits),
            _reserved: 0,
            _waiting: VecDeque::new(),
            _standing: false,
        }
    }
}

impl Logic for Queue {
    fn update(&mut self) {
        if self.clk.pos_edge() {
            let taken = self._standing && self.m_axis_tready.val();
            self._reserved = (self._reserved + usize::from(self.reserve.val())).saturating_sub(usize::from(taken));
            if !self._standing || taken {
                let leaves = self._waiting.pop_front();
                self._standing = leaves.is_some();
                if let Some((word, last)) = leaves {
                    self.m_axis_tdata.next = word;
                    self.m_axis_tlast.next = last;
                }
            }
            if self.write.val() {
                self._waiting.push_back((self.word.val(), self.last.val()));
            }
            if self.rst.val() {
                self._reserved = 0;
                self._waiting.clear();
                self._standing = false;
            }
            self.room.next = self._reserved < PLACES;
            self.m_axis_tvalid.next = self._standing;
        }
    }

    fn connect(&mut self) {
        self.room.connect();
        self.m_axis_tvalid.connect();
        self.m_axis_tlast.connect();
        self.m_axis_tdata.connect();
    }

    fn hdl(&self) -> Verilog {
        Verilog::Custom(format!(
            "\
reg [{bits}:0] places [0:{last}];
reg [{count_end}:0] written, read, reserved;
wire taken = m_axis_tvalid && m_axis_tready;
wire moves = !m_axis_tvalid || m_axis_tready;
wire waits = written != read;
wire [{count_end}:0] now_reserved = reserved + {{{place_bits}'d0, reserve}} - {{{place_bits}'d0, taken}};
always @(posedge clk) begin
  if (write) places[written[{place_end}:0]] <= {{last, word}};
  if (moves && waits) {{m_axis_tlast, m_axis_tdata}} <= places[read[{place_end}:0]];
  if (rst) begin
    written <= {count_bits}'d0;
    read <= {count_bits}'d0;
    reserved <= {count_bits}'d0;
    room <= 1'b1;
    m_axis_tvalid <= 1'b0;
  end else begin
    if (write) written <= written + {count_bits}'d1;
    if (moves && waits) read <= read + {count_bits}'d1;
    reserved <= now_reserved;
    room <= now_reserved != {count_bits}'d{PLACES};
    if (moves) m_axis_tvalid <= waits;
  end
end",
            bits = self.word.width(),
            last = PLACES - 1,
            place_bits = PLACE_BITS,
            place_end = PLACE_BITS - 1,
            count_bits = PLACE_BITS + 1,
            count_end = PLACE_BITS,
        ))
    }
}
