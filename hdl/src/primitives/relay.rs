//! Register slice of a stream.

use rust_hdl::prelude::*;

use super::pass_through::pass_through;
use crate::wire::{Wire, Word};

/// ```text
/// s_axis --> register --> m_axis
/// ```
/// Data and handshake pass through registers in both directions, which lets sender and receiver be placed far apart, at
/// the cost of one beat every two cycles. If not wanted, the stream passes through on wires.
#[derive(LogicBlock)]
pub struct Relay {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Synchronous reset, active high.
    pub rst: Signal<In, Bit>,
    /// Data of the beat; valid with `s_axis_tvalid`.
    pub s_axis_tdata: Wire<In>,
    /// A beat is offered on `s_axis_tdata`; the sender holds it until `s_axis_tready`.
    pub s_axis_tvalid: Signal<In, Bit>,
    /// The block accepts a beat in this cycle.
    pub s_axis_tready: Signal<Out, Bit>,
    /// The beat is the last of its frame; valid with `s_axis_tvalid`.
    pub s_axis_tlast: Signal<In, Bit>,
    /// Data of the beat; valid with `m_axis_tvalid`.
    pub m_axis_tdata: Wire<Out>,
    /// A beat is offered on `m_axis_tdata`; it is held until `m_axis_tready`.
    pub m_axis_tvalid: Signal<Out, Bit>,
    /// The receiver accepts a beat in this cycle.
    pub m_axis_tready: Signal<In, Bit>,
    /// The beat is the last of its frame; valid with `m_axis_tvalid`.
    pub m_axis_tlast: Signal<Out, Bit>,
    _wanted: bool,
    _stands: bool,
    _beat: (Word, bool),
}

impl Relay {
    /// For beats of `bits` bits; a register if `wanted`, otherwise wires.
    pub fn new(bits: usize, wanted: bool) -> Self {
        Relay {
            clk: Default::default(),
            rst: Default::default(),
            s_axis_tdata: Wire::new(bits),
            s_axis_tvalid: Default::default(),
            s_axis_tready: Default::default(),
            s_axis_tlast: Default::default(),
            m_axis_tdata: Wire::new(bits),
            m_axis_tvalid: Default::default(),
            m_axis_tready: Default::default(),
            m_axis_tlast: Default::default(),
            _wanted: wanted,
            _stands: false,
            _beat: Default::default(),
        }
    }
}

impl Logic for Relay {
    fn update(&mut self) {
        let offered = (self.s_axis_tdata.val(), self.s_axis_tlast.val());
        if self.clk.pos_edge() {
            if !self._stands {
                self._beat = offered;
            }
            let stands = if self._stands { !self.m_axis_tready.val() } else { self.s_axis_tvalid.val() };
            self._stands = stands && !self.rst.val();
        }
        let (valid, ready, (data, last)) = match self._wanted {
            true => (self._stands, !self._stands, self._beat),
            false => (self.s_axis_tvalid.val(), self.m_axis_tready.val(), offered),
        };
        self.m_axis_tvalid.next = valid;
        self.s_axis_tready.next = ready;
        self.m_axis_tdata.next = data;
        self.m_axis_tlast.next = last;
    }

    fn connect(&mut self) {
        self.s_axis_tready.connect();
        self.m_axis_tdata.connect();
        self.m_axis_tvalid.connect();
        self.m_axis_tlast.connect();
    }

    fn hdl(&self) -> Verilog {
        if !self._wanted {
            return pass_through("No register slice: sender and receiver are placed close together.");
        }
        Verilog::Custom(
            "\
always @(*) s_axis_tready = !m_axis_tvalid;
always @(posedge clk) begin
  if (!m_axis_tvalid) {m_axis_tlast, m_axis_tdata} <= {s_axis_tlast, s_axis_tdata};
  m_axis_tvalid <= !rst && (m_axis_tvalid ? !m_axis_tready : s_axis_tvalid);
end"
            .to_string(),
        )
    }
}
