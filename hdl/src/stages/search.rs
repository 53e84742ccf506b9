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

use crate::block;
use crate::language::{Block, Builder, Inside};
use crate::primitives::{
    count_bits, largest, position_bits, store_latency, BestCandidate, BitDelay, Candidates, CaseCounter, Delay, Dff,
    LaneMask, PolynomialWord, Score, ScoreBias, SearchSequencer, Store, Sum, Taylor, BUFFER_BITS, CANDIDATES_LATENCY,
    SCORE_LATENCY, TAYLOR_LATENCY,
};

block! {
    /// Polynomials in by coefficient, p(μ*) out by step.
    pub struct Search {
        cases: usize,
        /// Quads of a subarray.
        quads: usize,
        /// Coefficients of a taxel.
        vectors: usize,
        /// Width of a coefficient as it is written, and of a value.
        fill_bits: usize,
        value_bits: usize,
        /// Values that are output in a cycle.
        width: usize,
        score_bits: usize,
        sweeps: Box<Sweeps>,
    }
    ports SearchPorts {
        clock;
        reset;
        /// Index of the case of the frame that is searched; constant until its values have been output.
        in which: count_bits(*cases);
        /// Index of the case of the frame that is written; constant until its last coefficient.
        in fill_which: count_bits(*cases);
        /// One coefficient of four taxels, signed; valid with `fill`.
        in fill_quad: 4 * fill_bits;
        /// `fill_quad` holds a coefficient.
        in fill;
        /// Index of the coefficient; valid with `fill`.
        in fill_index: count_bits(*vectors);
        /// Address of the quad; valid with `fill`.
        in fill_address: count_bits(*quads);
        /// All coefficients have been written: start the search.
        in start;
        /// The subarray is searched, else p(0) is the result; valid with `start`.
        in enabled;
        /// Values may be output; the last sweep waits for it.
        in ready;
        /// The last sweep waits in this cycle.
        out stalled;
        /// `search_width` values p(μ*), `search_bits[0]` each, signed; valid with `values_valid`.
        out values: width * value_bits;
        /// `values` holds a step: the next ones of a quad, quad by quad.
        out values_valid;
        /// μ*, `score` and `found` are final; high for one cycle, before the values.
        out settled;
        /// High for one cycle, from which on the values can be read row-major, one a cycle: that of the first values where a
        /// step is a quad.
        out values_begin;
        /// All values have been output; high for one cycle.
        out done;
        /// Best position, x, in grid steps of the level, signed; valid with `compared` and `settled`.
        out best_x: position_bits();
        /// Best position, y, in grid steps of the level, signed; valid with `compared` and `settled`.
        out best_y: position_bits();
        /// Score of the best candidate, signed, 2^−6; valid with `compared` and `settled`.
        out score: score_bits;
        /// A candidate was found; valid with `settled`.
        out found;
        /// The candidates of a sweep have been compared; high for one cycle.
        out compared;
        /// A candidate was taken at this level; valid with `compared`.
        out taken;
    }
}

/// The parts of a search.
struct Sweeps {
    sequencer: SearchSequencer,
    bias: ScoreBias,
    best: BestCandidate,
    store: Store,
    taylor: Taylor,
    candidates: Candidates,
    scores: Score,
    lane_mask: LaneMask,
    sum: Sum,
    sum_taylor: Taylor,
    sum_candidates: Candidates,
    fill_mask: LaneMask,
    quads: CaseCounter,
    period: CaseCounter,
    began: BitDelay,
    compared_later: BitDelay,
    moved: BitDelay,
    sum_moved: BitDelay,
    sum_outcome: BitDelay,
    first: BitDelay,
    bias_start: BitDelay,
    totals: BitDelay,
    finish: BitDelay,
    step: Delay,
    target: Delay,
    moved_address: Delay,
    scored_address: Delay,
}

impl Search {
    /// With the widths of `model`, if it searches. Otherwise μ is 0 or that of a network, and the values are p.
    pub fn of_model(model: &Model) -> Option<Self> {
        let formats = model.formats();
        model.searches().then(|| Search {
            cases: model.cases().len(),
            quads: formats.quads,
            vectors: formats.vectors(),
            fill_bits: formats.vector_bits as usize + 2,
            value_bits: formats.search_bits[0] as usize,
            width: formats.search_width,
            score_bits: formats.score_bits as usize,
            sweeps: Box::new(Sweeps::new(model)),
        })
    }
}

impl Block for Search {
    fn build<'k>(&'k self, k: &'k Builder, io: SearchPorts<Inside<'k>>) {
        self.sweeps.build(k, io);
    }
}

