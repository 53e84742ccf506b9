//! After a sweep: compares its nine candidates with each other and with the best so far.

use dermis_golden::fixed::words::formats::Formats;

use crate::block;
use crate::language::{concat, Block, Builder, Expr, Inside, Type};
use crate::primitives::search::score_bias::weight_bits;
use crate::primitives::search::sweep::{position_bits, sweep_bits, Fields};

block! {
    /// Score = total − weight for all nine at once, then a tree of comparisons. Ties: in the coarse grid the first
    /// candidate in row-major order wins; in a halving the centre, then row-major order. The last three candidates are
    /// compared with the best so far in parallel with each other.
    ///
    /// `start` with totals, weights, eligibility and sweep; `done`, with `improved`, `LATENCY` cycles later.
    /// `begin_frame` clears the result for a new search, `halve` doubles the position for the next level.
    pub struct BestCandidate {
        score_bits: usize,
        weight_bits: usize,
    }
    ports BestCandidatePorts {
        clock;
        /// Synchronous reset, active high; clears the control pipeline only.
        in rst;
        /// A new search: position 0, score 0, nothing taken.
        in begin_frame;
        /// A new level: the position doubles and `taken` is cleared.
        in halve;
        /// The nine candidates are valid; starts their comparison.
        in start;
        /// Nine totals Σ log2(…), `score_bits` each, signed; valid with `start`.
        in totals: 9 * score_bits;
        /// Nine n·log2 Σp, unsigned; valid with `start`.
        in weights: 9 * weight_bits;
        /// Nine bits, candidate k may be taken; valid with `start`.
        in eligible: 9;
        /// Word of the sweep (`Fields`); valid with `start`.
        in sweep: sweep_bits();
        /// The comparison is complete; high for one cycle.
        out done;
        /// The best candidate changed; valid with `done`.
        out improved;
        /// The next sweep was waiting for this result; valid with `done`.
        out closes;
        /// Word of the sweep just compared; valid with `done`.
        out compared: sweep_bits();
        /// Best position, x, in grid steps of the level, signed; valid with `done` and from then on until the next
        /// `done`, `halve` or `begin_frame` takes effect.
        out best_x: position_bits();
        /// Best position, y, in grid steps of the level, signed; as `best_x`.
        out best_y: position_bits();
        /// Score of the best candidate, signed, 2^−6; as `best_x`.
        out score: score_bits;
        /// A candidate was taken at this level.
        out taken;
        /// A candidate was taken in the coarse grid.
        out found;
    }
}

/// Cycles from `start` to `done`.
pub const LATENCY: usize = 6;

impl BestCandidate {
    /// With the widths of `formats`, for subarrays of at most `taxels` taxels.
    pub fn new(formats: &Formats, taxels: usize) -> Self {
        BestCandidate { score_bits: formats.score_bits as usize, weight_bits: weight_bits(taxels) }
    }
}

/// a < b, both signed. Exchanging the sign bits makes the comparison unsigned, which takes only the carry out of one
/// chain; a signed comparison also taps the chain below the sign bit.
fn less<'k>(a: Expr<'k>, b: Expr<'k>) -> Expr<'k> {
    let below = a.bits() - 1;
    b.top().concat(a.low(below)).less(a.top().concat(b.low(below)))
}

/// A candidate on its way through the tree: eligible, score, index.
#[derive(Clone, Copy)]
struct Candidate<'k> {
    ok: Expr<'k>,
    score: Expr<'k>,
    index: Expr<'k>,
}

impl<'k> Candidate<'k> {
    /// The candidate one cycle later.
    fn delayed(self, k: &'k Builder, name: &str) -> Self {
        let later = |prefix: &str, value| k.delay(&format!("{prefix}_{name}"), value);
        Candidate { ok: later("ok", self.ok), score: later("s", self.score), index: later("k", self.index) }
    }

    /// The better of this and `other`, this on a tie, one cycle later.
    fn better(self, k: &'k Builder, other: Candidate<'k>, name: &str) -> Self {
        let second = k.wire(&format!("second_{name}"), other.ok & (!self.ok | less(other.score, self.score)));
        let winner = Candidate {
            ok: self.ok | other.ok,
            score: second.mux(other.score, self.score),
            index: second.mux(other.index, self.index),
        };
        winner.delayed(k, name)
    }

