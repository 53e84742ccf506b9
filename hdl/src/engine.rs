//! The engine: all stages in a row, one subarray after the other with the same matrices.
//!
//! ```text
//!            receive -> normalise -> fold -> pass -> rescale -> unfold -> search -> force -> send
//!  s_axis -->  |  frame buffer         |      ^________|  v_ij             |                  |--> m_axis
//!              '--- magnitude, signs --'                                   '--- μ, score -----'
//! ```
//! While a frame is computed and sent, the next one is received into the frame buffer, which is free again as soon as `fold` has
//! read it.

use dermis_golden::fixed::Model;
use dermis_golden::scene::Condition;
use rust_hdl::prelude::*;

use crate::primitives::{BitDelay, Counter, CYCLE_BITS};
use crate::stages::{Fold, Force, Normalise, Pass, Receive, Rescale, Search, Send, Unfold};
use crate::wire::Wire;

/// ```text
///                +---------+
///  s_axis_t* --> | engine  | --> m_axis_t*
///      clk, rst  +---------+
/// ```
/// | port | direction | width | meaning |
/// |---|---|---|---|
/// | `s_axis_tdata` | in | `input_bits` | a taxel's code, signed; row-major, one frame after the other |
/// | `m_axis_tdata` | out | 96 | `{fz, fy, fx}`, 32 bits signed each; then the status beats |
/// | `…tvalid`, `…tready`, `…tlast` | | 1 | AXI-Stream handshake; `tlast` on a frame's last beat |
///
/// Reset is synchronous and clears all control, not the data.
#[derive(LogicBlock)]
pub struct Engine {
    /// Clock.
    pub clk: Signal<In, Clock>,
    /// Reset.
    pub rst: Signal<In, Bit>,
    /// A taxel's code.
    pub s_axis_tdata: Wire<In>,
    /// It is offered.
    pub s_axis_tvalid: Signal<In, Bit>,
    /// It is taken.
    pub s_axis_tready: Signal<Out, Bit>,
    /// It is the frame's last.
    pub s_axis_tlast: Signal<In, Bit>,
    /// `{fz, fy, fx}`.
    pub m_axis_tdata: Wire<Out>,
    /// A beat is offered.
    pub m_axis_tvalid: Signal<Out, Bit>,
    /// It is taken.
    pub m_axis_tready: Signal<In, Bit>,
    /// It is the frame's last.
    pub m_axis_tlast: Signal<Out, Bit>,
    pub(crate) receive: Receive,
    pub(crate) normalise: Normalise,
    pub(crate) fold: Fold,
    pub(crate) pass: Pass,
    pub(crate) rescale: Rescale,
    pub(crate) unfold: Unfold,
    pub(crate) search: Search,
    pub(crate) forces: Force,
    send: Send,
    busy: DFF<Bit>,
    condition: DFF<Bit>,
    framing: DFF<Bit>,
    cycles: Counter,
    part: Counter,
    again: BitDelay,
    both_signs: Constant<Bit>,
    begin_frame: Signal<Local, Bit>,
    start: Signal<Local, Bit>,
}

impl Engine {
    /// The engine of a scene.
    pub fn new(model: &Model) -> Self {
        let formats = &model.formats;
        let layout = model.layout();
        let bits = formats.input_bits as usize;
        let parts = model.grid();
        let count = model.parts.len();
        let force = Force::new(formats, count, model.threshold);
        let mut engine = Engine {
            clk: Default::default(),
            rst: Default::default(),
            s_axis_tdata: Wire::new(bits),
            s_axis_tvalid: Default::default(),
            s_axis_tready: Default::default(),
            s_axis_tlast: Default::default(),
            m_axis_tdata: Wire::new(force.m_axis_tdata.width()),
            m_axis_tvalid: Default::default(),
            m_axis_tready: Default::default(),
            m_axis_tlast: Default::default(),
            receive: Receive::new(layout, parts, bits, model.noise_floor),
            normalise: Normalise::new(bits),
            fold: Fold::new(formats.quads, count, bits),
            pass: Pass::new(model),
            rescale: Rescale::new(formats),
            unfold: Unfold::new(model),
            search: Search::new(formats, layout, count > 1),
            forces: force,
            send: Send::new(layout, parts),
            busy: Default::default(),
            condition: Default::default(),
            framing: Default::default(),
            cycles: Counter::new(1 << CYCLE_BITS),
            part: Counter::new(count),
            again: BitDelay::new(1),
            both_signs: Constant::new(model.scene.partition.condition == Condition::BothSigns),
            begin_frame: Default::default(),
            start: Default::default(),
        };
        engine.connect_all();
        engine
    }
}

