//! From the bytes of packets to the bytes of the wire.

use dermis_golden::link::slip::{escape, END, ESC, ESC_END, ESC_ESC, ESC_IDLE, IDLE};
use rust_hdl::prelude::*;

use crate::wire::{Wire, Word};

/// Escapes what SLIP needs escaped; an END goes out as it is where `border` says that it stands between packets.
#[derive(LogicBlock)]
pub struct SlipEncoder {
    /// Clock.
    pub clk: Signal<In, Clock>,
    /// Reset.
    pub rst: Signal<In, Bit>,
    /// A byte of a packet.
    pub content: Wire<In>,
    /// An END between packets in its place.
    pub border: Signal<In, Bit>,
    /// It is offered.
    pub content_valid: Signal<In, Bit>,
    /// It is taken.
    pub content_ready: Signal<Out, Bit>,
    /// A byte for the wire.
    pub data: Wire<Out>,
    /// It is offered.
    pub valid: Signal<Out, Bit>,
    /// It is taken.
    pub ready: Signal<In, Bit>,
    _second: bool,
}

impl Default for SlipEncoder {
    fn default() -> Self {
        SlipEncoder {
            clk: Default::default(),
            rst: Default::default(),
            content: Wire::new(8),
            border: Default::default(),
            content_valid: Default::default(),
            content_ready: Default::default(),
            data: Wire::new(8),
            valid: Default::default(),
            ready: Default::default(),
            _second: false,
        }
    }
}

impl Logic for SlipEncoder {
    fn update(&mut self) {
        let content = self.content.val().number() as u8;
        let after = escape(content).filter(|_| !self.border.val());
        let special = after.is_some();
        if self.clk.pos_edge() {
            if self.rst.val() {
                self._second = false;
            } else if self.content_valid.val() && self.ready.val() {
                self._second = special && !self._second;
            }
        }
        let data = match after {
            _ if self.border.val() => END,
            Some(after) if self._second => after,
            Some(_) => ESC,
            None => content,
        };
        self.data.next = Word::from(u64::from(data));
        self.valid.next = self.content_valid.val();
        self.content_ready.next = self.ready.val() && (!special || self._second);
    }

    fn connect(&mut self) {
        self.content_ready.connect();
        self.data.connect();
        self.valid.connect();
    }

    fn hdl(&self) -> Verilog {
        Verilog::Custom(format!(
            "\
reg second;
wire is_end = content == 8'd{END};
wire is_escape = content == 8'd{ESC};
wire special = !border && (is_end || is_escape || content == 8'd{IDLE});
always @(*) begin
  data = border ? 8'd{END} : !special ? content : !second ? 8'd{ESC}
    : is_end ? 8'd{ESC_END} : is_escape ? 8'd{ESC_ESC} : 8'd{ESC_IDLE};
  valid = content_valid;
  content_ready = ready && (!special || second);
end
always @(posedge clk) begin
  if (rst) second <= 1'b0;
  else if (content_valid && ready) second <= special && !second;
end"
        ))
    }
}
