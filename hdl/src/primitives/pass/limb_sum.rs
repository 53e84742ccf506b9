//! Rows of v_00 from the accumulations of its low and its high limbs.

use dermis_golden::fixed::words::formats::Formats;
use rust_hdl::prelude::*;

use crate::kernel_block;
use crate::language::{concat, Body, Builder, Kernel, Type};
use crate::wire::Wire;

/// Adds the rows of the high limbs, shifted left by `limb_align`, to those of the low limbs, which have been written to
/// a memory. Until `clear` is followed by the `last` row of the low limbs, rows pass unchanged.
///
/// Where neither factor of v_00 has a low limb, all rows pass unchanged and all are `complete`.
#[derive(dermis_hdl_derive::Block)]
pub struct LimbSum {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// A new subarray: the next row is the first of the low limbs; with priority over `last`.
    pub clear: Signal<In, Bit>,
    /// `quad` is the last row of an accumulation.
    pub last: Signal<In, Bit>,
    /// Accumulators of one row for the four parities, `lane_bits` each, signed; taken in every cycle.
    pub quad: Wire<In>,
    /// The row as written before, of the low limbs, `acc_bits` each, signed; valid with a row of the high limbs.
    pub low: Wire<In>,
    /// The row to write, `acc_bits` each, signed; one cycle after `quad`.
    pub sum: Wire<Out>,
    /// The sum of `quad` has all products of v_00, not those of its low limbs only.
    pub complete: Signal<Out, Bit>,
    kernel: Body,
}

kernel_block!(LimbSum, clock clk, inputs [clear, last, quad, low], outputs [sum, complete]);

/// Widths of the words.
#[derive(Clone, Copy)]
struct Shape {
    lane: usize,
    acc: usize,
    /// Left shift of the high limbs, 0 without low limbs.
    align: usize,
}

impl LimbSum {
    /// With the widths of `formats`.
    pub fn new(formats: &Formats) -> Self {
        LimbSum::of(Shape {
            lane: formats.lane_bits as usize,
            acc: formats.acc_bits as usize,
            align: formats.limb_align as usize,
        })
    }

    fn of(shape: Shape) -> Self {
        let block = LimbSum {
            clk: Default::default(),
            clear: Default::default(),
            last: Default::default(),
            quad: Wire::new(4 * shape.lane),
            low: Wire::new(4 * shape.acc),
            sum: Wire::new(4 * shape.acc),
            complete: Default::default(),
            kernel: Body::default(),
        };
        block.bind(shape.kernel())
    }
}

impl Shape {
    fn kernel(self) -> Kernel {
        let k = Builder::new("limb_sum");
        let [clear, last] = ["clear", "last"].map(|name| k.input(name, 1));
        let (quad, low) = (k.input("quad", 4 * self.lane), k.input("low", 4 * self.acc));
        let plain = |parity: usize| quad.slice(parity * self.lane, self.lane).signed().extend(self.acc);
        if self.align == 0 {
            k.wire("complete", k.constant(1, 1));
            k.delay("sum", concat(&[3, 2, 1, 0].map(plain)));
            return k.finish();
        }
        let complete = k.state("complete", Type::unsigned(1), clear, 0);
        k.when(last, || complete.set(k.constant(1, 1)));
        let of = |parity: usize| {
            let (high, low) = (plain(parity), low.slice(parity * self.acc, self.acc));
            // The lowest bits of a shifted word are zero and need no adder.
            let upper = (high.low(self.acc - self.align) + low.slice(self.align, self.acc - self.align))
                .low(self.acc - self.align);
            complete.mux(upper.concat(low.low(self.align)), high.unsigned())
        };
        k.delay("sum", concat(&[3, 2, 1, 0].map(of)));
        k.finish()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::testbench::{check, Reference};
    use crate::wire::Word;

    const SHAPE: Shape = Shape { lane: 33, acc: 40, align: 5 };

    /// Whether the row of the low limbs has been the last; undefined before the first `clear`.
    struct Rows {
        shape: Shape,
        complete: Option<bool>,
        sum: Option<Word>,
    }

    impl Reference for Rows {
        fn outputs(&mut self, _: &[Word]) -> Vec<Option<Word>> {
            vec![self.complete.map(Word::from), self.sum]
        }

        fn clock(&mut self, inputs: &[Word]) {
            let Shape { lane, acc, align } = self.shape;
            let [quad, low] = [(2, lane), (3, acc)].map(|(k, bits)| [0, 1, 2, 3].map(|n| inputs[k].signed(n, bits)));
            let sums = [0, 1, 2, 3].map(|n| match self.complete {
                Some(true) if align > 0 => (low[n] + (quad[n] << align)) << (64 - acc) >> (64 - acc),
                _ => quad[n],
            });
            self.sum = self.complete.map(|_| Word::of_fields(&sums, acc));
            self.complete = match [inputs[0].number(), inputs[1].number()] {
                _ if self.shape.align == 0 => Some(true),
                [1, _] => Some(false),
                [_, 1] => self.complete.map(|_| true),
                _ => self.complete,
            };
        }
    }

    #[test]
    fn high_limbs_are_added_to_low_limbs() {
        for align in [SHAPE.align, 0] {
            let mut random = fastrand::Rng::with_seed(3);
            let mut inputs = |cycle: usize| {
                let words = |random: &mut fastrand::Rng, bits: usize| {
                    Word::of_fields(&[(); 4].map(|()| random.i64(-(1 << (bits - 1))..1 << (bits - 1))), bits)
                };
                let (quad, low) = (words(&mut random, SHAPE.lane), words(&mut random, SHAPE.acc));
                vec![(cycle == 0 || random.u8(..9) == 0).into(), (random.u8(..4) == 0).into(), quad, low]
            };
            let stimulus: Vec<Vec<Word>> = (0..3000).map(&mut inputs).collect();
            let shape = Shape { align, ..SHAPE };
            let complete = (align == 0).then_some(true);
            check(LimbSum::of(shape).kernel.kernel(), &stimulus, &mut Rows { shape, complete, sum: None });
        }
    }
}
