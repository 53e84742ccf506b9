//! Stage `send`: asks for the forces row-major, then for the status, at the receiver's pace.

use dermis_golden::fixed::quads::Quads;
use dermis_golden::fixed::send::STATUS_BEATS;
use rust_hdl::prelude::*;

use crate::primitives::{count_bits, Counter, Mirror};
use crate::wire::Wire;

/// From `start` one beat is offered per moving cycle: all taxels, then the status beats.
#[derive(LogicBlock)]
pub struct Send {
    /// Clock.
    pub clk: Signal<In, Clock>,
    /// Reset.
    pub rst: Signal<In, Bit>,
    /// All values are in.
    pub start: Signal<In, Bit>,
    /// A beat stands on the output.
    pub m_axis_tvalid: Signal<In, Bit>,
    /// The receiver takes it.
    pub m_axis_tready: Signal<In, Bit>,
    /// It is the frame's last.
    pub m_axis_tlast: Signal<In, Bit>,
    /// The pipeline to the output moves.
    pub advance: Signal<Out, Bit>,
    /// A beat is asked for.
    pub offer: Signal<Out, Bit>,
    /// Which beat: 0 a force, 1 … 3 the status.
    pub beat: Wire<Out>,
    /// The taxel's quad.
    pub address: Wire<Out>,
    /// The taxel's lane.
    pub lane: Wire<Out>,
    /// The frame's last beat is taken.
    pub done: Signal<Out, Bit>,
    column: Counter,
    row: Counter,
    mirror: Mirror,
    beats: Counter,
    sending: DFF<Bit>,
    status: DFF<Bit>,
    moves: Signal<Local, Bit>,
    step: Signal<Local, Bit>,
    at_end: Signal<Local, Bit>,
}

impl Send {
    /// Frames in `layout`.
    pub fn new(layout: Quads) -> Self {
        Send {
            clk: Default::default(),
            rst: Default::default(),
            start: Default::default(),
            m_axis_tvalid: Default::default(),
            m_axis_tready: Default::default(),
            m_axis_tlast: Default::default(),
            advance: Default::default(),
            offer: Default::default(),
            beat: Wire::new(count_bits(1 + STATUS_BEATS)),
            address: Wire::new(count_bits(layout.len())),
            lane: Wire::new(2),
            done: Default::default(),
            column: Counter::new(layout.cols),
            row: Counter::new(layout.rows),
            mirror: Mirror::new(layout),
            beats: Counter::new(1 + STATUS_BEATS),
            sending: Default::default(),
            status: Default::default(),
            moves: Default::default(),
            step: Default::default(),
            at_end: Default::default(),
        }
    }
}

impl Logic for Send {
    #[hdl_gen]
    fn update(&mut self) {
        self.column.clk.next = self.clk.val();
        self.row.clk.next = self.clk.val();
        self.beats.clk.next = self.clk.val();
        self.sending.clock.next = self.clk.val();
        self.status.clock.next = self.clk.val();

        self.moves.next = !self.m_axis_tvalid.val() | self.m_axis_tready.val();
        self.step.next = self.sending.q.val() & self.moves.val();
        self.at_end.next = self.step.val() & !self.status.q.val() & self.column.last.val() & self.row.last.val();
        self.advance.next = self.moves.val();
        self.offer.next = self.sending.q.val();

        self.column.clear.next = self.start.val();
        self.column.enable.next = self.step.val() & !self.status.q.val();
        self.row.clear.next = self.start.val();
        self.row.enable.next = self.step.val() & !self.status.q.val() & self.column.last.val();
        self.beats.clear.next = self.start.val();
        self.beats.enable.next = self.at_end.val() | (self.step.val() & self.status.q.val());
        self.beat.next = self.beats.value.val();
        self.mirror.row.next = self.row.value.val();
        self.mirror.col.next = self.column.value.val();
        self.address.next = self.mirror.address.val();
        self.lane.next = self.mirror.lane.val();

        self.sending.d.next =
            (self.start.val() | (self.sending.q.val() & !(self.step.val() & self.beats.last.val()))) & !self.rst.val();
        self.status.d.next =
            (self.at_end.val() | (self.status.q.val() & !(self.step.val() & self.beats.last.val()))) & !self.rst.val();
        self.done.next = self.m_axis_tvalid.val() & self.m_axis_tready.val() & self.m_axis_tlast.val();
    }
}
