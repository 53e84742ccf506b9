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
//! one has been sent. Where the case is chosen per frame, it is chosen while the frame is received.

use dermis_golden::fixed::Model;
use dermis_golden::spec::scene::Condition;

use crate::language::{Builder, Expr, Inside, Interface, Outside};
use crate::primitives::{
    count_bits, largest, Arrival, BitDelay, CaseCounter, Dff, EnableRegister, FrameCycles, OperandSource, StatusSource,
    SATURATION_BITS,
};
use crate::stages::{
    Contacts, Estimate, Fold, Forces, LabelBeats, Normalise, Pass, Prepare, Receive, Relax, Rescale, Resultants,
    Search, Segment, Send, Shear, Unfold, Window,
};
use crate::streams::{stage_list, EnginePorts};

/// The parts of the engine that follow from the scene.
pub(crate) struct Parallel {
    prepare: Prepare,
    receive: Receive,
    normalise: Normalise,
    fold: Fold,
    pass: Pass,
    segment: Segment,
    contacts: Contacts,
    window: Window,
    estimate: Estimate,
    shear: Shear,
    rescale: Rescale,
    relax: Relax,
    unfold: Unfold,
    search: Search,
    forces: Forces,
    send: Send,
    label_beats: LabelBeats,
    resultants: Resultants,
    operand_source: OperandSource,
    status_source: StatusSource,
    arrival: Arrival,
    /// Subarrays, by case.
    parts: Vec<usize>,
    /// A subarray without codes of both signs is not searched.
    both_signs: bool,
    /// A frame is computed while the previous one is sent.
    ahead: bool,
    /// There is a sliding mean or a running zero.
    has_memory: bool,
    /// The coefficients are checked.
    checks_coefficients: bool,
}

impl Parallel {
    stage_list! {
        prepare: "stages/prepare.rs",
        receive: "stages/receive.rs",
        normalise: "stages/normalise.rs",
        fold: "stages/fold.rs",
        pass: "stages/pass.rs",
        segment: "stages/segment.rs",
        contacts: "stages/contacts.rs",
        window: "stages/window.rs",
        estimate: "stages/estimate.rs",
        shear: "stages/shear.rs",
        rescale: "stages/rescale.rs",
        relax: "stages/relax.rs",
        unfold: "stages/unfold.rs",
        search: "stages/search.rs",
        forces: "stages/forces.rs",
        send: "stages/send.rs",
        label_beats: "stages/label_beats.rs",
        resultants: "stages/resultants.rs",
    }

    /// The engine of `model`.
    pub(crate) fn new(model: &Model) -> Self {
        let formats = model.formats();
        let bits = formats.input_bits as usize;
        let forces = Forces::new(model);
        Parallel {
            prepare: Prepare::new(model),
            receive: Receive::new(model),
            normalise: Normalise::new(bits),
            fold: Fold::new(model),
            pass: Pass::new(model),
            segment: Segment::of_model(model),
            contacts: Contacts::new(model),
            window: Window::new(model),
            estimate: Estimate::new(model),
            shear: Shear::new(model),
            rescale: Rescale::new(model),
            relax: Relax::new(formats),
            unfold: Unfold::new(model),
            search: Search::new(model),
            send: Send::new(model),
            label_beats: LabelBeats::new(model, forces.widths().m_axis_tdata),
            forces,
            resultants: Resultants::new(model),
            operand_source: OperandSource::new(model),
            status_source: StatusSource::new(model),
            arrival: Arrival::new(model.begins_with_first_row()),
            both_signs: model.scene.partition.condition == Condition::BothSigns,
            ahead: model.resources.overlaps,
            parts: model.cases().iter().map(|case| case.parts.len()).collect(),
            has_memory: model.scene.input.has_memory(),
            checks_coefficients: model.has_coefficient_check(),
        }
    }

    /// Whether every case has one subarray.
    fn is_single(&self) -> bool {
        self.parts.iter().all(|&parts| parts == 1)
    }

