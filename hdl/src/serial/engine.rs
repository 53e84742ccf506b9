//! The serial engine: all blocks connected; rounder, butterfly and memories are shared between steps.
//!
//! One frame at a time. While it is computed and sent, the next is received as soon as the frame buffer has been read.

use dermis_golden::fixed::plan::resources::Holds;
use dermis_golden::fixed::plan::serial::{floor_bits, product_bits, word_bits, SLOT};
use dermis_golden::fixed::words::formats::FORCE_BITS;
use dermis_golden::fixed::Model;
use dermis_golden::spec::scene::Condition;
use rust_hdl::prelude::*;

use super::{
    Banks, Candidates, CoefficientShift, Forces, Horner, Pass, PassSequencer, Receive, Rounder, Score, SearchSequencer,
    SerialButterfly, TaxelReorder, Unfold,
};
use crate::language::RustHdl;
use crate::primitives::{Dff, Ram, Slice};
use crate::stage_list::engine;
use crate::wire::Wire;

engine! {
    /// The serial engine, with the ports of the parallel [`Engine`](crate::engine::Engine).
    pub struct Engine {
        stages {
            receive: RustHdl<Receive> => "receive.rs",
            reorder: RustHdl<TaxelReorder> => "taxel_reorder.rs",
            pass_sequencer: RustHdl<PassSequencer> => "pass_sequencer.rs",
            rounder: RustHdl<Rounder> => "rounder.rs",
            butterfly: RustHdl<SerialButterfly> => "serial_butterfly.rs",
            pass: RustHdl<Pass> => "pass.rs",
            raw: RustHdl<Ram> => "../primitives/memory/ram.rs",
            unfold: RustHdl<Unfold> => "unfold.rs",
            banks: RustHdl<Banks> => "banks.rs",
            search_sequencer: RustHdl<SearchSequencer> => "search_sequencer.rs",
            along_x: RustHdl<Horner> => "horner.rs",
            transposed: RustHdl<Ram> => "../primitives/memory/ram.rs",
            along_y: RustHdl<Horner> => "horner.rs",
            coefficient_shift: RustHdl<CoefficientShift> => "coefficient_shift.rs",
            candidates: RustHdl<Candidates> => "candidates.rs",
            score: RustHdl<Score> => "score.rs",
            floors: RustHdl<Ram> => "../primitives/memory/ram.rs",
            totals: RustHdl<Ram> => "../primitives/memory/ram.rs",
            forces: RustHdl<Forces> => "forces.rs",
        }
        control {
            shifted: RustHdl<Slice>,
            computing: RustHdl<Dff>,
            condition: RustHdl<Dff>,
            framing: RustHdl<Dff>,
            both_signs: Constant<Bit>,
            begin_frame: Signal<Local, Bit>,
        }
    }
}

