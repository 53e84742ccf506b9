//! The serial engine: all blocks connected; rounder, butterfly and memories are shared between steps.
//!
//! One frame at a time. While it is computed and sent, the next is received as soon as the frame buffer has been read.

use dermis_golden::fixed::plan::resources::Holds;
use dermis_golden::fixed::plan::serial::{floor_bits, product_bits, word_bits, SLOT};
use dermis_golden::fixed::Model;
use dermis_golden::spec::scene::Condition;

use super::{
    Banks, Candidates, CoefficientShift, Forces, Horner, Pass, PassSequencer, Receive, Rounder, Score, SearchSequencer,
    SerialButterfly, TaxelReorder, Unfold,
};
use crate::language::{Builder, Inside};
use crate::primitives::{Dff, Ram};
use crate::streams::{stage_list, EnginePorts};
use crate::taps::streams;

stage_list! {
    |model| {
        let f = model.formats();
        let word = word_bits(f);
        let code = f.input_bits as usize;
        // `normalise` shifts codes left by `input_bits` − 1, then right by the length of the magnitude.
        let unrounded = (f.acc_bits as usize).max(2 * code).max(product_bits(f));
        let rounded = rounded_bits(model);
    }
    receive: Receive = Receive::new(f, model.noise_floor), "receive.rs";
    reorder: TaxelReorder = TaxelReorder::new(model.layout()), "taxel_reorder.rs";
    pass_sequencer: PassSequencer = PassSequencer::new(f, unrounded, rounded), "pass_sequencer.rs";
    rounder: Rounder = Rounder::new(unrounded, rounded), "rounder.rs";
    butterfly: SerialButterfly = SerialButterfly::new(rounded), "serial_butterfly.rs";
    pass: Pass = Pass::new(model), "pass.rs";
    raw: Ram = Ram::new(4 * f.quads, 1, f.acc_bits as usize).holding([Holds::Raw]), "../primitives/memory/ram.rs";
    unfold: Unfold = Unfold::new(f, rounded + 2), "unfold.rs";
    banks: Banks = Banks::new(f), "banks.rs";
    search_sequencer: SearchSequencer = SearchSequencer::new(f), "search_sequencer.rs";
    along_x: Horner = Horner::new(word), "horner.rs";
    transposed: Ram = Ram::new(4 * SLOT as usize, 1, word).holding([Holds::Transposed]), "../primitives/memory/ram.rs";
    along_y: Horner = Horner::new(word), "horner.rs";
    coefficient_shift: CoefficientShift = CoefficientShift::new(word, f.search_bits[0] as usize),
        "coefficient_shift.rs";
    candidates: Candidates = Candidates::new(f), "candidates.rs";
    score: Score = Score::new(f), "score.rs";
    floors: Ram = Ram::new(SLOT as usize, 1, floor_bits(f)).holding([Holds::Floors]), "../primitives/memory/ram.rs";
    totals: Ram = Ram::new(SLOT as usize, 1, f.score_bits as usize + 1).holding([Holds::Totals]),
        "../primitives/memory/ram.rs";
    forces: Forces = Forces::new(model, unrounded), "forces.rs";
}

/// Width of a rounded word.
fn rounded_bits(model: &Model) -> usize {
    let formats = model.formats();
    formats.input_bits.max(formats.vector_bits) as usize
}

