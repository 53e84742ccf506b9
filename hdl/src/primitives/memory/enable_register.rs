//! A register with enable.

use crate::block;
use crate::language::{Block, Builder, Inside};

block! {
    /// `kept` is the value of `word` at the last clock edge at which `keep` was high.
    pub struct EnableRegister {
        bits: usize,
    }
    ports EnableRegisterPorts {
        clock;
        /// Enable: store `word` at the clock edge.
        in keep;
        /// The word to store; valid with `keep`.
        in word: bits;
        /// Stored word, from the cycle after `keep`; undefined before the first.
        out kept: bits;
    }
}

impl EnableRegister {
    /// A register of `bits` bits.
    pub fn new(bits: usize) -> Self {
        EnableRegister { bits }
    }
}

impl Block for EnableRegister {
    fn build<'k>(&self, k: &'k Builder, io: EnableRegisterPorts<Inside<'k>>) {
        let kept = io.kept.register();
        k.when(io.keep, || kept.set(io.word));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::kernel_of;
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
        check(&kernel_of(&block), &random_words(1000, &[1, 70]), &mut Kept(None));
    }
}