    /// Connects the stages.
    pub(crate) fn build<'k>(&'k self, k: &'k Builder, io: EnginePorts<Inside<'k>>) {
        let s = Stages::new(self, k);
        let c = self.control(k, &s);
        self.follow(k, &s, &c);
        s.observe(k);
        s.write_tables(k, &c);
        s.receive_frame(k, &io, &c);
        s.multiply(k, &c);
        s.find_contacts(k, &c);
        self.search(k, &s, &c);
        self.send(k, &s, &c, &io);
    }

    /// What starts the stages and hands their results over.
    fn control<'k>(&self, k: &'k Builder, s: &Stages<'k>) -> Control<'k> {
        let begins = k.instance("begins", BitDelay::new(1));
        let arrival = k.instance("arrival", &self.arrival);
        let computing = k.instance("computing", Dff {});
        let first = k.instance("first", Dff {});
        let filled = k.instance("filled", Dff {});
        let searching = k.instance("searching", Dff {});
        let sending = k.instance("sending", Dff {});
        let condition = k.instance("condition", Dff {});
        let framing = k.instance("framing", Dff {});
        let searched_condition = k.instance("searched_condition", Dff {});
        let searched_first = k.instance("searched_first", Dff {});
        let searched_last = k.instance("searched_last", Dff {});
        let searched_framing = k.instance("searched_framing", Dff {});
        let sent_framing = k.instance("sent_framing", Dff {});
        let case = |name: &str| register(k, name, s.receive.which.bits(), self.parts.len() > 1);
        let [frame_case, searched_case, sent_case] = ["frame_case", "searched_case", "sent_case"].map(case);
        let searched_part = register(k, "searched_part", count_bits(largest(&self.parts)), true);
        let frame_cycles = k.instance("frame_cycles", FrameCycles::default());
        let part = k.instance("part", CaseCounter::new(&self.parts));
        let again = k.instance("again", BitDelay::new(1));
        let handed = k.instance("handed", BitDelay::new(1));
        let seeks = k.instance("seeks", BitDelay::new(1));
        let opens = (self.ahead && !self.is_single()).then(|| k.instance("opens", BitDelay::new(1)));

        let restarted = [&again.rst, &handed.rst, &seeks.rst, &begins.rst, &arrival.rst, &frame_cycles.rst];
        restarted.into_iter().chain(opens.iter().map(|opens| &opens.rst)).for_each(|rst| rst.set(s.prepare.restart));

        k.comment("A frame starts: buffer full, or its first row of subarrays in it;");
        k.comment("previous frame out of the passes");
        arrival.row_end.set(s.receive.row_end);
        arrival.dropped.set(s.receive.dropped);
        arrival.free.set(s.contacts.free);
        arrival.full.set(s.receive.full);
        arrival.begins.set(begins.q);
        let idle = arrival.ready & !begins.q & !computing.q;
        begins.d.set(if self.ahead { idle } else { idle & !sending.q });
        let begin_frame = k.wire("begin_frame", begins.q);

        k.comment("Case of the frame in the passes, searched, sent");
        frame_case.keep.set(begin_frame);
        frame_case.word.set(s.receive.which);
        s.fold.which.set(frame_case.kept);
        s.contacts.which.set(frame_case.kept);
        s.pass.which.set(s.contacts.section);
        s.rescale.which.set(frame_case.kept);
        s.unfold.which.set(frame_case.kept);
        s.search.fill_which.set(frame_case.kept);
        s.search.which.set(searched_case.kept);
        part.which.set(frame_case.kept);
        s.forces.which.set(sent_case.kept);
        s.send.which.set(sent_case.kept);

        k.comment("A subarray goes to the search when the search is idle;");
        k.comment("the first of several also waits for the previous send,");
        k.comment("as does one that is not searched: its only sweep reads");
        k.comment("the memory that the next frame is written to");
        seeks.d.set(handed.q);
        let begin_send = k.wire("begin_send", s.contacts.begins & searched_first.q);
        sent_case.keep.set(begin_send);
        sent_case.word.set(searched_case.kept);
        sending.d.set((begin_send | (sending.q & !s.send.done)) & !s.prepare.restart);
        let complete = k.wire("complete", filled.q | s.unfold.done);
        arrival.complete.set(complete);
        let unsent = k.wire("unsent", sending.q & !s.send.done);
        let behind = first.q & unsent;
        let behind = k.wire("behind", if self.is_single() { behind & !condition.q } else { behind });
        let hand_over = k.wire("hand_over", complete & !arrival.waits & !behind & (!searching.q | s.search.done));
        let passed = if self.ahead { hand_over & part.last } else { s.contacts.ended & searched_last.q };
        let passed = k.wire("passed", passed);
        computing.d.set((begin_frame | (computing.q & !passed & !arrival.discards)) & !s.prepare.restart);
        searched_case.keep.set(hand_over);
        searched_case.word.set(frame_case.kept);
        handed.d.set(hand_over);
        if let Some(opens) = &opens {
            opens.d.set(hand_over & first.q);
        }
        filled.d.set(complete & !hand_over & !arrival.discards & !s.prepare.restart);
        searching.d.set((hand_over | (searching.q & !s.search.done)) & !s.prepare.restart);
        first.d.set(begin_frame | (first.q & !hand_over));
        searched_condition.d.set(hand_over.mux(condition.q, searched_condition.q));
        searched_first.d.set(hand_over.mux(first.q, searched_first.q));
        searched_last.d.set(hand_over.mux(part.last, searched_last.q));
        searched_framing.d.set(hand_over.mux(framing.q, searched_framing.q));
        sent_framing.d.set(begin_send.mux(searched_framing.q, sent_framing.q));
        searched_part.keep.set(hand_over);
        searched_part.word.set(part.value);
        k.comment("Then the next subarray starts");
        part.clear.set(s.prepare.restart);
        part.enable.set(hand_over);
        again.d.set(hand_over & !part.last);
        let start = k.wire("start", begin_frame | again.q);
        k.comment("Waiting for frames or their rest is not counted");
        frame_cycles.begin_frame.set(begin_frame);
        frame_cycles.waits.set(complete & first.q & !hand_over);
        frame_cycles.hand_over.set(hand_over & first.q);
        frame_cycles.stalled.set(s.search.stalled);
        let signs = [s.receive.positive, s.receive.negative];
        let meets = if self.both_signs { signs[0] & signs[1] } else { signs[0] | signs[1] };
        condition.d.set(start.mux(meets, condition.q));
        framing.d.set(arrival.arrives.mux(s.receive.framing, framing.q));
        Control {
            begin_frame,
            arrives: arrival.arrives,
            start,
            part: part.value,
            last_part: part.last,
            condition: condition.q,
            hand_over,
            handed: handed.q,
            seeks: seeks.q,
            opens: opens.map(|opens| opens.q),
            searched_part: searched_part.kept,
            searched_condition: searched_condition.q,
            begin_send,
            unsent,
            sent_framing: sent_framing.q,
            cycles: frame_cycles.cycles,
            computes: begins.q | computing.q | filled.q | searching.q | sending.q,
        }
    }

    /// What follows a frame through its states: received, in the passes, searched.
    fn follow<'k>(&self, k: &'k Builder, s: &Stages<'k>, c: &Control<'k>) {
        let searched_normalise = register(k, "searched_normalise", s.normalise.shift.bits(), true);
        let searched_rescale = register(k, "searched_rescale", s.rescale.shift.bits(), true);
        let searched_saturations = register(k, "searched_saturations", SATURATION_BITS, true);
        let searched_damaged = register(k, "searched_damaged", 1, self.checks_coefficients);
        k.comment("Captured a cycle later, before the stages restart");
        searched_normalise.keep.set(c.handed);
        searched_normalise.word.set(s.normalise.shift);
        searched_rescale.keep.set(c.handed);
        searched_rescale.word.set(s.rescale.shift);
        searched_saturations.keep.set(c.handed);
        searched_saturations.word.set(s.relax.saturations);
        searched_damaged.keep.set(c.handed);
        searched_damaged.word.set(s.pass.damaged);
        s.forces.normalise.set(searched_normalise.kept);
        s.forces.rescale.set(searched_rescale.kept);
        s.forces.saturations.set(searched_saturations.kept);
        s.forces.damaged.set(searched_damaged.kept);

        let frames = |name: &str| register(k, name, s.prepare.frames.bits(), self.has_memory);
        let [received_frames, frame_frames, searched_frames] =
            ["received_frames", "frame_frames", "searched_frames"].map(frames);
        k.comment("Frames in a sliding mean follow their frame:");
        k.comment("received, in the passes, searched");
        received_frames.keep.set(s.receive.accept);
        received_frames.word.set(s.prepare.frames);
        frame_frames.keep.set(c.begin_frame);
        frame_frames.word.set(received_frames.kept);
        searched_frames.keep.set(c.hand_over);
        searched_frames.word.set(frame_frames.kept);
        s.forces.frames.set(searched_frames.kept);
    }

    fn search<'k>(&self, k: &'k Builder, s: &Stages<'k>, c: &Control<'k>) {
        k.comment("unfold -> search");
        s.search.fill_quad.set(s.unfold.taxels);
        s.search.fill.set(s.unfold.taxels_valid);
        s.search.fill_index.set(s.unfold.index);
        s.search.fill_address.set(s.unfold.address);
        s.search.start.set(c.seeks);
        s.search.enabled.set(c.searched_condition);
        s.search.ready.set(if self.is_single() { !c.unsent } else { k.constant(1, 1) });
    }

    fn send<'k>(&self, k: &'k Builder, s: &Stages<'k>, c: &Control<'k>, io: &EnginePorts<Inside<'k>>) {
        k.comment("search -> forces -> send");
        s.forces.values.set(s.search.values);
        s.forces.values_valid.set(s.search.values_valid);
        s.forces.begin_frame.set(match c.opens {
            Some(opens) => opens,
            None if self.ahead => s.search.settled,
            None => c.begin_frame,
        });
        s.status_source.settled.set(s.search.settled);
        s.status_source.subarray.set(c.searched_part);
        s.status_source.searched.set(c.searched_condition);
        s.status_source.best_x.set(s.search.best_x);
        s.status_source.best_y.set(s.search.best_y);
        s.status_source.best_score.set(s.search.score);
        s.status_source.candidate.set(s.search.found);
        s.status_source.mu_x.set(s.estimate.position_x);
        s.status_source.mu_y.set(s.estimate.position_y);
        s.status_source.ln_sigma.set(s.estimate.ln_sigma);
        s.status_source.told.set(s.contacts.told);
        s.status_source.told_label.set(s.contacts.told_label);
        s.status_source.told_x.set(s.contacts.told_x);
        s.status_source.told_y.set(s.contacts.told_y);
        s.status_source.told_ln_sigma.set(s.contacts.told_ln_sigma);
        s.status_source.told_condition.set(s.contacts.told_condition);
        s.forces.labels.set(s.segment.labels);
        s.forces.overflow.set(s.segment.overflow);
        s.forces.start.set(s.status_source.start);
        s.forces.part.set(s.status_source.part);
        s.forces.position_x.set(s.status_source.position_x);
        s.forces.position_y.set(s.status_source.position_y);
        s.forces.score.set(s.status_source.score);
        s.forces.found.set(s.status_source.found);
        s.forces.condition.set(s.status_source.condition);
        s.forces.framing.set(c.sent_framing);
        s.forces.cycles.set(c.cycles);
        s.send.start.set(c.begin_send);
        s.send.begins.set(s.contacts.begins);
        s.send.room.set(s.forces.room);
        s.forces.offer.set(s.send.offer);
        s.forces.beat.set(s.send.beat);
        s.forces.beat_part.set(s.send.part);
        s.forces.address.set(s.send.address);
        s.forces.lane.set(s.send.lane);
        s.send.m_axis_tvalid.set(s.forces.m_axis_tvalid);
        s.send.m_axis_tlast.set(s.forces.m_axis_tlast);
        s.send.m_axis_tready.set(s.label_beats.s_axis_tready);
        s.forces.m_axis_tready.set(s.label_beats.s_axis_tready);
        s.label_beats.s_axis_tdata.set(s.forces.m_axis_tdata);
        s.label_beats.s_axis_tvalid.set(s.forces.m_axis_tvalid);
        s.label_beats.s_axis_tlast.set(s.forces.m_axis_tlast);
        s.label_beats.labels.set(s.segment.labels);
        s.label_beats.m_axis_tready.set(s.resultants.s_axis_tready);
        s.resultants.s_axis_tdata.set(s.label_beats.m_axis_tdata);
        s.resultants.s_axis_tvalid.set(s.label_beats.m_axis_tvalid);
        s.resultants.s_axis_tlast.set(s.label_beats.m_axis_tlast);
        s.resultants.m_axis_tready.set(io.m_axis_tready);
        io.m_axis_tdata.set(s.resultants.m_axis_tdata);
        io.m_axis_tvalid.set(s.resultants.m_axis_tvalid);
        io.m_axis_tlast.set(s.resultants.m_axis_tlast);
    }
}