impl Logic for Engine {
    #[hdl_gen]
    fn update(&mut self) {
        self.receive.clk.next = self.clk.val();
        self.normalise.clk.next = self.clk.val();
        self.fold.clk.next = self.clk.val();
        self.pass.clk.next = self.clk.val();
        self.rescale.clk.next = self.clk.val();
        self.unfold.clk.next = self.clk.val();
        self.search.clk.next = self.clk.val();
        self.forces.clk.next = self.clk.val();
        self.send.clk.next = self.clk.val();
        self.cycles.clk.next = self.clk.val();
        self.part.clk.next = self.clk.val();
        self.again.clk.next = self.clk.val();
        self.again.rst.next = self.rst.val();
        self.busy.clock.next = self.clk.val();
        self.condition.clock.next = self.clk.val();
        self.framing.clock.next = self.clk.val();
        self.receive.rst.next = self.rst.val();
        self.fold.rst.next = self.rst.val();
        self.pass.rst.next = self.rst.val();
        self.rescale.rst.next = self.rst.val();
        self.unfold.rst.next = self.rst.val();
        self.search.rst.next = self.rst.val();
        self.forces.rst.next = self.rst.val();
        self.send.rst.next = self.rst.val();

        comment!("A frame begins when it is whole and the last one gone");
        self.begin_frame.next = self.receive.full.val() & !self.busy.q.val() & !self.rst.val();
        self.busy.d.next = (self.begin_frame.val() | (self.busy.q.val() & !self.send.done.val())) & !self.rst.val();
        self.part.clear.next = self.rst.val();
        self.part.enable.next = self.search.done.val();
        self.again.now.next = self.search.done.val() & !self.part.last.val();
        self.start.next = self.begin_frame.val() | self.again.then.val();
        self.cycles.clear.next = self.begin_frame.val();
        self.cycles.enable.next = true;
        self.condition.d.next = self.condition.q.val();
        self.framing.d.next = self.framing.q.val();
        if self.start.val() {
            self.condition.d.next = self.receive.positive.val() | self.receive.negative.val();
            if self.both_signs.val() {
                self.condition.d.next = self.receive.positive.val() & self.receive.negative.val();
            }
        }
        if self.begin_frame.val() {
            self.framing.d.next = self.receive.framing.val();
        }

        comment!("receive -> normalise -> fold");
        self.receive.s_axis_tdata.next = self.s_axis_tdata.val();
        self.receive.s_axis_tvalid.next = self.s_axis_tvalid.val();
        self.receive.s_axis_tlast.next = self.s_axis_tlast.val();
        self.s_axis_tready.next = self.receive.s_axis_tready.val();
        self.receive.quad_address.next = self.fold.quad_address.val();
        self.receive.free.next = self.fold.free.val();
        self.receive.reported.next = self.begin_frame.val();
        self.receive.part.next = self.part.value.val();
        self.normalise.start.next = self.start.val();
        self.normalise.magnitude.next = self.receive.magnitude.val();
        self.normalise.quad.next = self.receive.quad.val();
        self.fold.begin_frame.next = self.begin_frame.val();
        self.fold.start.next = self.start.val();
        self.fold.last_part.next = self.part.last.val();
        self.fold.normalised.next = self.normalise.shifted.val();

        comment!("fold -> pass -> rescale -> unfold, and back to pass");
        self.pass.start.next = self.fold.done.val();
        self.fold.read_address.next = self.pass.input_address.val();
        self.pass.input_quad.next = self.fold.read_quad.val();
        self.rescale.start.next = self.start.val();
        self.rescale.quad.next = self.pass.quad.val();
        self.rescale.quad_valid.next = self.pass.quad_valid.val();
        self.pass.vector_quad.next = self.rescale.operands.val();
        self.pass.vector_valid.next = self.rescale.operands_valid.val();
        self.unfold.start.next = self.start.val();
        self.unfold.words.next = self.rescale.words.val();
        self.unfold.words_valid.next = self.rescale.words_valid.val();

        comment!("unfold -> search");
        self.search.fill_quad.next = self.unfold.taxels.val();
        self.search.fill.next = self.unfold.taxels_valid.val();
        self.search.fill_index.next = self.unfold.index.val();
        self.search.fill_address.next = self.unfold.address.val();
        self.search.start.next = self.unfold.done.val();
        self.search.enabled.next = self.condition.q.val();

        comment!("search -> force -> send");
        self.forces.values.next = self.search.values.val();
        self.forces.values_valid.next = self.search.values_valid.val();
        self.forces.begin_frame.next = self.begin_frame.val();
        self.forces.start.next = self.search.settled.val();
        self.forces.part.next = self.part.value.val();
        self.forces.position_x.next = self.search.best_x.val();
        self.forces.position_y.next = self.search.best_y.val();
        self.forces.score.next = self.search.score.val();
        self.forces.found.next = self.search.found.val();
        self.forces.normalise.next = self.normalise.shift.val();
        self.forces.rescale.next = self.rescale.shift.val();
        self.forces.saturations.next = self.rescale.saturations.val();
        self.forces.condition.next = self.condition.q.val();
        self.forces.framing.next = self.framing.q.val();
        self.forces.cycles.next = self.cycles.value.val();
        self.send.start.next = self.search.values_begin.val() & self.part.last.val();
        self.forces.advance.next = self.send.advance.val();
        self.forces.offer.next = self.send.offer.val();
        self.forces.beat.next = self.send.beat.val();
        self.forces.beat_part.next = self.send.part.val();
        self.forces.address.next = self.send.address.val();
        self.forces.lane.next = self.send.lane.val();
        self.send.m_axis_tvalid.next = self.forces.m_axis_tvalid.val();
        self.send.m_axis_tlast.next = self.forces.m_axis_tlast.val();
        self.send.m_axis_tready.next = self.m_axis_tready.val();
        self.m_axis_tdata.next = self.forces.m_axis_tdata.val();
        self.m_axis_tvalid.next = self.forces.m_axis_tvalid.val();
        self.m_axis_tlast.next = self.forces.m_axis_tlast.val();
    }
}
