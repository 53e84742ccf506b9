//! The parallel engine: all stages connected, one subarray after the other through the same matrices.
//!
//! ```text
//! prepare -> receive -> normalise -> fold -> pass -> rescale -> unfold -> search -> forces -> send
//!  s_axis -->  |  frame buffer         |      ^________|  v_ij             |                  |--> m_axis
//!              '--- magnitude, signs --'                                   '--- μ, score -----'
//! ```
//! Where a network gives μ, rows of its layers go from `pass` to `estimate`, whose images are operands again; `relax`, between
//! `rescale` and `unfold`, adds v_00 to the products of each step. In other scenes both are wires.
//!
//! Where each contact has a μ of its own, `contacts` starts the stages in turn: v_00 goes to `segment`; for each contact `window`
//! gives the operands of the first layer; for each step `shear` gives those of the products; `label_beats` adds the labels to the
//! stream, or `resultants` sums the forces of each label. The frame buffer is free when the last window has been read.
//!
//! Overlaps shorten the frame interval:
//! - While a frame is computed, the next is received; the frame buffer is free as soon as `fold` has read it.
//! - The passes of several rows of subarrays begin once the first row is in the buffer. [`Arrival`] holds the first
//!   subarray back until the frame is complete.
//! - While one subarray is searched, the v_ij of the next are computed, or those of the next frame's first.
//! - Subarrays whose values are complete are sent while the next ones are searched.
//! - While a frame is sent, the next is searched. Of a single subarray that is searched, only the last sweep waits until the
//!   previous frame has been sent. Several subarrays, and one that is not searched, are handed over only then: their first
//!   sweep reads the memory that the next frame is written to, and must not wait.
//!
//! Without a search, and where block RAM is too short for a memory of the next frame, a frame starts when the previous
//! one has been sent. Where the case is chosen per frame, it is chosen while the frame is received. [`ReceiveStage`] and [`SearchStage`] are
//! the stages that differ.

use dermis_golden::fixed::Model;
use dermis_golden::spec::quads::Quads;
use dermis_golden::spec::scene::Condition;
use rust_hdl::prelude::*;

use crate::language::RustHdl;
use crate::ports::one_of;
use crate::primitives::{
    count_bits, largest, Arrival, BitDelay, CaseCounter, Dff, EnableRegister, FrameCycles, OperandSource, StatusSource,
    SATURATION_BITS,
};
use crate::stage_list::engine;
use crate::stages::{
    Banks, Contacts, Estimate, Fold, Forces, LabelBeats, Normalise, Pass, Prepare, Receive, ReceivePorts, Relax,
    Rescale, Resultants, Search, SearchPorts, Segment, Send, Shear, Unfold, Unsearched, Window,
};
use crate::wire::Wire;

one_of! {
    /// The stage that receives frames.
    pub enum ReceiveStage: ReceivePorts {
        /// One case.
        Receive,
        /// Several cases, one of which is chosen per frame.
        Banks,
    }
}

impl ReceiveStage {
    fn new(model: &Model) -> Self {
        match model.chooses() {
            false => ReceiveStage::Receive(Box::new(Receive::new(model, 0))),
            true => ReceiveStage::Banks(Box::new(Banks::new(model))),
        }
    }

    /// Whether a case is chosen per frame.
    pub(crate) fn chooses(&self) -> bool {
        matches!(self, ReceiveStage::Banks(_))
    }
}

one_of! {
    /// The stage that finds p(μ*).
    pub enum SearchStage: SearchPorts {
        /// With a search for μ*.
        Search,
        /// μ* is 0.
        Unsearched,
    }
}

impl SearchStage {
    /// Values that are output in a cycle.
    pub(crate) fn width(&self) -> usize {
        match self {
            SearchStage::Search(search) => search.width(),
            SearchStage::Unsearched(_) => Quads::LANES,
        }
    }

    fn new(model: &Model) -> Self {
        match model.searches() {
            true => SearchStage::Search(Box::new(Search::new(model))),
            false => SearchStage::Unsearched(Box::new(Unsearched::new(model))),
        }
    }
}

