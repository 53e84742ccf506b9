//! The nine candidates about a centre, computed from the coefficients of a polynomial as they arrive.
//!
//! Coefficient (i, j) arrives in cycle 4i + j. Even and odd powers of x are summed separately, for y = +1 and for y =
//! −1:
//! ```text
//! U, V = Σ over even i of (±1)^j w_ij        p(±1,  1) = U ± M        p(0,  1) = U before i = 2
//! M, N = Σ over odd  i of (±1)^j w_ij        p(±1, −1) = V ± N        p(0, −1) = V before i = 2
//! H = w00 + w20,  G = w10 + w30              p(±1,  0) = H ± G        p(0,  0) = U after w00
//! ```
//! One candidate leaves in each of the cycles 1, 4, 5, 13, 14, 15 and, of the previous polynomial, 0, 2, 3.

use dermis_golden::fixed::plan::serial::word_bits;
use dermis_golden::fixed::words::formats::Formats;

use super::one_of;
use crate::block;
use crate::language::{concat, Block, Builder, Inside, Type};

block! {
    /// Schedule in the module docs; `value` and `index` are registered, one cycle after the sums.
    pub struct Candidates {
        /// Width of a coefficient and of a value.
        bits: usize,
        degree: usize,
    }
    ports CandidatesPorts {
        clock;
        /// A coefficient, signed; that of `cycle`, taken in every cycle.
        in word: bits;
        /// Cycle of the polynomial, 4i + j; valid in every cycle.
        in cycle: 4;
        /// Bit 0, the polynomial that arrives is to be evaluated, bit 1, so was the previous one; valid in every cycle.
        in present: 2;
        /// Bit 0, the polynomial that arrives is the sum polynomial, bit 1, the previous one was; valid with the bits
        /// of `present`.
        in sums: 2;
        /// A candidate's value p, signed; valid with `valid`.
        out value: bits;
        /// Index of the candidate, 3(y + 1) + x + 1; valid with `valid`.
        out index: 4;
        /// `value` is valid.
        out valid;
        /// `value` belongs to the sum polynomial; valid with `valid`.
        out sum;
    }
}

impl Candidates {
    /// With the widths and the degree of `formats`.
    pub fn new(formats: &Formats) -> Self {
        Candidates { bits: word_bits(formats), degree: formats.degree }
    }
}

/// Cycle in which each candidate leaves, by its index; those of the previous polynomial leave before cycle 4.
const LEAVES: [usize; 9] = [0, 5, 15, 3, 1, 2, 14, 4, 13];

impl Block for Candidates {
    fn build<'k>(&self, k: &'k Builder, io: CandidatesPorts<Inside<'k>>) {
        let Candidates { bits, degree } = *self;
        let [u, v, m, n, a, h, g] =
            ["u", "v", "m", "n", "a", "h", "g"].map(|name| k.register(name, Type::unsigned(bits)));
        let [value, index] = [io.value, io.index].map(|output| output.register());
        let [valid, sum] = [io.valid, io.sum].map(|output| output.register());

        let is = |cycles: &[usize]| one_of(k, io.cycle, cycles);
        let zero = k.constant(bits, 0);
        let power = k.wire("power", io.cycle.slice(2, 2) + io.cycle.low(2));
        let counts = k.wire("counts", !k.constant(3, degree as u64).less(power));
        let even = !io.cycle.at(2);
        k.comment("Term of the alternating sums V and N: complemented where j is odd, with a carry.");
        let alternates = io.cycle.at(0);
        let term = k.wire("term", io.word ^ concat(&vec![alternates; bits]));
        // Cleared when the last candidate has left, so that the adder needs no gate at the start of a polynomial.
        k.when(even & counts, || {
            u.set((*u + io.word).low(bits));
            v.set((is(&[0]).mux(zero, *v) + term + alternates).low(bits));
        });
        k.when(is(&[15]), || u.set(zero));
        k.when(!even & counts, || {
            m.set((*m + io.word).low(bits));
            n.set((*n + term + alternates).low(bits));
        });
        k.when(is(&[3]), || [m, n].iter().for_each(|sum| sum.set(zero)));
        k.when(is(&[0]), || a.set(io.word));
        k.when(is(&[8]), || h.set(if degree >= 2 { (*a + io.word).low(bits) } else { *a }));
        let growing: &[usize] = if degree >= 3 { &[4, 12] } else { &[4] };
        k.when(is(growing), || g.set((*g + io.word).low(bits)));
        k.when(is(&[3]), || g.set(zero));

