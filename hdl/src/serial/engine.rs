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
use crate::language::{Builder, Expr, Inside};
use crate::primitives::{Dff, Ram};
use crate::streams::{stage_list, EnginePorts};
use crate::taps::observe;

stage_list! {
    |model| {
        let f = model.formats();
        let word = word_bits(f);
        let code = f.input_bits as usize;
        // `normalise` shifts codes left by `input_bits` − 1, then right by the length of the magnitude.
        let unrounded = (f.acc_bits as usize).max(2 * code).max(product_bits(f));
        let rounded = rounded_bits(model);
    }
    receive: Receive = Receive::new(f, model.noise_floor()), "receive.rs";
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
    let s = &Stages::new(k, model);
    let computing = k.instance("computing", Dff {});
    let condition = k.instance("condition", Dff {});
    let framing = k.instance("framing", Dff {});

    k.comment("A frame starts when the buffer is full and the engine idle");
    let begin_frame = k.wire("begin_frame", s.receive.full & !computing.q & !io.rst);
    computing.d.set((begin_frame | (computing.q & !s.forces.done)) & !io.rst);
    let signs = [s.receive.positive, s.receive.negative];
    let meets =
        if model.scene.partition.condition == Condition::BothSigns { signs[0] & signs[1] } else { signs[0] | signs[1] };
    condition.d.set(begin_frame.mux(meets, condition.q));
    framing.d.set(begin_frame.mux(s.receive.framing, framing.q));
    io.s_axis.connect(&s.receive.s_axis);
    s.receive.free.set(s.pass_sequencer.free);
    s.receive.reported.set(begin_frame);
    passes(model, k, s, begin_frame);
    search(k, s, begin_frame, condition.q);

    k.comment("Forces");
    s.forces.start.set(s.search_sequencer.done);
    s.forces.place.set(s.reorder.place);
    s.forces.value.set(s.banks.word);
    s.forces.best_x.set(s.search_sequencer.best_x);
    s.forces.best_y.set(s.search_sequencer.best_y);
    s.forces.score.set(s.search_sequencer.score);
    s.forces.found.set(s.search_sequencer.found);
    s.forces.condition.set(condition.q);
    s.forces.framing.set(framing.q);
    s.forces.normalise.set(s.pass_sequencer.normalise);
    s.forces.rescale.set(s.pass_sequencer.rescale);
    s.forces.saturations.set(s.pass_sequencer.saturations);
    s.forces.frame_begin.set(begin_frame);
    s.forces.rounded.set(s.rounder.rounded);
    s.forces.clipped.set(s.rounder.clipped);
    s.forces.m_axis.connect(&io.m_axis);

    observe(k, model);
}

/// Receives, multiplies, rounds.
fn passes<'k>(model: &Model, k: &'k Builder, s: &Stages<'k>, begin_frame: Expr<'k>) {
    k.comment("Taxel reorder: row-major or by quads");
    s.reorder.back.set(!s.pass_sequencer.busy);
    s.reorder.index.set(s.pass_sequencer.busy.mux(s.pass_sequencer.index, s.forces.index));
    s.receive.read_address.set(s.reorder.place);

    k.comment("Rounder, shared by normalise, rescale and forces");
    s.pass_sequencer.start.set(begin_frame);
    s.pass_sequencer.magnitude.set(s.receive.magnitude);
    s.pass_sequencer.code.set(s.receive.word);
    s.rounder.word.set(s.pass_sequencer.busy.mux(s.pass_sequencer.unrounded, s.forces.product));
    s.rounder.shift.set(s.pass_sequencer.busy.mux(s.pass_sequencer.round_shift, s.forces.round_shift));
    s.rounder.valid.set(s.pass_sequencer.round);
    s.rounder.wide.set(!s.pass_sequencer.busy);
    let shifted = k.wire("shifted", s.rounder.rounded.low(rounded_bits(model)));
    s.pass_sequencer.rounded.set(shifted);
    s.pass_sequencer.clipped.set(s.rounder.clipped);
    s.pass_sequencer.round_done.set(s.rounder.done);

    k.comment("Butterfly, shared by fold and unfold");
    s.butterfly.word.set(shifted);
    s.butterfly.valid.set(s.pass_sequencer.transform);
    s.pass_sequencer.transformed.set(s.butterfly.transformed);
    s.pass_sequencer.transformed_valid.set(s.butterfly.transformed_valid);

    k.comment("Matrix passes");
    s.pass.valid.set(s.pass_sequencer.issue);
    s.pass.last.set(s.pass_sequencer.last);
    s.pass.address.set(s.pass_sequencer.address);
    s.pass.low.set(s.pass_sequencer.low);
    s.pass.operand_address.set(s.pass_sequencer.operand_address);
    s.pass.flip.set(s.pass_sequencer.flip);
    s.pass.align.set(s.pass_sequencer.align);
    s.pass.write.set(s.pass_sequencer.write);
    s.pass.write_address.set(s.pass_sequencer.write_address);
    s.pass.write_lane.set(s.pass_sequencer.write_lane);
    s.pass.write_data.set(s.pass_sequencer.write_data);
    s.pass_sequencer.row_word.set(s.pass.word);
    s.pass_sequencer.row_valid.set(s.pass.word_valid);
    s.raw.write.set(s.pass_sequencer.raw_write);
    s.raw.write_address.set(s.pass_sequencer.raw_write_address);
    s.raw.write_data.set(s.pass.word);
    s.raw.read.set(k.constant(1, 1));
    s.raw.read_address.set(s.pass_sequencer.raw_read_address);
    s.pass_sequencer.raw_word.set(s.raw.read_data);
}