engine! {
    /// The parallel engine, the top module of the generated hardware.
    ///
    /// ```text
    ///                +---------+
    ///  s_axis_t* --> | engine  | --> m_axis_t*
    ///      clk, rst  +---------+
    /// ```
    /// | port | direction | width | meaning |
    /// |---|---|---|---|
    /// | `s_axis_tdata` | in | `stream_bits` | a taxel's code, two's complement; row-major, frame after frame; or a byte of an image of tables |
    /// | `m_axis_tdata` | out | 96 | `{fz, fy, fx}`, 32 bits signed each, row-major; then the status beats |
    /// | `…tvalid`, `…tready`, `…tlast` | | 1 | AXI-Stream handshake; `tlast` on a frame's last beat |
    ///
    /// Reset is synchronous; it clears all control registers, not the data.
    pub struct Engine {
        stages {
            prepare: Prepare => "stages/prepare.rs",
            receive: ReceiveStage => "stages/receive.rs",
            normalise: Normalise => "stages/normalise.rs",
            fold: RustHdl<Fold> => "stages/fold.rs",
            pass: Pass => "stages/pass.rs",
            segment: Segment => "stages/segment.rs",
            contacts: Contacts => "stages/contacts.rs",
            window: Window => "stages/window.rs",
            estimate: Estimate => "stages/estimate.rs",
            shear: Shear => "stages/shear.rs",
            rescale: Rescale => "stages/rescale.rs",
            relax: Relax => "stages/relax.rs",
            unfold: Unfold => "stages/unfold.rs",
            search: SearchStage => "stages/search.rs",
            forces: Forces => "stages/forces.rs",
            send: Send => "stages/send.rs",
            label_beats: LabelBeats => "stages/label_beats.rs",
            resultants: Resultants => "stages/resultants.rs",
        }
        control {
            operand_source: OperandSource,
            status_source: StatusSource,
            begins: RustHdl<BitDelay>,
            arrival: RustHdl<Arrival>,
            computing: RustHdl<Dff>,
            first: RustHdl<Dff>,
            filled: RustHdl<Dff>,
            searching: RustHdl<Dff>,
            sending: RustHdl<Dff>,
            condition: RustHdl<Dff>,
            framing: RustHdl<Dff>,
            searched_condition: RustHdl<Dff>,
            searched_first: RustHdl<Dff>,
            searched_last: RustHdl<Dff>,
            searched_framing: RustHdl<Dff>,
            sent_framing: RustHdl<Dff>,
            frame_case: RustHdl<EnableRegister>,
            searched_case: RustHdl<EnableRegister>,
            sent_case: RustHdl<EnableRegister>,
            searched_part: RustHdl<EnableRegister>,
            searched_normalise: RustHdl<EnableRegister>,
            searched_rescale: RustHdl<EnableRegister>,
            searched_saturations: RustHdl<EnableRegister>,
            searched_damaged: RustHdl<EnableRegister>,
            received_frames: RustHdl<EnableRegister>,
            frame_frames: RustHdl<EnableRegister>,
            searched_frames: RustHdl<EnableRegister>,
            frame_cycles: FrameCycles,
            part: RustHdl<CaseCounter>,
            again: RustHdl<BitDelay>,
            handed: RustHdl<BitDelay>,
            seeks: RustHdl<BitDelay>,
            opens: RustHdl<BitDelay>,
            both_signs: Constant<Bit>,
            ahead: Constant<Bit>,
            single: Constant<Bit>,
            begin_frame: Signal<Local, Bit>,
            start: Signal<Local, Bit>,
            leaves: Signal<Local, Bit>,
            passed: Signal<Local, Bit>,
            complete: Signal<Local, Bit>,
            unsent: Signal<Local, Bit>,
            behind: Signal<Local, Bit>,
            hand_over: Signal<Local, Bit>,
            begin_send: Signal<Local, Bit>,
        }
    }
}

