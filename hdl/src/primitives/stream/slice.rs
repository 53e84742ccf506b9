//! The low bits of a word.

use crate::block;
use crate::language::{Block, Builder, Inside};

block! {
    /// The least significant bits of a wider word; combinational.
    pub struct Slice {
        /// Width of the word in bits.
        bits: usize,
        /// Number of its bits that are shown.
        low: usize,
    }
    ports SlicePorts {
        /// The word of which the low bits are shown; taken in every cycle.
        in word: bits;
        /// Its low bits; combinational.
        out low: low;
    }
}

impl Slice {
    /// The low `low` bits of words of `bits` bits.
    pub fn new(bits: usize, low: usize) -> Self {
        Slice { bits, low }
    }
}

impl Block for Slice {
    fn build<'k>(&self, _: &'k Builder, io: SlicePorts<Inside<'k>>) {
        io.low.set(io.word.low(self.low));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::kernel_of;
    use crate::language::testbench::{check, random_words, Pipeline};
    use crate::wire::Word;

    #[test]
    fn the_low_bits_are_kept() {
        for low in [7, 70, 130] {
            let of = |inputs: &[Word]| {
                let mut kept = Word::default();
                (0..low).for_each(|bit| kept.set(bit, 1, inputs[0].field(bit, 1)));
                vec![Some(kept)]
            };
            let block = Slice::new(130, low);
            check(&kernel_of(&block), &random_words(200, &[130]), &mut Pipeline::new(0, 1, of));
        }
    }
}
