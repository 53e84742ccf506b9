//! The serial engine: all blocks connected; rounder, mixer and memories are shared between steps.
//!
//! One frame at a time. While it is computed and sent, the next is received as soon as the frame buffer has been read.

use dermis_golden::fixed::resources::Holds;
use dermis_golden::fixed::serial::{floor_bits, product_bits, word_bits, SLOT};
use dermis_golden::fixed::Model;
use dermis_golden::scene::Condition;
use rust_hdl::prelude::*;

use super::{
    Banks, Candidates, CoefficientShift, Force, Horner, Pass, PassSequencer, Receive, Rounder, Score, SearchSequencer,
    SerialButterfly, TaxelReorder, Unfold,
};
use crate::primitives::{Dff, Ram, Slice};
use crate::wire::Wire;

/// The serial engine, with the ports of the parallel [`Engine`](crate::engine::Engine).
#[derive(LogicBlock)]
pub struct Engine {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Synchronous reset, active high.
    pub rst: Signal<In, Bit>,
    /// A taxel's code, `code_bits` wide, two's complement; valid with `s_axis_tvalid`.
    pub s_axis_tdata: Wire<In>,
    /// A beat is offered on `s_axis_tdata`; the sender holds it until `s_axis_tready`.
    pub s_axis_tvalid: Signal<In, Bit>,
    /// The block accepts a beat in this cycle.
    pub s_axis_tready: Signal<Out, Bit>,
    /// The beat is the last of its frame; valid with `s_axis_tvalid`.
    pub s_axis_tlast: Signal<In, Bit>,
    /// `{fz, fy, fx}`, 32 bits signed each, or a status beat; valid with `m_axis_tvalid`.
    pub m_axis_tdata: Wire<Out>,
    /// A beat is offered on `m_axis_tdata`; it is held until `m_axis_tready`.
    pub m_axis_tvalid: Signal<Out, Bit>,
    /// The receiver accepts a beat in this cycle.
    pub m_axis_tready: Signal<In, Bit>,
    /// The beat is the last of its frame; valid with `m_axis_tvalid`.
    pub m_axis_tlast: Signal<Out, Bit>,
    pub(crate) receive: Receive,
    order: TaxelReorder,
    pub(crate) leader: PassSequencer,
    pub(crate) rounder: Rounder,
    pub(crate) shifted: Slice,
    pub(crate) mixer: SerialButterfly,
    pub(crate) pass: Pass,
    raw: Ram,
    pub(crate) unfold: Unfold,
    banks: Banks,
    pub(crate) walk: SearchSequencer,
    along_x: Horner,
    turned: Ram,
    along_y: Horner,
    pub(crate) halve: CoefficientShift,
    nine: Candidates,
    score: Score,
    floors: Ram,
    totals: Ram,
    forces: Force,
    computing: Dff,
    condition: Dff,
    framing: Dff,
    both_signs: Constant<Bit>,
    begin_frame: Signal<Local, Bit>,
}

impl Engine {
    /// The serial engine of `model`.
    pub fn new(model: &Model) -> Self {
        let f = &model.formats;
        let word = word_bits(f);
        let code = f.input_bits as usize;
        // `normalise` shifts codes left by `input_bits` − 1, then right by the length of the magnitude.
        let unrounded = (f.acc_bits as usize).max(2 * code).max(product_bits(f));
        let rounded = f.input_bits.max(f.vector_bits) as usize;
        let force = Force::new(f, model.threshold, unrounded);
        let mut engine = Engine {
            clk: Default::default(),
            rst: Default::default(),
            s_axis_tdata: Wire::new(f.code_bits as usize),
            s_axis_tvalid: Default::default(),
            s_axis_tready: Default::default(),
            s_axis_tlast: Default::default(),
            m_axis_tdata: Wire::new(force.m_axis_tdata.width()),
            m_axis_tvalid: Default::default(),
            m_axis_tready: Default::default(),
            m_axis_tlast: Default::default(),
            receive: Receive::new(f, model.noise_floor),
            order: TaxelReorder::new(model.layout()),
            leader: PassSequencer::new(f, unrounded, rounded),
            rounder: Rounder::new(unrounded, rounded),
            shifted: Slice::new(32, rounded),
            mixer: SerialButterfly::new(rounded),
            pass: Pass::new(model),
            raw: Ram::new(4 * f.quads, 1, f.acc_bits as usize).holding([Holds::Raw]),
            unfold: Unfold::new(f, rounded + 2),
            banks: Banks::new(f),
            walk: SearchSequencer::new(f),
            along_x: Horner::new(word),
            turned: Ram::new(4 * SLOT as usize, 1, word).holding([Holds::Transposed]),
            along_y: Horner::new(word),
            halve: CoefficientShift::new(word, f.search_bits[0] as usize),
            nine: Candidates::new(f),
            score: Score::new(f),
            floors: Ram::new(SLOT as usize, 1, floor_bits(f)).holding([Holds::Floors]),
            totals: Ram::new(SLOT as usize, 1, f.score_bits as usize + 1).holding([Holds::Totals]),
            forces: force,
            computing: Default::default(),
            condition: Default::default(),
            framing: Default::default(),
            both_signs: Constant::new(model.scene.partition.condition == Condition::BothSigns),
            begin_frame: Default::default(),
        };
        engine.connect_all();
        engine
    }
}

