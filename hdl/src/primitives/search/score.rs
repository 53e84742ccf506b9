//! Sparse objective over one sweep: Σ log2(|p| + ⌊Σp / 2^20⌋) for nine candidates in parallel.

use dermis_golden::fixed::words::formats::{Formats, EPSILON_SHIFT};

use crate::block;
use crate::language::{concat, Block, Builder, Expr, Inside, Type};
use crate::primitives::arithmetic::logarithm::{locate, logarithm};

block! {
    /// Values of a step's taxels and Σp in; `totals` of all valid steps since the `first`, [`LATENCY`] cycles later.
    ///
    /// One cycle each: magnitude; addition of ε Σp (0 for Σp < 0: such a candidate is not eligible); first half of the
    /// logarithm; second half and table; sum of the counted lanes; accumulation.
    pub struct Score {
        /// Taxels of a step.
        lanes: usize,
        value_bits: usize,
        sum_bits: usize,
        score_bits: usize,
    }
    ports ScorePorts {
        clock;
        /// `values`, `mask` and `sums` belong to a step.
        in valid;
        /// The step is the sweep's first: the totals restart.
        in first;
        /// Counted lanes, one bit each; valid with `valid`.
        in mask: lanes;
        /// Nine values per lane, `search_bits[0]` each, signed, field 9·lane + k; valid with `valid`.
        in values: 9 * lanes * value_bits;
        /// Σp of the nine candidates, `sum_bits[0]` each, signed; valid with `valid`.
        in sums: 9 * sum_bits;
        /// Nine totals, `score_bits` each, 2^−6; constant until the next valid step.
        out totals: 9 * score_bits;
    }
}

/// Cycles from a step to the totals that contain it.
pub const LATENCY: usize = 7;

impl Score {
    /// With the widths of `formats`.
    pub fn new(formats: &Formats) -> Self {
        Score {
            lanes: formats.search_width,
            value_bits: formats.search_bits[0] as usize,
            sum_bits: formats.sum_bits[0] as usize,
            score_bits: formats.score_bits as usize,
        }
    }
}

/// Control of a step on its way: the value of each of the last `depth` cycles, the latest first.
fn history<'k>(k: &'k Builder, name: &str, value: Expr<'k>, depth: usize) -> Vec<Expr<'k>> {
    let later = |value: &mut Expr<'k>, n: usize| {
        *value = k.delay(&format!("{name}_{n}"), *value);
        Some(*value)
    };
    (1..=depth).scan(value, later).collect()
}

impl Block for Score {
    fn build<'k>(&self, k: &'k Builder, io: ScorePorts<Inside<'k>>) {
        let Score { lanes, value_bits: v, sum_bits: s, score_bits: t } = *self;
        let last = |name: &str, value, depth| history(k, name, value, depth)[depth - 1];
        let (adds, begins) = (last("valid", io.valid, LATENCY - 1), last("first", io.first, LATENCY - 1));
        let counted = last("mask", io.mask, LATENCY - 2);
        let candidate = |n: usize| {
            // With small arrays and short words ε Σp is always 0.
            let shift = EPSILON_SHIFT as usize;
            let epsilon = (s - 1 > shift).then(|| {
                let sum = io.sums.slice(n * s, s);
                let bits = s - 1 - shift;
                k.delay("epsilon", sum.top().mux(k.constant(bits, 0), sum.slice(shift, bits)))
            });
            let lane = |lane: usize| {
                let log = k.scope(&format!("lane_{lane}"), || {
                    let value = io.values.slice((9 * lane + n) * v, v);
                    let negative = (k.constant(v, 0) - value).low(v);
                    let magnitude = k.delay("magnitude", value.top().mux(negative, value));
                    let sum = magnitude + epsilon.unwrap_or(k.constant(1, 0));
                    let argument = k.delay("argument", sum);
                    let located = k.delay("located", locate(k, "locate", argument));
                    k.delay("log", logarithm(k, "log", located))
                });
                counted.at(lane).mux(log, k.constant(log.bits(), 0))
            };
            let logs: Vec<Expr> = (0..lanes).map(lane).collect();
            let pairs: Vec<Expr> = logs.chunks(2).map(|pair| pair[1..].iter().fold(pair[0], |a, b| a + *b)).collect();
            let together = k.delay("together", pairs[1..].iter().fold(pairs[0], |a, b| a + *b));
            let total = k.register("total", Type::unsigned(t));
            let before = begins.mux(k.constant(t, 0), *total);
            k.when(adds, || total.set((before + together.resize(t)).low(t)));
            *total
        };
        let totals: Vec<Expr> = (0..9).map(|n| k.scope(&format!("candidate_{n}"), || candidate(n))).collect();
        io.totals.set(concat(&totals.into_iter().rev().collect::<Vec<_>>()));
    }
}

