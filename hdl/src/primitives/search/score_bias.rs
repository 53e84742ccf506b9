//! Bias of each candidate's score, n·log2 Σp, and whether the candidate is eligible.

use dermis_golden::fixed::words::formats::Formats;

use crate::block;
use crate::language::{concat, Block, Builder, Expr, Inside, Type};
use crate::primitives::address::case_counter::{expression_by_case, largest};
use crate::primitives::address::counter::count_bits;
use crate::primitives::arithmetic::logarithm::{locate, logarithm, LOG_BITS};
use crate::primitives::search::sweep::{square_bits, sweep_bits, Fields};

block! {
    /// Three candidates per cycle, one row of equal y: Σp selected and the disc tested, the logarithm in three steps,
    /// the last with its table, times n.
    ///
    /// `start` with the sweep and its nine sums, which stay stable for the next three cycles. The results are valid
    /// nine cycles after `start`, until those of the next sweep.
    pub struct ScoreBias {
        /// Width of a Σp in bits.
        sum_bits: usize,
        /// Taxels of a subarray, by case.
        taxels: Vec<usize>,
    }
    ports ScoreBiasPorts {
        clock;
        /// Synchronous reset, active high; clears the control pipeline only.
        in rst;
        /// Index of the case; constant while a frame is searched.
        in case_index: count_bits(taxels.len());
        /// Start with the nine candidates of `sweep`.
        in start;
        /// Word of the sweep (`Fields`); valid with `start`.
        in sweep: sweep_bits();
        /// Squared radius of the search disc; valid with `start`.
        in radius: square_bits();
        /// Nine Σp, `sum_bits[0]` each, signed; valid with `start` and for three more cycles.
        in sums: 9 * sum_bits;
        /// Nine n·log2 Σp, unsigned, 2^−6; valid nine cycles after `start`, until those of the next sweep.
        out weights: 9 * weight_bits(largest(taxels));
        /// Nine bits, each Σp > 0 and inside the disc; valid with `weights`.
        out eligible: 9;
        /// Word of the sweep the results belong to; valid with `weights`.
        out weighted_sweep: sweep_bits();
    }
}

/// Width of n·log2 Σp for subarrays of `taxels` taxels, in bits.
pub fn weight_bits(taxels: usize) -> usize {
    LOG_BITS + count(taxels as i64)
}

fn count(taxels: i64) -> usize {
    64 - (taxels as u64).leading_zeros() as usize
}

impl ScoreBias {
    /// With the widths of `formats`, for subarrays of `taxels[case]` taxels.
    pub fn new(formats: &Formats, taxels: &[usize]) -> Self {
        ScoreBias { sum_bits: formats.sum_bits[0] as usize, taxels: taxels.to_vec() }
    }
}

/// n·log2 Σp without a multiplier: one term per set bit of n, added up in two halves, of which the sum is that product.
fn halves<'k>(k: &'k Builder, taxels: usize, log: Expr<'k>, bits: usize) -> [Expr<'k>; 2] {
    let set = (0..usize::BITS as usize).filter(|bit| taxels >> bit & 1 == 1);
    let terms: Vec<Expr> = set.map(|bit| log.shift_left(bit)).collect();
    let (first, rest) = terms.split_at(terms.len().div_ceil(2));
    let sum = |terms: &[Expr<'k>]| {
        let all = terms.iter().copied().reduce(|sum, term| sum + term);
        all.unwrap_or(k.constant(bits, 0)).resize(bits)
    };
    [sum(first), sum(rest)]
}

