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
use crate::language::{Block, Builder, Expr, Inside, Interface, Outside};
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
        in case_index: count_bits(*cases);
        /// Index of the case of the frame that is written; constant until its last coefficient.
        in fill_case: count_bits(*cases);
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

/// Lists the parts of a search in the order of their instances: the struct `Parts` of their blocks, the struct `Placed` of the
/// ports of the instances.
macro_rules! part_list {
    ($($part:ident: $block:ty),+ $(,)?) => {
        /// The blocks of the parts.
        struct Parts { $($part: $block,)+ }

        /// The ports of the instances of the parts.
        struct Placed<'k> { $($part: <$block as Interface>::Ports<Outside<'k>>,)+ }

        impl Parts {
            fn place<'k>(&'k self, k: &'k Builder) -> Placed<'k> {
                Placed { $($part: k.instance(stringify!($part), &self.$part),)+ }
            }
        }
    };
}

part_list! {
    sequencer: SearchSequencer,
    bias: ScoreBias,
    best: BestCandidate,
    store: Store,
    taylor: Taylor,
    candidates: Candidates,
    scores: Score,
    sum: Sum,
    sum_taylor: Taylor,
    sum_candidates: Candidates,
    quads: CaseCounter,
    period: CaseCounter,
    counting: Dff,
    began: BitDelay,
    compared_later: BitDelay,
    go: BitDelay,
    moved: BitDelay,
    sum_moved: BitDelay,
    trial: BitDelay,
    outcome: BitDelay,
    sum_outcome: BitDelay,
    scored: BitDelay,
    first: BitDelay,
    bias_start: BitDelay,
    totals: BitDelay,
    finish: BitDelay,
    step: Delay,
    target: Delay,
    moved_address: Delay,
    set_up: Dff,
    stalled_before: Dff,
}

