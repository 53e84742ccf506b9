//! Replaces the words of dead taxels by zero, and those of a unipolar array that are negative: it reads no tension.

use rust_hdl::prelude::*;

use crate::kernel_block;
use crate::language::{Body, Builder, Kernel, Type};
use crate::primitives::address::counter::count_bits;
use crate::wire::Wire;

/// Counts the taxels of a frame; `kept` is `word`, or 0 if the current taxel is dead or, in a unipolar array, the word
/// negative. Combinational from `word` to `kept`: the comparison with the list of dead taxels is registered a cycle ahead.
#[derive(dermis_hdl_derive::Block)]
pub struct InputMask {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Restarts the count at the first taxel, with priority over `enable`.
    pub clear: Signal<In, Bit>,
    /// `word` is accepted; the next taxel follows.
    pub enable: Signal<In, Bit>,
    /// The current taxel's word, `bits` wide; valid with `enable`.
    pub word: Wire<In>,
    /// `word`, or 0 for a dead taxel or tension; same cycle.
    pub kept: Wire<Out>,
    kernel: Body,
}

kernel_block!(InputMask, clock clk, inputs [clear, enable, word], outputs [kept]);

impl InputMask {
    /// Words of `bits` bits of a frame of `taxels` taxels; `dead` lists the row-major indices of the dead ones, `unipolar`
    /// says that negative words are none.
    pub fn new(bits: usize, taxels: usize, dead: &[usize], unipolar: bool) -> Self {
        let block = InputMask {
            clk: Default::default(),
            clear: Default::default(),
            enable: Default::default(),
            word: Wire::new(bits),
            kept: Wire::new(bits),
            kernel: Body::default(),
        };
        block.bind(kernel(bits, taxels, dead, unipolar))
    }
}

fn kernel(bits: usize, taxels: usize, dead: &[usize], unipolar: bool) -> Kernel {
    let k = Builder::new("input_mask");
    let (clear, enable, word) = (k.input("clear", 1), k.input("enable", 1), k.input("word", bits));
    let count = Type::unsigned(count_bits(taxels));
    let is_dead = (!dead.is_empty()).then(|| {
        let taxel = k.register("taxel", count);
        let zero = k.constant(count.bits, 0);
        let after = k.wire("after", taxel.is(taxels as u64 - 1).mux(zero, taxel.plus(1)));
        let following = k.wire("following", clear.mux(zero, enable.mux(after, *taxel)));
        let table: Vec<u64> = (0..1 << count.bits).map(|taxel| u64::from(dead.contains(&taxel))).collect();
        taxel.set(following);
        k.delay("dead", following.table(1, &table))
    });
    let is_tension = unipolar.then(|| word.top());
    let masked = is_dead.into_iter().chain(is_tension).reduce(|dead, tension| dead | tension);
    match masked {
        Some(masked) => k.wire("kept", masked.mux(k.constant(bits, 0), word)),
        None => {
            k.comment("No taxel is dead, and tension is read.");
            k.wire("kept", word)
        }
    };
    k.finish()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::testbench::{check, random_words, Reference};
    use crate::wire::Word;

    const BITS: usize = 12;

    /// The current taxel; undefined before the first `clear`.
    struct Frame {
        taxel: Option<usize>,
        taxels: usize,
        dead: Vec<usize>,
        unipolar: bool,
    }

    impl Reference for Frame {
        fn outputs(&mut self, inputs: &[Word]) -> Vec<Option<Word>> {
            let tension = self.unipolar && inputs[2].signed(0, BITS) < 0;
            let kept = |taxel| if self.dead.contains(&taxel) || tension { Word::default() } else { inputs[2] };
            // Without a dead taxel none is counted.
            vec![self.taxel.or(self.dead.is_empty().then_some(0)).map(kept)]
        }

        fn clock(&mut self, inputs: &[Word]) {
            let step = usize::from(inputs[1].number() == 1);
            self.taxel = match inputs[0].number() {
                1 => Some(0),
                _ => self.taxel.map(|taxel| (taxel + step) % self.taxels),
            };
        }
    }

    #[test]
    fn dead_taxels_and_tension_are_zero() {
        for (taxels, dead, unipolar) in
            [(35, vec![0, 7, 8, 34], false), (64, vec![63], true), (9, vec![], false), (9, vec![], true)]
        {
            let mut stimulus = random_words(3000, &[1, 1, BITS]);
            stimulus.iter_mut().enumerate().for_each(|(cycle, inputs)| inputs[0] = (cycle % 500 == 0).into());
            let block = InputMask::new(BITS, taxels, &dead, unipolar);
            check(block.kernel.kernel(), &stimulus, &mut Frame { taxel: None, taxels, dead, unipolar });
        }
    }
}
