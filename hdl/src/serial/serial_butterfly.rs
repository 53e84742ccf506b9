//! The Hadamard butterfly of the serial engine, for `fold` and `unfold`: a quad enters in four cycles and leaves in
//! four.

use rust_hdl::prelude::*;

use crate::kernel_block;
use crate::language::{concat, Body, Builder, Kernel, Type};
use crate::primitives::subtracted;
use crate::wire::Wire;

/// ```text
/// word, valid (four of a quad) --> four accumulators --> transformed, one after the other
/// ```
/// Accumulator p adds (−1)^{p·l} times word l, as [`hadamard`](dermis_golden::physics::symmetry::parity::hadamard). The first
/// sum leaves in the cycle after the last word; the next quad may start when the fourth has left.
#[derive(dermis_hdl_derive::Block)]
pub struct SerialButterfly {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Synchronous reset, active high.
    pub rst: Signal<In, Bit>,
    /// A word of a quad, signed, lanes in order; valid with `valid`.
    pub word: Wire<In>,
    /// `word` is valid.
    pub valid: Signal<In, Bit>,
    /// All four sums; valid with `quad_valid`.
    pub quad: Wire<Out>,
    /// The first of the four sums leaves in this cycle.
    pub quad_valid: Signal<Out, Bit>,
    /// One sum, two bits wider than a word, signed; valid with `transformed_valid`.
    pub transformed: Wire<Out>,
    /// `transformed` is valid.
    pub transformed_valid: Signal<Out, Bit>,
    kernel: Body,
}

kernel_block!(
    SerialButterfly,
    clock clk,
    inputs [rst, word, valid],
    outputs [quad, quad_valid, transformed, transformed_valid]
);

impl SerialButterfly {
    /// For words of `bits` bits; sums have two more.
    pub fn new(bits: usize) -> Self {
        let block = SerialButterfly {
            clk: Default::default(),
            rst: Default::default(),
            word: Wire::new(bits),
            valid: Default::default(),
            quad: Wire::new(4 * (bits + 2)),
            quad_valid: Default::default(),
            transformed: Wire::new(bits + 2),
            transformed_valid: Default::default(),
            kernel: Body::default(),
        };
        block.bind(kernel(bits))
    }
}

fn kernel(bits: usize) -> Kernel {
    let k = Builder::new("serial_butterfly");
    let (rst, word, valid) = (k.input("rst", 1), k.input("word", bits).signed(), k.input("valid", 1));
    let count = Type::unsigned(2);
    let (taken, giving) = (k.state("taken", count, rst, 0), k.state("giving", Type::unsigned(1), rst, 0));
    let idle = k.wire("idle", rst | !*giving);
    let given = k.state("given", count, idle, 0);
    let ends = k.wire("ends", *giving & given.is(3));
    let clears = k.wire("clears", rst | ends);
    let sums = ["sum0", "sum1", "sum2", "sum3"].map(|name| k.state(name, Type::signed(bits + 2), clears, 0));
    k.when(valid, || {
        for (sum, odd) in sums.iter().zip(subtracted(&k, *taken)) {
            let [less, more] = [**sum - word, **sum + word].map(|sum| sum.low(bits + 2).signed());
            sum.set(odd.mux(less, more));
        }
        taken.set(taken.plus(1));
    });
    given.set(given.plus(1));
    giving.set((valid & taken.is(3)) | (*giving & !given.is(3)));
    let [sum0, sum1, sum2, sum3] = sums.map(|sum| sum.get());
    k.wire("quad", concat(&[sum3, sum2, sum1, sum0]));
    k.wire("quad_valid", *giving & given.is(0));
    k.wire("transformed", given.case(&[(0, sum0), (1, sum1), (2, sum2)], sum3).unsigned());
    k.wire("transformed_valid", *giving);
    k.finish()
}

#[cfg(test)]
mod tests {
    use dermis_golden::physics::symmetry::parity::hadamard;

    use super::*;
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
        check(SerialButterfly::new(BITS).kernel.kernel(), &all, &mut Quads::default());
    }
}
