//! Runs a kernel in its own simulation and under Verilator against a reference in plain integers: every output, every
//! cycle.

mod program;

use std::collections::VecDeque;

use super::kernel::{Kernel, Role, Type};
use super::simulate::Simulation;
use crate::wire::Word;
pub(crate) use program::verilated;

/// A reference in plain integers.
pub(crate) trait Reference {
    /// The outputs before the clock edge of a cycle with these inputs, in the order of the names; `None` for what is
    /// undefined.
    fn outputs(&mut self, inputs: &[Word]) -> Vec<Option<Word>>;
    /// The clock edge.
    fn clock(&mut self, inputs: &[Word]);
}

/// A reference without state: the outputs are a function of the inputs of `latency` cycles earlier.
pub(crate) struct Pipeline<F> {
    of: F,
    outputs: VecDeque<Vec<Option<Word>>>,
}

impl<F: FnMut(&[Word]) -> Vec<Option<Word>>> Pipeline<F> {
    /// `of` gives the `count` outputs from the inputs; before, they are undefined.
    pub(crate) fn new(latency: usize, count: usize, of: F) -> Self {
        Pipeline { of, outputs: vec![vec![None; count]; latency].into() }
    }
}

impl<F: FnMut(&[Word]) -> Vec<Option<Word>>> Reference for Pipeline<F> {
    fn outputs(&mut self, inputs: &[Word]) -> Vec<Option<Word>> {
        self.outputs.push_back((self.of)(inputs));
        self.outputs.pop_front().unwrap()
    }

    fn clock(&mut self, _: &[Word]) {}
}

/// Random words of these widths, of which every fourth is all zeros or all ones.
pub(crate) fn random_words(cycles: usize, widths: &[usize]) -> Vec<Vec<Word>> {
    let mut random = fastrand::Rng::with_seed(20);
    (0..cycles).map(|_| widths.iter().map(|&bits| random_word(&mut random, bits)).collect()).collect()
}

/// A random word of `bits` bits, every fourth all zeros or all ones.
pub(crate) fn random_word(random: &mut fastrand::Rng, bits: usize) -> Word {
    let kind = random.u8(..8);
    let mut word = Word::default();
    for low in (0..bits).step_by(64) {
        let limb = match kind {
            0 => 0,
            1 => u64::MAX,
            _ => random.u64(..),
        };
        word.set(low, (bits - low).min(64), limb);
    }
    word
}

/// Name and width of the ports of a kernel: inputs, driven ports.
fn ports(kernel: &Kernel) -> [Vec<(&str, Type)>; 2] {
    let of = |is_output: bool| {
        let own = move |signal: &&super::kernel::Signal| {
            if is_output {
                signal.output
            } else {
                signal.role == Role::Input
            }
        };
        kernel.signals.iter().filter(own).map(|signal| (signal.name.as_str(), signal.ty)).collect()
    };
    [of(false), of(true)]
}

/// The outputs of every cycle in the kernel's simulation.
pub(crate) fn simulated(kernel: &Kernel, stimulus: &[Vec<Word>]) -> Vec<Vec<Word>> {
    let [inputs, outputs] = ports(kernel);
    let mut simulation = Simulation::new(kernel);
    let mut all = Vec::new();
    for fields in stimulus {
        for (field, (name, ty)) in fields.iter().zip(&inputs) {
            let slot = simulation.slot_of(kernel, name).unwrap();
            simulation.set(slot, &field.limbs()[..ty.bits.div_ceil(64)]);
        }
        simulation.show();
        let value = |(name, ty): &(&str, Type)| {
            let mut word = Word::default();
            let limbs = ty.bits.div_ceil(64);
            let slot = simulation.slot_of(kernel, name).unwrap();
            // A signed number has its sign above its width.
            for (limb, value) in simulation.get(slot, limbs).iter().enumerate() {
                word.set(64 * limb, (ty.bits - 64 * limb).min(64), *value);
            }
            word
        };
        all.push(outputs.iter().map(value).collect());
        simulation.clock();
    }
    all
}

/// Checks both simulations of a kernel against `reference`; inputs and outputs in the order of the kernel's signals.
pub(crate) fn check(kernel: &Kernel, stimulus: &[Vec<Word>], reference: &mut dyn Reference) {
    assert!(kernel.errors().is_empty(), "{:?}", kernel.errors());
    let [_, outputs] = ports(kernel);
    let runs = [("simulation", simulated(kernel, stimulus)), ("verilator", verilated(kernel, stimulus))];
    let mut compared = 0;
    for (cycle, inputs) in stimulus.iter().enumerate() {
        let expected = reference.outputs(inputs);
        for (name, run) in &runs {
            for (k, (output, _)) in outputs.iter().enumerate() {
                if let Some(expected) = expected[k] {
                    assert_eq!(run[cycle][k], expected, "{name}, cycle {cycle}, {output}");
                    compared += 1;
                }
            }
        }
        reference.clock(inputs);
    }
    assert!(compared > stimulus.len(), "hardly anything is defined");
}
