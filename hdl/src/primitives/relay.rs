//! A register on a stream's way.

use rust_hdl::prelude::*;

use super::pass_through::pass_through;
use crate::wire::{Wire, Word};

/// ```text
/// s_axis --> register --> m_axis
/// ```
/// All that goes from one side to the other goes through a register, so that the sides may lie far apart: a beat every two
/// cycles. Where that is not wanted, wires.
#[derive(LogicBlock)]
pub struct Relay {
    /// Clock.
    pub clk: Signal<In, Clock>,
    /// Reset.
    pub rst: Signal<In, Bit>,
    /// Data.
    pub s_axis_tdata: Wire<In>,
    /// It is offered.
    pub s_axis_tvalid: Signal<In, Bit>,
    /// It is taken.
    pub s_axis_tready: Signal<Out, Bit>,
    /// It is the frame's last.
    pub s_axis_tlast: Signal<In, Bit>,
    /// Data.
    pub m_axis_tdata: Wire<Out>,
    /// It is offered.
    pub m_axis_tvalid: Signal<Out, Bit>,
    /// It is taken.
    pub m_axis_tready: Signal<In, Bit>,
    /// It is the frame's last.
    pub m_axis_tlast: Signal<Out, Bit>,
    _wanted: bool,
    _stands: bool,
    _beat: (Word, bool),
}

impl Relay {
    /// For beats of `bits` bits; a register where it is `wanted`.
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
            return pass_through("The sides are near.");
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
