//! Rows of v_00 from the accumulations of its low and its high limbs.

use dermis_golden::fixed::words::formats::Formats;

use crate::block;
use crate::language::{concat, Block, Builder, Inside};

block! {
    /// Adds the rows of the high limbs, shifted left by `limb_align`, to those of the low limbs, which have been
    /// written to a memory. Until `clear` is followed by the `last` row of the low limbs, rows pass unchanged.
    ///
    /// Where neither factor of v_00 has a low limb, all rows pass unchanged and all are `complete`.
    #[derive(Clone, Copy)]
    pub struct LimbSum {
        lane: usize,
        acc: usize,
        /// Left shift of the high limbs, 0 without low limbs.
        align: usize,
    }
    ports LimbSumPorts {
        clock;
        /// A new subarray: the next row is the first of the low limbs; with priority over `last`.
        in clear;
        /// `quad` is the last row of an accumulation.
        in last;
        /// Accumulators of one row for the four parities, `lane_bits` each, signed; taken in every cycle.
        in quad: 4 * lane;
        /// The row as written before, of the low limbs, `acc_bits` each, signed; valid with a row of the high limbs.
        in low: 4 * acc;
        /// The row to write, `acc_bits` each, signed; one cycle after `quad`.
        out sum: 4 * acc;
        /// The sum of `quad` has all products of v_00, not those of its low limbs only.
        out complete;
    }
}

impl LimbSum {
    /// With the widths of `formats`.
    pub fn new(formats: &Formats) -> Self {
        LimbSum { lane: formats.lane_bits as usize, acc: formats.acc_bits as usize, align: formats.limb_align as usize }
    }
}

impl Block for LimbSum {
    fn build<'k>(&self, k: &'k Builder, io: LimbSumPorts<Inside<'k>>) {
        let plain = |parity: usize| io.quad.slice(parity * self.lane, self.lane).signed().extend(self.acc);
        if self.align == 0 {
            io.complete.set(k.constant(1, 1));
            io.sum.delay(concat(&[3, 2, 1, 0].map(plain)));
            return;
        }
        let complete = io.complete.state(io.clear, 0);
        k.when(io.last, || complete.set(k.constant(1, 1)));
        let of = |parity: usize| {
            let (high, low) = (plain(parity), io.low.slice(parity * self.acc, self.acc));
            // The lowest bits of a shifted word are zero and need no adder.
            let upper = (high.low(self.acc - self.align) + low.slice(self.align, self.acc - self.align))
                .low(self.acc - self.align);
            complete.mux(upper.concat(low.low(self.align)), high.unsigned())
        };
        io.sum.delay(concat(&[3, 2, 1, 0].map(of)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::kernel_of;
    use crate::language::testbench::{check, Reference};
    use crate::wire::Word;

    const BLOCK: LimbSum = LimbSum { lane: 33, acc: 40, align: 5 };

    /// Whether the row of the low limbs has been the last; undefined before the first `clear`.
    struct Rows {
        shape: LimbSum,
        complete: Option<bool>,
        sum: Option<Word>,
    }

    impl Reference for Rows {
        fn outputs(&mut self, _: &[Word]) -> Vec<Option<Word>> {
            vec![self.complete.map(Word::from), self.sum]
        }

        fn clock(&mut self, inputs: &[Word]) {
            let LimbSum { lane, acc, align } = self.shape;
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
        for align in [BLOCK.align, 0] {
            let mut random = fastrand::Rng::with_seed(3);
            let mut inputs = |cycle: usize| {
                let words = |random: &mut fastrand::Rng, bits: usize| {
                    Word::of_fields(&[(); 4].map(|()| random.i64(-(1 << (bits - 1))..1 << (bits - 1))), bits)
                };
                let (quad, low) = (words(&mut random, BLOCK.lane), words(&mut random, BLOCK.acc));
                vec![(cycle == 0 || random.u8(..9) == 0).into(), (random.u8(..4) == 0).into(), quad, low]
            };
            let stimulus: Vec<Vec<Word>> = (0..3000).map(&mut inputs).collect();
            let shape = LimbSum { align, ..BLOCK };
            let complete = (align == 0).then_some(true);
            check(&kernel_of(&shape), &stimulus, &mut Rows { shape, complete, sum: None });
        }
    }
}