/// The parts of a search, and those of which only some scenes have an instance.
struct Sweeps {
    parts: Parts,
    fill_mask: LaneMask,
    lane_mask: LaneMask,
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
        let parts = Parts {
            sequencer: SearchSequencer::new(quads),
            bias: ScoreBias::new(formats, &taxel_counts),
            best: BestCandidate::new(formats, largest(&taxel_counts)),
            store: Store::new(taxels.clone(), quads, fill_bits, model.resources.overlaps),
            taylor: Taylor::new(&taxels),
            candidates: Candidates::new(&taxels),
            scores: Score::new(formats),
            sum: Sum::new(&sums, quads, fill_bits),
            sum_taylor: Taylor::new(&sums),
            sum_candidates: Candidates::new(&sums),
            quads: CaseCounter::new(&limits),
            period: CaseCounter::new(&periods),
            counting: Dff {},
            // The result of a comparison and the move computed from it are registered before a sweep is set up.
            // `set_up` is a register too, because it drives the whole search.
            began: BitDelay::new(SET_UP as usize - 1),
            compared_later: BitDelay::new(SET_UP as usize - 1),
            go: BitDelay::new(1),
            moved: BitDelay::new(moved - 1),
            sum_moved: BitDelay::new(moved - 1),
            trial: BitDelay::new(1),
            outcome: BitDelay::new(1),
            sum_outcome: BitDelay::of_pulse(1 + values_delay(model.first())),
            scored: BitDelay::new(CANDIDATES_LATENCY),
            first: BitDelay::new(moved + CANDIDATES_LATENCY),
            // One cycle after the first step's candidates, so that a sweep is compared before the next is weighted.
            bias_start: BitDelay::new(moved + CANDIDATES_LATENCY + 1),
            totals: BitDelay::new(moved + CANDIDATES_LATENCY + SCORE_LATENCY + padding),
            finish: BitDelay::new(moved + 1),
            step: Delay::new(5, store_latency(formats) - 1),
            // The target buffer is known one cycle after the set-up and needed one cycle before the write.
            target: Delay::new(BUFFER_BITS, moved - 2),
            moved_address: Delay::new(step, moved),
            set_up: Dff {},
            stalled_before: Dff {},
        };
        Sweeps {
            parts,
            fill_mask: LaneMask::new(&layouts, Quads::LANES),
            lane_mask: LaneMask::new(&layouts, width),
            scored_address: Delay::new(step, CANDIDATES_LATENCY),
        }
    }

    fn build<'k>(&'k self, k: &'k Builder, io: SearchPorts<Inside<'k>>) {
        let s = &self.parts.place(k);
        s.bias.case_index.set(io.case_index);
        s.quads.case_index.set(io.case_index);
        s.period.case_index.set(io.case_index);
        self.fill(k, s, &io);
        set_up(k, s, &io);
        let quad_end = quads(k, s, io.rst);
        sum_polynomial(k, s);
        self.score(k, s, io.case_index, quad_end);
        output(k, s, &io, quad_end);
        k.unused([s.period.value]);
    }

    /// The coefficients go to the store and, added up, to the sum polynomial.
    fn fill<'k>(&'k self, k: &'k Builder, s: &Placed<'k>, io: &SearchPorts<Inside<'k>>) {
        k.comment("Coefficients are written");
        s.store.fill.set(io.fill);
        s.store.fill_index.set(io.fill_index);
        s.store.fill_address.set(io.fill_address);
        s.store.fill_quad.set(io.fill_quad);
        s.sum.fill.set(io.fill);
        s.sum.fill_index.set(io.fill_index);
        s.sum.fill_address.set(io.fill_address);
        s.sum.fill_mask.set(self.fill_mask.of(k, "fill_mask", io.fill_case, || io.fill_address));
        s.sum.fill_quad.set(io.fill_quad);
    }

    /// The candidates of the quads are scored, and compared after the last one.
    fn score<'k>(&'k self, k: &'k Builder, s: &Placed<'k>, case_index: Expr<'k>, quad_end: Expr<'k>) {
        k.comment("Scores and their comparison");
        s.scored.d.set(s.trial.q);
        s.first.d.set(s.go.q);
        s.scores.first.set(s.first.q);
        s.scores.valid.set(s.scored.q);
        let address = || {
            let scored_address = k.instance("scored_address", &self.scored_address);
            scored_address.d.set(s.moved_address.q);
            scored_address.q
        };
        s.scores.mask.set(self.lane_mask.of(k, "lane_mask", case_index, address));
        s.scores.values.set(s.candidates.values);
        s.scores.sums.set(s.sum_candidates.values);
        s.totals.d.set(quad_end & !s.sequencer.last);
        s.bias_start.d.set(s.go.q & !s.sequencer.last);
        s.bias.start.set(s.bias_start.q);
        s.bias.sweep.set(s.sequencer.sweep);
        s.bias.radius.set(s.sequencer.radius);
        s.bias.sums.set(s.sum_candidates.values);
        s.best.start.set(s.totals.q);
        s.best.totals.set(s.scores.totals);
        s.best.weights.set(s.bias.weights);
        s.best.eligible.set(s.bias.eligible);
        s.best.sweep.set(s.bias.weighted_sweep);
    }
}

/// When a sweep starts and, at the last one, waits.
fn set_up<'k>(k: &'k Builder, s: &Placed<'k>, io: &SearchPorts<Inside<'k>>) {
    k.comment("A sweep is set up and starts one cycle later");
    s.sequencer.begin_frame.set(io.start);
    s.sequencer.enabled.set(io.enabled);
    s.best.begin_frame.set(io.start);
    s.began.d.set(io.start);
    let due = k.wire("due", s.began.q | s.compared_later.q | s.stalled_before.q);
    let stall = k.wire("stall", due & s.sequencer.next_last & !io.ready);
    s.stalled_before.d.set(stall & !io.rst);
    io.stalled.set(stall);
    s.set_up.d.set(((due & !stall) | (s.sequencer.chains & s.period.last)) & !io.rst);
    s.compared_later.d.set(s.best.done & s.best.closes);
    s.period.clear.set(s.set_up.q);
    s.period.enable.set(k.constant(1, 1));
    s.sequencer.set_up.set(s.set_up.q);
    s.sequencer.compared.set(s.best.done);
    s.sequencer.improved.set(s.best.improved);
    s.sequencer.compared_sweep.set(s.best.compared);
    s.sequencer.best_x.set(s.best.best_x);
    s.sequencer.best_y.set(s.best.best_y);
    s.best.halve.set(s.set_up.q & s.sequencer.next_halves);
    s.go.d.set(s.set_up.q);
}