impl Logic for Engine {
    #[hdl_gen]
    fn update(&mut self) {
        self.receive.clk.next = self.clk.val();
        self.order.clk.next = self.clk.val();
        self.leader.clk.next = self.clk.val();
        self.rounder.clk.next = self.clk.val();
        self.mixer.clk.next = self.clk.val();
        self.pass.clk.next = self.clk.val();
        self.raw.clk.next = self.clk.val();
        self.unfold.clk.next = self.clk.val();
        self.banks.clk.next = self.clk.val();
        self.walk.clk.next = self.clk.val();
        self.along_x.clk.next = self.clk.val();
        self.turned.clk.next = self.clk.val();
        self.along_y.clk.next = self.clk.val();
        self.halve.clk.next = self.clk.val();
        self.nine.clk.next = self.clk.val();
        self.score.clk.next = self.clk.val();
        self.floors.clk.next = self.clk.val();
        self.totals.clk.next = self.clk.val();
        self.forces.clk.next = self.clk.val();
        self.computing.clk.next = self.clk.val();
        self.condition.clk.next = self.clk.val();
        self.framing.clk.next = self.clk.val();
        self.receive.rst.next = self.rst.val();
        self.leader.rst.next = self.rst.val();
        self.mixer.rst.next = self.rst.val();
        self.pass.rst.next = self.rst.val();
        self.unfold.rst.next = self.rst.val();
        self.walk.rst.next = self.rst.val();
        self.score.rst.next = self.rst.val();
        self.forces.rst.next = self.rst.val();

        comment!("A frame starts when the buffer is full and the engine idle");
        self.begin_frame.next = self.receive.full.val() & !self.computing.q.val() & !self.rst.val();
        self.computing.d.next =
            (self.begin_frame.val() | (self.computing.q.val() & !self.forces.done.val())) & !self.rst.val();
        self.condition.d.next = self.condition.q.val();
        self.framing.d.next = self.framing.q.val();
        if self.begin_frame.val() {
            self.framing.d.next = self.receive.framing.val();
            self.condition.d.next = self.receive.positive.val() | self.receive.negative.val();
            if self.both_signs.val() {
                self.condition.d.next = self.receive.positive.val() & self.receive.negative.val();
            }
        }
        self.receive.s_axis_tdata.next = self.s_axis_tdata.val();
        self.receive.s_axis_tvalid.next = self.s_axis_tvalid.val();
        self.receive.s_axis_tlast.next = self.s_axis_tlast.val();
        self.s_axis_tready.next = self.receive.s_axis_tready.val();
        self.receive.free.next = self.leader.free.val();
        self.receive.reported.next = self.begin_frame.val();

        comment!("Taxel order: row-major or by quads");
        self.order.back.next = !self.leader.busy.val();
        self.order.index.next = self.forces.index.val();
        if self.leader.busy.val() {
            self.order.index.next = self.leader.index.val();
        }
        self.receive.read_address.next = self.order.place.val();

        comment!("Rounder, shared by normalise, rescale and force");
        self.leader.start.next = self.begin_frame.val();
        self.leader.magnitude.next = self.receive.magnitude.val();
        self.leader.code.next = self.receive.word.val();
        self.rounder.word.next = self.forces.product.val();
        self.rounder.shift.next = self.forces.round_shift.val();
        if self.leader.busy.val() {
            self.rounder.word.next = self.leader.unrounded.val();
            self.rounder.shift.next = self.leader.round_shift.val();
        }
        self.rounder.valid.next = self.leader.round.val();
        self.rounder.wide.next = !self.leader.busy.val();
        self.shifted.word.next = self.rounder.rounded.val();
        self.leader.rounded.next = self.shifted.low.val();
        self.leader.clipped.next = self.rounder.clipped.val();
        self.leader.round_done.next = self.rounder.done.val();

        comment!("Mixer, shared by fold and unfold");
        self.mixer.word.next = self.shifted.low.val();
        self.mixer.valid.next = self.leader.mix.val();
        self.leader.mixed.next = self.mixer.mixed.val();
        self.leader.mixed_valid.next = self.mixer.mixed_valid.val();

        comment!("Matrix passes");
        self.pass.valid.next = self.leader.issue.val();
        self.pass.last.next = self.leader.last.val();
        self.pass.address.next = self.leader.address.val();
        self.pass.low.next = self.leader.low.val();
        self.pass.operand_address.next = self.leader.operand_address.val();
        self.pass.flip.next = self.leader.flip.val();
        self.pass.align.next = self.leader.align.val();
        self.pass.write.next = self.leader.write.val();
        self.pass.write_address.next = self.leader.write_address.val();
        self.pass.write_lane.next = self.leader.write_lane.val();
        self.pass.write_data.next = self.leader.write_data.val();
        self.leader.row_word.next = self.pass.word.val();
        self.leader.row_valid.next = self.pass.word_valid.val();
        self.raw.write.next = self.leader.raw_write.val().into();
        self.raw.write_address.next = self.leader.raw_write_address.val();
        self.raw.write_data.next = self.pass.word.val();
        self.raw.read.next = true;
        self.raw.read_address.next = self.leader.raw_read_address.val();
        self.leader.raw_word.next = self.raw.read_data.val();

        comment!("Polynomials: unfold, search, banks");
        self.unfold.start.next = self.begin_frame.val();
        self.unfold.mixed.next = self.mixer.mixed.val();
        self.unfold.valid.next = self.mixer.mixed_valid.val() & self.leader.unfolding.val();
        self.walk.filling.next = self.leader.busy.val();
        self.walk.start.next = self.leader.done.val();
        self.walk.enabled.next = self.condition.q.val();
        self.walk.wanted.next = self.forces.wanted.val();
        self.banks.odd.next = self.walk.odd.val();
        self.banks.read_address.next = self.walk.read_address.val();
        self.banks.write.next = self.walk.write.val();
        self.banks.write_address.next = self.walk.write_address.val();
        self.banks.data.next = self.halve.halved.val();
        if self.leader.busy.val() {
            self.banks.write.next = self.unfold.write.val();
            self.banks.write_address.next = self.unfold.address.val();
            self.banks.data.next = self.unfold.data.val();
        }

        comment!("Taylor shift along x, then along y");
        self.along_x.word.next = self.banks.word.val();
        self.along_x.element.next = self.walk.x_element.val();
        self.along_x.top.next = self.walk.x_top.val();
        self.along_x.moves.next = self.walk.x_moves.val();
        self.along_x.down.next = self.walk.x_down.val();
        self.turned.write.next = true.into();
        self.turned.write_address.next = self.walk.turn_write.val();
        self.turned.write_data.next = self.along_x.moved.val();
        self.turned.read.next = true;
        self.turned.read_address.next = self.walk.turn_read.val();
        self.along_y.word.next = self.turned.read_data.val();
        self.along_y.element.next = self.walk.y_element.val();
        self.along_y.top.next = self.walk.y_top.val();
        self.along_y.moves.next = self.walk.y_moves.val();
        self.along_y.down.next = self.walk.y_down.val();
        self.halve.word.next = self.along_y.moved.val();
        self.halve.halvings.next = self.walk.halvings.val();

        comment!("Candidates, scores and their comparison");
        self.nine.word.next = self.halve.halved.val();
        self.nine.cycle.next = self.walk.cycle.val();
        self.nine.present.next = self.walk.present.val();
        self.nine.sums.next = self.walk.sums.val();
        self.score.value.next = self.nine.value.val();
        self.score.index.next = self.nine.index.val();
        self.score.valid.next = self.nine.valid.val();
        self.score.sum.next = self.nine.sum.val();
        self.floors.read.next = true;
        self.floors.read_address.next = self.nine.index.val();
        self.score.floor.next = self.floors.read_data.val();
        self.floors.write.next = self.score.floor_write.val().into();
        self.floors.write_address.next = self.score.floor_index.val();
        self.floors.write_data.next = self.score.floor_data.val();
        self.totals.read.next = true;
        self.totals.read_address.next = self.score.read_index.val();
        if self.walk.judging.val() {
            self.totals.read_address.next = self.walk.candidate.val();
        }
        self.score.total.next = self.totals.read_data.val();
        self.walk.total.next = self.totals.read_data.val();
        self.totals.write.next = self.score.write.val().into();
        self.totals.write_address.next = self.score.write_index.val();
        self.totals.write_data.next = self.score.write_data.val();

        comment!("Forces");
        self.forces.start.next = self.walk.done.val();
        self.forces.place.next = self.order.place.val();
        self.forces.value.next = self.banks.word.val();
        self.forces.best_x.next = self.walk.best_x.val();
        self.forces.best_y.next = self.walk.best_y.val();
        self.forces.score.next = self.walk.score.val();
        self.forces.found.next = self.walk.found.val();
        self.forces.condition.next = self.condition.q.val();
        self.forces.framing.next = self.framing.q.val();
        self.forces.normalise.next = self.leader.normalise.val();
        self.forces.rescale.next = self.leader.rescale.val();
        self.forces.saturations.next = self.leader.saturations.val();
        self.forces.frame_begin.next = self.begin_frame.val();
        self.forces.rounded.next = self.rounder.rounded.val();
        self.forces.clipped.next = self.rounder.clipped.val();
        self.m_axis_tdata.next = self.forces.m_axis_tdata.val();
        self.m_axis_tvalid.next = self.forces.m_axis_tvalid.val();
        self.m_axis_tlast.next = self.forces.m_axis_tlast.val();
        self.forces.m_axis_tready.next = self.m_axis_tready.val();
    }
}