/// The instance `name` of a register of `bits` bits, wires where what it holds never varies.
fn register<'k>(k: &'k Builder, name: &str, bits: usize, varies: bool) -> Ports<'k, EnableRegister> {
    k.instance(name, EnableRegister::new(bits).constant(!varies))
}

/// Signals of the control.
struct Control<'k> {
    /// A frame enters the passes.
    begin_frame: Expr<'k>,
    /// The first subarray of a frame is complete.
    arrives: Expr<'k>,
    /// A subarray starts, of this index; it is the frame's last; it meets the scene's condition.
    start: Expr<'k>,
    part: Expr<'k>,
    last_part: Expr<'k>,
    condition: Expr<'k>,
    /// A subarray goes to the search; the same one cycle later, and two.
    hand_over: Expr<'k>,
    handed: Expr<'k>,
    seeks: Expr<'k>,
    /// A frame's first subarray went to the search one cycle ago; where several wait for the frame before.
    opens: Option<Expr<'k>>,
    /// The subarray that is searched, and whether it meets the condition.
    searched_part: Expr<'k>,
    searched_condition: Expr<'k>,
    /// A frame is sent from now on; one is being sent.
    begin_send: Expr<'k>,
    unsent: Expr<'k>,
    /// `tlast` was early or missing in the frame that is sent.
    sent_framing: Expr<'k>,
    /// Cycle counter of the frame.
    cycles: Expr<'k>,
    /// A frame is under way behind the frame buffer.
    computes: Expr<'k>,
}