    /// Whether this, a later candidate, wins against `earlier`.
    fn beats(self, earlier: Candidate<'k>) -> Expr<'k> {
        !earlier.ok | less(self.score, earlier.score)
    }
}

/// −1, 0 or 1 in two bits, signed: the column of candidate `index` in the 3×3.
fn column<'k>(k: &'k Builder, index: Expr<'k>) -> Expr<'k> {
    let one_of = |numbers: [u64; 3]| index.is(numbers[0]) | index.is(numbers[1]) | index.is(numbers[2]);
    let step = |value| k.signed_constant(2, value);
    one_of([0, 3, 6]).mux(step(-1), one_of([1, 4, 7]).mux(step(0), step(1)))
}

/// −1, 0 or 1 in two bits, signed: the row of candidate `index` in the 3×3.
fn row<'k>(k: &'k Builder, index: Expr<'k>) -> Expr<'k> {
    let below = |limit| index.less(k.constant(4, limit));
    let step = |value| k.signed_constant(2, value);
    below(3).mux(step(-1), below(6).mux(step(0), step(1)))
}

/// Along one axis: whether the best so far, `ahead` of the centre, is past the candidate at centre + `step`.
fn beyond<'k>(ahead: Expr<'k>, step: Expr<'k>) -> Expr<'k> {
    let half = ahead.slice(1, ahead.bits() - 1);
    !ahead.top() & (step.at(1) | step.at(0).mux(half.any(), ahead.any()))
}

/// What the comparison with the best so far needs: its score, its distance from the centre, the centre.
#[derive(Clone, Copy)]
struct Best<'k> {
    score: Expr<'k>,
    ahead: [Expr<'k>; 2],
    centre: [Expr<'k>; 2],
}

/// One of the last three candidates: whether it is lower than the best so far, or level and earlier; score, position.
#[derive(Clone, Copy)]
struct Compared<'k> {
    lower: Expr<'k>,
    tie: Expr<'k>,
    score: Expr<'k>,
    x: Expr<'k>,
    y: Expr<'k>,
}

impl<'k> Compared<'k> {
    fn new(k: &'k Builder, candidate: Candidate<'k>, best: Best<'k>, name: &str) -> Self {
        let later = |prefix: &str, value| k.delay(&format!("{prefix}_{name}"), value);
        let column = k.wire(&format!("column_{name}"), column(k, candidate.index));
        let row = k.wire(&format!("row_{name}"), row(k, candidate.index));
        let position = |axis: usize, step| (best.centre[axis] + step).low(position_bits()).signed();
        let lower = later("lower", less(candidate.score, best.score));
        let same = later("same", candidate.score.equals(best.score));
        let above = later("above", beyond(best.ahead[1], row));
        let level = later("level", best.ahead[1].equals(row));
        let left = later("left", beyond(best.ahead[0], column));
        Compared {
            lower,
            tie: k.wire(&format!("tie_{name}"), same & (above | (level & left))),
            score: later("score", candidate.score),
            x: later("at_x", position(0, column)),
            y: later("at_y", position(1, row)),
        }
    }
}

impl Block for BestCandidate {
    fn build<'k>(&self, k: &'k Builder, io: BestCandidatePorts<Inside<'k>>) {
        let (p, t, w) = (position_bits(), self.score_bits, self.weight_bits);
        let done = io.done.state(io.rst, 0);
        let (improved, closes) = (io.improved.register(), io.closes.register());
        let compared = io.compared.register();
        let (best_x, best_y) = (k.register("best_x", Type::signed(p)), k.register("best_y", Type::signed(p)));
        let score = k.register("score", Type::signed(t));
        let (taken, found) = (io.taken.register(), io.found.register());
        let valid = k.state("valid", Type::unsigned(LATENCY - 1), io.rst, 0);

        // Score = total − weight, for all nine at once.
        let difference = |n: usize| {
            let weight = io.weights.slice(n * w, w);
            (io.totals.slice(n * t, t) - weight.low(w.min(t))).low(t)
        };
        let scores = k.delay("scores", concat(&(0..9).rev().map(difference).collect::<Vec<_>>()));
        let (fits, own_sweep) =
            (k.register("fits", Type::unsigned(9)), k.register("own_sweep", Type::unsigned(sweep_bits())));
        k.when(io.start, || {
            fits.set(io.eligible);
            own_sweep.set(io.sweep);
        });
        let fields = Fields::of(*own_sweep);
        let centre = [("own_centre_x", fields.centre[0]), ("own_centre_y", fields.centre[1])];
        let centre = centre.map(|(name, value)| k.wire(name, value));
        let coarse = k.wire("own_coarse", fields.coarse);

