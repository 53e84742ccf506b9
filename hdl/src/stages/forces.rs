//! Stage `forces`: p(μ*) by step of the search into a memory; from there, force words by taxel into the output queue.

use dermis_golden::fixed::plan::resources::Holds;
use dermis_golden::fixed::Model;
use rust_hdl::prelude::*;

use crate::primitives::{
    count_bits, frame_quads, position_bits, shift_bits, Counter, Delay, ForceUnit, Queue, Ram, CYCLE_BITS,
    SATURATION_BITS,
};
use crate::wire::Wire;

/// Values in by step, a quad or a part of it; beats out in the order in which `send` requests them.
#[derive(LogicBlock)]
pub struct Forces {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Synchronous reset, active high.
    pub rst: Signal<In, Bit>,
    /// Index of the case of the frame being sent; constant until its last beat.
    pub which: Wire<In>,
    /// `search_width` values p(μ*), `search_bits[0]` each, signed; valid with `values_valid`.
    pub values: Wire<In>,
    /// `values` holds a step.
    pub values_valid: Signal<In, Bit>,
    /// A new frame: its first values come next.
    pub begin_frame: Signal<In, Bit>,
    /// Stores position, exponents and status of subarray `part` in this cycle.
    pub start: Signal<In, Bit>,
    /// Index of the subarray; valid with `start`.
    pub part: Wire<In>,
    /// A beat may be requested in this cycle.
    pub room: Signal<Out, Bit>,
    /// A beat is requested; only with `room`.
    pub offer: Signal<In, Bit>,
    /// 0: a force, 1 … 3: a status beat; valid with `offer`.
    pub beat: Wire<In>,
    /// Index of the beat's subarray; valid with `offer`.
    pub beat_part: Wire<In>,
    /// Address of the memory word with the taxel; valid with `offer`.
    pub address: Wire<In>,
    /// Lane of the taxel in the word; valid with `offer`.
    pub lane: Wire<In>,
    /// μ1 in grid steps of the last level, signed; valid with `start`.
    pub position_x: Wire<In>,
    /// μ2 in grid steps of the last level, signed; valid with `start`.
    pub position_y: Wire<In>,
    /// Left shift of `normalise`; valid with `start`.
    pub normalise: Wire<In>,
    /// Right shift of `rescale`; valid with `start`.
    pub rescale: Wire<In>,
    /// The subarray meets the scene's condition; valid with `start`.
    pub condition: Signal<In, Bit>,
    /// The search found a candidate; valid with `start`.
    pub found: Signal<In, Bit>,
    /// `tlast` was early or missing; valid while the frame is sent.
    pub framing: Signal<In, Bit>,
    /// The coefficient signature is wrong, 1 bit; valid with `start`.
    pub damaged: Wire<In>,
    /// Number of frames in a sliding mean, otherwise one bit, 0; valid with `start`.
    pub frames: Wire<In>,
    /// Score of the best candidate, signed, 2^−6; valid with `start`.
    pub score: Wire<In>,
    /// Words saturated by `rescale`; valid with `start`.
    pub saturations: Wire<In>,
    /// Cycle counter of the frame; sampled for its first beat.
    pub cycles: Wire<In>,
    /// A beat is offered on `m_axis_tdata`; it is held until `m_axis_tready`.
    pub m_axis_tvalid: Signal<Out, Bit>,
    /// The receiver accepts a beat in this cycle.
    pub m_axis_tready: Signal<In, Bit>,
    /// The beat is the last of its frame; valid with `m_axis_tvalid`.
    pub m_axis_tlast: Signal<Out, Bit>,
    /// `{fz, fy, fx}`, 32 bits signed each, or a status beat; valid with `m_axis_tvalid`.
    pub m_axis_tdata: Wire<Out>,
    quads: Counter,
    asked: Delay,
    store: Ram,
    unit: ForceUnit,
    leaving: Queue,
}

