//! Sparse objective over one sweep: Σ log2(|p| + ⌊Σp / 2^20⌋) for nine candidates in parallel.

use dermis_golden::fixed::words::formats::{Formats, EPSILON_SHIFT};
use rust_hdl::prelude::*;

use crate::kernel_block;
use crate::language::{concat, Body, Builder, Expr, Kernel, Type};
use crate::primitives::arithmetic::logarithm::{locate, logarithm};
use crate::wire::Wire;

/// Values of a step's taxels and Σp in; `totals` of all valid steps since the `first`, [`LATENCY`] cycles later.
///
/// One cycle each: magnitude; addition of ε Σp (0 for Σp < 0: such a candidate is not eligible); first half of the
/// logarithm; second half and table; sum of the counted lanes; accumulation.
#[derive(dermis_hdl_derive::Block)]
pub struct Score {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// `values`, `mask` and `sums` belong to a step.
    pub valid: Signal<In, Bit>,
    /// The step is the sweep's first: the totals restart.
    pub first: Signal<In, Bit>,
    /// Counted lanes, one bit each; valid with `valid`.
    pub mask: Wire<In>,
    /// Nine values per lane, `search_bits[0]` each, signed, field 9·lane + k; valid with `valid`.
    pub values: Wire<In>,
    /// Σp of the nine candidates, `sum_bits[0]` each, signed; valid with `valid`.
    pub sums: Wire<In>,
    /// Nine totals, `score_bits` each, 2^−6; constant until the next valid step.
    pub totals: Wire<Out>,
    kernel: Body,
}

/// Cycles from a step to the totals that contain it.
pub const LATENCY: usize = 7;

kernel_block!(Score, clock clk, inputs [valid, first, mask, values, sums], outputs [totals]);

impl Score {
    /// With the widths of `formats`.
    pub fn new(formats: &Formats) -> Self {
        let [value, sum] = [formats.search_bits[0], formats.sum_bits[0]];
        Score::with_widths(formats.search_width, value as usize, sum as usize, formats.score_bits as usize)
    }

    /// With `lanes` taxels per step, values of `value_bits`, Σp of `sum_bits` and totals of `score_bits`.
    fn with_widths(lanes: usize, value_bits: usize, sum_bits: usize, score_bits: usize) -> Self {
        let block = Score {
            clk: Default::default(),
            valid: Default::default(),
            first: Default::default(),
            mask: Wire::new(lanes),
            values: Wire::new(9 * lanes * value_bits),
            sums: Wire::new(9 * sum_bits),
            totals: Wire::new(9 * score_bits),
            kernel: Body::default(),
        };
        block.bind(kernel(lanes, value_bits, sum_bits, score_bits))
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

fn kernel(lanes: usize, v: usize, s: usize, t: usize) -> Kernel {
    let k = Builder::new("score");
    let (valid, first) = (k.input("valid", 1), k.input("first", 1));
    let mask = k.input("mask", lanes);
    let (values, sums) = (k.input("values", 9 * lanes * v), k.input("sums", 9 * s));
    let last = |name: &str, value, depth| history(&k, name, value, depth)[depth - 1];
    let (adds, begins) = (last("valid", valid, LATENCY - 1), last("first", first, LATENCY - 1));
    let counted = last("mask", mask, LATENCY - 2);
    let candidate = |n: usize| {
        // With small arrays and short words ε Σp is always 0.
        let shift = EPSILON_SHIFT as usize;
        let epsilon = (s - 1 > shift).then(|| {
            let sum = sums.slice(n * s, s);
            let bits = s - 1 - shift;
            k.delay("epsilon", sum.top().mux(k.constant(bits, 0), sum.slice(shift, bits)))
        });
        let lane = |lane: usize| {
            let log = k.scope(&format!("lane_{lane}"), || {
                let value = values.slice((9 * lane + n) * v, v);
                let negative = (k.constant(v, 0) - value).low(v);
                let magnitude = k.delay("magnitude", value.top().mux(negative, value));
                let sum = magnitude + epsilon.unwrap_or(k.constant(1, 0));
                let argument = k.delay("argument", sum);
                let located = k.delay("located", locate(&k, "locate", argument));
                k.delay("log", logarithm(&k, "log", located))
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
    k.wire("totals", concat(&totals.into_iter().rev().collect::<Vec<_>>()));
    k.finish()
}

#[cfg(test)]
mod tests {
    use dermis_golden::fixed::stages::search::log2;

    use super::*;
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
        let block = Score::with_widths(lanes, v, s, SCORE_BITS);
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
        check(block.kernel.kernel(), &stimulus, &mut reference);
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