impl Sweeps {
    fn new(model: &Model) -> Self {
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
        // Cycles from the address of a step to its shifted polynomials.
        let moved = store_latency(formats) + TAYLOR_LATENCY;
        Sweeps {
            sequencer: SearchSequencer::new(quads),
            bias: ScoreBias::new(formats, &taxel_counts),
            best: BestCandidate::new(formats, largest(&taxel_counts)),
            store: Store::new(taxels.clone(), quads, fill_bits, model.resources.overlaps),
            taylor: Taylor::new(&taxels),
            candidates: Candidates::new(&taxels),
            scores: Score::new(formats),
            lane_mask: LaneMask::new(&layouts, width),
            sum: Sum::new(&sums, quads, fill_bits),
            sum_taylor: Taylor::new(&sums),
            sum_candidates: Candidates::new(&sums),
            fill_mask: LaneMask::new(&layouts, Quads::LANES),
            quads: CaseCounter::new(&limits),
            period: CaseCounter::new(&periods),
            // The result of a comparison and the move computed from it are registered before a sweep is set up.
            // `set_up` is a register too, because it drives the whole search.
            began: BitDelay::new(SET_UP as usize - 1),
            compared_later: BitDelay::new(SET_UP as usize - 1),
            moved: BitDelay::new(moved - 1),
            sum_moved: BitDelay::new(moved - 1),
            sum_outcome: BitDelay::of_pulse(1 + values_delay(model.first())),
            first: BitDelay::new(moved + CANDIDATES_LATENCY),
            // One cycle after the first step's candidates, so that a sweep is compared before the next is weighted.
            bias_start: BitDelay::new(moved + CANDIDATES_LATENCY + 1),
            totals: BitDelay::new(moved + CANDIDATES_LATENCY + SCORE_LATENCY + padding),
            finish: BitDelay::new(moved + 1),
            step: Delay::new(5, store_latency(formats) - 1),
            // The target buffer is known one cycle after the set-up and needed one cycle before the write.
            target: Delay::new(BUFFER_BITS, moved - 2),
            moved_address: Delay::new(step, moved),
            scored_address: Delay::new(step, CANDIDATES_LATENCY),
        }
    }

