//! A register with enable.

use rust_hdl::prelude::*;

use crate::kernel_block;
use crate::language::{Body, Builder, Kernel, Type};
use crate::wire::Wire;

/// `kept` is the value of `word` at the last clock edge at which `keep` was high.
#[derive(dermis_hdl_derive::Block)]
pub struct EnableRegister {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Enable: store `word` at the clock edge.
    pub keep: Signal<In, Bit>,
    /// The word to store; valid with `keep`.
    pub word: Wire<In>,
    /// Stored word, from the cycle after `keep`; undefined before the first.
    pub kept: Wire<Out>,
    kernel: Body,
}

kernel_block!(EnableRegister, clock clk, inputs [keep, word], outputs [kept]);

impl EnableRegister {
    /// A register of `bits` bits.
    pub fn new(bits: usize) -> Self {
        EnableRegister::with(bits, false)
    }

    /// With `constant`, wires in place of the register, for a word that never changes.
    pub fn constant(self, constant: bool) -> Self {
        EnableRegister::with(self.word.width(), constant)
    }

    fn with(bits: usize, constant: bool) -> Self {
        let block = EnableRegister {
            clk: Default::default(),
            keep: Default::default(),
            word: Wire::new(bits),
            kept: Wire::new(bits),
            kernel: Body::default(),
        };
        block.bind(kernel(bits, constant))
    }
}

fn kernel(bits: usize, constant: bool) -> Kernel {
    let k = Builder::new("enable_register");
    let (keep, word) = (k.input("keep", 1), k.input("word", bits));
    if constant {
        k.wire("kept", word);
    } else {
        let kept = k.register("kept", Type::unsigned(bits));
        k.when(keep, || kept.set(word));
    }
    k.finish()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::testbench::{check, random_words, Reference};
    use crate::wire::Word;

    struct Kept(Option<Word>);

    impl Reference for Kept {
        fn outputs(&mut self, _: &[Word]) -> Vec<Option<Word>> {
            vec![self.0]
        }

        fn clock(&mut self, inputs: &[Word]) {
            self.0 = if inputs[0].number() == 1 { Some(inputs[1]) } else { self.0 };
        }
    }

    #[test]
    fn a_word_stays_until_the_next() {
        let block = EnableRegister::new(70);
        check(block.kernel.kernel(), &random_words(1000, &[1, 70]), &mut Kept(None));
    }
}
