//! Shift registers: a word or a control bit, delayed by a fixed number of cycles.

use crate::block;
use crate::language::{Block, Builder, Inside, Type};
use crate::primitives::address::counter::count_bits;

block! {
    /// A word delayed by `depth` ≥ 1 cycles. Data, therefore without reset.
    pub struct Delay {
        bits: usize,
        depth: usize,
    }
    ports DelayPorts {
        clock;
        /// The word that `q` shows `depth` cycles later; taken in every cycle.
        in d: bits;
        /// The word that was on `d`; `depth` cycles later.
        out q: bits;
    }
}

impl Delay {
    /// Delays words of `bits` bits by `depth` cycles.
    pub fn new(bits: usize, depth: usize) -> Self {
        Delay { bits, depth }
    }
}

impl Block for Delay {
    fn build<'k>(&self, k: &'k Builder, io: DelayPorts<Inside<'k>>) {
        io.q.delay((1..self.depth).fold(io.d, |value, number| k.delay(&format!("pipe{number}"), value)));
    }
}

block! {
    /// A control bit delayed by `depth` cycles; reset clears the whole shift register.
    pub struct BitDelay {
        depth: usize,
        /// A counter stands in the place of the shift register.
        counts: bool,
    }
    ports BitDelayPorts {
        clock;
        reset;
        /// The bit that `q` shows `depth` cycles later.
        in d;
        /// The bit that was on `d` `depth` cycles earlier.
        out q;
    }
}

/// Longest delay of a pulse for which a shift register is used.
const LONGEST_SHIFT: usize = 8;

impl BitDelay {
    /// Delays by `depth` ≥ 1 cycles.
    pub fn new(depth: usize) -> Self {
        BitDelay { depth, counts: false }
    }

    /// Delays pulses of one cycle, more than `depth` ≥ 1 cycles apart, by `depth` cycles: a counter where a shift register
    /// would be longer.
    pub fn of_pulse(depth: usize) -> Self {
        BitDelay { depth, counts: depth > LONGEST_SHIFT }
    }

    /// A pulse starts a counter, whose end is the delayed pulse.
    fn count<'k>(&self, k: &'k Builder, io: BitDelayPorts<Inside<'k>>) {
        let count = Type::unsigned(count_bits(self.depth));
        let (left, runs, q) =
            (k.register("left", count), k.state("runs", Type::unsigned(1), io.rst, 0), io.q.state(io.rst, 0));
        let ends = k.wire("ends", *runs & left.is(1));
        let start = k.constant(count.bits, self.depth as u64 - 1);
        left.set(io.d.mux(start, (*left - k.constant(count.bits, 1)).low(count.bits)));
        runs.set(io.d | (*runs & !ends));
        q.set(ends);
    }
}

impl Block for BitDelay {
    fn build<'k>(&self, k: &'k Builder, io: BitDelayPorts<Inside<'k>>) {
        if self.counts {
            return self.count(k, io);
        }
        let later = |value, number| {
            let register = k.state(&format!("pipe{number}"), Type::unsigned(1), io.rst, 0);
            register.set(value);
            *register
        };
        io.q.state(io.rst, 0).set((1..self.depth).fold(io.d, later));
    }
}

#[cfg(test)]
mod tests {
    use std::collections::VecDeque;

    use super::*;
    use crate::language::kernel_of;
    use crate::language::testbench::{check, random_words, Pipeline, Reference};
    use crate::wire::Word;

    struct Bits(VecDeque<Option<bool>>);

    impl Reference for Bits {
        fn outputs(&mut self, _: &[Word]) -> Vec<Option<Word>> {
            vec![self.0[0].map(Word::from)]
        }

        fn clock(&mut self, inputs: &[Word]) {
            self.0.push_back(Some(inputs[1].number() == 1));
            self.0.pop_front();
            if inputs[0].number() == 1 {
                self.0.iter_mut().for_each(|bit| *bit = Some(false));
            }
        }
    }

    #[test]
    fn words_and_bits_come_later() {
        for depth in [1, 2, 5] {
            let delay = Delay::new(70, depth);
            check(
                &kernel_of(&delay),
                &random_words(1000, &[70]),
                &mut Pipeline::new(depth, 1, |inputs: &[Word]| vec![Some(inputs[0])]),
            );
            let mut stimulus = random_words(1000, &[1, 1]);
            stimulus.iter_mut().enumerate().for_each(|(cycle, inputs)| inputs[0] = (cycle % 17 == 0).into());
            let block = BitDelay::new(depth);
            check(&kernel_of(&block), &stimulus, &mut Bits(vec![None; depth].into()));
        }
    }

    #[test]
    fn pulses_come_later_and_a_reset_clears_them() {
        for depth in [3, 9, 16, 53] {
            let mut random = fastrand::Rng::with_seed(depth as u64);
            let mut idle = 0;
            let mut inputs = |cycle: usize| {
                let rst = cycle < 2 || random.usize(..5 * depth) == 0;
                let pulse = !rst && idle > depth && random.u8(..4) == 0;
                idle = if pulse { 0 } else { idle + 1 };
                vec![rst.into(), pulse.into()]
            };
            let stimulus: Vec<Vec<Word>> = (0..4000).map(&mut inputs).collect();
            let block = BitDelay::of_pulse(depth);
            check(&kernel_of(&block), &stimulus, &mut Bits(vec![None; depth].into()));
        }
    }
}
