//! Divides a coefficient by a power of two when the grid step is halved.

use rust_hdl::prelude::*;

use crate::kernel_block;
use crate::language::{Body, Builder, Kernel, Type};
use crate::wire::Wire;

/// `halved` is ⌊word / 2^halvings⌋, one cycle later.
#[derive(dermis_hdl_derive::Block)]
pub struct CoefficientShift {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// A coefficient, signed; taken in every cycle.
    pub word: Wire<In>,
    /// Right shift, 2 bits; valid with `word`.
    pub halvings: Wire<In>,
    /// The shifted coefficient, signed; one cycle later.
    pub halved: Wire<Out>,
    /// Low bits of `halved`, a taxel's value p(μ*), signed; one cycle after `word`.
    pub value: Wire<Out>,
    kernel: Body,
}

kernel_block!(CoefficientShift, clock clk, inputs [word, halvings], outputs [halved, value]);

impl CoefficientShift {
    /// For coefficients of `bits` bits and values of `value` bits.
    pub fn new(bits: usize, value: usize) -> Self {
        let block = CoefficientShift {
            clk: Default::default(),
            word: Wire::new(bits),
            halvings: Wire::new(2),
            halved: Wire::new(bits),
            value: Wire::new(value),
            kernel: Body::default(),
        };
        block.bind(kernel(bits, value))
    }
}

fn kernel(bits: usize, value: usize) -> Kernel {
    let k = Builder::new("coefficient_shift");
    let (word, halvings) = (k.input("word", bits).signed(), k.input("halvings", 2));
    let halved = k.register("halved", Type::signed(bits));
    halved.set(word.shift_right_by(halvings));
    k.wire("value", halved.low(value));
    k.finish()
}

#[cfg(test)]
mod tests {
    use super::*;
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
        check(CoefficientShift::new(BITS, VALUE).kernel.kernel(), &all, &mut Shifted(None));
    }
}
