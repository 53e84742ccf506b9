//! SLIP encoder: from the bytes of packets to the bytes of the link.

use dermis_golden::link::slip::{escape, END, ESC, ESC_END, ESC_ESC, ESC_IDLE, IDLE};
use rust_hdl::prelude::*;

use crate::wire::{Wire, Word};

/// Escapes bytes as SLIP requires; with `border`, an END between packets is sent unescaped.
///
/// With many lanes the block has two extra registers, because the link's pins may be far from the packer: whether a
/// byte is escaped is known one cycle after the byte, and `content_ready` comes one cycle after the link accepted it.
#[derive(LogicBlock)]
pub struct SlipEncoder {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Synchronous reset, active high.
    pub rst: Signal<In, Bit>,
    /// A byte of a packet; valid with `content_valid`.
    pub content: Wire<In>,
    /// Send an END in place of `content`; valid with `content_valid`.
    pub border: Signal<In, Bit>,
    /// A byte or an END is offered; held until `content_ready`.
    pub content_valid: Signal<In, Bit>,
    /// The byte is accepted; with registers, one cycle after the link took its last part.
    pub content_ready: Signal<Out, Bit>,
    /// A byte for the link; valid with `valid`.
    pub data: Wire<Out>,
    /// `data` is offered; held until `ready`.
    pub valid: Signal<Out, Bit>,
    /// The link accepts the byte in this cycle.
    pub ready: Signal<In, Bit>,
    _registered: bool,
    _second: bool,
    _seen: bool,
    _gone: bool,
}

impl SlipEncoder {
    /// With the two extra registers if `registered`.
    pub fn new(registered: bool) -> Self {
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
            _registered: registered,
            _second: false,
            _seen: false,
            _gone: false,
        }
    }

    /// A byte is offered, and it is known whether it has to be escaped.
    fn stands(&self) -> bool {
        match self._registered {
            true => self._seen,
            false => self.content_valid.val(),
        }
    }

    /// The link accepts a byte.
    fn goes(&self) -> bool {
        self.stands() && self.ready.val()
    }

    /// The link accepts the last byte of `content`: the only one, or the second of an escape.
    fn takes(&self, special: bool) -> bool {
        self.goes() && (!special || self._second)
    }
}

impl Logic for SlipEncoder {
    fn update(&mut self) {
        let content = self.content.val().number() as u8;
        let after = escape(content).filter(|_| !self.border.val());
        let special = after.is_some();
        if self.clk.pos_edge() {
            let taken = self.takes(special);
            self._second = !self.rst.val() && (self._second ^ (self.goes() && special));
            self._seen = !self.rst.val() && self.content_valid.val() && !taken && !self._gone;
            self._gone = !self.rst.val() && taken;
        }
        let data = match after {
            _ if self.border.val() => END,
            Some(after) if self._second => after,
            Some(_) => ESC,
            None => content,
        };
        self.data.next = Word::from(u64::from(data));
        self.valid.next = self.stands();
        self.content_ready.next = match self._registered {
            true => self._gone,
            false => self.takes(special),
        };
    }

    fn connect(&mut self) {
        self.content_ready.connect();
        self.data.connect();
        self.valid.connect();
    }

    fn hdl(&self) -> Verilog {
        let (known, told) = match self._registered {
            false => ("wire stands = content_valid;\nwire special = found;\n", "always @(*) content_ready = taken;\n"),
            true => (
                "reg stands, special;\n",
                "always @(posedge clk) begin\n  special <= found;\n  \
                 stands <= !rst && content_valid && !taken && !content_ready;\n  content_ready <= !rst && taken;\nend\n",
            ),
        };
        Verilog::Custom(format!(
            "\
reg second;
wire is_end = content == 8'd{END};
wire is_escape = content == 8'd{ESC};
wire found = !border && (is_end || is_escape || content == 8'd{IDLE});
{known}wire taken = stands && ready && (!special || second);
{told}always @(*) begin
  data = border ? 8'd{END} : !special ? content : !second ? 8'd{ESC}
    : is_end ? 8'd{ESC_END} : is_escape ? 8'd{ESC_ESC} : 8'd{ESC_IDLE};
  valid = stands;
end
always @(posedge clk) begin
  if (rst) second <= 1'b0;
  else if (stands && ready) second <= special && !second;
end"
        ))
    }
}
