//! Stage `send`: asks for the forces row-major, then for each subarray's status, as fast as the queue has room.

use dermis_golden::fixed::send::STATUS_BEATS;
use dermis_golden::fixed::Model;
use rust_hdl::prelude::*;

use crate::primitives::{count_bits, largest, BitDelay, CaseCounter, Counter, Scan, StatusCode};
use crate::wire::Wire;

/// From `start` one beat is asked for in each cycle that has `room` for it: all taxels, then the status beats.
#[derive(LogicBlock)]
pub struct Send {
    /// Clock.
    pub clk: Signal<In, Clock>,
    /// Reset.
    pub rst: Signal<In, Bit>,
    /// Which case.
    pub which: Wire<In>,
    /// All values are in.
    pub start: Signal<In, Bit>,
    /// A beat stands on the output.
    pub m_axis_tvalid: Signal<In, Bit>,
    /// The receiver takes it.
    pub m_axis_tready: Signal<In, Bit>,
    /// It is the frame's last.
    pub m_axis_tlast: Signal<In, Bit>,
    /// A beat may be asked for.
    pub room: Signal<In, Bit>,
    /// A beat is asked for.
    pub offer: Signal<Out, Bit>,
    /// Which beat: 0 a force, 1 … 3 the status.
    pub beat: Wire<Out>,
    /// The beat's subarray.
    pub part: Wire<Out>,
    /// The taxel's quad.
    pub address: Wire<Out>,
    /// The taxel's lane.
    pub lane: Wire<Out>,
    /// The frame's last beat was taken.
    pub done: Signal<Out, Bit>,
    scan: Scan,
    words: Counter,
    parts: CaseCounter,
    code: StatusCode,
    sending: DFF<Bit>,
    status: DFF<Bit>,
    out: BitDelay,
    step: Signal<Local, Bit>,
    at_end: Signal<Local, Bit>,
    finish: Signal<Local, Bit>,
}

impl Send {
    /// Frames of `model`.
    pub fn new(model: &Model) -> Self {
        let counts: Vec<usize> = model.cases().iter().map(|case| case.parts.len()).collect();
        let count = largest(&counts);
        let scan = Scan::new(model.cases());
        Send {
            clk: Default::default(),
            rst: Default::default(),
            which: Wire::new(count_bits(counts.len())),
            start: Default::default(),
            m_axis_tvalid: Default::default(),
            m_axis_tready: Default::default(),
            m_axis_tlast: Default::default(),
            room: Default::default(),
            offer: Default::default(),
            beat: Wire::new(2),
            part: Wire::new(count_bits(count)),
            address: Wire::new(scan.address.width()),
            lane: Wire::new(2),
            done: Default::default(),
            scan,
            words: Counter::new(STATUS_BEATS),
            parts: CaseCounter::new(&counts),
            code: StatusCode::new(count_bits(STATUS_BEATS), count_bits(count)),
            sending: Default::default(),
            status: Default::default(),
            out: BitDelay::new(1),
            step: Default::default(),
            at_end: Default::default(),
            finish: Default::default(),
        }
    }
}

impl Logic for Send {
    #[hdl_gen]
    fn update(&mut self) {
        self.scan.clk.next = self.clk.val();
        self.words.clk.next = self.clk.val();
        self.parts.clk.next = self.clk.val();
        self.sending.clock.next = self.clk.val();
        self.status.clock.next = self.clk.val();

        self.scan.which.next = self.which.val();
        self.parts.which.next = self.which.val();
        self.step.next = self.sending.q.val() & self.room.val();
        self.at_end.next = self.step.val() & !self.status.q.val() & self.scan.last.val();
        self.finish.next = self.step.val() & self.status.q.val() & self.words.last.val() & self.parts.last.val();
        self.offer.next = self.step.val();

        self.scan.clear.next = self.start.val();
        self.scan.enable.next = self.step.val() & !self.status.q.val();
        self.words.clear.next = self.start.val();
        self.words.enable.next = self.step.val() & self.status.q.val();
        self.parts.clear.next = self.start.val();
        self.parts.enable.next = self.step.val() & self.status.q.val() & self.words.last.val();
        self.code.status.next = self.status.q.val();
        self.code.word.next = self.words.value.val();
        self.code.status_part.next = self.parts.value.val();
        self.code.scan_part.next = self.scan.part.val();
        self.beat.next = self.code.beat.val();
        self.part.next = self.code.part.val();
        self.address.next = self.scan.address.val();
        self.lane.next = self.scan.lane.val();

        self.sending.d.next = (self.start.val() | (self.sending.q.val() & !self.finish.val())) & !self.rst.val();
        self.status.d.next = (self.at_end.val() | (self.status.q.val() & !self.finish.val())) & !self.rst.val();
        comment!("From a register: who takes the beats may be far away");
        self.out.clk.next = self.clk.val();
        self.out.rst.next = self.rst.val();
        self.out.now.next = self.m_axis_tvalid.val() & self.m_axis_tready.val() & self.m_axis_tlast.val();
        self.done.next = self.out.then.val();
    }
}