        k.comment("The eight around the centre keep their order: four pairs, then the four before it and after it.");
        let leaf = |n: usize| {
            let (ok, score) = (fits.at(n), scores.slice(n * t, t).signed());
            Candidate { ok, score, index: k.constant(4, n as u64) }
        };
        let [a, b, c, d] =
            [(0, "a"), (2, "b"), (5, "c"), (7, "d")].map(|(n, name)| leaf(n).better(k, leaf(n + 1), name));
        let middle = leaf(4).delayed(k, "middle");
        let (before, after) = (a.better(k, b, "before"), c.better(k, d, "after"));
        let central = middle.delayed(k, "centre");

        k.comment("The earlier one wins ties; in a halving that is the centre.");
        let level = !coarse & central.score.equals(before.score);
        let centre_wins = k.wire("centre_wins", central.ok & (central.beats(before) | level));
        let after_wins = k.wire("after_wins", after.ok & after.beats(before) & after.beats(central));
        let takes_centre = k.delay("takes_centre", centre_wins);
        let takes_after = k.delay("takes_after", after_wins);
        let some = k.delay("some", before.ok | central.ok | after.ok);

        k.comment("All three are compared with the best so far in parallel with the choice among them. The best's");
        k.comment("distance from the centre was registered a cycle earlier.");
        let ahead = [k.delay("ahead_x", *best_x - centre[0]), k.delay("ahead_y", *best_y - centre[1])];
        let best = Best { score: *score, ahead, centre };
        let against_best = |candidate, name| Compared::new(k, candidate, best, name);
        let last = [against_best(before, "before"), against_best(central, "centre"), against_best(after, "after")];
        let choose = |what: usize| {
            let [before, centre, after] = last.map(|one| [one.lower, one.tie, one.score, one.x, one.y][what]);
            takes_after.mux(after, takes_centre.mux(centre, before))
        };
        let fit = k.delay("fit", some & (coarse | *found));
        let lower = k.delay("lower", !*taken | choose(0));
        let tie = k.delay("tie", coarse & choose(1));
        let [s, x, y] = [("s", 2), ("x", 3), ("y", 4)].map(|(name, what)| k.delay(name, choose(what)));
        let ends = valid.top();
        let take = k.wire("take", ends & fit & (lower | tie));

