//! Memories of the polynomials: two single-port banks, one read while the other is written.

use dermis_golden::fixed::plan::resources::Holds;
use dermis_golden::fixed::plan::serial::{polynomials, word_bits};
use dermis_golden::fixed::words::formats::Formats;

use crate::block;
use crate::language::{Block, Builder, Contents, Inside, Type};
use crate::primitives::count_bits;

block! {
    /// `odd` selects the bank that is read; writes go to the other one. An address is `{region, polynomial,
    /// coefficient}`, of 1, n and 4 bits.
    pub struct Banks {
        /// Width of an address.
        address: usize,
        /// Width of a word.
        bits: usize,
    }
    ports BanksPorts {
        clock;
        /// Read the odd bank and write the even one; if low, the other way round.
        in odd;
        /// Address to read; taken in every cycle.
        in read_address: address;
        /// The word read; one cycle after `read_address` and `odd`.
        out word: bits;
        /// Write `data` in this cycle.
        in write;
        /// Address to write; valid with `write`.
        in write_address: address;
        /// Word to write; valid with `write`.
        in data: bits;
    }
}

impl Banks {
    /// With the word width and the number of polynomials of `formats`.
    pub fn new(formats: &Formats) -> Self {
        Banks { address: 1 + count_bits(polynomials(formats)) + 4, bits: word_bits(formats) }
    }
}

impl Block for Banks {
    fn build<'k>(&self, k: &'k Builder, io: BanksPorts<Inside<'k>>) {
        let [even_word, odd_word] = [(0, "even", !io.odd), (1, "odd_bank", io.odd)].map(|(number, name, reads)| {
            let memory = k.memory(name, 1 << self.address, self.bits, Contents::Undefined).holds(Holds::Bank(number));
            let word = k.register(&format!("{name}_word"), Type::unsigned(self.bits));
            let reads = k.wire(&format!("{name}_reads"), reads);
            // One port: a bank is read or written.
            let own = k.wire(&format!("{name}_address"), reads.mux(io.read_address, io.write_address));
            k.when(reads, || word.set(memory.read(own)));
            memory.write(!reads & io.write, own, io.data);
            *word
        });
        let odd_then = k.delay("odd_then", io.odd);
        io.word.set(odd_then.mux(odd_word, even_word));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::kernel_of;
    use crate::language::testbench::{check, Reference};
    use crate::wire::Word;

    const ADDRESS: usize = 5;
    const BITS: usize = 29;

    /// Both banks, and the word of the address of the last cycle.
    #[derive(Default)]
    struct Both {
        banks: [[Option<Word>; 1 << ADDRESS]; 2],
        word: Option<Word>,
    }

    impl Reference for Both {
        fn outputs(&mut self, _: &[Word]) -> Vec<Option<Word>> {
            vec![self.word]
        }

        fn clock(&mut self, inputs: &[Word]) {
            let [odd, from, write, to] = [0, 1, 2, 3].map(|k| inputs[k].number() as usize);
            self.word = self.banks[odd][from];
            if write == 1 {
                self.banks[1 - odd][to] = Some(inputs[4]);
            }
        }
    }

    #[test]
    fn one_bank_is_read_while_the_other_is_written() {
        let mut random = fastrand::Rng::with_seed(23);
        let mut odd = false;
        let cycle = |_| {
            odd ^= random.u8(..40) == 0;
            let mut address = || Word::from(random.u64(..1 << ADDRESS));
            let (from, to) = (address(), address());
            vec![Word::from(odd), from, Word::from(random.bool()), to, Word::from(random.u64(..1 << BITS))]
        };
        let all: Vec<Vec<Word>> = (0..6000).map(cycle).collect();
        let block = Banks { address: ADDRESS, bits: BITS };
        check(&kernel_of(&block), &all, &mut Both::default());
    }
}
