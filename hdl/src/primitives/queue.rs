//! Beats on their way out wait here for the receiver, so that what makes them never waits.

use std::collections::VecDeque;

use rust_hdl::prelude::*;

use crate::wire::{Wire, Word};

/// ```text
/// reserve ... later write, word --> queue --> m_axis, two cycles after write
/// room <-- places that are neither reserved nor taken
/// ```
/// Each `reserve`, only where there is `room`, is followed by one `write` at any later time, in order. A place is free
/// again a cycle after its beat was taken.
#[derive(LogicBlock)]
pub struct Queue {
    /// Clock.
    pub clk: Signal<In, Clock>,
    /// Reset.
    pub rst: Signal<In, Bit>,
    /// A beat will come.
    pub reserve: Signal<In, Bit>,
    /// Another may be reserved.
    pub room: Signal<Out, Bit>,
    /// A beat that was reserved.
    pub write: Signal<In, Bit>,
    /// It is the frame's last.
    pub last: Signal<In, Bit>,
    /// Its data.
    pub word: Wire<In>,
    /// A beat stands on the output.
    pub m_axis_tvalid: Signal<Out, Bit>,
    /// The receiver takes it.
    pub m_axis_tready: Signal<In, Bit>,
    /// It is the frame's last.
    pub m_axis_tlast: Signal<Out, Bit>,
    /// Its data.
    pub m_axis_tdata: Wire<Out>,
    _reserved: usize,
    _waiting: VecDeque<(Word, bool)>,
    _standing: bool,
}

const PLACE_BITS: usize = 4;
/// Places; a cell of distributed RAM has so many.
pub const PLACES: usize = 1 << PLACE_BITS;
/// From `write` to the output, in cycles.
pub const LATENCY: usize = 2;

impl Queue {
    /// Beats of `bits` bits.
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