/// The quads of a sweep, one step after the other; the last one is read.
fn quads<'k>(k: &'k Builder, s: &Placed<'k>, rst: Expr<'k>) -> Expr<'k> {
    k.comment("Quads pass memory, Taylor shift and candidates");
    let quad_end = k.wire("quad_end", s.counting.q & s.quads.last);
    s.counting.d.set((s.set_up.q | (s.counting.q & !s.quads.last)) & !rst);
    s.quads.clear.set(s.set_up.q);
    s.quads.enable.set(s.counting.q);
    s.step.d.set(s.sequencer.step);
    s.target.d.set(s.sequencer.target);
    s.store.read_buffer.set(s.sequencer.source);
    s.store.begins.set(s.set_up.q);
    s.store.counts.set(s.counting.q);
    s.store.next_base.set(s.sequencer.next_base);
    s.store.read_address.set(s.quads.value);
    s.taylor.word.set(s.store.read_data);
    s.taylor.step.set(s.step.q);
    s.moved.d.set(s.counting.q);
    s.trial.d.set(s.moved.q & !s.sequencer.last);
    s.outcome.d.set(s.moved.q & s.sequencer.last);
    s.moved_address.d.set(s.quads.value);
    s.store.write.set(s.trial.q);
    s.store.write_buffer.set(s.target.q);
    s.store.write_address.set(s.moved_address.q);
    s.store.write_data.set(s.taylor.moved);
    s.candidates.word.set(s.taylor.moved);
    quad_end
}

/// The sum polynomial, beside the first step of a sweep.
fn sum_polynomial<'k>(k: &'k Builder, s: &Placed<'k>) {
    k.comment("The sum polynomial passes the same blocks");
    s.sum.read.set(s.go.q);
    s.sum.read_buffer.set(s.sequencer.source);
    s.sum_taylor.word.set(s.sum.word);
    s.sum_taylor.step.set(s.step.q);
    s.sum_moved.d.set(s.go.q);
    s.sum_outcome.d.set(s.sum_moved.q & s.sequencer.last);
    s.sum.write.set(s.sum_moved.q & !s.sequencer.last);
    s.sum.write_buffer.set(s.target.q);
    s.sum.write_data.set(s.sum_taylor.moved);
    s.sum_candidates.word.set(s.sum_taylor.moved);
}

/// The values, and the position with its score.
fn output<'k>(k: &'k Builder, s: &Placed<'k>, io: &SearchPorts<Inside<'k>>, quad_end: Expr<'k>) {
    k.comment("The constant terms of the last sweep are the values");
    io.values.set(s.taylor.moved.low(io.values.bits()));
    io.values_valid.set(s.outcome.q);
    io.settled.set(s.go.q & s.sequencer.last);
    io.values_begin.set(s.sum_outcome.q);
    s.finish.d.set(quad_end & s.sequencer.last);
    io.done.set(s.finish.q);
    io.best_x.set(s.best.best_x);
    io.best_y.set(s.best.best_y);
    io.score.set(s.best.score);
    io.found.set(s.best.found);
    io.compared.set(s.best.done);
    io.taken.set(s.best.taken);
}

#[cfg(test)]
mod tests;
