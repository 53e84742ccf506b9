//! Stage `search`: the μ search over the polynomials of all taxels, sweep by sweep.
//!
//! `walk` sets up a sweep. One quad per cycle passes memory (2 cycles), Taylor shift (4) and goes back to memory, and
//! passes candidates (2) and score (6). The sum polynomial passes the same blocks beside the first quad and is held, so
//! that Σp is available when the first taxel is scored. `weigh` computes the bias of the scores from it, `judge`
//! compares (6). Coarse sweeps follow one another without a gap; a halving is set up when the previous sweep has been
//! compared. The last sweep only moves to the best position: its constant coefficients are p(μ*).

use dermis_golden::fixed::cycles::{coarse_period, SET_UP, SHORTEST_SWEEP};
use dermis_golden::fixed::quads::Quads;
use dermis_golden::fixed::schedule::vectors;
use dermis_golden::fixed::Model;
use rust_hdl::prelude::*;

use crate::ports::{has_ports, ports};
use crate::primitives::{
    count_bits, largest, position_bits, BestCandidate, BitDelay, Candidates, CaseCounter, Delay, Dff, LaneMask,
    PolynomialWord, Score, ScoreBias, SearchSequencer, Slice, Store, Sum, Taylor, BUFFER_BITS, CANDIDATES_LATENCY,
    SCORE_LATENCY, STORE_LATENCY, TAYLOR_LATENCY,
};
use crate::wire::Wire;

/// Cycles from a quad's address to its shifted polynomials.
const MOVED: usize = STORE_LATENCY + TAYLOR_LATENCY;

/// Polynomials in by coefficient, p(μ*) out by quad.
#[derive(LogicBlock)]
pub struct Search {
    ports: SearchPorts,
    walk: SearchSequencer,
    weigh: ScoreBias,
    judge: BestCandidate,
    store: Store,
    taylor: Taylor,
    candidates: Candidates,
    scores: Score,
    counts: LaneMask,
    sum: Sum,
    sum_taylor: Taylor,
    sum_candidates: Candidates,
    fill_counts: LaneMask,
    constants: Slice,
    quads: CaseCounter,
    period: CaseCounter,
    counting: Dff,
    began: BitDelay,
    judged_then: BitDelay,
    go: BitDelay,
    moved: BitDelay,
    sum_moved: BitDelay,
    trial: BitDelay,
    outcome: BitDelay,
    sum_outcome: BitDelay,
    scored: BitDelay,
    first: BitDelay,
    weighs: BitDelay,
    totals: BitDelay,
    finish: BitDelay,
    step: Delay,
    target: Delay,
    moved_address: Delay,
    scored_address: Delay,
    set_up: Dff,
    quad_end: Signal<Local, Bit>,
}

ports! {
    /// Ports of a stage that finds p(μ*).
    pub struct SearchPorts {
        /// Clock; registers change on its rising edge.
        pub clk: Signal<In, Clock>,
        /// Synchronous reset, active high.
        pub rst: Signal<In, Bit>,
        /// Index of the case; constant while a frame is computed.
        pub which: Wire<In>,
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
        /// Four values p(μ*), `search_bits[0]` each, signed; valid with `values_valid`.
        pub values: Wire<Out>,
        /// `values` holds a quad.
        pub values_valid: Signal<Out, Bit>,
        /// μ*, `score` and `found` are final; high for one cycle, before the values.
        pub settled: Signal<Out, Bit>,
        /// High in the cycle of the first values.
        pub values_begin: Signal<Out, Bit>,
        /// All values have been output; high for one cycle.
        pub done: Signal<Out, Bit>,
        /// Best position, x, in grid steps of the level, signed; valid with `judged` and `settled`.
        pub best_x: Wire<Out>,
        /// Best position, y, in grid steps of the level, signed; valid with `judged` and `settled`.
        pub best_y: Wire<Out>,
        /// Score of the best candidate, signed, 2^−6; valid with `judged` and `settled`.
        pub score: Wire<Out>,
        /// A candidate was found; valid with `settled`.
        pub found: Signal<Out, Bit>,
        /// The candidates of a sweep have been compared; high for one cycle.
        pub judged: Signal<Out, Bit>,
        /// A candidate was taken at this level; valid with `judged`.
        pub taken: Signal<Out, Bit>,
    }
}