impl Engine {
    /// The engine of `model`.
    pub fn new(model: &Model) -> Self {
        let formats = model.formats();
        let bits = formats.input_bits as usize;
        let counts: Vec<usize> = model.cases().iter().map(|case| case.parts.len()).collect();
        let which = count_bits(counts.len());
        let (prepare, normalise, rescale) = (Prepare::new(model), Normalise::new(bits), Rescale::new(model));
        let (forces, resultants) = (Forces::new(model), Resultants::new(model));
        let frames = || EnableRegister::new(prepare.frames.width()).constant(!model.scene.input.has_memory());
        let mut engine = Engine {
            clk: Default::default(),
            rst: Default::default(),
            s_axis_tdata: Wire::new(model.stream_bits() as usize),
            s_axis_tvalid: Default::default(),
            s_axis_tready: Default::default(),
            s_axis_tlast: Default::default(),
            m_axis_tdata: Wire::new(resultants.m_axis_tdata.width()),
            m_axis_tvalid: Default::default(),
            m_axis_tready: Default::default(),
            m_axis_tlast: Default::default(),
            receive: ReceiveStage::new(model),
            fold: RustHdl::new(Fold::new(model)),
            pass: Pass::new(model),
            estimate: Estimate::new(model),
            segment: Segment::of_model(model),
            contacts: Contacts::new(model),
            window: Window::new(model),
            label_beats: LabelBeats::new(model, forces.m_axis_tdata.width()),
            shear: Shear::new(model),
            operand_source: OperandSource::new(model),
            status_source: StatusSource::new(model),
            relax: Relax::new(formats),
            unfold: Unfold::new(model),
            search: SearchStage::new(model),
            forces,
            send: Send::new(model),
            resultants,
            begins: RustHdl::new(BitDelay::new(1)),
            arrival: RustHdl::new(Arrival::new(model.begins_with_first_row())),
            computing: Default::default(),
            first: Default::default(),
            filled: Default::default(),
            searching: Default::default(),
            sending: Default::default(),
            condition: Default::default(),
            framing: Default::default(),
            searched_condition: Default::default(),
            searched_first: Default::default(),
            searched_last: Default::default(),
            searched_framing: Default::default(),
            sent_framing: Default::default(),
            frame_case: RustHdl::new(EnableRegister::new(which).constant(!model.chooses())),
            searched_case: RustHdl::new(EnableRegister::new(which).constant(!model.chooses())),
            sent_case: RustHdl::new(EnableRegister::new(which).constant(!model.chooses())),
            searched_part: RustHdl::new(EnableRegister::new(count_bits(largest(&counts)))),
            searched_normalise: RustHdl::new(EnableRegister::new(normalise.shift.width())),
            searched_rescale: RustHdl::new(EnableRegister::new(rescale.shift.width())),
            searched_saturations: RustHdl::new(EnableRegister::new(SATURATION_BITS)),
            searched_damaged: RustHdl::new(EnableRegister::new(1).constant(!model.has_coefficient_check())),
            received_frames: RustHdl::new(frames()),
            frame_frames: RustHdl::new(frames()),
            searched_frames: RustHdl::new(frames()),
            prepare,
            normalise,
            rescale,
            frame_cycles: Default::default(),
            part: RustHdl::new(CaseCounter::new(&counts)),
            again: RustHdl::new(BitDelay::new(1)),
            handed: RustHdl::new(BitDelay::new(1)),
            seeks: RustHdl::new(BitDelay::new(1)),
            opens: RustHdl::new(BitDelay::new(1)),
            both_signs: Constant::new(model.scene.partition.condition == Condition::BothSigns),
            ahead: Constant::new(model.resources.overlaps),
            single: Constant::new(counts.iter().all(|&count| count == 1)),
            begin_frame: Default::default(),
            start: Default::default(),
            leaves: Default::default(),
            passed: Default::default(),
            complete: Default::default(),
            unsent: Default::default(),
            behind: Default::default(),
            hand_over: Default::default(),
            begin_send: Default::default(),
        };
        engine.connect_all();
        engine
    }
}