impl Forces {
    /// With the widths of `model`.
    pub fn new(model: &Model) -> Self {
        let formats = model.formats();
        let words = formats.sweep_steps(frame_quads(model.cases()));
        let (address, value) = (count_bits(words), formats.search_width * formats.search_bits[0] as usize);
        let unit = ForceUnit::new(model);
        Forces {
            clk: Default::default(),
            rst: Default::default(),
            which: Wire::new(unit.which.width()),
            values: Wire::new(value),
            values_valid: Default::default(),
            begin_frame: Default::default(),
            start: Default::default(),
            part: Wire::new(unit.part.width()),
            beat_part: Wire::new(unit.part.width()),
            room: Default::default(),
            offer: Default::default(),
            beat: Wire::new(2),
            address: Wire::new(address),
            lane: Wire::new(2),
            position_x: Wire::new(position_bits()),
            position_y: Wire::new(position_bits()),
            normalise: Wire::new(unit.normalise.width()),
            rescale: Wire::new(shift_bits(formats)),
            condition: Default::default(),
            found: Default::default(),
            framing: Default::default(),
            damaged: Wire::new(1),
            frames: Wire::new(unit.frames.width()),
            score: Wire::new(formats.score_bits as usize),
            saturations: Wire::new(SATURATION_BITS),
            cycles: Wire::new(CYCLE_BITS),
            m_axis_tvalid: Default::default(),
            m_axis_tready: Default::default(),
            m_axis_tlast: Default::default(),
            m_axis_tdata: Wire::new(unit.beat_data.width()),
            quads: Counter::new(words),
            asked: Delay::new(address, 1),
            store: Ram::new(words, 1, value).holding([Holds::Values]).registered(),
            leaving: Queue::new(unit.beat_data.width()),
            unit,
        }
    }
}

impl Logic for Forces {
    #[hdl_gen]
    fn update(&mut self) {
        self.quads.clk.next = self.clk.val();
        self.asked.clk.next = self.clk.val();
        self.store.clk.next = self.clk.val();
        self.unit.clk.next = self.clk.val();
        self.unit.rst.next = self.rst.val();
        self.leaving.clk.next = self.clk.val();
        self.leaving.rst.next = self.rst.val();
        self.store.write.next = self.values_valid.val().into();
        self.quads.clear.next = self.begin_frame.val();
        self.quads.enable.next = self.values_valid.val();
        self.store.write_address.next = self.quads.value.val();
        self.store.write_data.next = self.values.val();
        self.store.read.next = true;
        self.asked.d.next = self.address.val();
        self.store.read_address.next = self.asked.q.val();

        self.unit.which.next = self.which.val();
        self.unit.begin_frame.next = self.begin_frame.val();
        self.unit.part.next = self.part.val();
        self.unit.beat_part.next = self.beat_part.val();
        self.unit.start.next = self.start.val();
        self.unit.offer.next = self.offer.val();
        self.unit.beat.next = self.beat.val();
        self.unit.lane.next = self.lane.val();
        self.unit.quad.next = self.store.read_data.val();
        self.unit.position_x.next = self.position_x.val();
        self.unit.position_y.next = self.position_y.val();
        self.unit.normalise.next = self.normalise.val();
        self.unit.rescale.next = self.rescale.val();
        self.unit.condition.next = self.condition.val();
        self.unit.found.next = self.found.val();
        self.unit.framing.next = self.framing.val();
        self.unit.damaged.next = self.damaged.val();
        self.unit.frames.next = self.frames.val();
        self.unit.score.next = self.score.val();
        self.unit.saturations.next = self.saturations.val();
        self.unit.cycles.next = self.cycles.val();

        self.leaving.reserve.next = self.offer.val();
        self.room.next = self.leaving.room.val();
        self.leaving.write.next = self.unit.valid.val();
        self.leaving.last.next = self.unit.last.val();
        self.leaving.word.next = self.unit.beat_data.val();
        self.leaving.m_axis_tready.next = self.m_axis_tready.val();
        self.m_axis_tvalid.next = self.leaving.m_axis_tvalid.val();
        self.m_axis_tlast.next = self.leaving.m_axis_tlast.val();
        self.m_axis_tdata.next = self.leaving.m_axis_tdata.val();
    }
}
