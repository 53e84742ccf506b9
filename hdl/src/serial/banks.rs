//! Memories of the polynomials: two single-port banks, one read while the other is written.

use dermis_golden::fixed::plan::resources::Holds;
use dermis_golden::fixed::plan::serial::{polynomials, word_bits};
use dermis_golden::fixed::words::formats::Formats;
use rust_hdl::prelude::*;

use crate::kernel_block;
use crate::language::{Body, Builder, Contents, Kernel, Type};
use crate::primitives::count_bits;
use crate::wire::Wire;

/// `odd` selects the bank that is read; writes go to the other one. An address is `{region, polynomial, coefficient}`,
/// of 1, n and 4 bits.
#[derive(dermis_hdl_derive::Block)]
pub struct Banks {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Read the odd bank and write the even one; if low, the other way round.
    pub odd: Signal<In, Bit>,
    /// Address to read; taken in every cycle.
    pub read_address: Wire<In>,
    /// The word read; one cycle after `read_address` and `odd`.
    pub word: Wire<Out>,
    /// Write `data` in this cycle.
    pub write: Signal<In, Bit>,
    /// Address to write; valid with `write`.
    pub write_address: Wire<In>,
    /// Word to write; valid with `write`.
    pub data: Wire<In>,
    kernel: Body,
}

kernel_block!(Banks, clock clk, inputs [odd, read_address, write, write_address, data], outputs [word]);

impl Banks {
    /// With the word width and the number of polynomials of `formats`.
    pub fn new(formats: &Formats) -> Self {
        let address = 1 + count_bits(polynomials(formats)) + 4;
        let bits = word_bits(formats);
        let block = Banks {
            clk: Default::default(),
            odd: Default::default(),
            read_address: Wire::new(address),
            word: Wire::new(bits),
            write: Default::default(),
            write_address: Wire::new(address),
            data: Wire::new(bits),
            kernel: Body::default(),
        };
        block.bind(kernel(address, bits))
    }
}

fn kernel(address: usize, bits: usize) -> Kernel {
    let k = Builder::new("banks");
    let (odd, read_address) = (k.input("odd", 1), k.input("read_address", address));
    let (write, write_address, data) = (k.input("write", 1), k.input("write_address", address), k.input("data", bits));
    let [even_word, odd_word] = [(0, "even", !odd), (1, "odd_bank", odd)].map(|(number, name, reads)| {
        let memory = k.memory(name, 1 << address, bits, Contents::Undefined).holds(Holds::Bank(number));
        let word = k.register(&format!("{name}_word"), Type::unsigned(bits));
        let reads = k.wire(&format!("{name}_reads"), reads);
        // One port: a bank is read or written.
        let own = k.wire(&format!("{name}_address"), reads.mux(read_address, write_address));
        k.when(reads, || word.set(memory.read(own)));
        memory.write(!reads & write, own, data);
        *word
    });
    let odd_then = k.register("odd_then", Type::unsigned(1));
    odd_then.set(odd);
    k.wire("word", odd_then.mux(odd_word, even_word));
    k.finish()
}

#[cfg(test)]
mod tests {
    use super::*;
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
        let block = Body::new(kernel(ADDRESS, BITS), &[], &[("word", BITS)]);
        check(block.kernel(), &all, &mut Both::default());
    }
}