/// The ports of an instance of `B`.
type Ports<'k, B> = <B as Interface>::Ports<Outside<'k>>;

/// The instances of the stages, and of what stands between several.
struct Stages<'k> {
    prepare: Ports<'k, Prepare>,
    receive: Ports<'k, Receive>,
    normalise: Ports<'k, Normalise>,
    fold: Ports<'k, Fold>,
    pass: Ports<'k, Pass>,
    segment: Ports<'k, Segment>,
    contacts: Ports<'k, Contacts>,
    window: Ports<'k, Window>,
    estimate: Ports<'k, Estimate>,
    shear: Ports<'k, Shear>,
    rescale: Ports<'k, Rescale>,
    relax: Ports<'k, Relax>,
    unfold: Ports<'k, Unfold>,
    search: Ports<'k, Search>,
    forces: Ports<'k, Forces>,
    send: Ports<'k, Send>,
    label_beats: Ports<'k, LabelBeats>,
    resultants: Ports<'k, Resultants>,
    operand_source: Ports<'k, OperandSource>,
    status_source: Ports<'k, StatusSource>,
}

impl<'k> Stages<'k> {
    fn new(engine: &'k Parallel, k: &'k Builder) -> Self {
        let stages = Stages {
            prepare: k.instance("prepare", &engine.prepare),
            receive: k.instance("receive", &engine.receive),
            normalise: k.instance("normalise", &engine.normalise),
            fold: k.instance("fold", &engine.fold),
            pass: k.instance("pass", &engine.pass),
            segment: k.instance("segment", &engine.segment),
            contacts: k.instance("contacts", &engine.contacts),
            window: k.instance("window", &engine.window),
            estimate: k.instance("estimate", &engine.estimate),
            shear: k.instance("shear", &engine.shear),
            rescale: k.instance("rescale", &engine.rescale),
            relax: k.instance("relax", &engine.relax),
            unfold: k.instance("unfold", &engine.unfold),
            search: k.instance("search", &engine.search),
            forces: k.instance("forces", &engine.forces),
            send: k.instance("send", &engine.send),
            label_beats: k.instance("label_beats", &engine.label_beats),
            resultants: k.instance("resultants", &engine.resultants),
            operand_source: k.instance("operand_source", &engine.operand_source),
            status_source: k.instance("status_source", &engine.status_source),
        };
        stages.restart();
        stages
    }

