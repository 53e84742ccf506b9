//! Stage `search`: the μ search over the polynomials of all taxels, sweep by sweep.
//!
//! `sequencer` sets up a sweep. One step per cycle, a quad or a part of it, passes memory (3 cycles, 4 where a quad takes
//! several steps), Taylor shift (4) and goes back to memory, and passes candidates (2) and score (6). The sum polynomial
//! passes the same blocks beside the first step and is held, so that Σp is available when the first taxel is scored. `bias` computes the bias of the scores from it, `best`
//! compares (6). Coarse sweeps follow one another without a gap; a halving is set up when the previous sweep has been
//! compared. The last sweep only moves to the best position: its constant coefficients are p(μ*).

use dermis_golden::fixed::plan::cycles::{coarse_period, values_delay, SET_UP, SHORTEST_SWEEP};
use dermis_golden::fixed::{CasePlan, Model};
use dermis_golden::spec::quads::Quads;
use rust_hdl::prelude::*;

use crate::language::RustHdl;
use crate::ports::{has_ports, ports};
use crate::primitives::{
    count_bits, largest, position_bits, store_latency, BestCandidate, BitDelay, Candidates, CaseCounter, Delay, Dff,
    LaneMask, PolynomialWord, Score, ScoreBias, SearchSequencer, Slice, Store, Sum, Taylor, BUFFER_BITS,
    CANDIDATES_LATENCY, SCORE_LATENCY, TAYLOR_LATENCY,
};
use crate::wire::Wire;

/// Polynomials in by coefficient, p(μ*) out by step.
#[derive(dermis_hdl_derive::Block)]
pub struct Search {
    ports: SearchPorts,
    sequencer: SearchSequencer,
    bias: ScoreBias,
    best: BestCandidate,
    store: Store,
    taylor: Taylor,
    candidates: Candidates,
    scores: Score,
    lane_mask: RustHdl<LaneMask>,
    sum: Sum,
    sum_taylor: Taylor,
    sum_candidates: Candidates,
    fill_mask: RustHdl<LaneMask>,
    constants: RustHdl<Slice>,
    quads: RustHdl<CaseCounter>,
    period: RustHdl<CaseCounter>,
    counting: RustHdl<Dff>,
    began: RustHdl<BitDelay>,
    compared_later: RustHdl<BitDelay>,
    go: RustHdl<BitDelay>,
    moved: RustHdl<BitDelay>,
    sum_moved: RustHdl<BitDelay>,
    trial: RustHdl<BitDelay>,
    outcome: RustHdl<BitDelay>,
    sum_outcome: RustHdl<BitDelay>,
    scored: RustHdl<BitDelay>,
    first: RustHdl<BitDelay>,
    bias_start: RustHdl<BitDelay>,
    totals: RustHdl<BitDelay>,
    finish: RustHdl<BitDelay>,
    step: RustHdl<Delay>,
    target: RustHdl<Delay>,
    moved_address: RustHdl<Delay>,
    scored_address: RustHdl<Delay>,
    set_up: RustHdl<Dff>,
    stalled_before: RustHdl<Dff>,
    due: Signal<Local, Bit>,
    stall: Signal<Local, Bit>,
    quad_end: Signal<Local, Bit>,
}

