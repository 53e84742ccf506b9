//! From the bytes of the wire to the bytes of packets.

use dermis_golden::link::slip::{unescape, END, ESC, ESC_END, ESC_ESC, ESC_IDLE, IDLE};
use rust_hdl::prelude::*;

use crate::wire::{Wire, Word};

/// What follows an escape is told apart by its last two bits; whether it may follow one at all, by `spoiled`.
const _: () = assert!(matches!([ESC_END % 4, ESC_ESC % 4, ESC_IDLE % 4], [0, 1, 2..=3]));

/// Undoes SLIP's escapes, a cycle later; IDLE is as if nothing had come.
#[derive(LogicBlock)]
pub struct SlipDecoder {
    /// Clock.
    pub clk: Signal<In, Clock>,
    /// Reset.
    pub rst: Signal<In, Bit>,
    /// A byte from the wire.
    pub data: Wire<In>,
    /// It came in this cycle.
    pub valid: Signal<In, Bit>,
    /// A byte came that cannot be read.
    pub broken: Signal<In, Bit>,
    /// A byte of a packet.
    pub content: Wire<Out>,
    /// It came in this cycle.
    pub content_valid: Signal<Out, Bit>,
    /// The packet is over.
    pub packet_end: Signal<Out, Bit>,
    /// The packet has lost a byte.
    pub spoiled: Signal<Out, Bit>,
    _escaped: bool,
}

impl Default for SlipDecoder {
    fn default() -> Self {
        SlipDecoder {
            clk: Default::default(),
            rst: Default::default(),
            data: Wire::new(8),
            valid: Default::default(),
            broken: Default::default(),
            content: Wire::new(8),
            content_valid: Default::default(),
            packet_end: Default::default(),
            spoiled: Default::default(),
            _escaped: false,
        }
    }
}

impl SlipDecoder {
    fn clocked(&mut self) {
        let (data, run) = (self.data.val().number() as u8, !self.rst.val());
        let (end, idle) = (data == END, data == IDLE);
        let stands_for = unescape(data);
        let unread = self._escaped && stands_for.is_none() && !end && !idle;
        let content = if self._escaped { stands_for } else { Some(data).filter(|&data| data != ESC) };
        let shown = match data % 4 {
            _ if !self._escaped => data,
            0 => END,
            1 => ESC,
            _ => IDLE,
        };
        self.content.next = Word::from(u64::from(shown));
        self.content_valid.next = run && self.valid.val() && !end && !idle && content.is_some();
        self.packet_end.next = run && self.valid.val() && end;
        self.spoiled.next = run && (self.broken.val() || (self.valid.val() && unread));
        if !run {
            self._escaped = false;
        } else if self.valid.val() && !idle {
            self._escaped = data == ESC && !self._escaped;
        }
    }
}

impl Logic for SlipDecoder {
    fn update(&mut self) {
        if self.clk.pos_edge() {
            self.clocked();
        }
    }

    fn connect(&mut self) {
        self.content.connect();
        self.content_valid.connect();
        self.packet_end.connect();
        self.spoiled.connect();
    }

    fn hdl(&self) -> Verilog {
        Verilog::Custom(format!(
            "\
reg escaped;
wire is_end = data == 8'd{END};
wire is_escape = data == 8'd{ESC};
wire is_idle = data == 8'd{IDLE};
wire stands = data == 8'd{ESC_END} || data == 8'd{ESC_ESC} || data == 8'd{ESC_IDLE};
always @(posedge clk) begin
  content <= !escaped ? data : data[1] ? 8'd{IDLE} : data[0] ? 8'd{ESC} : 8'd{END};
  content_valid <= !rst && valid && !is_end && !is_idle && (escaped ? stands : !is_escape);
  packet_end <= !rst && valid && is_end;
  spoiled <= !rst && (broken || (valid && escaped && !stands && !is_end && !is_idle));
  if (rst) escaped <= 1'b0;
  else if (valid && !is_idle) escaped <= is_escape && !escaped;
end"
        ))
    }
}