    /// A restart clears all stages but the first, which asks for it.
    fn restart(&self) {
        let resets = [
            &self.receive.rst,
            &self.fold.rst,
            &self.pass.rst,
            &self.segment.rst,
            &self.contacts.rst,
            &self.window.rst,
            &self.estimate.rst,
            &self.shear.rst,
            &self.rescale.rst,
            &self.relax.rst,
            &self.unfold.rst,
            &self.search.rst,
            &self.forces.rst,
            &self.send.rst,
            &self.label_beats.rst,
            &self.resultants.rst,
            &self.operand_source.rst,
        ];
        resets.iter().for_each(|rst| rst.set(self.prepare.restart));
    }

    /// What only the test bench reads, and the end of a frame, which a frame that is computed ahead does not wait for.
    fn observe(&self, k: &'k Builder) {
        k.unused([self.receive.taken_word, self.fold.normalised_valid, self.fold.folded, self.fold.folded_valid]);
        k.unused([self.pass.issued, self.pass.step, self.search.compared, self.search.taken]);
        k.unused([self.segment.labelled, self.segment.labelled_quad, self.operand_source.of_window]);
        k.unused([self.contacts.ended]);
    }

    /// Tables are written while no frame is under way.
    fn write_tables(&self, k: &'k Builder, c: &Control<'k>) {
        let s = self;
        k.comment("Tables are written while no frame is under way");
        s.prepare.idle.set(!(s.receive.full | c.computes | s.resultants.m_axis_tvalid));
        s.pass.coefficient_write.set(s.prepare.coefficient_write);
        s.pass.coefficient_word.set(s.prepare.coefficient_word);
        s.pass.coefficient_pair.set(s.prepare.coefficient_pair);
        s.pass.coefficient_data.set(s.prepare.coefficient_data);
        s.receive.floor.set(s.prepare.noise_floor);
        s.window.floor.set(s.prepare.noise_floor);
        s.forces.threshold.set(s.prepare.threshold);
        s.forces.version.set(s.prepare.version);
        s.forces.incomplete.set(s.prepare.incomplete);
    }

