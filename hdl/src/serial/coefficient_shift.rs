//! Divides a coefficient by a power of two when the grid step is halved.

use crate::block;
use crate::language::{Block, Builder, Inside, Type};

block! {
    /// `halved` is ⌊word / 2^halvings⌋, one cycle later.
    pub struct CoefficientShift {
        bits: usize,
        value: usize,
    }
    ports CoefficientShiftPorts {
        clock;
        /// A coefficient, signed; taken in every cycle.
        in word: bits;
        /// Right shift, 2 bits; valid with `word`.
        in halvings: 2;
        /// The shifted coefficient, signed; one cycle later.
        out halved: bits;
        /// Low bits of `halved`, a taxel's value p(μ*), signed; one cycle after `word`.
        out value: value;
    }
}

impl CoefficientShift {
    /// For coefficients of `bits` bits and values of `value` bits.
    pub fn new(bits: usize, value: usize) -> Self {
        CoefficientShift { bits, value }
    }
}

impl Block for CoefficientShift {
    fn build<'k>(&self, k: &'k Builder, io: CoefficientShiftPorts<Inside<'k>>) {
        let halved = k.register("halved", Type::signed(self.bits));
        halved.set(io.word.signed().shift_right_by(io.halvings));
        io.value.set(halved.low(self.value));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::kernel_of;
    use crate::language::testbench::{check, Reference};
    use crate::wire::Word;

    const BITS: usize = 30;
    const VALUE: usize = 24;

    struct Shifted(Option<i64>);

    impl Reference for Shifted {
        fn outputs(&mut self, _: &[Word]) -> Vec<Option<Word>> {
            [BITS, VALUE].map(|bits| self.0.map(|word| Word::of_fields(&[word], bits))).to_vec()
        }

        fn clock(&mut self, inputs: &[Word]) {
            self.0 = Some(inputs[0].signed(0, BITS) >> inputs[1].number());
        }
    }

    #[test]
    fn coefficients_are_rounded_down() {
        let mut random = fastrand::Rng::with_seed(22);
        let cycle = |_| vec![Word::from(random.u64(..1 << BITS)), Word::from(random.u64(..4))];
        let all: Vec<Vec<Word>> = (0..2000).map(cycle).collect();
        check(&kernel_of(&CoefficientShift::new(BITS, VALUE)), &all, &mut Shifted(None));
    }
}