        let middle = is(&[2, 3]);
        let base = k.wire("base", middle.mux(*h, is(&[5, 15, 0]).mux(*v, *u)));
        let part = k.wire("part", middle.mux(*g, is(&[15, 0]).mux(*n, *m)));
        let alone = k.wire("alone", is(&[1, 4, 5]));
        let negate = k.wire("negate", is(&[14, 0, 3]));
        let other = k.wire("other", alone.mux(zero, part ^ concat(&vec![negate; bits])));
        value.set((base + other + negate).low(bits));
        let from_before = k.wire("from_before", is(&[0, 2, 3]));
        let leaves = from_before | alone | !io.cycle.less(k.constant(4, 13));
        let bit = |bit: usize| {
            is(&(0..9).filter(|index| index >> bit & 1 == 1).map(|index| LEAVES[index]).collect::<Vec<_>>())
        };
        index.set(concat(&[bit(3), bit(2), bit(1), bit(0)]));
        valid.set(leaves & from_before.mux(io.present.at(1), io.present.at(0)));
        sum.set(from_before.mux(io.sums.at(1), io.sums.at(0)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::kernel_of;
    use crate::language::testbench::{check, Reference};
    use crate::wire::Word;

    const BITS: usize = 30;

    /// Coefficients w_ij; whether the polynomial is to be evaluated, and whether it is the sum polynomial.
    #[derive(Clone, Copy, Default)]
    struct Polynomial {
        coefficients: [[i64; 4]; 4],
        present: bool,
        sum: bool,
    }

    /// Whole polynomials, evaluated at the candidates; what the two last ones said of themselves.
    struct Evaluated {
        degree: usize,
        /// The polynomial that arrives, and the one before.
        polynomials: [Polynomial; 2],
        out: Option<(usize, i64, bool)>,
        cycle: Option<usize>,
    }

    impl Evaluated {
        fn value(&self, coefficients: [[i64; 4]; 4], candidate: usize) -> i64 {
            let [x, y] = [candidate % 3, candidate / 3].map(|at| at as i64 - 1);
            let term = |(i, j): (usize, usize)| coefficients[i][j] * x.pow(i as u32) * y.pow(j as u32);
            let all = (0..4).flat_map(|i| (0..4).map(move |j| (i, j)));
            all.filter(|(i, j)| i + j <= self.degree).map(term).sum()
        }
    }

    impl Reference for Evaluated {
        fn outputs(&mut self, _: &[Word]) -> Vec<Option<Word>> {
            let out = self.out.map(|(index, value, sum)| (index as u64, Word::of_fields(&[value], BITS), sum));
            vec![
                out.map(|(_, value, _)| value),
                out.map(|(index, ..)| Word::from(index)),
                self.cycle.map(|_| Word::from(out.is_some())),
                out.map(|(.., sum)| Word::from(sum)),
            ]
        }

        fn clock(&mut self, inputs: &[Word]) {
            let [cycle, present, sums] = [1, 2, 3].map(|k| inputs[k].number());
            let cycle = cycle as usize;
            if cycle == 0 {
                let own = Polynomial { present: present & 1 == 1, sum: sums & 1 == 1, ..Polynomial::default() };
                self.polynomials = [own, self.polynomials[0]];
            }
            self.polynomials[0].coefficients[cycle / 4][cycle % 4] = inputs[0].signed(0, BITS);
            let candidate = LEAVES.iter().position(|&leaves| leaves == cycle);
            let from = self.polynomials[usize::from(cycle < 4 && cycle != 1)];
            let value = |candidate| (candidate, self.value(from.coefficients, candidate), from.sum);
            self.out = candidate.filter(|_| from.present).map(value);
            self.cycle = Some(cycle);
        }
    }

    #[test]
    fn the_nine_candidates_are_values_of_the_polynomial() {
        for degree in 1..=3 {
            let mut random = fastrand::Rng::with_seed(24);
            let mut before = [false; 2];
            let polynomial = |at: usize| {
                // The sums are cleared by the end of the first polynomial.
                let own = [at > 0 && random.u8(..4) > 0, random.bool()];
                let pair = |now: bool, then: bool| Word::from(u64::from(now) | u64::from(then) << 1);
                let [present, sums] = [0, 1].map(|which| pair(own[which], before[which]));
                before = own;
                let cycle = |cycle: u64| {
                    let word = Word::of_fields(&[random.i64(-(1 << 24)..1 << 24)], BITS);
                    vec![word, Word::from(cycle), present, sums]
                };
                (0..16).map(cycle).collect::<Vec<_>>()
            };
            let all: Vec<Vec<Word>> = (0..200).flat_map(polynomial).collect();
            let block = Candidates { bits: BITS, degree };
            let mut evaluated = Evaluated { degree, polynomials: Default::default(), out: None, cycle: None };
            check(&kernel_of(&block), &all, &mut evaluated);
        }
    }
}