        valid.set(valid.low(LATENCY - 2).concat(io.start));
        done.set(ends);
        improved.set(take);
        k.when(ends, || {
            closes.set(fields.closes);
            compared.set(*own_sweep);
        });
        // A new search has priority over a new level, and that over a result.
        k.when(take & !io.halve, || {
            best_x.set(x);
            best_y.set(y);
            score.set(s);
            taken.set(k.constant(1, 1));
            k.when(coarse, || found.set(k.constant(1, 1)));
        });
        k.when(io.halve, || {
            best_x.set(best_x.low(p - 1).concat(k.constant(1, 0)).signed());
            best_y.set(best_y.low(p - 1).concat(k.constant(1, 0)).signed());
            taken.set(k.constant(1, 0));
        });
        k.when(io.begin_frame, || {
            best_x.set(k.signed_constant(p, 0));
            best_y.set(k.signed_constant(p, 0));
            score.set(k.signed_constant(t, 0));
            taken.set(k.constant(1, 0));
            found.set(k.constant(1, 0));
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::kernel_of;
    use crate::language::testbench::{check, Reference};
    use crate::primitives::search::sweep::Sweep;
    use crate::wire::Word;

    const SCORE_BITS: usize = 20;
    const WEIGHT_BITS: usize = 14;
    /// Order of comparison: centre first in a halving, row-major in the coarse grid.
    const ORDERS: [[usize; 9]; 2] = [[4, 0, 1, 2, 3, 5, 6, 7, 8], [0, 1, 2, 3, 4, 5, 6, 7, 8]];

    /// Compares all nine one after the other in the cycle of the result.
    #[derive(Default)]
    struct OneByOne {
        left: usize,
        next: Vec<Word>,
        /// Position, score, taken, found; none before the first search.
        best: Option<([i64; 2], i64, bool, bool)>,
        done: Option<bool>,
        improved: bool,
        sweep: Option<Sweep>,
    }

    impl OneByOne {
        fn compare(&mut self) -> bool {
            let sweep = Sweep::of_word(&self.next[7]);
            let Some((position, score, taken, found)) = &mut self.best else { return false };
            let mut improved = false;
            for n in ORDERS[usize::from(sweep.coarse)] {
                if self.next[6].field(n, 1) == 0 || !(sweep.coarse || *found) {
                    continue;
                }
                let own = self.next[4].signed(n, SCORE_BITS) - self.next[5].field(n * WEIGHT_BITS, WEIGHT_BITS) as i64;
                let at = [sweep.centre[0] + n as i64 % 3 - 1, sweep.centre[1] + n as i64 / 3 - 1];
                let earlier = sweep.coarse && (at[1], at[0]) < (position[1], position[0]);
                if !*taken || own < *score || (own == *score && earlier) {
                    (*position, *score, *taken, improved) = (at, own, true, true);
                }
            }
            *found |= sweep.coarse && *taken;
            improved
        }
    }

    impl Reference for OneByOne {
        fn outputs(&mut self, _: &[Word]) -> Vec<Option<Word>> {
            let signed = |value: i64, bits| Some(Word::of_fields(&[value], bits));
            let best = self.best.map(|(position, score, taken, found)| {
                let p = position_bits();
                [
                    signed(position[0], p),
                    signed(position[1], p),
                    signed(score, SCORE_BITS),
                    Some(taken.into()),
                    Some(found.into()),
                ]
            });
            let start = [
                self.done.map(Word::from),
                self.done.map(|_| Word::from(self.improved)),
                self.sweep.map(|sweep| Word::from(sweep.closes)),
                self.sweep.map(|sweep| sweep.word()),
            ];
            start.into_iter().chain(best.unwrap_or_default()).collect()
        }

        fn clock(&mut self, inputs: &[Word]) {
            let [rst, begin_frame, halve, start] = [0, 1, 2, 3].map(|k| inputs[k].number() == 1);
            let ends = self.left == 1;
            self.improved = ends && self.compare();
            if ends {
                self.sweep = Some(Sweep::of_word(&self.next[7]));
            }
            self.done = if rst { Some(false) } else { self.done.map(|_| ends) };
            self.left = match (rst, start) {
                (true, _) => 0,
                (false, true) => LATENCY - 1,
                (false, false) => self.left.saturating_sub(1),
            };
            if start {
                self.next = inputs.to_vec();
            }
            match (&mut self.best, begin_frame, halve) {
                (best, true, _) => *best = Some(([0; 2], 0, false, false)),
                (Some((position, _, taken, _)), false, true) => (*position, *taken) = (position.map(|p| 2 * p), false),
                _ => {}
            }
        }
    }

    /// Searches of some sweeps each, with ties, levels, resets; a new one never while another is compared.
    fn stimulus(cycles: usize) -> Vec<Vec<Word>> {
        let mut random = fastrand::Rng::with_seed(5);
        let mut busy = 0;
        let mut levels = 0;
        let inputs = |cycle: usize| {
            let idle = busy == 0;
            busy = usize::max(busy, 1) - 1;
            let rst = cycle < 2 || random.u16(..300) == 0;
            let begin_frame = idle && (cycle < 4 || random.u8(..20) == 0);
            let halve = idle && levels < 3 && random.u8(..10) == 0;
            let start = idle && cycle > 4 && !begin_frame && !halve && random.bool();
            levels = if begin_frame { 0 } else { levels + usize::from(halve) };
            if start {
                busy = LATENCY + random.usize(..3);
            }
            let sweep = Sweep {
                centre: [random.i64(-4..5), random.i64(-4..5)],
                square: random.i64(..100).abs(),
                buffer: random.usize(..4),
                coarse: random.bool(),
                closes: random.bool(),
            };
            // Small numbers tie; large ones reach the ends of the range.
            let large = random.bool();
            let total = |_| if large { random.i64(-500_000..500_000) } else { random.i64(-2..3) };
            let totals: Vec<i64> = (0..9).map(total).collect();
            let weights: Vec<i64> = (0..9).map(|_| random.i64(0..if large { 16_000 } else { 2 })).collect();
            vec![
                rst.into(),
                begin_frame.into(),
                halve.into(),
                start.into(),
                Word::of_fields(&totals, SCORE_BITS),
                Word::of_fields(&weights, WEIGHT_BITS),
                random.u64(..512).into(),
                sweep.word(),
            ]
        };
        (0..cycles).map(inputs).collect()
    }

    #[test]
    fn the_tree_finds_what_comparing_one_by_one_finds() {
        let block = BestCandidate { score_bits: SCORE_BITS, weight_bits: WEIGHT_BITS };
        check(&kernel_of(&block), &stimulus(8000), &mut OneByOne::default());
    }
}
