//! Stage `force`: p(μ*) by quad into a memory, out of it force words by taxel, which wait in a queue for the receiver.

use dermis_golden::fixed::Model;
use rust_hdl::prelude::*;

use crate::primitives::{
    count_bits, frame_quads, position_bits, shift_bits, Counter, Delay, ForceUnit, Queue, Ram, CYCLE_BITS,
    SATURATION_BITS,
};
use crate::wire::Wire;

/// Values in by quad; beats out in the order `send` asks for them.
#[derive(LogicBlock)]
pub struct Force {
    /// Clock.
    pub clk: Signal<In, Clock>,
    /// Reset.
    pub rst: Signal<In, Bit>,
    /// Which case is sent.
    pub which: Wire<In>,
    /// Four taxels' p(μ*).
    pub values: Wire<In>,
    /// `values` are a quad.
    pub values_valid: Signal<In, Bit>,
    /// The frame's first values come next.
    pub begin_frame: Signal<In, Bit>,
    /// A subarray's values are in: keep its μ, exponents and status.
    pub start: Signal<In, Bit>,
    /// Which subarray.
    pub part: Wire<In>,
    /// A beat may be asked for.
    pub room: Signal<Out, Bit>,
    /// A beat is asked for.
    pub offer: Signal<In, Bit>,
    /// Which beat: 0 a force, 1 … 3 the status.
    pub beat: Wire<In>,
    /// The beat's subarray.
    pub beat_part: Wire<In>,
    /// The taxel's quad.
    pub address: Wire<In>,
    /// The taxel's lane.
    pub lane: Wire<In>,
    /// μ1 as a position.
    pub position_x: Wire<In>,
    /// μ2 as a position.
    pub position_y: Wire<In>,
    /// Left shift of `normalise`.
    pub normalise: Wire<In>,
    /// Right shift of `rescale`.
    pub rescale: Wire<In>,
    /// The scene's condition is met.
    pub condition: Signal<In, Bit>,
    /// The search found a candidate.
    pub found: Signal<In, Bit>,
    /// `tlast` was early or missing.
    pub framing: Signal<In, Bit>,
    /// The subarray's coefficients were not what they must be.
    pub damaged: Wire<In>,
    /// Score of the winner.
    pub score: Wire<In>,
    /// Words that `rescale` saturated.
    pub saturations: Wire<In>,
    /// Cycles of the frame so far.
    pub cycles: Wire<In>,
    /// A beat stands on the output.
    pub m_axis_tvalid: Signal<Out, Bit>,
    /// The receiver takes it.
    pub m_axis_tready: Signal<In, Bit>,
    /// It is the frame's last.
    pub m_axis_tlast: Signal<Out, Bit>,
    /// `{fz, fy, fx}`.
    pub m_axis_tdata: Wire<Out>,
    quads: Counter,
    asked: Delay,
    store: Ram,
    unit: ForceUnit,
    leaving: Queue,
}

impl Force {
    /// Widths of `model`.
    pub fn new(model: &Model) -> Self {
        let formats = &model.formats;
        let quads = frame_quads(model.cases());
        let (address, value) = (count_bits(quads), 4 * formats.search_bits[0] as usize);
        let unit = ForceUnit::new(model);
        Force {
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
            score: Wire::new(formats.score_bits as usize),
            saturations: Wire::new(SATURATION_BITS),
            cycles: Wire::new(CYCLE_BITS),
            m_axis_tvalid: Default::default(),
            m_axis_tready: Default::default(),
            m_axis_tlast: Default::default(),
            m_axis_tdata: Wire::new(unit.beat_data.width()),
            quads: Counter::new(quads),
            asked: Delay::new(address, 1),
            store: Ram::new(quads, 1, value).registered(),
            leaving: Queue::new(unit.beat_data.width()),
            unit,
        }
    }
}

impl Logic for Force {
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
        self.asked.now.next = self.address.val();
        self.store.read_address.next = self.asked.then.val();

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
