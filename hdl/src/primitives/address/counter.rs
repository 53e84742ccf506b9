//! A counter from 0 to `limit − 1` that wraps.

pub use dermis_golden::fixed::plan::resources::count_bits;
use rust_hdl::prelude::*;

use crate::kernel_block;
use crate::language::{Body, Builder, Expr, Kernel, Type};
use crate::wire::Wire;

/// ```text
/// clear, enable --> value, last
/// ```
/// `enable` steps at the clock edge, from `limit − 1` back to 0; `clear` has priority. `last` is high while the value
/// is `limit − 1`.
#[derive(dermis_hdl_derive::Block)]
pub struct Counter {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Sets the count to 0 at the clock edge, with priority over `enable`.
    pub clear: Signal<In, Bit>,
    /// Advances the count at the clock edge.
    pub enable: Signal<In, Bit>,
    /// The count, 0..`limit`, unsigned; valid from the first `clear` on.
    pub value: Wire<Out>,
    /// The count is `limit − 1`; combinational.
    pub last: Signal<Out, Bit>,
    kernel: Body,
}

kernel_block!(Counter, clock clk, inputs [clear, enable], outputs [value, last]);

impl Counter {
    /// Counts 0..`limit`; a `limit` of 0 is taken as 1.
    pub fn new(limit: usize) -> Self {
        let block = Counter {
            clk: Default::default(),
            clear: Default::default(),
            enable: Default::default(),
            value: Wire::new(count_bits(limit)),
            last: Default::default(),
            kernel: Body::default(),
        };
        block.bind(kernel(count_bits(limit), |k, bits| k.constant(bits, limit.max(1) as u64 - 1)))
    }
}

/// A counter of `bits` bits that wraps after the value `end`.
pub(super) fn kernel(bits: usize, end: impl for<'k> Fn(&'k Builder, usize) -> Expr<'k>) -> Kernel {
    let k = Builder::new("counter");
    let end = end(&k, bits);
    let (clear, enable) = (k.input("clear", 1), k.input("enable", 1));
    let value = k.state("value", Type::unsigned(bits), clear, 0);
    let last = k.wire("last", value.equals(end));
    k.when(enable, || value.set(last.mux(k.constant(bits, 0), value.plus(1))));
    k.finish()
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::language::testbench::{check, random_words, Reference};
    use crate::wire::Word;

    /// The count; undefined before the first `clear`. Inputs: the case where there are several limits, clear, enable.
    struct Count<'a> {
        value: Option<u64>,
        limits: &'a [u64],
    }

    impl Count<'_> {
        fn limit(&self, inputs: &[Word]) -> u64 {
            self.limits[if inputs.len() == 3 { inputs[0].number() as usize } else { 0 }]
        }
    }

    impl Reference for Count<'_> {
        fn outputs(&mut self, inputs: &[Word]) -> Vec<Option<Word>> {
            let last = self.value.map(|value| Word::from(value + 1 == self.limit(inputs)));
            vec![self.value.map(Word::from), last]
        }

        fn clock(&mut self, inputs: &[Word]) {
            let [clear, enable] = [2, 1].map(|from_end| inputs[inputs.len() - from_end].number());
            self.value = match clear {
                0 => self.value.map(|value| if value + enable == self.limit(inputs) { 0 } else { value + enable }),
                _ => Some(0),
            };
        }
    }

    /// Checks the counter `kernel` with these limits.
    pub fn counts(kernel: &Kernel, limits: &[u64]) {
        let widths: &[usize] = if limits.len() == 1 { &[1, 1] } else { &[1, 1, 1] };
        let mut stimulus = random_words(3000, widths);
        // A change of the case needs a `clear`.
        let mut random = fastrand::Rng::with_seed(3);
        let mut case = Word::default();
        for inputs in &mut stimulus {
            let clear = random.u8(..20) == 0;
            let at = inputs.len() - 2;
            inputs[at] = clear.into();
            if limits.len() > 1 {
                inputs[0] = case;
                case = if clear { random.bool().into() } else { case };
            }
        }
        check(kernel, &stimulus, &mut Count { value: None, limits });
    }

    #[test]
    fn values_wrap_at_the_limit() {
        for limit in [1, 8, 13] {
            counts(Counter::new(limit).kernel.kernel(), &[limit as u64]);
        }
    }
}