impl SearchPorts {
    /// With the widths of `model`.
    pub(super) fn new(model: &Model) -> Self {
        let formats = &model.formats;
        SearchPorts {
            clk: Default::default(),
            rst: Default::default(),
            which: Wire::new(count_bits(model.cases().len())),
            fill_quad: Wire::new(4 * (formats.vector_bits as usize + 2)),
            fill: Default::default(),
            fill_index: Wire::new(count_bits(vectors(formats.degree))),
            fill_address: Wire::new(count_bits(formats.quads)),
            start: Default::default(),
            enabled: Default::default(),
            values: Wire::new(4 * formats.search_bits[0] as usize),
            values_valid: Default::default(),
            settled: Default::default(),
            values_begin: Default::default(),
            done: Default::default(),
            best_x: Wire::new(position_bits()),
            best_y: Wire::new(position_bits()),
            score: Wire::new(formats.score_bits as usize),
            found: Default::default(),
            judged: Default::default(),
            taken: Default::default(),
        }
    }
}

has_ports!(Search: SearchPorts);

impl Search {
    /// With the widths of `model`.
    pub fn new(model: &Model) -> Self {
        let formats = &model.formats;
        let quads = formats.quads;
        let layouts: Vec<Quads> = model.cases().iter().map(Model::layout).collect();
        let limits: Vec<usize> = layouts.iter().map(Quads::len).collect();
        let periods: Vec<usize> = limits.iter().map(|&quads| coarse_period(quads as u64) as usize - 1).collect();
        let taxel_counts: Vec<usize> = layouts.iter().map(|layout| layout.rows * layout.cols).collect();
        // One subarray is filled while another is searched.
        let apart = model.cases().iter().any(|case| case.parts.len() > 1);
        // Zero where there are several cases: none of them has so few quads.
        let padding = (SHORTEST_SWEEP as usize).saturating_sub(quads);
        let address = count_bits(quads);
        let fill_bits = formats.vector_bits as usize + 2;
        let taxels = PolynomialWord::new(4, &formats.search_bits);
        let sums = PolynomialWord::new(1, &formats.sum_bits);
        let value = 4 * formats.search_bits[0] as usize;
        Search {
            ports: SearchPorts::new(model),
            walk: SearchSequencer::new(quads),
            weigh: ScoreBias::new(formats, &taxel_counts),
            judge: BestCandidate::new(formats, largest(&taxel_counts)),
            constants: Slice::new(taxels.bits(), value),
            store: Store::new(taxels.clone(), quads, fill_bits, apart),
            taylor: Taylor::new(&taxels),
            candidates: Candidates::new(&taxels),
            scores: Score::new(formats),
            counts: LaneMask::new(&layouts),
            sum: Sum::new(&sums, quads, fill_bits, apart),
            sum_taylor: Taylor::new(&sums),
            sum_candidates: Candidates::new(&sums),
            fill_counts: LaneMask::new(&layouts),
            quads: CaseCounter::new(&limits),
            period: CaseCounter::new(&periods),
            counting: Default::default(),
            // The result of a comparison and the move computed from it are registered before a sweep is set up.
            // `set_up` is a register too, because it drives the whole search.
            began: BitDelay::new(SET_UP as usize - 1),
            judged_then: BitDelay::new(SET_UP as usize - 1),
            go: BitDelay::new(1),
            moved: BitDelay::new(MOVED - 1),
            sum_moved: BitDelay::new(MOVED - 1),
            trial: BitDelay::new(1),
            outcome: BitDelay::new(1),
            sum_outcome: BitDelay::new(1),
            scored: BitDelay::new(CANDIDATES_LATENCY),
            first: BitDelay::new(MOVED + CANDIDATES_LATENCY),
            // One cycle after the first quad's candidates, so that a sweep is compared before the next is weighed.
            weighs: BitDelay::new(MOVED + CANDIDATES_LATENCY + 1),
            totals: BitDelay::new(MOVED + CANDIDATES_LATENCY + SCORE_LATENCY + padding),
            finish: BitDelay::new(MOVED + 1),
            step: Delay::new(5, STORE_LATENCY),
            // The target buffer is known one cycle after the set-up and needed one cycle before the write.
            target: Delay::new(BUFFER_BITS, MOVED - 2),
            moved_address: Delay::new(address, MOVED),
            scored_address: Delay::new(address, CANDIDATES_LATENCY),
            set_up: Default::default(),
            quad_end: Default::default(),
        }
    }
}