impl Block for ScoreBias {
    fn build<'k>(&self, k: &'k Builder, io: ScoreBiasPorts<Inside<'k>>) {
        let ScoreBias { sum_bits: s, ref taxels } = *self;
        let (w, q) = (weight_bits(largest(taxels)), square_bits());
        let (bit, zero) = (Type::unsigned(1), k.constant(1, 0));
        let running = k.state("running", bit, io.rst, 0);
        let valid = k.state("valid", Type::unsigned(5), io.rst, 0);
        let (own_sweep, own_radius) =
            (k.register("own_sweep", io.sweep.ty()), k.register("own_radius", io.radius.ty()));
        k.when(io.start, || {
            own_sweep.set(io.sweep);
            own_radius.set(io.radius);
        });
        let row = k.register("row", Type::unsigned(2));
        row.set(io.start.mux(k.constant(2, 0), row.plus(1)));
        let rows = ["row2", "row3", "row4", "row5", "row6"].iter().scan(*row, |row, name| {
            *row = k.delay(name, *row);
            Some(*row)
        });
        let row6 = rows.last().unwrap_or(*row);
        k.when(row.is(2), || running.set(zero));
        k.when(io.start, || running.set(k.constant(1, 1)));
        valid.set(valid.low(4).concat(*running));
        let writes = valid.top();

        k.comment("|c + u|² = |c|² + 2 (ux cx + uy cy) + |ux| + |uy|, so the disc needs no multiplier. One carry");
        k.comment("chain per cycle, the comparison in a third cycle. Rows in order uy = −1, 0, 1.");
        let fields = Fields::of(*own_sweep);
        let twice = [("twice_x", fields.centre[0]), ("twice_y", fields.centre[1])];
        let [twice_x, twice_y] = twice.map(|(name, value)| k.wire(name, value.shift_left(1).resize(q).unsigned()));
        let below = (fields.square - twice_y).low(q).plus(1);
        let above = (fields.square + twice_y).low(q).plus(1);
        let in_row = k.delay("in_row", row.is(0).mux(below, row.is(2).mux(above, fields.square)));
        let distances = [
            k.delay("distance_0", (in_row - twice_x).low(q).plus(1)),
            k.delay("distance_1", in_row),
            k.delay("distance_2", (in_row + twice_x).low(q).plus(1)),
        ];

        let mut results = Vec::new();
        for (column, distance) in distances.into_iter().enumerate() {
            k.scope(&format!("column_{column}"), || {
                let sum_of = |row: usize| io.sums.slice((3 * row + column) * s, s);
                let sum = k.delay("sum", row.is(0).mux(sum_of(0), row.is(1).mux(sum_of(1), sum_of(2))));
                let presses = k.delay("presses", !sum.top() & sum.any());
                let fits = k.delay("fits", presses & !own_radius.less(distance));
                let fits = k.delay("fits_2", k.delay("fits_1", fits));
                let located = k.delay("located", locate(k, "locate", sum));
                let log = k.delay("log", logarithm(k, "log", located));
                let all: Vec<[Expr; 2]> = taxels.iter().map(|&taxels| halves(k, taxels, log, w)).collect();
                let half = |n: usize| {
                    let of: Vec<Expr> = all.iter().map(|halves| halves[n]).collect();
                    expression_by_case(io.case_index, &of).unwrap_or(k.constant(w, 0))
                };
                let weight = (k.delay("first", half(0)) + k.delay("rest", half(1))).low(w);
                for row in 0..3 {
                    let own = (
                        k.register(&format!("weight_{row}"), Type::unsigned(w)),
                        k.register(&format!("eligible_{row}"), bit),
                    );
                    k.when(writes & row6.is(row), || {
                        own.0.set(weight);
                        own.1.set(fits);
                    });
                    results.push((3 * row as usize + column, own));
                }
            });
        }
        results.sort_by_key(|&(n, _)| std::cmp::Reverse(n));
        io.weights.set(concat(&results.iter().map(|(_, (weight, _))| weight.get()).collect::<Vec<_>>()));
        io.eligible.set(concat(&results.iter().map(|(_, (_, eligible))| eligible.get()).collect::<Vec<_>>()));
        let weighted_sweep = io.weighted_sweep.register();
        k.when(writes & row6.is(2), || weighted_sweep.set(*own_sweep));
    }
}

#[cfg(test)]
mod tests {
    use dermis_golden::fixed::stages::search::log2;

