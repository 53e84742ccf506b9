//! The low bits of a word.

use rust_hdl::prelude::*;

use crate::kernel_block;
use crate::language::{Body, Builder};
use crate::wire::Wire;

/// The least significant bits of a wider word; combinational.
#[derive(dermis_hdl_derive::Block)]
pub struct Slice {
    /// The word of which the low bits are shown; taken in every cycle.
    pub word: Wire<In>,
    /// Its low bits; combinational.
    pub low: Wire<Out>,
    kernel: Body,
}

kernel_block!(Slice, inputs[word], outputs[low]);

impl Slice {
    /// The low `low` bits of words of `bits` bits.
    pub fn new(bits: usize, low: usize) -> Self {
        let block = Slice { word: Wire::new(bits), low: Wire::new(low), kernel: Body::default() };
        let k = Builder::combinational("slice");
        k.wire("low", k.input("word", bits).low(low));
        block.bind(k.finish())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
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
            check(block.kernel.kernel(), &random_words(200, &[130]), &mut Pipeline::new(0, 1, of));
        }
    }
}
