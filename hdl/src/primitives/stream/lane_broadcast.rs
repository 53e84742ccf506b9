//! Copies a sample to all lanes of a quad, with the write enables of the lanes.

use crate::block;
use crate::language::{Block, Builder, Inside};

block! {
    /// The sample on all four lanes, and the mask gated by `enable`; combinational.
    pub struct LaneBroadcast {
        /// Width of a sample in bits.
        bits: usize,
    }
    ports LaneBroadcastPorts {
        /// A sample of `bits` bits; valid with `enable`.
        in word: bits;
        /// Lanes the sample is written to, one bit each; valid with `enable`.
        in mask: 4;
        /// Write in this cycle.
        in enable;
        /// The sample on each of the four lanes; combinational from `word`.
        out quad: 4 * bits;
        /// Write enable of each lane; combinational from `enable`.
        out write: 4;
    }
}

impl LaneBroadcast {
    /// For samples of `bits` bits.
    pub fn new(bits: usize) -> Self {
        LaneBroadcast { bits }
    }
}

impl Block for LaneBroadcast {
    fn build<'k>(&self, k: &'k Builder, io: LaneBroadcastPorts<Inside<'k>>) {
        io.quad.set(io.word.repeat(4));
        io.write.set(io.enable.mux(io.mask, k.constant(4, 0)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::kernel_of;
    use crate::language::testbench::{check, random_words, Pipeline};
    use crate::wire::Word;

    #[test]
    fn the_sample_is_on_every_lane() {
        for bits in [9, 24] {
            let of = |inputs: &[Word]| {
                let quad = Word::of_fields(&[inputs[0].signed(0, bits); 4], bits);
                vec![Some(quad), Some(if inputs[2].number() == 1 { inputs[1] } else { Word::default() })]
            };
            check(
                &kernel_of(&LaneBroadcast::new(bits)),
                &random_words(500, &[bits, 4, 1]),
                &mut Pipeline::new(0, 2, of),
            );
        }
    }
}
