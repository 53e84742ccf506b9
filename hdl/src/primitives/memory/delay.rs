//! Shift registers: a word or a control bit, delayed by a fixed number of cycles.

use rust_hdl::prelude::*;

use crate::kernel_block;
use crate::language::{Body, Builder, Kernel, Type};
use crate::primitives::address::counter::count_bits;
use crate::wire::Wire;

/// A word delayed by `depth` cycles, with 0 on wires. Data, therefore without reset.
#[derive(dermis_hdl_derive::Block)]
pub struct Delay {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// The word that `q` shows `depth` cycles later; taken in every cycle.
    pub d: Wire<In>,
    /// The word that was on `d`; `depth` cycles later.
    pub q: Wire<Out>,
    kernel: Body,
}

kernel_block!(Delay, clock clk, inputs [d], outputs [q]);

impl Delay {
    /// Delays words of `bits` bits by `depth` cycles.
    pub fn new(bits: usize, depth: usize) -> Self {
        let (d, q) = (Wire::new(bits), Wire::new(bits));
        let block = Delay { clk: Default::default(), d, q, kernel: Body::default() };
        block.bind(kernel(bits, depth))
    }
}

fn kernel(bits: usize, depth: usize) -> Kernel {
    let k = Builder::new("delay");
    let first = k.input("d", bits);
    if depth == 0 {
        k.wire("q", first);
        return k.finish();
    }
    let last = (1..depth).fold(first, |value, number| k.delay(&format!("pipe{number}"), value));
    k.delay("q", last);
    k.finish()
}

/// A control bit delayed by `depth` cycles; reset clears the whole shift register.
#[derive(dermis_hdl_derive::Block)]
pub struct BitDelay {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Synchronous reset, active high.
    pub rst: Signal<In, Bit>,
    /// The bit that `q` shows `depth` cycles later.
    pub d: Signal<In, Bit>,
    /// The bit that was on `d` `depth` cycles earlier.
    pub q: Signal<Out, Bit>,
    kernel: Body,
}

kernel_block!(BitDelay, clock clk, inputs [rst, d], outputs [q]);

impl BitDelay {
    /// Delays by `depth` ≥ 1 cycles.
    pub fn new(depth: usize) -> Self {
        BitDelay::of(bit_kernel(depth))
    }

    /// Delays pulses of one cycle, more than `depth` ≥ 1 cycles apart, by `depth` cycles: a counter where a shift register
    /// would be longer.
    pub fn of_pulse(depth: usize) -> Self {
        match depth <= LONGEST_SHIFT {
            true => BitDelay::new(depth),
            false => BitDelay::of(pulse_kernel(depth)),
        }
    }

    fn of(kernel: Kernel) -> Self {
        let block = BitDelay {
            clk: Default::default(),
            rst: Default::default(),
            d: Default::default(),
            q: Default::default(),
            kernel: Body::default(),
        };
        block.bind(kernel)
    }
}

/// Longest delay of a pulse for which a shift register is used.
const LONGEST_SHIFT: usize = 8;

fn bit_kernel(depth: usize) -> Kernel {
    let k = Builder::new("bit_delay");
    let (rst, mut value) = (k.input("rst", 1), k.input("d", 1));
    let inner = (1..depth).map(|number| format!("pipe{number}"));
    for name in inner.chain(["q".to_owned()]) {
        let register = k.state(&name, Type::unsigned(1), rst, 0);
        register.set(value);
        value = *register;
    }
    k.finish()
}

/// A pulse starts a counter, whose end is the delayed pulse.
fn pulse_kernel(depth: usize) -> Kernel {
    let k = Builder::new("pulse_delay");
    let (rst, d) = (k.input("rst", 1), k.input("d", 1));
    let count = Type::unsigned(count_bits(depth));
    let (left, runs, q) = (
        k.register("left", count),
        k.state("runs", Type::unsigned(1), rst, 0),
        k.state("q", Type::unsigned(1), rst, 0),
    );
    let ends = k.wire("ends", *runs & left.is(1));
    left.set(d.mux(k.constant(count.bits, depth as u64 - 1), (*left - k.constant(count.bits, 1)).low(count.bits)));
    runs.set(d | (*runs & !ends));
    q.set(ends);
    k.finish()
}

#[cfg(test)]
mod tests {
    use std::collections::VecDeque;

    use super::*;
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
                delay.kernel.kernel(),
                &random_words(1000, &[70]),
                &mut Pipeline::new(depth, 1, |inputs: &[Word]| vec![Some(inputs[0])]),
            );
            let mut stimulus = random_words(1000, &[1, 1]);
            stimulus.iter_mut().enumerate().for_each(|(cycle, inputs)| inputs[0] = (cycle % 17 == 0).into());
            let block = BitDelay::new(depth);
            check(block.kernel.kernel(), &stimulus, &mut Bits(vec![None; depth].into()));
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
            check(block.kernel.kernel(), &stimulus, &mut Bits(vec![None; depth].into()));
        }
    }
}