impl Logic for Engine {
    #[hdl_gen]
    fn update(&mut self) {
        self.prepare.clk.next = self.clk.val();
        self.prepare.rst.next = self.rst.val();
        self.receive.clk.next = self.clk.val();
        self.normalise.clk.next = self.clk.val();
        self.fold.clk.next = self.clk.val();
        self.pass.clk.next = self.clk.val();
        self.estimate.clk.next = self.clk.val();
        self.estimate.rst.next = self.prepare.restart.val();
        self.rescale.clk.next = self.clk.val();
        self.segment.clk.next = self.clk.val();
        self.segment.rst.next = self.prepare.restart.val();
        self.contacts.clk.next = self.clk.val();
        self.contacts.rst.next = self.prepare.restart.val();
        self.window.clk.next = self.clk.val();
        self.window.rst.next = self.prepare.restart.val();
        self.label_beats.clk.next = self.clk.val();
        self.label_beats.rst.next = self.prepare.restart.val();
        self.shear.clk.next = self.clk.val();
        self.shear.rst.next = self.prepare.restart.val();
        self.operand_source.clk.next = self.clk.val();
        self.operand_source.rst.next = self.prepare.restart.val();
        self.relax.clk.next = self.clk.val();
        self.relax.rst.next = self.prepare.restart.val();
        self.unfold.clk.next = self.clk.val();
        self.search.clk.next = self.clk.val();
        self.forces.clk.next = self.clk.val();
        self.send.clk.next = self.clk.val();
        self.frame_cycles.clk.next = self.clk.val();
        self.part.clk.next = self.clk.val();
        self.again.clk.next = self.clk.val();
        self.again.rst.next = self.prepare.restart.val();
        self.handed.clk.next = self.clk.val();
        self.handed.rst.next = self.prepare.restart.val();
        self.seeks.clk.next = self.clk.val();
        self.seeks.rst.next = self.prepare.restart.val();
        self.opens.clk.next = self.clk.val();
        self.opens.rst.next = self.prepare.restart.val();
        self.begins.clk.next = self.clk.val();
        self.begins.rst.next = self.prepare.restart.val();
        self.arrival.clk.next = self.clk.val();
        self.arrival.rst.next = self.prepare.restart.val();
        self.frame_cycles.rst.next = self.prepare.restart.val();
        self.computing.clk.next = self.clk.val();
        self.first.clk.next = self.clk.val();
        self.filled.clk.next = self.clk.val();
        self.searching.clk.next = self.clk.val();
        self.sending.clk.next = self.clk.val();
        self.condition.clk.next = self.clk.val();
        self.framing.clk.next = self.clk.val();
        self.searched_condition.clk.next = self.clk.val();
        self.searched_first.clk.next = self.clk.val();
        self.searched_last.clk.next = self.clk.val();
        self.searched_framing.clk.next = self.clk.val();
        self.sent_framing.clk.next = self.clk.val();
        self.frame_case.clk.next = self.clk.val();
        self.searched_case.clk.next = self.clk.val();
        self.sent_case.clk.next = self.clk.val();
        self.searched_part.clk.next = self.clk.val();
        self.searched_normalise.clk.next = self.clk.val();
        self.searched_rescale.clk.next = self.clk.val();
        self.searched_saturations.clk.next = self.clk.val();
        self.searched_damaged.clk.next = self.clk.val();
        self.received_frames.clk.next = self.clk.val();
        self.frame_frames.clk.next = self.clk.val();
        self.searched_frames.clk.next = self.clk.val();
        self.receive.rst.next = self.prepare.restart.val();
        self.fold.rst.next = self.prepare.restart.val();
        self.pass.rst.next = self.prepare.restart.val();
        self.rescale.rst.next = self.prepare.restart.val();
        self.unfold.rst.next = self.prepare.restart.val();
        self.search.rst.next = self.prepare.restart.val();
        self.forces.rst.next = self.prepare.restart.val();
        self.send.rst.next = self.prepare.restart.val();
        self.resultants.clk.next = self.clk.val();
        self.resultants.rst.next = self.prepare.restart.val();

        comment!("A frame starts: buffer full, or its first row of subarrays in it;");
        comment!("previous frame out of the passes");
        self.arrival.row_end.next = self.receive.row_end.val();
        self.arrival.dropped.next = self.receive.dropped.val();
        self.arrival.free.next = self.contacts.free.val();
        self.arrival.full.next = self.receive.full.val();
        self.arrival.begins.next = self.begins.q.val();
        self.begins.d.next = self.arrival.ready.val()
            & !self.begins.q.val()
            & !self.computing.q.val()
            & (!self.sending.q.val() | self.ahead.val());
        self.begin_frame.next = self.begins.q.val();

        comment!("Case of the frame in the passes, searched, sent");
        self.frame_case.keep.next = self.begin_frame.val();
        self.frame_case.word.next = self.receive.which.val();
        self.fold.which.next = self.frame_case.kept.val();
        self.contacts.which.next = self.frame_case.kept.val();
        self.pass.which.next = self.contacts.section.val();
        self.rescale.which.next = self.frame_case.kept.val();
        self.unfold.which.next = self.frame_case.kept.val();
        self.search.fill_which.next = self.frame_case.kept.val();
        self.search.which.next = self.searched_case.kept.val();
        self.part.which.next = self.frame_case.kept.val();
        self.forces.which.next = self.sent_case.kept.val();
        self.send.which.next = self.sent_case.kept.val();

        comment!("A subarray goes to the search when the search is idle;");
        comment!("the first of several also waits for the previous send,");
        comment!("as does one that is not searched: its only sweep reads");
        comment!("the memory that the next frame is written to");
        self.begin_send.next = self.contacts.begins.val() & self.searched_first.q.val();
        self.sent_case.keep.next = self.begin_send.val();
        self.sent_case.word.next = self.searched_case.kept.val();
        self.sending.d.next =
            (self.begin_send.val() | (self.sending.q.val() & !self.send.done.val())) & !self.prepare.restart.val();
        self.complete.next = self.filled.q.val() | self.unfold.done.val();
        self.arrival.complete.next = self.complete.val();
        self.unsent.next = self.sending.q.val() & !self.send.done.val();
        self.behind.next = self.first.q.val() & self.unsent.val() & (!self.single.val() | !self.condition.q.val());
        self.hand_over.next = self.complete.val()
            & !self.arrival.waits.val()
            & !self.behind.val()
            & (!self.searching.q.val() | self.search.done.val());
        self.leaves.next = self.hand_over.val() & self.part.last.val();
        self.passed.next = self.contacts.ended.val() & self.searched_last.q.val();
        if self.ahead.val() {
            self.passed.next = self.leaves.val();
        }
        self.computing.d.next = (self.begin_frame.val()
            | (self.computing.q.val() & !self.passed.val() & !self.arrival.discards.val()))
            & !self.prepare.restart.val();
        self.searched_case.keep.next = self.hand_over.val();
        self.searched_case.word.next = self.frame_case.kept.val();
        self.handed.d.next = self.hand_over.val();
        self.opens.d.next = self.hand_over.val() & self.first.q.val();
        self.filled.d.next =
            self.complete.val() & !self.hand_over.val() & !self.arrival.discards.val() & !self.prepare.restart.val();
        self.searching.d.next =
            (self.hand_over.val() | (self.searching.q.val() & !self.search.done.val())) & !self.prepare.restart.val();
        self.first.d.next = self.begin_frame.val() | (self.first.q.val() & !self.hand_over.val());
        self.searched_condition.d.next = self.searched_condition.q.val();
        self.searched_first.d.next = self.searched_first.q.val();
        self.searched_last.d.next = self.searched_last.q.val();
        self.searched_framing.d.next = self.searched_framing.q.val();
        self.sent_framing.d.next = self.sent_framing.q.val();
        if self.begin_send.val() {
            self.sent_framing.d.next = self.searched_framing.q.val();
        }
        if self.hand_over.val() {
            self.searched_condition.d.next = self.condition.q.val();
            self.searched_first.d.next = self.first.q.val();
            self.searched_last.d.next = self.part.last.val();
            self.searched_framing.d.next = self.framing.q.val();
        }
        self.searched_part.keep.next = self.hand_over.val();
        self.searched_part.word.next = self.part.value.val();
        comment!("Captured a cycle later, before the stages restart");
        self.searched_normalise.keep.next = self.handed.q.val();
        self.searched_normalise.word.next = self.normalise.shift.val();
        self.searched_rescale.keep.next = self.handed.q.val();
        self.searched_rescale.word.next = self.rescale.shift.val();
        self.searched_saturations.keep.next = self.handed.q.val();
        self.searched_saturations.word.next = self.relax.saturations.val();
        self.searched_damaged.keep.next = self.handed.q.val();
        self.searched_damaged.word.next = self.pass.damaged.val();

        comment!("Frames in a sliding mean follow their frame:");
        comment!("received, in the passes, searched");
        self.received_frames.keep.next = self.receive.accept.val();
        self.received_frames.word.next = self.prepare.frames.val();
        self.frame_frames.keep.next = self.begin_frame.val();
        self.frame_frames.word.next = self.received_frames.kept.val();
        self.searched_frames.keep.next = self.hand_over.val();
        self.searched_frames.word.next = self.frame_frames.kept.val();
        self.forces.frames.next = self.searched_frames.kept.val();

        comment!("Then the next subarray starts");
        self.part.clear.next = self.prepare.restart.val();
        self.part.enable.next = self.hand_over.val();
        self.again.d.next = self.hand_over.val() & !self.part.last.val();
        self.start.next = self.begin_frame.val() | self.again.q.val();
        comment!("Waiting for frames or their rest is not counted");
        self.frame_cycles.begin_frame.next = self.begin_frame.val();
        self.frame_cycles.waits.next = self.complete.val() & self.first.q.val() & !self.hand_over.val();
        self.frame_cycles.hand_over.next = self.hand_over.val() & self.first.q.val();
        self.frame_cycles.stalled.next = self.search.stalled.val();
        self.condition.d.next = self.condition.q.val();
        self.framing.d.next = self.framing.q.val();
        if self.start.val() {
            self.condition.d.next = self.receive.positive.val() | self.receive.negative.val();
            if self.both_signs.val() {
                self.condition.d.next = self.receive.positive.val() & self.receive.negative.val();
            }
        }
        if self.arrival.arrives.val() {
            self.framing.d.next = self.receive.framing.val();
        }

        comment!("Tables are written while no frame is under way");
        self.prepare.idle.next = !self.receive.full.val()
            & !self.begins.q.val()
            & !self.computing.q.val()
            & !self.filled.q.val()
            & !self.searching.q.val()
            & !self.sending.q.val()
            & !self.resultants.m_axis_tvalid.val();
        self.pass.coefficient_write.next = self.prepare.coefficient_write.val();
        self.pass.coefficient_word.next = self.prepare.coefficient_word.val();
        self.pass.coefficient_pair.next = self.prepare.coefficient_pair.val();
        self.pass.coefficient_data.next = self.prepare.coefficient_data.val();
        self.receive.floor.next = self.prepare.noise_floor.val();
        self.window.floor.next = self.prepare.noise_floor.val();
        self.forces.threshold.next = self.prepare.threshold.val();
        self.forces.version.next = self.prepare.version.val();
        self.forces.incomplete.next = self.prepare.incomplete.val();

        comment!("prepare -> receive -> normalise -> fold");
        self.prepare.s_axis_tdata.next = self.s_axis_tdata.val();
        self.prepare.s_axis_tvalid.next = self.s_axis_tvalid.val();
        self.prepare.s_axis_tlast.next = self.s_axis_tlast.val();
        self.s_axis_tready.next = self.prepare.s_axis_tready.val();
        self.receive.s_axis_tdata.next = self.prepare.m_axis_tdata.val();
        self.receive.s_axis_tvalid.next = self.prepare.m_axis_tvalid.val();
        self.receive.s_axis_tlast.next = self.prepare.m_axis_tlast.val();
        self.prepare.m_axis_tready.next = self.receive.s_axis_tready.val();
        self.receive.quad_address.next = self.contacts.quad_address.val();
        self.receive.free.next = self.contacts.free.val();
        self.receive.reported.next = self.arrival.arrives.val();
        self.receive.part.next = self.part.value.val();
        self.normalise.start.next = self.start.val();
        self.normalise.magnitude.next = self.receive.magnitude.val();
        self.normalise.quad.next = self.receive.quad.val();
        self.fold.begin_frame.next = self.begin_frame.val();
        self.fold.start.next = self.start.val();
        self.fold.last_part.next = self.part.last.val();
        self.fold.normalised.next = self.normalise.shifted.val();

        comment!("fold -> pass -> rescale -> unfold, and back to pass");
        self.pass.start.next = self.contacts.pass_start.val();
        self.fold.read_address.next = self.pass.input_address.val();
        self.pass.input_quad.next = self.fold.read_quad.val();
        self.rescale.start.next = self.start.val();
        self.rescale.quad.next = self.pass.quad.val();
        self.rescale.quad_valid.next = self.pass.quad_valid.val();
        self.rescale.quad_soon.next = self.pass.quad_soon.val();
        self.estimate.start.next = self.contacts.estimate_start.val();
        self.estimate.clear.next = self.start.val();
        self.estimate.enabled.next = self.contacts.enabled.val();
        self.estimate.quad.next = self.pass.quad.val();
        self.estimate.valid.next = self.pass.layer_valid.val();
        self.relax.start.next = self.start.val();
        self.relax.words.next = self.rescale.words.val();
        self.relax.words_valid.next = self.rescale.words_valid.val();
        self.relax.short.next = self.rescale.operands.val();
        self.relax.short_valid.next = self.rescale.operands_valid.val();
        self.relax.rescaled.next = self.rescale.saturations.val();
        self.relax.estimated.next = self.estimate.saturations.val();
        self.relax.sheared.next = self.shear.saturations.val();
        self.operand_source.own.next = self.relax.operands.val();
        self.operand_source.own_valid.next = self.relax.operands_valid.val();
        self.operand_source.images.next = self.estimate.operands.val();
        self.operand_source.images_valid.next = self.estimate.operands_valid.val();
        self.pass.vector_quad.next = self.operand_source.quad.val();
        self.pass.vector_valid.next = self.operand_source.valid.val();
        self.pass.position_x.next = self.estimate.position_x.val();
        self.pass.position_y.next = self.estimate.position_y.val();
        self.unfold.start.next = self.start.val();
        self.unfold.words.next = self.relax.sums.val();
        self.unfold.words_valid.next = self.relax.sums_valid.val();

        comment!("Contacts: segment -> window -> pass, relax -> shear -> pass");
        self.contacts.start.next = self.start.val();
        self.contacts.readable.next = self.fold.readable.val();
        self.contacts.folded.next = self.fold.free.val();
        self.contacts.taxels_valid.next = self.unfold.taxels_valid.val();
        self.contacts.segmented.next = self.segment.done.val();
        self.contacts.count.next = self.segment.count.val();
        self.contacts.known.next = self.estimate.known.val();
        self.contacts.condition.next = self.condition.q.val();
        self.contacts.positive.next = self.window.positive.val();
        self.contacts.negative.next = self.window.negative.val();
        self.contacts.position_x.next = self.estimate.position_x.val();
        self.contacts.position_y.next = self.estimate.position_y.val();
        self.contacts.ln_sigma.next = self.estimate.ln_sigma.val();
        self.contacts.values_begin.next = self.search.values_begin.val();
        self.contacts.searched.next = self.search.done.val();
        self.contacts.fold_address.next = self.fold.quad_address.val();
        self.contacts.window_address.next = self.window.quad_address.val();
        self.contacts.shear_address.next = self.shear.label_address.val();
        self.contacts.forces_address.next = self.forces.label_address.val();
        self.contacts.sent_address.next = self.label_beats.label_address.val();
        self.contacts.sends_labels.next = self.label_beats.reads.val();
        self.segment.fill_quad.next = self.unfold.taxels.val();
        self.segment.fill.next = self.contacts.fills.val();
        self.segment.fill_address.next = self.unfold.address.val();
        self.segment.start.next = self.contacts.segment_start.val();
        self.segment.label_address.next = self.contacts.label_address.val();
        self.segment.contact.next = self.contacts.contact.val();
        self.window.start.next = self.contacts.window_start.val();
        self.window.middle_row.next = self.segment.middle_row.val();
        self.window.middle_col.next = self.segment.middle_col.val();
        self.window.label.next = self.contacts.label.val();
        self.window.quad.next = self.receive.quad.val();
        self.window.labels.next = self.segment.labels.val();
        self.operand_source.window_quad.next = self.window.write_quad.val();
        self.operand_source.mask.next = self.window.mask_quad.val();
        self.operand_source.window_valid.next = self.window.write.val();
        self.shear.clear.next = self.start.val();
        self.shear.operands.next = self.relax.operands.val();
        self.shear.operands_valid.next = self.relax.operands_valid.val();
        self.shear.start.next = self.contacts.shear_start.val();
        self.shear.labels.next = self.segment.labels.val();
        self.shear.positions_x.next = self.contacts.positions_x.val();
        self.shear.positions_y.next = self.contacts.positions_y.val();
        self.operand_source.sheared.next = self.shear.sheared.val();
        self.operand_source.sheared_valid.next = self.shear.sheared_valid.val();

        comment!("unfold -> search");
        self.search.fill_quad.next = self.unfold.taxels.val();
        self.search.fill.next = self.unfold.taxels_valid.val();
        self.search.fill_index.next = self.unfold.index.val();
        self.search.fill_address.next = self.unfold.address.val();
        self.seeks.d.next = self.handed.q.val();
        self.search.start.next = self.seeks.q.val();
        self.search.enabled.next = self.searched_condition.q.val();
        self.search.ready.next = !self.unsent.val() | !self.single.val();

        comment!("search -> forces -> send");
        self.forces.values.next = self.search.values.val();
        self.forces.values_valid.next = self.search.values_valid.val();
        self.forces.begin_frame.next = self.begin_frame.val();
        if self.ahead.val() {
            self.forces.begin_frame.next = self.opens.q.val();
            if self.single.val() {
                self.forces.begin_frame.next = self.search.settled.val();
            }
        }
        self.status_source.settled.next = self.search.settled.val();
        self.status_source.subarray.next = self.searched_part.kept.val();
        self.status_source.searched.next = self.searched_condition.q.val();
        self.status_source.best_x.next = self.search.best_x.val();
        self.status_source.best_y.next = self.search.best_y.val();
        self.status_source.best_score.next = self.search.score.val();
        self.status_source.candidate.next = self.search.found.val();
        self.status_source.mu_x.next = self.estimate.position_x.val();
        self.status_source.mu_y.next = self.estimate.position_y.val();
        self.status_source.ln_sigma.next = self.estimate.ln_sigma.val();
        self.status_source.told.next = self.contacts.told.val();
        self.status_source.told_label.next = self.contacts.told_label.val();
        self.status_source.told_x.next = self.contacts.told_x.val();
        self.status_source.told_y.next = self.contacts.told_y.val();
        self.status_source.told_ln_sigma.next = self.contacts.told_ln_sigma.val();
        self.status_source.told_condition.next = self.contacts.told_condition.val();
        self.forces.labels.next = self.segment.labels.val();
        self.forces.overflow.next = self.segment.overflow.val();
        self.forces.start.next = self.status_source.start.val();
        self.forces.part.next = self.status_source.part.val();
        self.forces.position_x.next = self.status_source.position_x.val();
        self.forces.position_y.next = self.status_source.position_y.val();
        self.forces.score.next = self.status_source.score.val();
        self.forces.found.next = self.status_source.found.val();
        self.forces.normalise.next = self.searched_normalise.kept.val();
        self.forces.rescale.next = self.searched_rescale.kept.val();
        self.forces.saturations.next = self.searched_saturations.kept.val();
        self.forces.damaged.next = self.searched_damaged.kept.val();
        self.forces.condition.next = self.status_source.condition.val();
        self.forces.framing.next = self.sent_framing.q.val();
        self.forces.cycles.next = self.frame_cycles.cycles.val();
        self.send.start.next = self.begin_send.val();
        self.send.begins.next = self.contacts.begins.val();
        self.send.room.next = self.forces.room.val();
        self.forces.offer.next = self.send.offer.val();
        self.forces.beat.next = self.send.beat.val();
        self.forces.beat_part.next = self.send.part.val();
        self.forces.address.next = self.send.address.val();
        self.forces.lane.next = self.send.lane.val();
        self.send.m_axis_tvalid.next = self.forces.m_axis_tvalid.val();
        self.send.m_axis_tlast.next = self.forces.m_axis_tlast.val();
        self.send.m_axis_tready.next = self.label_beats.s_axis_tready.val();
        self.forces.m_axis_tready.next = self.label_beats.s_axis_tready.val();
        self.label_beats.s_axis_tdata.next = self.forces.m_axis_tdata.val();
        self.label_beats.s_axis_tvalid.next = self.forces.m_axis_tvalid.val();
        self.label_beats.s_axis_tlast.next = self.forces.m_axis_tlast.val();
        self.label_beats.labels.next = self.segment.labels.val();
        self.label_beats.m_axis_tready.next = self.resultants.s_axis_tready.val();
        self.resultants.s_axis_tdata.next = self.label_beats.m_axis_tdata.val();
        self.resultants.s_axis_tvalid.next = self.label_beats.m_axis_tvalid.val();
        self.resultants.s_axis_tlast.next = self.label_beats.m_axis_tlast.val();
        self.resultants.m_axis_tready.next = self.m_axis_tready.val();
        self.m_axis_tdata.next = self.resultants.m_axis_tdata.val();
        self.m_axis_tvalid.next = self.resultants.m_axis_tvalid.val();
        self.m_axis_tlast.next = self.resultants.m_axis_tlast.val();
    }
}

#[cfg(test)]
pub(crate) mod tests;
