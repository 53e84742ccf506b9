//! The Hadamard butterfly of the serial engine, for `fold` and `unfold`: a quad enters in four cycles and leaves in
//! four.

use crate::block;
use crate::language::{concat, Block, Builder, Inside, Type};
use crate::primitives::subtracted;

block! {
    /// ```text
    /// word, valid (four of a quad) --> four accumulators --> transformed, one after the other
    /// ```
    /// Accumulator p adds (−1)^{p·l} times word l, as [`hadamard`](dermis_golden::physics::symmetry::parity::hadamard).
    /// The first sum leaves in the cycle after the last word; the next quad may start when the fourth has left.
    pub struct SerialButterfly {
        /// Width of a word.
        bits: usize,
    }
    ports SerialButterflyPorts {
        clock;
        reset;
        /// A word of a quad, signed, lanes in order; valid with `valid`.
        in word: bits;
        /// `word` is valid.
        in valid;
        /// All four sums; valid with `quad_valid`.
        out quad: 4 * (bits + 2);
        /// The first of the four sums leaves in this cycle.
        out quad_valid;
        /// One sum, two bits wider than a word, signed; valid with `transformed_valid`.
        out transformed: bits + 2;
        /// `transformed` is valid.
        out transformed_valid;
    }
}

impl SerialButterfly {
    /// For words of `bits` bits; sums have two more.
    pub fn new(bits: usize) -> Self {
        SerialButterfly { bits }
    }
}

impl Block for SerialButterfly {
    fn build<'k>(&self, k: &'k Builder, io: SerialButterflyPorts<Inside<'k>>) {
        let (word, bits) = (io.word.signed(), self.bits + 2);
        let count = Type::unsigned(2);
        let (taken, giving) = (k.state("taken", count, io.rst, 0), k.state("giving", Type::unsigned(1), io.rst, 0));
        let idle = k.wire("idle", io.rst | !*giving);
        let given = k.state("given", count, idle, 0);
        let ends = k.wire("ends", *giving & given.is(3));
        let clears = k.wire("clears", io.rst | ends);
        let sums = ["sum0", "sum1", "sum2", "sum3"].map(|name| k.state(name, Type::signed(bits), clears, 0));
        k.when(io.valid, || {
            for (sum, odd) in sums.iter().zip(subtracted(k, *taken)) {
                let [less, more] = [**sum - word, **sum + word].map(|sum| sum.low(bits).signed());
                sum.set(odd.mux(less, more));
            }
            taken.set(taken.plus(1));
        });
        given.set(given.plus(1));
        giving.set((io.valid & taken.is(3)) | (*giving & !given.is(3)));
        let [sum0, sum1, sum2, sum3] = sums.map(|sum| sum.get());
        io.quad.set(concat(&[sum3, sum2, sum1, sum0]));
        io.quad_valid.set(*giving & given.is(0));
        io.transformed.set(given.case(&[(0, sum0), (1, sum1), (2, sum2)], sum3).unsigned());
        io.transformed_valid.set(*giving);
    }
}

#[cfg(test)]
mod tests {
    use dermis_golden::physics::symmetry::parity::hadamard;

    use super::*;
    use crate::language::kernel_of;
    use crate::language::testbench::{check, Reference};
    use crate::wire::Word;

    const BITS: usize = 20;

    /// Quads and their sums, as the golden model computes them.
    #[derive(Default)]
    struct Quads {
        taken: Vec<i64>,
        sums: Option<([i64; 4], usize)>,
        reset: bool,
    }

    impl Reference for Quads {
        fn outputs(&mut self, _: &[Word]) -> Vec<Option<Word>> {
            let bit = |bit: bool| self.reset.then(|| Word::from(bit));
            let first = self.sums.filter(|(_, given)| *given == 0);
            vec![
                first.map(|(sums, _)| Word::of_fields(&sums, BITS + 2)),
                bit(first.is_some()),
                self.sums.map(|(sums, given)| Word::of_fields(&[sums[given]], BITS + 2)),
                bit(self.sums.is_some()),
            ]
        }

        fn clock(&mut self, inputs: &[Word]) {
            self.sums = self.sums.map(|(sums, given)| (sums, given + 1)).filter(|(_, given)| *given < 4);
            if inputs[2].number() == 1 {
                self.taken.push(inputs[1].signed(0, BITS));
            }
            if let [a, b, c, d] = self.taken[..] {
                self.sums = Some((hadamard([a, b, c, d]), 0));
                self.taken.clear();
            }
            if inputs[0].number() == 1 {
                *self = Quads { reset: true, ..Quads::default() };
            }
        }
    }

    #[test]
    fn the_sums_of_a_quad_leave_one_after_the_other() {
        let mut random = fastrand::Rng::with_seed(2);
        let mut quads = Quads::default();
        let cycle = |cycle: usize| {
            let rst = cycle < 2 || random.u16(..300) == 0;
            let valid = !rst && quads.sums.is_none() && random.u8(..3) > 0;
            let inputs = vec![Word::from(rst), Word::from(random.u64(..1 << BITS)), Word::from(valid)];
            quads.clock(&inputs);
            inputs
        };
        let all: Vec<Vec<Word>> = (0..5000).map(cycle).collect();
        check(&kernel_of(&SerialButterfly::new(BITS)), &all, &mut Quads::default());
    }
}
