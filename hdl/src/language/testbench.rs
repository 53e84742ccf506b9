//! Runs a kernel, or a block with the blocks inside it, in its simulation and under Verilator against a reference in plain
//! integers: every output, every cycle.

mod memory;
mod program;
mod subject;
#[path = "../../../tests/src/variants.rs"]
mod variants;

use std::collections::VecDeque;

use super::change::Change;
use crate::wire::Word;
pub(crate) use memory::MemoryReference;
pub(crate) use program::verilated;
pub(crate) use subject::Subject;
pub(crate) use variants::variants;

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

/// The first difference between `reference` and one of the simulations of `subject`; inputs and outputs in the order of
/// its ports.
pub(crate) fn difference<'a>(
    subject: impl Into<Subject<'a>>,
    stimulus: &[Vec<Word>],
    reference: &mut dyn Reference,
) -> Option<String> {
    let mut subject = subject.into();
    let runs = [("simulation", subject.simulated(stimulus)), ("verilator", verilated(&subject, stimulus))];
    first_difference(&subject, &runs, stimulus, reference)
}

/// The first difference between `reference` and the outputs of one of `runs`, each with its name.
fn first_difference(
    subject: &Subject,
    runs: &[(&str, Vec<Vec<Word>>)],
    stimulus: &[Vec<Word>],
    reference: &mut dyn Reference,
) -> Option<String> {
    let mut compared = 0;
    for (cycle, inputs) in stimulus.iter().enumerate() {
        let expected = reference.outputs(inputs);
        assert_eq!(expected.len(), subject.outputs.len(), "a value for every output");
        for (name, run) in runs {
            for ((output, _), (value, expected)) in subject.outputs.iter().zip(run[cycle].iter().zip(&expected)) {
                let Some(expected) = expected else { continue };
                compared += 1;
                if value != expected {
                    return Some(format!("{name}, cycle {cycle}, {output}: {value:?}, not {expected:?}"));
                }
            }
        }
        reference.clock(inputs);
    }
    assert!(2 * compared > runs.len() * stimulus.len(), "hardly anything is defined");
    None
}

/// Checks both simulations of `subject` against `reference`.
pub(crate) fn check<'a>(subject: impl Into<Subject<'a>>, stimulus: &[Vec<Word>], reference: &mut dyn Reference) {
    let difference = difference(subject, stimulus, reference);
    assert!(difference.is_none(), "{}", difference.unwrap_or_default());
}

/// Checks a subject without change, and that the check finds the first of `defects`, in `make nightly` each; they are in its
/// Verilog.
pub(crate) fn check_with_defects<'a, R: Reference>(
    subject: impl Fn(&[Change]) -> Subject<'a>,
    stimulus: &[Vec<Word>],
    reference: impl Fn() -> R,
    defects: &[Change],
) {
    check(subject(&[]), stimulus, &mut reference());
    for defect in variants(defects, 1) {
        let changed = subject(std::slice::from_ref(defect));
        let run = ("verilator", verilated(&changed, stimulus));
        let found = first_difference(&changed, &[run], stimulus, &mut reference());
        assert!(found.is_some(), "not found: {defect}");
    }
}

/// A block of the language with the blocks inside it as a [`Subject`], with seeded defects; its ports in this order.
///
/// ```text
/// subject_of!(Queue::new(8), &[], inputs [rst, write, word], outputs [room, m_axis_tvalid])
/// ```
macro_rules! subject_of {
    ($block:expr, $changes:expr, inputs [$($input:ident),* $(,)?], outputs [$($output:ident),* $(,)?] $(,)?) => {
        $crate::language::testbench::Subject::of(
            $crate::language::kernel_of(&$block),
            $changes,
            &[$(stringify!($input)),*],
            &[$(stringify!($output)),*],
        )
    };
}
pub(crate) use subject_of;