ports! {
    /// Ports of a stage that finds p(μ*).
    pub struct SearchPorts {
        /// Clock; registers change on its rising edge.
        pub clk: Signal<In, Clock>,
        /// Synchronous reset, active high.
        pub rst: Signal<In, Bit>,
        /// Index of the case of the frame that is searched; constant until its values have been output.
        pub which: Wire<In>,
        /// Index of the case of the frame that is written; constant until its last coefficient.
        pub fill_which: Wire<In>,
        /// One coefficient of four taxels, signed; valid with `fill`.
        pub fill_quad: Wire<In>,
        /// `fill_quad` holds a coefficient.
        pub fill: Signal<In, Bit>,
        /// Index of the coefficient; valid with `fill`.
        pub fill_index: Wire<In>,
        /// Address of the quad; valid with `fill`.
        pub fill_address: Wire<In>,
        /// All coefficients have been written: start the search.
        pub start: Signal<In, Bit>,
        /// The subarray is searched, else p(0) is the result; valid with `start`.
        pub enabled: Signal<In, Bit>,
        /// Values may be output; the last sweep waits for it.
        pub ready: Signal<In, Bit>,
        /// The last sweep waits in this cycle.
        pub stalled: Signal<Out, Bit>,
        /// `search_width` values p(μ*), `search_bits[0]` each, signed; valid with `values_valid`.
        pub values: Wire<Out>,
        /// `values` holds a step: the next ones of a quad, quad by quad.
        pub values_valid: Signal<Out, Bit>,
        /// μ*, `score` and `found` are final; high for one cycle, before the values.
        pub settled: Signal<Out, Bit>,
        /// High for one cycle, from which on the values can be read row-major, one a cycle: that of the first values where a
        /// step is a quad.
        pub values_begin: Signal<Out, Bit>,
        /// All values have been output; high for one cycle.
        pub done: Signal<Out, Bit>,
        /// Best position, x, in grid steps of the level, signed; valid with `compared` and `settled`.
        pub best_x: Wire<Out>,
        /// Best position, y, in grid steps of the level, signed; valid with `compared` and `settled`.
        pub best_y: Wire<Out>,
        /// Score of the best candidate, signed, 2^−6; valid with `compared` and `settled`.
        pub score: Wire<Out>,
        /// A candidate was found; valid with `settled`.
        pub found: Signal<Out, Bit>,
        /// The candidates of a sweep have been compared; high for one cycle.
        pub compared: Signal<Out, Bit>,
        /// A candidate was taken at this level; valid with `compared`.
        pub taken: Signal<Out, Bit>,
    }
}

impl SearchPorts {
    /// With the widths of `model`.
    pub(super) fn new(model: &Model) -> Self {
        let formats = model.formats();
        SearchPorts {
            clk: Default::default(),
            rst: Default::default(),
            which: Wire::new(count_bits(model.cases().len())),
            fill_which: Wire::new(count_bits(model.cases().len())),
            fill_quad: Wire::new(4 * (formats.vector_bits as usize + 2)),
            fill: Default::default(),
            fill_index: Wire::new(count_bits(formats.vectors())),
            fill_address: Wire::new(count_bits(formats.quads)),
            start: Default::default(),
            enabled: Default::default(),
            ready: Default::default(),
            stalled: Default::default(),
            values: Wire::new(formats.search_width * formats.search_bits[0] as usize),
            values_valid: Default::default(),
            settled: Default::default(),
            values_begin: Default::default(),
            done: Default::default(),
            best_x: Wire::new(position_bits()),
            best_y: Wire::new(position_bits()),
            score: Wire::new(formats.score_bits as usize),
            found: Default::default(),
            compared: Default::default(),
            taken: Default::default(),
        }
    }
}

has_ports!(Search: SearchPorts);

impl Search {
    /// Taxels that are computed in a cycle.
    pub(crate) fn width(&self) -> usize {
        self.lane_mask.mask.width()
    }