    use super::*;
    use crate::language::kernel_of;
    use crate::language::testbench::{check, Reference};
    use crate::primitives::search::sweep::Sweep;
    use crate::wire::Word;

    /// Cycles from `start` to the results.
    const LATENCY: usize = 9;
    const SUM_BITS: usize = 30;
    const TAXELS: [usize; 3] = [64, 25, 9];

    /// Weighs all nine in the cycle of the results.
    #[derive(Default)]
    struct AtOnce {
        left: usize,
        next: Vec<Word>,
        results: Option<[Word; 3]>,
    }

    impl AtOnce {
        fn weigh(&self) -> [Word; 3] {
            let sweep = Sweep::of_word(&self.next[3]);
            let sum = |n: usize| self.next[5].signed(n, SUM_BITS);
            // The weight of a negative Σp, which is not eligible, is that of its bits.
            let bits = |n: usize| self.next[5].field(n * SUM_BITS, SUM_BITS) as i64;
            let weight = |n: usize| TAXELS[self.next[1].number() as usize] as i64 * log2(bits(n));
            let eligible = (0..9).filter(|&n| {
                let at = [n as i64 % 3 - 1 + sweep.centre[0], n as i64 / 3 - 1 + sweep.centre[1]];
                sum(n) > 0 && at[0] * at[0] + at[1] * at[1] <= self.next[4].number() as i64
            });
            let weights: Vec<i64> = (0..9).map(weight).collect();
            [
                Word::of_fields(&weights, weight_bits(TAXELS[0])),
                eligible.map(|n| 1 << n).sum::<u64>().into(),
                self.next[3],
            ]
        }
    }

    impl Reference for AtOnce {
        fn outputs(&mut self, _: &[Word]) -> Vec<Option<Word>> {
            match self.results {
                // Rows are written one after the other.
                Some(results) if self.left == 0 || self.left > 2 => results.map(Some).to_vec(),
                _ => vec![None; 3],
            }
        }

        fn clock(&mut self, inputs: &[Word]) {
            if self.left == 1 {
                self.results = Some(self.weigh());
            }
            self.left = self.left.saturating_sub(1);
            if inputs[2].number() == 1 {
                (self.left, self.next) = (LATENCY - 1, inputs.to_vec());
            }
            if inputs[0].number() == 1 {
                // What was on its way may or may not have been written.
                (self.left, self.results) = (0, None);
            }
        }
    }

    /// Sweeps at any distance of at least the results', inputs stable.
    fn stimulus(cycles: usize) -> Vec<Vec<Word>> {
        let mut random = fastrand::Rng::with_seed(6);
        let (mut busy, mut given): (usize, Vec<Word>) = (0, Vec::new());
        let inputs = |cycle: usize| {
            let rst = cycle < 2 || random.u16(..300) == 0;
            let start = !rst && busy == 0 && random.bool();
            busy = busy.saturating_sub(1);
            if start || cycle == 0 {
                busy = LATENCY + random.usize(..3);
                let centre = [random.i64(-30..31), random.i64(-30..31)];
                let square = centre[0] * centre[0] + centre[1] * centre[1];
                let sweep =
                    Sweep { centre, square, buffer: random.usize(..4), coarse: random.bool(), closes: random.bool() };
                let radius = (square + random.i64(-20..20)).max(0) as u64;
                let sum = |_| random.i64(..) >> random.usize(64 - SUM_BITS..64);
                let sums: Vec<i64> = (0..9).map(sum).collect();
                let case_index = random.u64(..TAXELS.len() as u64);
                given = vec![case_index.into(), sweep.word(), radius.into(), Word::of_fields(&sums, SUM_BITS)];
            }
            vec![rst.into(), given[0], start.into(), given[1], given[2], given[3]]
        };
        (0..cycles).map(inputs).collect()
    }

    #[test]
    fn nine_weights_and_the_disc_are_those_of_the_model() {
        let block = ScoreBias { sum_bits: SUM_BITS, taxels: TAXELS.to_vec() };
        check(&kernel_of(&block), &stimulus(6000), &mut AtOnce::default());
    }
}