impl Logic for Search {
    #[hdl_gen]
    fn update(&mut self) {
        self.walk.clk.next = self.clk.val();
        self.weigh.clk.next = self.clk.val();
        self.judge.clk.next = self.clk.val();
        self.period.clk.next = self.clk.val();
        self.first.clk.next = self.clk.val();
        self.weighs.clk.next = self.clk.val();
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
        self.trial.clk.next = self.clk.val();
        self.trial.rst.next = self.rst.val();
        self.outcome.clk.next = self.clk.val();
        self.outcome.rst.next = self.rst.val();
        self.sum_outcome.clk.next = self.clk.val();
        self.sum_outcome.rst.next = self.rst.val();
        self.began.clk.next = self.clk.val();
        self.judged_then.clk.next = self.clk.val();
        self.go.clk.next = self.clk.val();
        self.moved.clk.next = self.clk.val();
        self.sum_moved.clk.next = self.clk.val();
        self.scored.clk.next = self.clk.val();
        self.totals.clk.next = self.clk.val();
        self.finish.clk.next = self.clk.val();
        self.moved_address.clk.next = self.clk.val();
        self.scored_address.clk.next = self.clk.val();
        self.walk.rst.next = self.rst.val();
        self.weigh.rst.next = self.rst.val();
        self.judge.rst.next = self.rst.val();
        self.first.rst.next = self.rst.val();
        self.weighs.rst.next = self.rst.val();
        self.began.rst.next = self.rst.val();
        self.judged_then.rst.next = self.rst.val();
        self.go.rst.next = self.rst.val();
        self.moved.rst.next = self.rst.val();
        self.sum_moved.rst.next = self.rst.val();
        self.scored.rst.next = self.rst.val();
        self.totals.rst.next = self.rst.val();
        self.finish.rst.next = self.rst.val();

        self.weigh.which.next = self.which.val();
        self.counts.which.next = self.which.val();
        self.fill_counts.which.next = self.which.val();
        self.quads.which.next = self.which.val();
        self.period.which.next = self.which.val();

        comment!("Coefficients are written");
        self.store.fill.next = self.fill.val();
        self.store.fill_index.next = self.fill_index.val();
        self.store.fill_address.next = self.fill_address.val();
        self.store.fill_quad.next = self.fill_quad.val();
        self.fill_counts.address.next = self.fill_address.val();
        self.sum.fill.next = self.fill.val();
        self.sum.fill_index.next = self.fill_index.val();
        self.sum.fill_address.next = self.fill_address.val();
        self.sum.fill_mask.next = self.fill_counts.mask.val();
        self.sum.fill_quad.next = self.fill_quad.val();

        comment!("A sweep is set up and starts one cycle later");
        self.walk.begin_frame.next = self.start.val();
        self.walk.enabled.next = self.enabled.val();
        self.judge.begin_frame.next = self.start.val();
        self.began.now.next = self.start.val();
        self.set_up.d.next =
            (self.began.then.val() | self.judged_then.then.val() | (self.walk.chains.val() & self.period.last.val()))
                & !self.rst.val();
        self.judged_then.now.next = self.judge.done.val() & self.judge.closes.val();
        self.period.clear.next = self.set_up.q.val();
        self.period.enable.next = true;
        self.walk.set_up.next = self.set_up.q.val();
        self.walk.judged.next = self.judge.done.val();
        self.walk.improved.next = self.judge.improved.val();
        self.walk.judged_sweep.next = self.judge.judged.val();
        self.walk.best_x.next = self.judge.best_x.val();
        self.walk.best_y.next = self.judge.best_y.val();
        self.judge.halve.next = self.set_up.q.val() & self.walk.next_halves.val();
        self.go.now.next = self.set_up.q.val();

        comment!("Quads pass memory, Taylor shift and candidates");
        self.quad_end.next = self.counting.q.val() & self.quads.last.val();
        self.counting.d.next =
            (self.set_up.q.val() | (self.counting.q.val() & !self.quads.last.val())) & !self.rst.val();
        self.quads.clear.next = self.set_up.q.val();
        self.quads.enable.next = self.counting.q.val();
        self.step.now.next = self.walk.step.val();
        self.target.now.next = self.walk.target.val();
        self.store.read_buffer.next = self.walk.source.val();
        self.store.begins.next = self.set_up.q.val();
        self.store.counts.next = self.counting.q.val();
        self.store.next_base.next = self.walk.next_base.val();
        self.store.read_address.next = self.quads.value.val();
        self.taylor.word.next = self.store.read_data.val();
        self.taylor.step.next = self.step.then.val();
        self.moved.now.next = self.counting.q.val();
        self.trial.now.next = self.moved.then.val() & !self.walk.last.val();
        self.outcome.now.next = self.moved.then.val() & self.walk.last.val();
        self.moved_address.now.next = self.quads.value.val();
        self.store.write.next = self.trial.then.val();
        self.store.write_buffer.next = self.target.then.val();
        self.store.write_address.next = self.moved_address.then.val();
        self.store.write_data.next = self.taylor.moved.val();
        self.candidates.word.next = self.taylor.moved.val();

        comment!("The sum polynomial passes the same blocks");
        self.sum.read.next = self.go.then.val();
        self.sum.read_buffer.next = self.walk.source.val();
        self.sum_taylor.word.next = self.sum.word.val();
        self.sum_taylor.step.next = self.step.then.val();
        self.sum_moved.now.next = self.go.then.val();
        self.sum_outcome.now.next = self.sum_moved.then.val() & self.walk.last.val();
        self.sum.write.next = self.sum_moved.then.val() & !self.walk.last.val();
        self.sum.write_buffer.next = self.target.then.val();
        self.sum.write_data.next = self.sum_taylor.moved.val();
        self.sum_candidates.word.next = self.sum_taylor.moved.val();

        comment!("Scores and their comparison");
        self.scored.now.next = self.trial.then.val();
        self.scored_address.now.next = self.moved_address.then.val();
        self.counts.address.next = self.scored_address.then.val();
        self.first.now.next = self.go.then.val();
        self.scores.first.next = self.first.then.val();
        self.scores.valid.next = self.scored.then.val();
        self.scores.mask.next = self.counts.mask.val();
        self.scores.values.next = self.candidates.values.val();
        self.scores.sums.next = self.sum_candidates.values.val();
        self.totals.now.next = self.quad_end.val() & !self.walk.last.val();
        self.weighs.now.next = self.go.then.val() & !self.walk.last.val();
        self.weigh.start.next = self.weighs.then.val();
        self.weigh.sweep.next = self.walk.sweep.val();
        self.weigh.radius.next = self.walk.radius.val();
        self.weigh.sums.next = self.sum_candidates.values.val();
        self.judge.start.next = self.totals.then.val();
        self.judge.totals.next = self.scores.totals.val();
        self.judge.weights.next = self.weigh.weights.val();
        self.judge.eligible.next = self.weigh.eligible.val();
        self.judge.sweep.next = self.weigh.weighed.val();

        comment!("The constant terms of the last sweep are the values");
        self.constants.word.next = self.taylor.moved.val();
        self.values.next = self.constants.low.val();
        self.values_valid.next = self.outcome.then.val();
        self.settled.next = self.go.then.val() & self.walk.last.val();
        self.values_begin.next = self.sum_outcome.then.val();
        self.finish.now.next = self.quad_end.val() & self.walk.last.val();
        self.done.next = self.finish.then.val();
        self.best_x.next = self.judge.best_x.val();
        self.best_y.next = self.judge.best_y.val();
        self.score.next = self.judge.score.val();
        self.found.next = self.judge.found.val();
        self.judged.next = self.judge.done.val();
        self.taken.next = self.judge.taken.val();
    }
}