    fn build<'k>(&'k self, k: &'k Builder, io: SearchPorts<Inside<'k>>) {
        let sequencer = k.instance("sequencer", &self.sequencer);
        let bias = k.instance("bias", &self.bias);
        let best = k.instance("best", &self.best);
        let store = k.instance("store", &self.store);
        let taylor = k.instance("taylor", &self.taylor);
        let candidates = k.instance("candidates", &self.candidates);
        let scores = k.instance("scores", &self.scores);
        let sum = k.instance("sum", &self.sum);
        let sum_taylor = k.instance("sum_taylor", &self.sum_taylor);
        let sum_candidates = k.instance("sum_candidates", &self.sum_candidates);
        let quads = k.instance("quads", &self.quads);
        let period = k.instance("period", &self.period);
        let counting = k.instance("counting", Dff {});
        let began = k.instance("began", &self.began);
        let compared_later = k.instance("compared_later", &self.compared_later);
        let go = k.instance("go", BitDelay::new(1));
        let moved = k.instance("moved", &self.moved);
        let sum_moved = k.instance("sum_moved", &self.sum_moved);
        let trial = k.instance("trial", BitDelay::new(1));
        let outcome = k.instance("outcome", BitDelay::new(1));
        let sum_outcome = k.instance("sum_outcome", &self.sum_outcome);
        let scored = k.instance("scored", BitDelay::new(CANDIDATES_LATENCY));
        let first = k.instance("first", &self.first);
        let bias_start = k.instance("bias_start", &self.bias_start);
        let totals = k.instance("totals", &self.totals);
        let finish = k.instance("finish", &self.finish);
        let step = k.instance("step", &self.step);
        let target = k.instance("target", &self.target);
        let moved_address = k.instance("moved_address", &self.moved_address);
        let set_up = k.instance("set_up", Dff {});
        let stalled_before = k.instance("stalled_before", Dff {});

        bias.which.set(io.which);
        quads.which.set(io.which);
        period.which.set(io.which);

        k.comment("Coefficients are written");
        store.fill.set(io.fill);
        store.fill_index.set(io.fill_index);
        store.fill_address.set(io.fill_address);
        store.fill_quad.set(io.fill_quad);
        sum.fill.set(io.fill);
        sum.fill_index.set(io.fill_index);
        sum.fill_address.set(io.fill_address);
        sum.fill_mask.set(self.fill_mask.of(k, "fill_mask", io.fill_which, || io.fill_address));
        sum.fill_quad.set(io.fill_quad);

        k.comment("A sweep is set up and starts one cycle later");
        sequencer.begin_frame.set(io.start);
        sequencer.enabled.set(io.enabled);
        best.begin_frame.set(io.start);
        began.d.set(io.start);
        let due = k.wire("due", began.q | compared_later.q | stalled_before.q);
        let stall = k.wire("stall", due & sequencer.next_last & !io.ready);
        stalled_before.d.set(stall & !io.rst);
        io.stalled.set(stall);
        set_up.d.set(((due & !stall) | (sequencer.chains & period.last)) & !io.rst);
        compared_later.d.set(best.done & best.closes);
        period.clear.set(set_up.q);
        period.enable.set(k.constant(1, 1));
        sequencer.set_up.set(set_up.q);
        sequencer.compared.set(best.done);
        sequencer.improved.set(best.improved);
        sequencer.compared_sweep.set(best.compared);
        sequencer.best_x.set(best.best_x);
        sequencer.best_y.set(best.best_y);
        best.halve.set(set_up.q & sequencer.next_halves);
        go.d.set(set_up.q);

        k.comment("Quads pass memory, Taylor shift and candidates");
        let quad_end = k.wire("quad_end", counting.q & quads.last);
        counting.d.set((set_up.q | (counting.q & !quads.last)) & !io.rst);
        quads.clear.set(set_up.q);
        quads.enable.set(counting.q);
        step.d.set(sequencer.step);
        target.d.set(sequencer.target);
        store.read_buffer.set(sequencer.source);
        store.begins.set(set_up.q);
        store.counts.set(counting.q);
        store.next_base.set(sequencer.next_base);
        store.read_address.set(quads.value);
        taylor.word.set(store.read_data);
        taylor.step.set(step.q);
        moved.d.set(counting.q);
        trial.d.set(moved.q & !sequencer.last);
        outcome.d.set(moved.q & sequencer.last);
        moved_address.d.set(quads.value);
        store.write.set(trial.q);
        store.write_buffer.set(target.q);
        store.write_address.set(moved_address.q);
        store.write_data.set(taylor.moved);
        candidates.word.set(taylor.moved);

        k.comment("The sum polynomial passes the same blocks");
        sum.read.set(go.q);
        sum.read_buffer.set(sequencer.source);
        sum_taylor.word.set(sum.word);
        sum_taylor.step.set(step.q);
        sum_moved.d.set(go.q);
        sum_outcome.d.set(sum_moved.q & sequencer.last);
        sum.write.set(sum_moved.q & !sequencer.last);
        sum.write_buffer.set(target.q);
        sum.write_data.set(sum_taylor.moved);
        sum_candidates.word.set(sum_taylor.moved);

        k.comment("Scores and their comparison");
        scored.d.set(trial.q);
        first.d.set(go.q);
        scores.first.set(first.q);
        scores.valid.set(scored.q);
        let address = || {
            let scored_address = k.instance("scored_address", &self.scored_address);
            scored_address.d.set(moved_address.q);
            scored_address.q
        };
        scores.mask.set(self.lane_mask.of(k, "lane_mask", io.which, address));
        scores.values.set(candidates.values);
        scores.sums.set(sum_candidates.values);
        totals.d.set(quad_end & !sequencer.last);
        bias_start.d.set(go.q & !sequencer.last);
        bias.start.set(bias_start.q);
        bias.sweep.set(sequencer.sweep);
        bias.radius.set(sequencer.radius);
        bias.sums.set(sum_candidates.values);
        best.start.set(totals.q);
        best.totals.set(scores.totals);
        best.weights.set(bias.weights);
        best.eligible.set(bias.eligible);
        best.sweep.set(bias.weighted_sweep);

        k.comment("The constant terms of the last sweep are the values");
        io.values.set(taylor.moved.low(io.values.bits()));
        io.values_valid.set(outcome.q);
        io.settled.set(go.q & sequencer.last);
        io.values_begin.set(sum_outcome.q);
        finish.d.set(quad_end & sequencer.last);
        io.done.set(finish.q);
        io.best_x.set(best.best_x);
        io.best_y.set(best.best_y);
        io.score.set(best.score);
        io.found.set(best.found);
        io.compared.set(best.done);
        io.taken.set(best.taken);
        k.unused([period.value]);
    }
}

#[cfg(test)]
mod tests;
