//! Copies a sample to all lanes of a quad, with the write enables of the lanes.

use rust_hdl::prelude::*;

use crate::kernel_block;
use crate::language::{Body, Builder, Kernel};
use crate::wire::Wire;

/// The sample on all four lanes, and the mask gated by `enable`; combinational.
#[derive(dermis_hdl_derive::Block)]
pub struct LaneBroadcast {
    /// A sample of `bits` bits; valid with `enable`.
    pub word: Wire<In>,
    /// Lanes the sample is written to, one bit each; valid with `enable`.
    pub mask: Wire<In>,
    /// Write in this cycle.
    pub enable: Signal<In, Bit>,
    /// The sample on each of the four lanes; combinational from `word`.
    pub quad: Wire<Out>,
    /// Write enable of each lane; combinational from `enable`.
    pub write: Wire<Out>,
    kernel: Body,
}

kernel_block!(LaneBroadcast, inputs [word, mask, enable], outputs [quad, write]);

impl LaneBroadcast {
    /// For samples of `bits` bits.
    pub fn new(bits: usize) -> Self {
        let block = LaneBroadcast {
            word: Wire::new(bits),
            mask: Wire::new(4),
            enable: Default::default(),
            quad: Wire::new(4 * bits),
            write: Wire::new(4),
            kernel: Body::default(),
        };
        block.bind(kernel(bits))
    }
}

fn kernel(bits: usize) -> Kernel {
    let k = Builder::combinational("lane_broadcast");
    let (word, mask, enable) = (k.input("word", bits), k.input("mask", 4), k.input("enable", 1));
    k.wire("quad", word.repeat(4));
    k.wire("write", enable.mux(mask, k.constant(4, 0)));
    k.finish()
}

#[cfg(test)]
mod tests {
    use super::*;
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
                LaneBroadcast::new(bits).kernel.kernel(),
                &random_words(500, &[bits, 4, 1]),
                &mut Pipeline::new(0, 2, of),
            );
        }
    }
}