impl Engine {
    /// The serial engine of `model`.
    pub fn new(model: &Model) -> Self {
        let f = model.formats();
        let word = word_bits(f);
        let code = f.input_bits as usize;
        // `normalise` shifts codes left by `input_bits` − 1, then right by the length of the magnitude.
        let unrounded = (f.acc_bits as usize).max(2 * code).max(product_bits(f));
        let rounded = f.input_bits.max(f.vector_bits) as usize;
        let mut engine = Engine {
            clk: Default::default(),
            rst: Default::default(),
            s_axis_tdata: Wire::new(f.code_bits as usize),
            s_axis_tvalid: Default::default(),
            s_axis_tready: Default::default(),
            s_axis_tlast: Default::default(),
            m_axis_tdata: Wire::new(3 * FORCE_BITS as usize),
            m_axis_tvalid: Default::default(),
            m_axis_tready: Default::default(),
            m_axis_tlast: Default::default(),
            receive: RustHdl::new(Receive::new(f, model.noise_floor)),
            reorder: RustHdl::new(TaxelReorder::new(model.layout())),
            pass_sequencer: RustHdl::new(PassSequencer::new(f, unrounded, rounded)),
            rounder: RustHdl::new(Rounder::new(unrounded, rounded)),
            shifted: RustHdl::new(Slice::new(32, rounded)),
            butterfly: RustHdl::new(SerialButterfly::new(rounded)),
            pass: RustHdl::new(Pass::new(model)),
            raw: RustHdl::new(Ram::new(4 * f.quads, 1, f.acc_bits as usize).holding([Holds::Raw])),
            unfold: RustHdl::new(Unfold::new(f, rounded + 2)),
            banks: RustHdl::new(Banks::new(f)),
            search_sequencer: RustHdl::new(SearchSequencer::new(f)),
            along_x: RustHdl::new(Horner::new(word)),
            transposed: RustHdl::new(Ram::new(4 * SLOT as usize, 1, word).holding([Holds::Transposed])),
            along_y: RustHdl::new(Horner::new(word)),
            coefficient_shift: RustHdl::new(CoefficientShift::new(word, f.search_bits[0] as usize)),
            candidates: RustHdl::new(Candidates::new(f)),
            score: RustHdl::new(Score::new(f)),
            floors: RustHdl::new(Ram::new(SLOT as usize, 1, floor_bits(f)).holding([Holds::Floors])),
            totals: RustHdl::new(Ram::new(SLOT as usize, 1, f.score_bits as usize + 1).holding([Holds::Totals])),
            forces: RustHdl::new(Forces::new(model, unrounded)),
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
        self.reorder.clk.next = self.clk.val();
        self.pass_sequencer.clk.next = self.clk.val();
        self.rounder.clk.next = self.clk.val();
        self.butterfly.clk.next = self.clk.val();
        self.pass.clk.next = self.clk.val();
        self.raw.clk.next = self.clk.val();
        self.unfold.clk.next = self.clk.val();
        self.banks.clk.next = self.clk.val();
        self.search_sequencer.clk.next = self.clk.val();
        self.along_x.clk.next = self.clk.val();
        self.transposed.clk.next = self.clk.val();
        self.along_y.clk.next = self.clk.val();
        self.coefficient_shift.clk.next = self.clk.val();
        self.candidates.clk.next = self.clk.val();
        self.score.clk.next = self.clk.val();
        self.floors.clk.next = self.clk.val();
        self.totals.clk.next = self.clk.val();
        self.forces.clk.next = self.clk.val();
        self.computing.clk.next = self.clk.val();
        self.condition.clk.next = self.clk.val();
        self.framing.clk.next = self.clk.val();
        self.receive.rst.next = self.rst.val();
        self.pass_sequencer.rst.next = self.rst.val();
        self.butterfly.rst.next = self.rst.val();
        self.pass.rst.next = self.rst.val();
        self.unfold.rst.next = self.rst.val();
        self.search_sequencer.rst.next = self.rst.val();
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
        self.receive.free.next = self.pass_sequencer.free.val();
        self.receive.reported.next = self.begin_frame.val();

        comment!("Taxel reorder: row-major or by quads");
        self.reorder.back.next = !self.pass_sequencer.busy.val();
        self.reorder.index.next = self.forces.index.val();
        if self.pass_sequencer.busy.val() {
            self.reorder.index.next = self.pass_sequencer.index.val();
        }
        self.receive.read_address.next = self.reorder.place.val();

        comment!("Rounder, shared by normalise, rescale and forces");
        self.pass_sequencer.start.next = self.begin_frame.val();
        self.pass_sequencer.magnitude.next = self.receive.magnitude.val();
        self.pass_sequencer.code.next = self.receive.word.val();
        self.rounder.word.next = self.forces.product.val();
        self.rounder.shift.next = self.forces.round_shift.val();
        if self.pass_sequencer.busy.val() {
            self.rounder.word.next = self.pass_sequencer.unrounded.val();
            self.rounder.shift.next = self.pass_sequencer.round_shift.val();
        }
        self.rounder.valid.next = self.pass_sequencer.round.val();
        self.rounder.wide.next = !self.pass_sequencer.busy.val();
        self.shifted.word.next = self.rounder.rounded.val();
        self.pass_sequencer.rounded.next = self.shifted.low.val();
        self.pass_sequencer.clipped.next = self.rounder.clipped.val();
        self.pass_sequencer.round_done.next = self.rounder.done.val();

        comment!("Butterfly, shared by fold and unfold");
        self.butterfly.word.next = self.shifted.low.val();
        self.butterfly.valid.next = self.pass_sequencer.transform.val();
        self.pass_sequencer.transformed.next = self.butterfly.transformed.val();
        self.pass_sequencer.transformed_valid.next = self.butterfly.transformed_valid.val();

        comment!("Matrix passes");
        self.pass.valid.next = self.pass_sequencer.issue.val();
        self.pass.last.next = self.pass_sequencer.last.val();
        self.pass.address.next = self.pass_sequencer.address.val();
        self.pass.low.next = self.pass_sequencer.low.val();
        self.pass.operand_address.next = self.pass_sequencer.operand_address.val();
        self.pass.flip.next = self.pass_sequencer.flip.val();
        self.pass.align.next = self.pass_sequencer.align.val();
        self.pass.write.next = self.pass_sequencer.write.val();
        self.pass.write_address.next = self.pass_sequencer.write_address.val();
        self.pass.write_lane.next = self.pass_sequencer.write_lane.val();
        self.pass.write_data.next = self.pass_sequencer.write_data.val();
        self.pass_sequencer.row_word.next = self.pass.word.val();
        self.pass_sequencer.row_valid.next = self.pass.word_valid.val();
        self.raw.write.next = self.pass_sequencer.raw_write.val().into();
        self.raw.write_address.next = self.pass_sequencer.raw_write_address.val();
        self.raw.write_data.next = self.pass.word.val();
        self.raw.read.next = true;
        self.raw.read_address.next = self.pass_sequencer.raw_read_address.val();
        self.pass_sequencer.raw_word.next = self.raw.read_data.val();

        comment!("Polynomials: unfold, search, banks");
        self.unfold.start.next = self.begin_frame.val();
        self.unfold.transformed.next = self.butterfly.transformed.val();
        self.unfold.valid.next = self.butterfly.transformed_valid.val() & self.pass_sequencer.unfolding.val();
        self.search_sequencer.filling.next = self.pass_sequencer.busy.val();
        self.search_sequencer.start.next = self.pass_sequencer.done.val();
        self.search_sequencer.enabled.next = self.condition.q.val();
        self.search_sequencer.wanted.next = self.forces.wanted.val();
        self.banks.odd.next = self.search_sequencer.odd.val();
        self.banks.read_address.next = self.search_sequencer.read_address.val();
        self.banks.write.next = self.search_sequencer.write.val();
        self.banks.write_address.next = self.search_sequencer.write_address.val();
        self.banks.data.next = self.coefficient_shift.halved.val();
        if self.pass_sequencer.busy.val() {
            self.banks.write.next = self.unfold.write.val();
            self.banks.write_address.next = self.unfold.address.val();
            self.banks.data.next = self.unfold.data.val();
        }

        comment!("Taylor shift along x, then along y");
        self.along_x.word.next = self.banks.word.val();
        self.along_x.element.next = self.search_sequencer.x_element.val();
        self.along_x.top.next = self.search_sequencer.x_top.val();
        self.along_x.moves.next = self.search_sequencer.x_moves.val();
        self.along_x.down.next = self.search_sequencer.x_down.val();
        self.transposed.write.next = true.into();
        self.transposed.write_address.next = self.search_sequencer.turn_write.val();
        self.transposed.write_data.next = self.along_x.moved.val();
        self.transposed.read.next = true;
        self.transposed.read_address.next = self.search_sequencer.turn_read.val();
        self.along_y.word.next = self.transposed.read_data.val();
        self.along_y.element.next = self.search_sequencer.y_element.val();
        self.along_y.top.next = self.search_sequencer.y_top.val();
        self.along_y.moves.next = self.search_sequencer.y_moves.val();
        self.along_y.down.next = self.search_sequencer.y_down.val();
        self.coefficient_shift.word.next = self.along_y.moved.val();
        self.coefficient_shift.halvings.next = self.search_sequencer.halvings.val();

        comment!("Candidates, scores and their comparison");
        self.candidates.word.next = self.coefficient_shift.halved.val();
        self.candidates.cycle.next = self.search_sequencer.cycle.val();
        self.candidates.present.next = self.search_sequencer.present.val();
        self.candidates.sums.next = self.search_sequencer.sums.val();
        self.score.value.next = self.candidates.value.val();
        self.score.index.next = self.candidates.index.val();
        self.score.valid.next = self.candidates.valid.val();
        self.score.sum.next = self.candidates.sum.val();
        self.floors.read.next = true;
        self.floors.read_address.next = self.candidates.index.val();
        self.score.floor.next = self.floors.read_data.val();
        self.floors.write.next = self.score.floor_write.val().into();
        self.floors.write_address.next = self.score.floor_index.val();
        self.floors.write_data.next = self.score.floor_data.val();
        self.totals.read.next = true;
        self.totals.read_address.next = self.score.read_index.val();
        if self.search_sequencer.comparing.val() {
            self.totals.read_address.next = self.search_sequencer.candidate.val();
        }
        self.score.total.next = self.totals.read_data.val();
        self.search_sequencer.total.next = self.totals.read_data.val();
        self.totals.write.next = self.score.write.val().into();
        self.totals.write_address.next = self.score.write_index.val();
        self.totals.write_data.next = self.score.write_data.val();

        comment!("Forces");
        self.forces.start.next = self.search_sequencer.done.val();
        self.forces.place.next = self.reorder.place.val();
        self.forces.value.next = self.banks.word.val();
        self.forces.best_x.next = self.search_sequencer.best_x.val();
        self.forces.best_y.next = self.search_sequencer.best_y.val();
        self.forces.score.next = self.search_sequencer.score.val();
        self.forces.found.next = self.search_sequencer.found.val();
        self.forces.condition.next = self.condition.q.val();
        self.forces.framing.next = self.framing.q.val();
        self.forces.normalise.next = self.pass_sequencer.normalise.val();
        self.forces.rescale.next = self.pass_sequencer.rescale.val();
        self.forces.saturations.next = self.pass_sequencer.saturations.val();
        self.forces.frame_begin.next = self.begin_frame.val();
        self.forces.rounded.next = self.rounder.rounded.val();
        self.forces.clipped.next = self.rounder.clipped.val();
        self.m_axis_tdata.next = self.forces.m_axis_tdata.val();
        self.m_axis_tvalid.next = self.forces.m_axis_tvalid.val();
        self.m_axis_tlast.next = self.forces.m_axis_tlast.val();
        self.forces.m_axis_tready.next = self.m_axis_tready.val();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::tests::{engine_subject, stimulus, Frames};
    use crate::language::testbench::check_with_defects;
    use crate::language::Change;
    use crate::scenes::model;

    #[test]
    fn beats_leave_in_the_cycles_of_the_model() {
        let model = model(4, 4, "[search]\nmu_max = 0.3\n[hardware]\nboard = \"icebreaker\"\n");
        let subject = |changes: &[Change]| engine_subject!(Engine::new(&model), changes);
        let defects = [Change::value("", "m_axis_tlast", |k| k.constant(1, 0))];
        check_with_defects(subject, &stimulus(&model, 4), || Frames::new(model.clone()), &defects);
    }
}