    /// With the widths of `model`.
    pub fn new(model: &Model) -> Self {
        let formats = model.formats();
        let quads = formats.quads;
        let layouts: Vec<Quads> = model.cases().iter().map(CasePlan::layout).collect();
        let width = formats.search_width;
        let limits: Vec<usize> = layouts.iter().map(|layout| formats.sweep_steps(layout.len())).collect();
        let periods: Vec<usize> =
            layouts.iter().map(|layout| coarse_period(formats, layout.len()) as usize - 1).collect();
        let taxel_counts: Vec<usize> = layouts.iter().map(|layout| layout.rows * layout.cols).collect();
        // Zero where there are several cases: none of them has so few quads.
        let padding = (SHORTEST_SWEEP as usize).saturating_sub(formats.sweep_steps(quads));
        let step = count_bits(formats.sweep_steps(quads));
        let fill_bits = formats.vector_bits as usize + 2;
        let taxels = PolynomialWord::new(width, &formats.search_bits);
        let sums = PolynomialWord::new(1, &formats.sum_bits);
        let value = width * formats.search_bits[0] as usize;
        // Cycles from the address of a step to its shifted polynomials.
        let moved = store_latency(formats) + TAYLOR_LATENCY;
        Search {
            ports: SearchPorts::new(model),
            sequencer: SearchSequencer::new(quads),
            bias: ScoreBias::new(formats, &taxel_counts),
            best: BestCandidate::new(formats, largest(&taxel_counts)),
            constants: RustHdl::new(Slice::new(taxels.bits(), value)),
            store: Store::new(taxels.clone(), quads, fill_bits, model.resources.overlaps),
            taylor: Taylor::new(&taxels),
            candidates: Candidates::new(&taxels),
            scores: Score::new(formats),
            lane_mask: RustHdl::new(LaneMask::new(&layouts, width)),
            sum: Sum::new(&sums, quads, fill_bits),
            sum_taylor: Taylor::new(&sums),
            sum_candidates: Candidates::new(&sums),
            fill_mask: RustHdl::new(LaneMask::new(&layouts, Quads::LANES)),
            quads: RustHdl::new(CaseCounter::new(&limits)),
            period: RustHdl::new(CaseCounter::new(&periods)),
            counting: Default::default(),
            // The result of a comparison and the move computed from it are registered before a sweep is set up.
            // `set_up` is a register too, because it drives the whole search.
            began: RustHdl::new(BitDelay::new(SET_UP as usize - 1)),
            compared_later: RustHdl::new(BitDelay::new(SET_UP as usize - 1)),
            go: RustHdl::new(BitDelay::new(1)),
            moved: RustHdl::new(BitDelay::new(moved - 1)),
            sum_moved: RustHdl::new(BitDelay::new(moved - 1)),
            trial: RustHdl::new(BitDelay::new(1)),
            outcome: RustHdl::new(BitDelay::new(1)),
            sum_outcome: RustHdl::new(BitDelay::of_pulse(1 + values_delay(model.first()))),
            scored: RustHdl::new(BitDelay::new(CANDIDATES_LATENCY)),
            first: RustHdl::new(BitDelay::new(moved + CANDIDATES_LATENCY)),
            // One cycle after the first step's candidates, so that a sweep is compared before the next is weighted.
            bias_start: RustHdl::new(BitDelay::new(moved + CANDIDATES_LATENCY + 1)),
            totals: RustHdl::new(BitDelay::new(moved + CANDIDATES_LATENCY + SCORE_LATENCY + padding)),
            finish: RustHdl::new(BitDelay::new(moved + 1)),
            step: RustHdl::new(Delay::new(5, store_latency(formats) - 1)),
            // The target buffer is known one cycle after the set-up and needed one cycle before the write.
            target: RustHdl::new(Delay::new(BUFFER_BITS, moved - 2)),
            moved_address: RustHdl::new(Delay::new(step, moved)),
            scored_address: RustHdl::new(Delay::new(step, CANDIDATES_LATENCY)),
            set_up: Default::default(),
            stalled_before: Default::default(),
            due: Default::default(),
            stall: Default::default(),
            quad_end: Default::default(),
        }
    }
}