#[cfg(test)]
mod tests {
    use dermis_golden::fixed::stages::search::log2;

    use super::*;
    use crate::language::kernel_of;
    use crate::language::testbench::{check, random_word, Reference};
    use crate::wire::Word;

    const SCORE_BITS: usize = 24;

    /// Adds up the model's logarithms as the steps enter; shows them when they leave.
    struct Totals {
        lanes: usize,
        widths: [usize; 2],
        entered: [Option<[i64; 9]>; LATENCY],
        totals: Option<[i64; 9]>,
    }

    impl Totals {
        fn add(&mut self, inputs: &[Word]) {
            let [v, s] = self.widths;
            let log = |n: usize| -> i64 {
                let epsilon = inputs[4].signed(n, s).max(0) >> EPSILON_SHIFT;
                let counted = (0..self.lanes).filter(|&lane| inputs[2].field(lane, 1) == 1);
                counted.map(|lane| log2(inputs[3].signed(9 * lane + n, v).abs() + epsilon)).sum()
            };
            let before = if inputs[1].number() == 1 { Some([0; 9]) } else { self.totals };
            self.totals = before.map(|before| std::array::from_fn(|n| before[n] + log(n)));
        }
    }

    impl Reference for Totals {
        fn outputs(&mut self, _: &[Word]) -> Vec<Option<Word>> {
            vec![self.entered[0].map(|totals| Word::of_fields(&totals, SCORE_BITS))]
        }

        fn clock(&mut self, inputs: &[Word]) {
            if inputs[0].number() == 1 {
                self.add(inputs);
            }
            self.entered.rotate_left(1);
            self.entered[LATENCY - 1] = self.totals;
        }
    }

    fn is_the_sum_of_logarithms(lanes: usize, v: usize, s: usize) {
        let block = Score { lanes, value_bits: v, sum_bits: s, score_bits: SCORE_BITS };
        let mut random = fastrand::Rng::with_seed(2);
        let inputs = |cycle: usize| {
            let mut values = Word::default();
            for n in 0..9 * lanes {
                // All magnitudes.
                values.set(n * v, v, (random.i64(..) >> random.usize(64 - v..64)) as u64);
            }
            // The first step of all is a sweep's first.
            let first = cycle == 0 || random.u8(..20) == 0;
            let valid = cycle == 0 || random.u8(..4) > 0;
            vec![valid.into(), first.into(), random.u64(..1 << lanes).into(), values, random_word(&mut random, 9 * s)]
        };
        let stimulus: Vec<Vec<Word>> = (0..1500).map(inputs).collect();
        let mut reference = Totals { lanes, widths: [v, s], entered: [None; LATENCY], totals: None };
        check(&kernel_of(&block), &stimulus, &mut reference);
    }

    /// Σp with and without bits above 2^20.
    #[test]
    fn totals_are_sums_of_the_model_s_logarithms() {
        is_the_sum_of_logarithms(4, 27, 34);
        is_the_sum_of_logarithms(4, 12, 16);
        is_the_sum_of_logarithms(2, 20, 26);
        is_the_sum_of_logarithms(1, 20, 26);
    }
}
