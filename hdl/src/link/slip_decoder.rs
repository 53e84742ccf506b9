//! SLIP decoder: from the bytes of the link to the bytes of packets.

use dermis_golden::link::slip::{unescape, END, ESC, ESC_END, ESC_ESC, ESC_IDLE, IDLE};
use rust_hdl::prelude::*;

use crate::wire::{Wire, Word};

/// The byte after an escape is decoded from its last two bits; `spoiled` reports bytes that must not follow an escape.
const _: () = assert!(matches!([ESC_END % 4, ESC_ESC % 4, ESC_IDLE % 4], [0, 1, 2..=3]));

/// Resolves SLIP escapes, with a latency of one cycle; IDLE bytes are skipped. A receiver resynchronises at the next
/// END.
#[derive(LogicBlock)]
pub struct SlipDecoder {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Synchronous reset, active high.
    pub rst: Signal<In, Bit>,
    /// A received byte; valid with `valid`.
    pub data: Wire<In>,
    /// A byte was received in this cycle.
    pub valid: Signal<In, Bit>,
    /// A byte was received with an error in this cycle.
    pub broken: Signal<In, Bit>,
    /// A byte of a packet; valid with `content_valid`.
    pub content: Wire<Out>,
    /// `content` holds a byte.
    pub content_valid: Signal<Out, Bit>,
    /// END was received: the packet is complete; high for one cycle.
    pub packet_end: Signal<Out, Bit>,
    /// A byte of the packet was lost; high for one cycle.
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
