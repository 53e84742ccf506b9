//! Parities of a v_ij back to taxels, scaled to the units of the search.

use crate::block;
use crate::language::{concat, Block, Builder, Expr, Inside};
use crate::primitives::address::counter::count_bits;

block! {
    /// Butterfly in two steps, then v_ij / 4^(i+j), rounded half up: taxels three cycles after their parities.
    pub struct Unfolder {
        /// Width of a parity in bits.
        bits: usize,
        /// Total degrees i + j of the vectors.
        degrees: Vec<u32>,
    }
    ports UnfolderPorts {
        clock;
        /// Four parities of a v_ij, signed; taken in every cycle.
        in quad: 4 * bits;
        /// Index of the v_ij; two cycles after its `quad`.
        in index: count_bits(degrees.len());
        /// Four taxels, two bits wider, signed; three cycles after `quad`.
        out taxels: 4 * (bits + 2);
    }
}

impl Unfolder {
    /// For parities of `bits` bits of vectors with these total degrees i + j.
    pub fn new(bits: usize, degrees: &[u32]) -> Self {
        Unfolder { bits, degrees: degrees.to_vec() }
    }
}

impl Block for Unfolder {
    fn build<'k>(&self, k: &'k Builder, io: UnfolderPorts<Inside<'k>>) {
        let wide = self.bits + 2;
        let shifts: Vec<u64> = (0..1 << io.index.bits()).map(|index| shift(index, &self.degrees).into()).collect();
        let amount = k.wire("amount", io.index.table(3, &shifts));
        let [a, b, c, d] = [0, 1, 2, 3].map(|parity| io.quad.slice(parity * self.bits, self.bits).signed());
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
        io.taxels.set(concat(&taxels));
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

#[cfg(test)]
mod tests {
    use dermis_golden::fixed::words::arith::round_shift;
    use dermis_golden::fixed::words::schedule::EXPONENTS;
    use dermis_golden::physics::symmetry::parity::hadamard;

    use super::*;
    use crate::language::kernel_of;
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
        check(&kernel_of(&block), &stimulus, &mut Pipeline::new(3, 1, taxels));
    }
}