/// The search and what it shares.
fn search<'k>(k: &'k Builder, s: &Stages<'k>, begin_frame: Expr<'k>, condition: Expr<'k>) {
    k.comment("Polynomials: unfold, search, banks");
    s.unfold.start.set(begin_frame);
    s.unfold.transformed.set(s.butterfly.transformed);
    s.unfold.valid.set(s.butterfly.transformed_valid & s.pass_sequencer.unfolding);
    s.search_sequencer.filling.set(s.pass_sequencer.busy);
    s.search_sequencer.start.set(s.pass_sequencer.done);
    s.search_sequencer.enabled.set(condition);
    s.search_sequencer.wanted.set(s.forces.wanted);
    s.banks.odd.set(s.search_sequencer.odd);
    s.banks.read_address.set(s.search_sequencer.read_address);
    s.banks.write.set(s.pass_sequencer.busy.mux(s.unfold.write, s.search_sequencer.write));
    s.banks.write_address.set(s.pass_sequencer.busy.mux(s.unfold.address, s.search_sequencer.write_address));
    s.banks.data.set(s.pass_sequencer.busy.mux(s.unfold.data, s.coefficient_shift.halved));

    k.comment("Taylor shift along x, then along y");
    s.along_x.word.set(s.banks.word);
    s.along_x.element.set(s.search_sequencer.x_element);
    s.along_x.top.set(s.search_sequencer.x_top);
    s.along_x.moves.set(s.search_sequencer.x_moves);
    s.along_x.down.set(s.search_sequencer.x_down);
    s.transposed.write.set(k.constant(1, 1));
    s.transposed.write_address.set(s.search_sequencer.turn_write);
    s.transposed.write_data.set(s.along_x.moved);
    s.transposed.read.set(k.constant(1, 1));
    s.transposed.read_address.set(s.search_sequencer.turn_read);
    s.along_y.word.set(s.transposed.read_data);
    s.along_y.element.set(s.search_sequencer.y_element);
    s.along_y.top.set(s.search_sequencer.y_top);
    s.along_y.moves.set(s.search_sequencer.y_moves);
    s.along_y.down.set(s.search_sequencer.y_down);
    s.coefficient_shift.word.set(s.along_y.moved);
    s.coefficient_shift.halvings.set(s.search_sequencer.halvings);

    k.comment("Candidates, scores and their comparison");
    s.candidates.word.set(s.coefficient_shift.halved);
    s.candidates.cycle.set(s.search_sequencer.cycle);
    s.candidates.present.set(s.search_sequencer.present);
    s.candidates.sums.set(s.search_sequencer.sums);
    s.score.value.set(s.candidates.value);
    s.score.index.set(s.candidates.index);
    s.score.valid.set(s.candidates.valid);
    s.score.sum.set(s.candidates.sum);
    s.floors.read.set(k.constant(1, 1));
    s.floors.read_address.set(s.candidates.index);
    s.score.floor.set(s.floors.read_data);
    s.floors.write.set(s.score.floor_write);
    s.floors.write_address.set(s.score.floor_index);
    s.floors.write_data.set(s.score.floor_data);
    s.totals.read.set(k.constant(1, 1));
    s.totals.read_address.set(s.search_sequencer.comparing.mux(s.search_sequencer.candidate, s.score.read_index));
    s.score.total.set(s.totals.read_data);
    s.search_sequencer.total.set(s.totals.read_data);
    s.totals.write.set(s.score.write);
    s.totals.write_address.set(s.score.write_index);
    s.totals.write_data.set(s.score.write_data);
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