impl Logic for Search {
    #[hdl_gen]
    fn update(&mut self) {
        self.sequencer.clk.next = self.clk.val();
        self.bias.clk.next = self.clk.val();
        self.best.clk.next = self.clk.val();
        self.period.clk.next = self.clk.val();
        self.first.clk.next = self.clk.val();
        self.bias_start.clk.next = self.clk.val();
        self.step.clk.next = self.clk.val();
        self.target.clk.next = self.clk.val();
        self.store.clk.next = self.clk.val();
        self.taylor.clk.next = self.clk.val();
        self.candidates.clk.next = self.clk.val();
        self.scores.clk.next = self.clk.val();
        self.sum.clk.next = self.clk.val();
        self.sum_taylor.clk.next = self.clk.val();
        self.sum_candidates.clk.next = self.clk.val();
        self.quads.clk.next = self.clk.val();
        self.counting.clk.next = self.clk.val();
        self.set_up.clk.next = self.clk.val();
        self.stalled_before.clk.next = self.clk.val();
        self.trial.clk.next = self.clk.val();
        self.trial.rst.next = self.rst.val();
        self.outcome.clk.next = self.clk.val();
        self.outcome.rst.next = self.rst.val();
        self.sum_outcome.clk.next = self.clk.val();
        self.sum_outcome.rst.next = self.rst.val();
        self.began.clk.next = self.clk.val();
        self.compared_later.clk.next = self.clk.val();
        self.go.clk.next = self.clk.val();
        self.moved.clk.next = self.clk.val();
        self.sum_moved.clk.next = self.clk.val();
        self.scored.clk.next = self.clk.val();
        self.totals.clk.next = self.clk.val();
        self.finish.clk.next = self.clk.val();
        self.moved_address.clk.next = self.clk.val();
        self.scored_address.clk.next = self.clk.val();
        self.sequencer.rst.next = self.rst.val();
        self.bias.rst.next = self.rst.val();
        self.best.rst.next = self.rst.val();
        self.first.rst.next = self.rst.val();
        self.bias_start.rst.next = self.rst.val();
        self.began.rst.next = self.rst.val();
        self.compared_later.rst.next = self.rst.val();
        self.go.rst.next = self.rst.val();
        self.moved.rst.next = self.rst.val();
        self.sum_moved.rst.next = self.rst.val();
        self.scored.rst.next = self.rst.val();
        self.totals.rst.next = self.rst.val();
        self.finish.rst.next = self.rst.val();

        self.bias.which.next = self.which.val();
        self.lane_mask.which.next = self.which.val();
        self.fill_mask.which.next = self.fill_which.val();
        self.quads.which.next = self.which.val();
        self.period.which.next = self.which.val();

        comment!("Coefficients are written");
        self.store.fill.next = self.fill.val();
        self.store.fill_index.next = self.fill_index.val();
        self.store.fill_address.next = self.fill_address.val();
        self.store.fill_quad.next = self.fill_quad.val();
        self.fill_mask.address.next = self.fill_address.val();
        self.sum.fill.next = self.fill.val();
        self.sum.fill_index.next = self.fill_index.val();
        self.sum.fill_address.next = self.fill_address.val();
        self.sum.fill_mask.next = self.fill_mask.mask.val();
        self.sum.fill_quad.next = self.fill_quad.val();

        comment!("A sweep is set up and starts one cycle later");
        self.sequencer.begin_frame.next = self.start.val();
        self.sequencer.enabled.next = self.enabled.val();
        self.best.begin_frame.next = self.start.val();
        self.began.d.next = self.start.val();
        self.due.next = self.began.q.val() | self.compared_later.q.val() | self.stalled_before.q.val();
        self.stall.next = self.due.val() & self.sequencer.next_last.val() & !self.ready.val();
        self.stalled_before.d.next = self.stall.val() & !self.rst.val();
        self.stalled.next = self.stall.val();
        self.set_up.d.next = ((self.due.val() & !self.stall.val())
            | (self.sequencer.chains.val() & self.period.last.val()))
            & !self.rst.val();
        self.compared_later.d.next = self.best.done.val() & self.best.closes.val();
        self.period.clear.next = self.set_up.q.val();
        self.period.enable.next = true;
        self.sequencer.set_up.next = self.set_up.q.val();
        self.sequencer.compared.next = self.best.done.val();
        self.sequencer.improved.next = self.best.improved.val();
        self.sequencer.compared_sweep.next = self.best.compared.val();
        self.sequencer.best_x.next = self.best.best_x.val();
        self.sequencer.best_y.next = self.best.best_y.val();
        self.best.halve.next = self.set_up.q.val() & self.sequencer.next_halves.val();
        self.go.d.next = self.set_up.q.val();

        comment!("Quads pass memory, Taylor shift and candidates");
        self.quad_end.next = self.counting.q.val() & self.quads.last.val();
        self.counting.d.next =
            (self.set_up.q.val() | (self.counting.q.val() & !self.quads.last.val())) & !self.rst.val();
        self.quads.clear.next = self.set_up.q.val();
        self.quads.enable.next = self.counting.q.val();
        self.step.d.next = self.sequencer.step.val();
        self.target.d.next = self.sequencer.target.val();
        self.store.read_buffer.next = self.sequencer.source.val();
        self.store.begins.next = self.set_up.q.val();
        self.store.counts.next = self.counting.q.val();
        self.store.next_base.next = self.sequencer.next_base.val();
        self.store.read_address.next = self.quads.value.val();
        self.taylor.word.next = self.store.read_data.val();
        self.taylor.step.next = self.step.q.val();
        self.moved.d.next = self.counting.q.val();
        self.trial.d.next = self.moved.q.val() & !self.sequencer.last.val();
        self.outcome.d.next = self.moved.q.val() & self.sequencer.last.val();
        self.moved_address.d.next = self.quads.value.val();
        self.store.write.next = self.trial.q.val();
        self.store.write_buffer.next = self.target.q.val();
        self.store.write_address.next = self.moved_address.q.val();
        self.store.write_data.next = self.taylor.moved.val();
        self.candidates.word.next = self.taylor.moved.val();

        comment!("The sum polynomial passes the same blocks");
        self.sum.read.next = self.go.q.val();
        self.sum.read_buffer.next = self.sequencer.source.val();
        self.sum_taylor.word.next = self.sum.word.val();
        self.sum_taylor.step.next = self.step.q.val();
        self.sum_moved.d.next = self.go.q.val();
        self.sum_outcome.d.next = self.sum_moved.q.val() & self.sequencer.last.val();
        self.sum.write.next = self.sum_moved.q.val() & !self.sequencer.last.val();
        self.sum.write_buffer.next = self.target.q.val();
        self.sum.write_data.next = self.sum_taylor.moved.val();
        self.sum_candidates.word.next = self.sum_taylor.moved.val();

        comment!("Scores and their comparison");
        self.scored.d.next = self.trial.q.val();
        self.scored_address.d.next = self.moved_address.q.val();
        self.lane_mask.address.next = self.scored_address.q.val();
        self.first.d.next = self.go.q.val();
        self.scores.first.next = self.first.q.val();
        self.scores.valid.next = self.scored.q.val();
        self.scores.mask.next = self.lane_mask.mask.val();
        self.scores.values.next = self.candidates.values.val();
        self.scores.sums.next = self.sum_candidates.values.val();
        self.totals.d.next = self.quad_end.val() & !self.sequencer.last.val();
        self.bias_start.d.next = self.go.q.val() & !self.sequencer.last.val();
        self.bias.start.next = self.bias_start.q.val();
        self.bias.sweep.next = self.sequencer.sweep.val();
        self.bias.radius.next = self.sequencer.radius.val();
        self.bias.sums.next = self.sum_candidates.values.val();
        self.best.start.next = self.totals.q.val();
        self.best.totals.next = self.scores.totals.val();
        self.best.weights.next = self.bias.weights.val();
        self.best.eligible.next = self.bias.eligible.val();
        self.best.sweep.next = self.bias.weighted_sweep.val();

        comment!("The constant terms of the last sweep are the values");
        self.constants.word.next = self.taylor.moved.val();
        self.values.next = self.constants.low.val();
        self.values_valid.next = self.outcome.q.val();
        self.settled.next = self.go.q.val() & self.sequencer.last.val();
        self.values_begin.next = self.sum_outcome.q.val();
        self.finish.d.next = self.quad_end.val() & self.sequencer.last.val();
        self.done.next = self.finish.q.val();
        self.best_x.next = self.best.best_x.val();
        self.best_y.next = self.best.best_y.val();
        self.score.next = self.best.score.val();
        self.found.next = self.best.found.val();
        self.compared.next = self.best.done.val();
        self.taken.next = self.best.taken.val();
    }
}

#[cfg(test)]
mod tests;
