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

use crate::engine::{stage_list, EnginePorts};
use crate::language::{Builder, Inside, Interface};
use crate::primitives::{
    count_bits, largest, Arrival, BitDelay, CaseCounter, Dff, EnableRegister, FrameCycles, OperandSource, StatusSource,
    SATURATION_BITS,
};
use crate::stages::{
    Contacts, Estimate, Fold, Forces, LabelBeats, Normalise, Pass, Prepare, Receive, Relax, Rescale, Resultants,
    Search, Segment, Send, Shear, Unfold, Window,
};

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

    /// Connects the stages.
    pub(crate) fn build<'k>(&'k self, k: &'k Builder, io: EnginePorts<Inside<'k>>) {
        let prepare = k.instance("prepare", &self.prepare);
        let receive = k.instance("receive", &self.receive);
        let normalise = k.instance("normalise", &self.normalise);
        let fold = k.instance("fold", &self.fold);
        let pass = k.instance("pass", &self.pass);
        let segment = k.instance("segment", &self.segment);
        let contacts = k.instance("contacts", &self.contacts);
        let window = k.instance("window", &self.window);
        let estimate = k.instance("estimate", &self.estimate);
        let shear = k.instance("shear", &self.shear);
        let rescale = k.instance("rescale", &self.rescale);
        let relax = k.instance("relax", &self.relax);
        let unfold = k.instance("unfold", &self.unfold);
        let search = k.instance("search", &self.search);
        let forces = k.instance("forces", &self.forces);
        let send = k.instance("send", &self.send);
        let label_beats = k.instance("label_beats", &self.label_beats);
        let resultants = k.instance("resultants", &self.resultants);
        let operand_source = k.instance("operand_source", &self.operand_source);
        let status_source = k.instance("status_source", &self.status_source);
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
        let single = self.parts.iter().all(|&parts| parts == 1);
        let register =
            |name: &str, bits: usize, varies: bool| k.instance(name, EnableRegister::new(bits).constant(!varies));
        let case = |name: &str| register(name, receive.which.bits(), self.parts.len() > 1);
        let [frame_case, searched_case, sent_case] = ["frame_case", "searched_case", "sent_case"].map(case);
        let searched_part = register("searched_part", count_bits(largest(&self.parts)), true);
        let searched_normalise = register("searched_normalise", normalise.shift.bits(), true);
        let searched_rescale = register("searched_rescale", rescale.shift.bits(), true);
        let searched_saturations = register("searched_saturations", SATURATION_BITS, true);
        let searched_damaged = register("searched_damaged", 1, self.checks_coefficients);
        let frames = |name: &str| register(name, prepare.frames.bits(), self.has_memory);
        let [received_frames, frame_frames, searched_frames] =
            ["received_frames", "frame_frames", "searched_frames"].map(frames);
        let frame_cycles = k.instance("frame_cycles", FrameCycles::default());
        let part = k.instance("part", CaseCounter::new(&self.parts));
        let again = k.instance("again", BitDelay::new(1));
        let handed = k.instance("handed", BitDelay::new(1));
        let seeks = k.instance("seeks", BitDelay::new(1));
        let opens = k.instance("opens", BitDelay::new(1));

        let restarted = [
            &estimate.rst,
            &segment.rst,
            &contacts.rst,
            &window.rst,
            &label_beats.rst,
            &shear.rst,
            &operand_source.rst,
            &relax.rst,
            &again.rst,
            &handed.rst,
            &seeks.rst,
            &opens.rst,
            &begins.rst,
            &arrival.rst,
            &frame_cycles.rst,
            &receive.rst,
            &fold.rst,
            &pass.rst,
            &rescale.rst,
            &unfold.rst,
            &search.rst,
            &forces.rst,
            &send.rst,
            &resultants.rst,
        ];
        restarted.iter().for_each(|rst| rst.set(prepare.restart));

        k.comment("A frame starts: buffer full, or its first row of subarrays in it;");
        k.comment("previous frame out of the passes");
        arrival.row_end.set(receive.row_end);
        arrival.dropped.set(receive.dropped);
        arrival.free.set(contacts.free);
        arrival.full.set(receive.full);
        arrival.begins.set(begins.q);
        let idle = arrival.ready & !begins.q & !computing.q;
        begins.d.set(if self.ahead { idle } else { idle & !sending.q });
        let begin_frame = k.wire("begin_frame", begins.q);

        k.comment("Case of the frame in the passes, searched, sent");
        frame_case.keep.set(begin_frame);
        frame_case.word.set(receive.which);
        fold.which.set(frame_case.kept);
        contacts.which.set(frame_case.kept);
        pass.which.set(contacts.section);
        rescale.which.set(frame_case.kept);
        unfold.which.set(frame_case.kept);
        search.fill_which.set(frame_case.kept);
        search.which.set(searched_case.kept);
        part.which.set(frame_case.kept);
        forces.which.set(sent_case.kept);
        send.which.set(sent_case.kept);

        k.comment("A subarray goes to the search when the search is idle;");
        k.comment("the first of several also waits for the previous send,");
        k.comment("as does one that is not searched: its only sweep reads");
        k.comment("the memory that the next frame is written to");
        let begin_send = k.wire("begin_send", contacts.begins & searched_first.q);
        sent_case.keep.set(begin_send);
        sent_case.word.set(searched_case.kept);
        sending.d.set((begin_send | (sending.q & !send.done)) & !prepare.restart);
        let complete = k.wire("complete", filled.q | unfold.done);
        arrival.complete.set(complete);
        let unsent = k.wire("unsent", sending.q & !send.done);
        let behind = first.q & unsent;
        let behind = k.wire("behind", if single { behind & !condition.q } else { behind });
        let hand_over = k.wire("hand_over", complete & !arrival.waits & !behind & (!searching.q | search.done));
        let passed = if self.ahead { hand_over & part.last } else { contacts.ended & searched_last.q };
        let passed = k.wire("passed", passed);
        computing.d.set((begin_frame | (computing.q & !passed & !arrival.discards)) & !prepare.restart);
        searched_case.keep.set(hand_over);
        searched_case.word.set(frame_case.kept);
        handed.d.set(hand_over);
        opens.d.set(hand_over & first.q);
        filled.d.set(complete & !hand_over & !arrival.discards & !prepare.restart);
        searching.d.set((hand_over | (searching.q & !search.done)) & !prepare.restart);
        first.d.set(begin_frame | (first.q & !hand_over));
        searched_condition.d.set(hand_over.mux(condition.q, searched_condition.q));
        searched_first.d.set(hand_over.mux(first.q, searched_first.q));
        searched_last.d.set(hand_over.mux(part.last, searched_last.q));
        searched_framing.d.set(hand_over.mux(framing.q, searched_framing.q));
        sent_framing.d.set(begin_send.mux(searched_framing.q, sent_framing.q));
        searched_part.keep.set(hand_over);
        searched_part.word.set(part.value);
        k.comment("Captured a cycle later, before the stages restart");
        searched_normalise.keep.set(handed.q);
        searched_normalise.word.set(normalise.shift);
        searched_rescale.keep.set(handed.q);
        searched_rescale.word.set(rescale.shift);
        searched_saturations.keep.set(handed.q);
        searched_saturations.word.set(relax.saturations);
        searched_damaged.keep.set(handed.q);
        searched_damaged.word.set(pass.damaged);

        k.comment("Frames in a sliding mean follow their frame:");
        k.comment("received, in the passes, searched");
        received_frames.keep.set(receive.accept);
        received_frames.word.set(prepare.frames);
        frame_frames.keep.set(begin_frame);
        frame_frames.word.set(received_frames.kept);
        searched_frames.keep.set(hand_over);
        searched_frames.word.set(frame_frames.kept);
        forces.frames.set(searched_frames.kept);

        k.comment("Then the next subarray starts");
        part.clear.set(prepare.restart);
        part.enable.set(hand_over);
        again.d.set(hand_over & !part.last);
        let start = k.wire("start", begin_frame | again.q);
        k.comment("Waiting for frames or their rest is not counted");
        frame_cycles.begin_frame.set(begin_frame);
        frame_cycles.waits.set(complete & first.q & !hand_over);
        frame_cycles.hand_over.set(hand_over & first.q);
        frame_cycles.stalled.set(search.stalled);
        let signs = [receive.positive, receive.negative];
        let meets = if self.both_signs { signs[0] & signs[1] } else { signs[0] | signs[1] };
        condition.d.set(start.mux(meets, condition.q));
        framing.d.set(arrival.arrives.mux(receive.framing, framing.q));

        k.comment("Tables are written while no frame is under way");
        let computes = begins.q | computing.q | filled.q | searching.q | sending.q;
        prepare.idle.set(!(receive.full | computes | resultants.m_axis_tvalid));
        pass.coefficient_write.set(prepare.coefficient_write);
        pass.coefficient_word.set(prepare.coefficient_word);
        pass.coefficient_pair.set(prepare.coefficient_pair);
        pass.coefficient_data.set(prepare.coefficient_data);
        receive.floor.set(prepare.noise_floor);
        window.floor.set(prepare.noise_floor);
        forces.threshold.set(prepare.threshold);
        forces.version.set(prepare.version);
        forces.incomplete.set(prepare.incomplete);

        k.comment("prepare -> receive -> normalise -> fold");
        prepare.s_axis_tdata.set(io.s_axis_tdata);
        prepare.s_axis_tvalid.set(io.s_axis_tvalid);
        prepare.s_axis_tlast.set(io.s_axis_tlast);
        io.s_axis_tready.set(prepare.s_axis_tready);
        receive.s_axis_tdata.set(prepare.m_axis_tdata);
        receive.s_axis_tvalid.set(prepare.m_axis_tvalid);
        receive.s_axis_tlast.set(prepare.m_axis_tlast);
        prepare.m_axis_tready.set(receive.s_axis_tready);
        receive.quad_address.set(contacts.quad_address);
        receive.free.set(contacts.free);
        receive.reported.set(arrival.arrives);
        receive.part.set(part.value);
        normalise.start.set(start);
        normalise.magnitude.set(receive.magnitude);
        normalise.quad.set(receive.quad);
        fold.begin_frame.set(begin_frame);
        fold.start.set(start);
        fold.last_part.set(part.last);
        fold.normalised.set(normalise.shifted);

        k.comment("fold -> pass -> rescale -> unfold, and back to pass");
        pass.start.set(contacts.pass_start);
        fold.read_address.set(pass.input_address);
        pass.input_quad.set(fold.read_quad);
        rescale.start.set(start);
        rescale.quad.set(pass.quad);
        rescale.quad_valid.set(pass.quad_valid);
        rescale.quad_soon.set(pass.quad_soon);
        estimate.start.set(contacts.estimate_start);
        estimate.clear.set(start);
        estimate.enabled.set(contacts.enabled);
        estimate.quad.set(pass.quad);
        estimate.valid.set(pass.layer_valid);
        relax.start.set(start);
        relax.words.set(rescale.words);
        relax.words_valid.set(rescale.words_valid);
        relax.short.set(rescale.operands);
        relax.short_valid.set(rescale.operands_valid);
        relax.rescaled.set(rescale.saturations);
        relax.estimated.set(estimate.saturations);
        relax.sheared.set(shear.saturations);
        operand_source.own.set(relax.operands);
        operand_source.own_valid.set(relax.operands_valid);
        operand_source.images.set(estimate.operands);
        operand_source.images_valid.set(estimate.operands_valid);
        pass.vector_quad.set(operand_source.quad);
        pass.vector_valid.set(operand_source.valid);
        pass.position_x.set(estimate.position_x);
        pass.position_y.set(estimate.position_y);
        unfold.start.set(start);
        unfold.words.set(relax.sums);
        unfold.words_valid.set(relax.sums_valid);

        k.comment("Contacts: segment -> window -> pass, relax -> shear -> pass");
        contacts.start.set(start);
        contacts.readable.set(fold.readable);
        contacts.folded.set(fold.free);
        contacts.taxels_valid.set(unfold.taxels_valid);
        contacts.segmented.set(segment.done);
        contacts.count.set(segment.count);
        contacts.known.set(estimate.known);
        contacts.condition.set(condition.q);
        contacts.positive.set(window.positive);
        contacts.negative.set(window.negative);
        contacts.position_x.set(estimate.position_x);
        contacts.position_y.set(estimate.position_y);
        contacts.ln_sigma.set(estimate.ln_sigma);
        contacts.values_begin.set(search.values_begin);
        contacts.searched.set(search.done);
        contacts.fold_address.set(fold.quad_address);
        contacts.window_address.set(window.quad_address);
        contacts.shear_address.set(shear.label_address);
        contacts.forces_address.set(forces.label_address);
        contacts.sent_address.set(label_beats.label_address);
        contacts.sends_labels.set(label_beats.reads);
        segment.fill_quad.set(unfold.taxels);
        segment.fill.set(contacts.fills);
        segment.fill_address.set(unfold.address);
        segment.start.set(contacts.segment_start);
        segment.label_address.set(contacts.label_address);
        segment.contact.set(contacts.contact);
        window.start.set(contacts.window_start);
        window.middle_row.set(segment.middle_row);
        window.middle_col.set(segment.middle_col);
        window.label.set(contacts.label);
        window.quad.set(receive.quad);
        window.labels.set(segment.labels);
        operand_source.window_quad.set(window.write_quad);
        operand_source.mask.set(window.mask_quad);
        operand_source.window_valid.set(window.write);
        shear.clear.set(start);
        shear.operands.set(relax.operands);
        shear.operands_valid.set(relax.operands_valid);
        shear.start.set(contacts.shear_start);
        shear.labels.set(segment.labels);
        shear.positions_x.set(contacts.positions_x);
        shear.positions_y.set(contacts.positions_y);
        operand_source.sheared.set(shear.sheared);
        operand_source.sheared_valid.set(shear.sheared_valid);

        k.comment("unfold -> search");
        search.fill_quad.set(unfold.taxels);
        search.fill.set(unfold.taxels_valid);
        search.fill_index.set(unfold.index);
        search.fill_address.set(unfold.address);
        seeks.d.set(handed.q);
        search.start.set(seeks.q);
        search.enabled.set(searched_condition.q);
        search.ready.set(if single { !unsent } else { k.constant(1, 1) });

        k.comment("search -> forces -> send");
        forces.values.set(search.values);
        forces.values_valid.set(search.values_valid);
        forces.begin_frame.set(match self.ahead {
            false => begin_frame,
            true if single => search.settled,
            true => opens.q,
        });
        status_source.settled.set(search.settled);
        status_source.subarray.set(searched_part.kept);
        status_source.searched.set(searched_condition.q);
        status_source.best_x.set(search.best_x);
        status_source.best_y.set(search.best_y);
        status_source.best_score.set(search.score);
        status_source.candidate.set(search.found);
        status_source.mu_x.set(estimate.position_x);
        status_source.mu_y.set(estimate.position_y);
        status_source.ln_sigma.set(estimate.ln_sigma);
        status_source.told.set(contacts.told);
        status_source.told_label.set(contacts.told_label);
        status_source.told_x.set(contacts.told_x);
        status_source.told_y.set(contacts.told_y);
        status_source.told_ln_sigma.set(contacts.told_ln_sigma);
        status_source.told_condition.set(contacts.told_condition);
        forces.labels.set(segment.labels);
        forces.overflow.set(segment.overflow);
        forces.start.set(status_source.start);
        forces.part.set(status_source.part);
        forces.position_x.set(status_source.position_x);
        forces.position_y.set(status_source.position_y);
        forces.score.set(status_source.score);
        forces.found.set(status_source.found);
        forces.normalise.set(searched_normalise.kept);
        forces.rescale.set(searched_rescale.kept);
        forces.saturations.set(searched_saturations.kept);
        forces.damaged.set(searched_damaged.kept);
        forces.condition.set(status_source.condition);
        forces.framing.set(sent_framing.q);
        forces.cycles.set(frame_cycles.cycles);
        send.start.set(begin_send);
        send.begins.set(contacts.begins);
        send.room.set(forces.room);
        forces.offer.set(send.offer);
        forces.beat.set(send.beat);
        forces.beat_part.set(send.part);
        forces.address.set(send.address);
        forces.lane.set(send.lane);
        send.m_axis_tvalid.set(forces.m_axis_tvalid);
        send.m_axis_tlast.set(forces.m_axis_tlast);
        send.m_axis_tready.set(label_beats.s_axis_tready);
        forces.m_axis_tready.set(label_beats.s_axis_tready);
        label_beats.s_axis_tdata.set(forces.m_axis_tdata);
        label_beats.s_axis_tvalid.set(forces.m_axis_tvalid);
        label_beats.s_axis_tlast.set(forces.m_axis_tlast);
        label_beats.labels.set(segment.labels);
        label_beats.m_axis_tready.set(resultants.s_axis_tready);
        resultants.s_axis_tdata.set(label_beats.m_axis_tdata);
        resultants.s_axis_tvalid.set(label_beats.m_axis_tvalid);
        resultants.s_axis_tlast.set(label_beats.m_axis_tlast);
        resultants.m_axis_tready.set(io.m_axis_tready);
        io.m_axis_tdata.set(resultants.m_axis_tdata);
        io.m_axis_tvalid.set(resultants.m_axis_tvalid);
        io.m_axis_tlast.set(resultants.m_axis_tlast);
    }
}
