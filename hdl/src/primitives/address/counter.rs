//! A counter from 0 to `limit − 1` that wraps.

pub use dermis_golden::fixed::plan::resources::count_bits;

use crate::block;
use crate::language::{Block, Builder, Expr, Inside, Output};

block! {
    /// ```text
    /// clear, enable --> value, last
    /// ```
    /// `enable` steps at the clock edge, from `limit − 1` back to 0; `clear` has priority. `last` is high while the value
    /// is `limit − 1`.
    pub struct Counter {
        limit: usize,
    }
    ports CounterPorts {
        clock;
        /// Sets the count to 0 at the clock edge, with priority over `enable`.
        in clear;
        /// Advances the count at the clock edge.
        in enable;
        /// The count, 0..`limit`, unsigned; valid from the first `clear` on.
        out value: count_bits(*limit);
        /// The count is `limit − 1`; combinational.
        out last;
    }
}

impl Counter {
    /// Counts 0..`limit`; a `limit` of 0 is taken as 1.
    pub fn new(limit: usize) -> Self {
        Counter { limit }
    }
}

impl Block for Counter {
    fn build<'k>(&self, k: &'k Builder, io: CounterPorts<Inside<'k>>) {
        let end = k.constant(io.value.bits(), self.limit.max(1) as u64 - 1);
        count(k, [io.clear, io.enable], end, [io.value, io.last]);
    }
}

/// A count from 0 to `end` and back, from the inputs clear and enable; the outputs value and last.
pub(super) fn count<'k>(k: &'k Builder, [clear, enable]: [Expr<'k>; 2], end: Expr<'k>, [value, last]: [Output<'k>; 2]) {
    let value = value.state(clear, 0);
    let last = last.set(value.equals(end));
    k.when(enable, || value.set(last.mux(k.constant(value.bits(), 0), value.plus(1))));
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::language::testbench::{check, random_words, Reference};
    use crate::language::{kernel_of, Kernel};
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
            counts(&kernel_of(&Counter::new(limit)), &[limit as u64]);
        }
    }
}
