//! Replaces the words of dead taxels by zero, and those of a unipolar array that are negative: it reads no tension.

use crate::block;
use crate::language::{Block, Builder, Inside, Type};
use crate::primitives::address::counter::count_bits;

block! {
    /// Counts the taxels of a frame; `kept` is `word`, or 0 if the current taxel is dead or, in a unipolar array, the word
    /// negative. Combinational from `word` to `kept`: the comparison with the list of dead taxels is registered a cycle ahead.
    pub struct InputMask {
        /// Width of a word in bits.
        bits: usize,
        /// Taxels of a frame.
        taxels: usize,
        /// Row-major indices of the dead taxels.
        dead: Vec<usize>,
        unipolar: bool,
    }
    ports InputMaskPorts {
        clock;
        /// Restarts the count at the first taxel, with priority over `enable`.
        in clear;
        /// `word` is accepted; the next taxel follows.
        in enable;
        /// The current taxel's word, `bits` wide; valid with `enable`.
        in word: bits;
        /// `word`, or 0 for a dead taxel or tension; same cycle.
        out kept: bits;
    }
}

impl InputMask {
    /// Words of `bits` bits of a frame of `taxels` taxels; `dead` lists the row-major indices of the dead ones, `unipolar`
    /// says that negative words are none. `None` where every word is kept.
    pub fn new(bits: usize, taxels: usize, dead: &[usize], unipolar: bool) -> Option<Self> {
        let masks = unipolar || !dead.is_empty();
        masks.then(|| InputMask { bits, taxels, dead: dead.to_vec(), unipolar })
    }
}

impl Block for InputMask {
    fn build<'k>(&self, k: &'k Builder, io: InputMaskPorts<Inside<'k>>) {
        let is_dead = (!self.dead.is_empty()).then(|| {
            let count = Type::unsigned(count_bits(self.taxels));
            let taxel = k.register("taxel", count);
            let zero = k.constant(count.bits, 0);
            let after = k.wire("after", taxel.is(self.taxels as u64 - 1).mux(zero, taxel.plus(1)));
            let following = k.wire("following", io.clear.mux(zero, io.enable.mux(after, *taxel)));
            let table: Vec<u64> = (0..1 << count.bits).map(|taxel| u64::from(self.dead.contains(&taxel))).collect();
            taxel.set(following);
            k.delay("dead", following.table(1, &table))
        });
        let is_tension = self.unipolar.then(|| io.word.top());
        let masked = is_dead.into_iter().chain(is_tension).reduce(|dead, tension| dead | tension);
        io.kept.set(masked.map_or(io.word, |masked| masked.mux(k.constant(self.bits, 0), io.word)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::kernel_of;
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
        for (taxels, dead, unipolar) in [(35, vec![0, 7, 8, 34], false), (64, vec![63], true), (9, vec![], true)] {
            let mut stimulus = random_words(3000, &[1, 1, BITS]);
            stimulus.iter_mut().enumerate().for_each(|(cycle, inputs)| inputs[0] = (cycle % 500 == 0).into());
            let block = InputMask::new(BITS, taxels, &dead, unipolar).unwrap();
            check(&kernel_of(&block), &stimulus, &mut Frame { taxel: None, taxels, dead, unipolar });
        }
    }
}
