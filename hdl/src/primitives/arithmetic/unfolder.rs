//! Parities of a v_ij back to taxels, scaled to the units of the search.

use rust_hdl::prelude::*;

use crate::kernel_block;
use crate::language::{concat, Body, Builder, Expr, Kernel};
use crate::primitives::address::counter::count_bits;
use crate::wire::Wire;

/// Butterfly in two steps, then v_ij / 4^(i+j), rounded half up: taxels three cycles after their parities.
#[derive(dermis_hdl_derive::Block)]
pub struct Unfolder {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Four parities of a v_ij, signed; taken in every cycle.
    pub quad: Wire<In>,
    /// Index of the v_ij; two cycles after its `quad`.
    pub index: Wire<In>,
    /// Four taxels, two bits wider, signed; three cycles after `quad`.
    pub taxels: Wire<Out>,
    kernel: Body,
}

kernel_block!(Unfolder, clock clk, inputs [quad, index], outputs [taxels]);

impl Unfolder {
    /// For parities of `bits` bits of vectors with these total degrees i + j.
    pub fn new(bits: usize, degrees: &[u32]) -> Self {
        let block = Unfolder {
            clk: Default::default(),
            quad: Wire::new(4 * bits),
            index: Wire::new(count_bits(degrees.len())),
            taxels: Wire::new(4 * (bits + 2)),
            kernel: Body::default(),
        };
        block.bind(kernel(bits, degrees))
    }
}

/// Right shift of the vector of this index: 4^(i+j).
fn shift(index: usize, degrees: &[u32]) -> u32 {
    degrees.get(index).map_or(0, |degree| 2 * degree)
}

/// The four-point Hadamard butterfly of four signed fields, two bits wider.
pub(crate) fn hadamard<'k>(quad: Expr<'k>) -> [Expr<'k>; 4] {
    let bits = quad.bits() / 4;
    let wide = bits + 2;
    let [a, b, c, d] = [0, 1, 2, 3].map(|lane| quad.slice(lane * bits, bits).signed().extend(wide));
    [a + b + c + d, a - b + c - d, a + b - c - d, a - b - c + d].map(|sum| sum.resize(wide))
}

fn kernel(bits: usize, degrees: &[u32]) -> Kernel {
    let wide = bits + 2;
    let k = Builder::new("unfolder");
    let (quad, index) = (k.input("quad", 4 * bits), k.input("index", count_bits(degrees.len())));
    let shifts: Vec<u64> = (0..1 << index.bits()).map(|index| shift(index, degrees).into()).collect();
    let amount = k.wire("amount", index.table(3, &shifts));
    let [a, b, c, d] = [0, 1, 2, 3].map(|parity| quad.slice(parity * bits, bits).signed());
    let halves = [("even_low", a + b), ("even_high", c + d), ("odd_low", a - b), ("odd_high", c - d)];
    let [even_low, even_high, odd_low, odd_high] = halves.map(|(name, sum)| k.delay(name, sum));
    let sums = [even_low + even_high, odd_low + odd_high, even_low - even_high, odd_low - odd_high];
    let sums = sums.map(|sum| sum.resize(wide));
    let taxel = |lane: usize| {
        let sum = k.delay(&format!("sum_{lane}"), sums[lane]);
        let moved = k.wire(&format!("moved_{lane}"), sum.shift_left(1).shift_right_by(amount));
        k.delay(&format!("taxel_{lane}"), moved.round_shift(1).low(wide))
    };
    let taxels: Vec<Expr> = (0..4).rev().map(taxel).collect();
    k.wire("taxels", concat(&taxels));
    k.finish()
}

#[cfg(test)]
mod tests {
    use dermis_golden::fixed::words::arith::round_shift;
    use dermis_golden::fixed::words::schedule::EXPONENTS;
    use dermis_golden::physics::symmetry::parity::hadamard;

    use super::*;
    use crate::language::testbench::{check, random_word, Pipeline};
    use crate::wire::Word;

    const BITS: usize = 19;

    #[test]
    fn taxels_are_those_of_the_model() {
        let degrees = EXPONENTS.map(|(i, j)| i + j);
        let block = Unfolder::new(BITS, &degrees);
        let mut random = fastrand::Rng::with_seed(9);
        let quads: Vec<(Word, usize)> =
            (0..2000).map(|_| (random_word(&mut random, 4 * BITS), random.usize(..degrees.len()))).collect();
        // The index follows its quad by two cycles.
        let stimulus: Vec<Vec<Word>> =
            (2..quads.len()).map(|n| vec![quads[n].0, Word::from(quads[n - 2].1 as u64)]).collect();
        let mut at = 1;
        let taxels = |inputs: &[Word]| {
            at += 1;
            let quad = std::array::from_fn(|lane| inputs[0].signed(lane, BITS));
            let all = hadamard(quad).map(|sum| round_shift(sum, shift(quads[at].1, &degrees)));
            vec![Some(Word::of_fields(&all, BITS + 2))]
        };
        check(block.kernel.kernel(), &stimulus, &mut Pipeline::new(3, 1, taxels));
    }
}
