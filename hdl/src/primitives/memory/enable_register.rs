//! A register with enable.

use crate::block;
use crate::language::{Block, Builder, Inside};

block! {
    /// `held` is the value of `word` at the last clock edge at which `enable` was high.
    pub struct EnableRegister {
        bits: usize,
    }
    ports EnableRegisterPorts {
        clock;
        /// Store `word` at the clock edge.
        in enable;
        /// The word to store; valid with `enable`.
        in word: bits;
        /// Stored word, from the cycle after `enable`; undefined before the first.
        out held: bits;
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
        let held = io.held.register();
        k.when(io.enable, || held.set(io.word));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::kernel_of;
    use crate::language::testbench::{check, random_words, Reference};
    use crate::wire::Word;

    struct Held(Option<Word>);

    impl Reference for Held {
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
        check(&kernel_of(&block), &random_words(1000, &[1, 70]), &mut Held(None));
    }
}