    fn receive_frame(&self, k: &'k Builder, io: &EnginePorts<Inside<'k>>, c: &Control<'k>) {
        let s = self;
        k.comment("prepare -> receive -> normalise -> fold");
        s.prepare.s_axis_tdata.set(io.s_axis_tdata);
        s.prepare.s_axis_tvalid.set(io.s_axis_tvalid);
        s.prepare.s_axis_tlast.set(io.s_axis_tlast);
        io.s_axis_tready.set(s.prepare.s_axis_tready);
        s.receive.s_axis_tdata.set(s.prepare.m_axis_tdata);
        s.receive.s_axis_tvalid.set(s.prepare.m_axis_tvalid);
        s.receive.s_axis_tlast.set(s.prepare.m_axis_tlast);
        s.prepare.m_axis_tready.set(s.receive.s_axis_tready);
        s.receive.quad_address.set(s.contacts.quad_address);
        s.receive.free.set(s.contacts.free);
        s.receive.reported.set(c.arrives);
        s.receive.part.set(c.part);
        s.normalise.start.set(c.start);
        s.normalise.magnitude.set(s.receive.magnitude);
        s.normalise.quad.set(s.receive.quad);
        s.fold.begin_frame.set(c.begin_frame);
        s.fold.start.set(c.start);
        s.fold.last_part.set(c.last_part);
        s.fold.normalised.set(s.normalise.shifted);
    }