/// Connects the stages of `model` between the ports `io`.
pub(crate) fn build<'k>(model: &Model, k: &'k Builder, io: EnginePorts<Inside<'k>>) {
    let Stages {
        receive,
        reorder,
        pass_sequencer,
        rounder,
        butterfly,
        pass,
        raw,
        unfold,
        banks,
        search_sequencer,
        along_x,
        transposed,
        along_y,
        coefficient_shift,
        candidates,
        score,
        floors,
        totals,
        forces,
    } = Stages::new(k, model);
    let computing = k.instance("computing", Dff {});
    let condition = k.instance("condition", Dff {});
    let framing = k.instance("framing", Dff {});

    k.comment("A frame starts when the buffer is full and the engine idle");
    let begin_frame = k.wire("begin_frame", receive.full & !computing.q & !io.rst);
    computing.d.set((begin_frame | (computing.q & !forces.done)) & !io.rst);
    let signs = [receive.positive, receive.negative];
    let meets =
        if model.scene.partition.condition == Condition::BothSigns { signs[0] & signs[1] } else { signs[0] | signs[1] };
    condition.d.set(begin_frame.mux(meets, condition.q));
    framing.d.set(begin_frame.mux(receive.framing, framing.q));
    receive.s_axis_tdata.set(io.s_axis_tdata);
    receive.s_axis_tvalid.set(io.s_axis_tvalid);
    receive.s_axis_tlast.set(io.s_axis_tlast);
    io.s_axis_tready.set(receive.s_axis_tready);
    receive.free.set(pass_sequencer.free);
    receive.reported.set(begin_frame);

    k.comment("Taxel reorder: row-major or by quads");
    reorder.back.set(!pass_sequencer.busy);
    reorder.index.set(pass_sequencer.busy.mux(pass_sequencer.index, forces.index));
    receive.read_address.set(reorder.place);

    k.comment("Rounder, shared by normalise, rescale and forces");
    pass_sequencer.start.set(begin_frame);
    pass_sequencer.magnitude.set(receive.magnitude);
    pass_sequencer.code.set(receive.word);
    rounder.word.set(pass_sequencer.busy.mux(pass_sequencer.unrounded, forces.product));
    rounder.shift.set(pass_sequencer.busy.mux(pass_sequencer.round_shift, forces.round_shift));
    rounder.valid.set(pass_sequencer.round);
    rounder.wide.set(!pass_sequencer.busy);
    let shifted = k.wire("shifted", rounder.rounded.low(rounded_bits(model)));
    pass_sequencer.rounded.set(shifted);
    pass_sequencer.clipped.set(rounder.clipped);
    pass_sequencer.round_done.set(rounder.done);

    k.comment("Butterfly, shared by fold and unfold");
    butterfly.word.set(shifted);
    butterfly.valid.set(pass_sequencer.transform);
    pass_sequencer.transformed.set(butterfly.transformed);
    pass_sequencer.transformed_valid.set(butterfly.transformed_valid);

    k.comment("Matrix passes");
    pass.valid.set(pass_sequencer.issue);
    pass.last.set(pass_sequencer.last);
    pass.address.set(pass_sequencer.address);
    pass.low.set(pass_sequencer.low);
    pass.operand_address.set(pass_sequencer.operand_address);
    pass.flip.set(pass_sequencer.flip);
    pass.align.set(pass_sequencer.align);
    pass.write.set(pass_sequencer.write);
    pass.write_address.set(pass_sequencer.write_address);
    pass.write_lane.set(pass_sequencer.write_lane);
    pass.write_data.set(pass_sequencer.write_data);
    pass_sequencer.row_word.set(pass.word);
    pass_sequencer.row_valid.set(pass.word_valid);
    raw.write.set(pass_sequencer.raw_write);
    raw.write_address.set(pass_sequencer.raw_write_address);
    raw.write_data.set(pass.word);
    raw.read.set(k.constant(1, 1));
    raw.read_address.set(pass_sequencer.raw_read_address);
    pass_sequencer.raw_word.set(raw.read_data);

    k.comment("Polynomials: unfold, search, banks");
    unfold.start.set(begin_frame);
    unfold.transformed.set(butterfly.transformed);
    unfold.valid.set(butterfly.transformed_valid & pass_sequencer.unfolding);
    search_sequencer.filling.set(pass_sequencer.busy);
    search_sequencer.start.set(pass_sequencer.done);
    search_sequencer.enabled.set(condition.q);
    search_sequencer.wanted.set(forces.wanted);
    banks.odd.set(search_sequencer.odd);
    banks.read_address.set(search_sequencer.read_address);
    banks.write.set(pass_sequencer.busy.mux(unfold.write, search_sequencer.write));
    banks.write_address.set(pass_sequencer.busy.mux(unfold.address, search_sequencer.write_address));
    banks.data.set(pass_sequencer.busy.mux(unfold.data, coefficient_shift.halved));

    k.comment("Taylor shift along x, then along y");
    along_x.word.set(banks.word);
    along_x.element.set(search_sequencer.x_element);
    along_x.top.set(search_sequencer.x_top);
    along_x.moves.set(search_sequencer.x_moves);
    along_x.down.set(search_sequencer.x_down);
    transposed.write.set(k.constant(1, 1));
    transposed.write_address.set(search_sequencer.turn_write);
    transposed.write_data.set(along_x.moved);
    transposed.read.set(k.constant(1, 1));
    transposed.read_address.set(search_sequencer.turn_read);
    along_y.word.set(transposed.read_data);
    along_y.element.set(search_sequencer.y_element);
    along_y.top.set(search_sequencer.y_top);
    along_y.moves.set(search_sequencer.y_moves);
    along_y.down.set(search_sequencer.y_down);
    coefficient_shift.word.set(along_y.moved);
    coefficient_shift.halvings.set(search_sequencer.halvings);

    k.comment("Candidates, scores and their comparison");
    candidates.word.set(coefficient_shift.halved);
    candidates.cycle.set(search_sequencer.cycle);
    candidates.present.set(search_sequencer.present);
    candidates.sums.set(search_sequencer.sums);
    score.value.set(candidates.value);
    score.index.set(candidates.index);
    score.valid.set(candidates.valid);
    score.sum.set(candidates.sum);
    floors.read.set(k.constant(1, 1));
    floors.read_address.set(candidates.index);
    score.floor.set(floors.read_data);
    floors.write.set(score.floor_write);
    floors.write_address.set(score.floor_index);
    floors.write_data.set(score.floor_data);
    totals.read.set(k.constant(1, 1));
    totals.read_address.set(search_sequencer.comparing.mux(search_sequencer.candidate, score.read_index));
    score.total.set(totals.read_data);
    search_sequencer.total.set(totals.read_data);
    totals.write.set(score.write);
    totals.write_address.set(score.write_index);
    totals.write_data.set(score.write_data);

    k.comment("Forces");
    forces.start.set(search_sequencer.done);
    forces.place.set(reorder.place);
    forces.value.set(banks.word);
    forces.best_x.set(search_sequencer.best_x);
    forces.best_y.set(search_sequencer.best_y);
    forces.score.set(search_sequencer.score);
    forces.found.set(search_sequencer.found);
    forces.condition.set(condition.q);
    forces.framing.set(framing.q);
    forces.normalise.set(pass_sequencer.normalise);
    forces.rescale.set(pass_sequencer.rescale);
    forces.saturations.set(pass_sequencer.saturations);
    forces.frame_begin.set(begin_frame);
    forces.rounded.set(rounder.rounded);
    forces.clipped.set(rounder.clipped);
    io.m_axis_tdata.set(forces.m_axis_tdata);
    io.m_axis_tvalid.set(forces.m_axis_tvalid);
    io.m_axis_tlast.set(forces.m_axis_tlast);
    forces.m_axis_tready.set(io.m_axis_tready);

    k.comment("What only the test bench reads");
    let observed = streams(model);
    k.unused(observed.iter().flat_map(|stream| stream.signals()).map(|name| k.named(name)));
}

#[cfg(test)]
mod tests {
    use crate::engine::tests::{engine_subject, stimulus, Frames};
    use crate::engine::Engine;
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