    fn multiply(&self, k: &'k Builder, c: &Control<'k>) {
        let s = self;
        k.comment("fold -> pass -> rescale -> unfold, and back to pass");
        s.pass.start.set(s.contacts.pass_start);
        s.fold.read_address.set(s.pass.input_address);
        s.pass.input_quad.set(s.fold.read_quad);
        s.rescale.start.set(c.start);
        s.rescale.quad.set(s.pass.quad);
        s.rescale.quad_valid.set(s.pass.quad_valid);
        s.rescale.quad_soon.set(s.pass.quad_soon);
        s.estimate.start.set(s.contacts.estimate_start);
        s.estimate.clear.set(c.start);
        s.estimate.enabled.set(s.contacts.enabled);
        s.estimate.quad.set(s.pass.quad);
        s.estimate.valid.set(s.pass.layer_valid);
        s.relax.start.set(c.start);
        s.relax.words.set(s.rescale.words);
        s.relax.words_valid.set(s.rescale.words_valid);
        s.relax.short.set(s.rescale.operands);
        s.relax.short_valid.set(s.rescale.operands_valid);
        s.relax.rescaled.set(s.rescale.saturations);
        s.relax.estimated.set(s.estimate.saturations);
        s.relax.sheared.set(s.shear.saturations);
        s.operand_source.own.set(s.relax.operands);
        s.operand_source.own_valid.set(s.relax.operands_valid);
        s.operand_source.images.set(s.estimate.operands);
        s.operand_source.images_valid.set(s.estimate.operands_valid);
        s.pass.vector_quad.set(s.operand_source.quad);
        s.pass.vector_valid.set(s.operand_source.valid);
        s.pass.position_x.set(s.estimate.position_x);
        s.pass.position_y.set(s.estimate.position_y);
        s.unfold.start.set(c.start);
        s.unfold.words.set(s.relax.sums);
        s.unfold.words_valid.set(s.relax.sums_valid);
    }

    fn find_contacts(&self, k: &'k Builder, c: &Control<'k>) {
        let s = self;
        k.comment("Contacts: segment -> window -> pass, relax -> shear -> pass");
        s.contacts.start.set(c.start);
        s.contacts.readable.set(s.fold.readable);
        s.contacts.folded.set(s.fold.free);
        s.contacts.taxels_valid.set(s.unfold.taxels_valid);
        s.contacts.segmented.set(s.segment.done);
        s.contacts.count.set(s.segment.count);
        s.contacts.known.set(s.estimate.known);
        s.contacts.condition.set(c.condition);
        s.contacts.positive.set(s.window.positive);
        s.contacts.negative.set(s.window.negative);
        s.contacts.position_x.set(s.estimate.position_x);
        s.contacts.position_y.set(s.estimate.position_y);
        s.contacts.ln_sigma.set(s.estimate.ln_sigma);
        s.contacts.values_begin.set(s.search.values_begin);
        s.contacts.searched.set(s.search.done);
        s.contacts.fold_address.set(s.fold.quad_address);
        s.contacts.window_address.set(s.window.quad_address);
        s.contacts.shear_address.set(s.shear.label_address);
        s.contacts.forces_address.set(s.forces.label_address);
        s.contacts.sent_address.set(s.label_beats.label_address);
        s.contacts.sends_labels.set(s.label_beats.reads);
        s.segment.fill_quad.set(s.unfold.taxels);
        s.segment.fill.set(s.contacts.fills);
        s.segment.fill_address.set(s.unfold.address);
        s.segment.start.set(s.contacts.segment_start);
        s.segment.label_address.set(s.contacts.label_address);
        s.segment.contact.set(s.contacts.contact);
        s.window.start.set(s.contacts.window_start);
        s.window.middle_row.set(s.segment.middle_row);
        s.window.middle_col.set(s.segment.middle_col);
        s.window.label.set(s.contacts.label);
        s.window.quad.set(s.receive.quad);
        s.window.labels.set(s.segment.labels);
        s.operand_source.window_quad.set(s.window.write_quad);
        s.operand_source.mask.set(s.window.mask_quad);
        s.operand_source.window_valid.set(s.window.write);
        s.shear.clear.set(c.start);
        s.shear.operands.set(s.relax.operands);
        s.shear.operands_valid.set(s.relax.operands_valid);
        s.shear.start.set(s.contacts.shear_start);
        s.shear.labels.set(s.segment.labels);
        s.shear.positions_x.set(s.contacts.positions_x);
        s.shear.positions_y.set(s.contacts.positions_y);
        s.operand_source.sheared.set(s.shear.sheared);
        s.operand_source.sheared_valid.set(s.shear.sheared_valid);
    }
}
