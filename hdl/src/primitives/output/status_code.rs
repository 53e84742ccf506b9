//! Beat code and subarray of the requested beat.

use rust_hdl::prelude::*;

use crate::kernel_block;
use crate::language::{Body, Builder, Kernel};
use crate::wire::Wire;

/// During the status, beat codes 1 to 3 and the status counter's subarray; otherwise code 0 and the scanned subarray;
/// combinational.
#[derive(LogicBlock)]
pub struct StatusCode {
    /// The status is being requested.
    pub status: Signal<In, Bit>,
    /// Index of the status beat within its subarray, 0 to 2, 2 bits; valid with `status`.
    pub word: Wire<In>,
    /// Subarray whose status is requested; valid with `status`.
    pub status_part: Wire<In>,
    /// Subarray of the scanned taxel; valid while `status` is low.
    pub scan_part: Wire<In>,
    /// 0: a force, 1 … 3: a status beat; combinational.
    pub beat: Wire<Out>,
    /// Index of the beat's subarray; combinational.
    pub part: Wire<Out>,
    kernel: Body,
}

kernel_block!(StatusCode, inputs [status, word, status_part, scan_part], outputs [beat, part]);

/// Width of a beat code in bits.
const BEAT_BITS: usize = 2;

impl StatusCode {
    /// For subarray indices of `part_bits` bits.
    pub fn new(part_bits: usize) -> Self {
        let block = StatusCode {
            status: Default::default(),
            word: Wire::new(BEAT_BITS),
            status_part: Wire::new(part_bits),
            scan_part: Wire::new(part_bits),
            beat: Wire::new(BEAT_BITS),
            part: Wire::new(part_bits),
            kernel: Body::default(),
        };
        block.bind(kernel(part_bits))
    }
}

fn kernel(part_bits: usize) -> Kernel {
    let k = Builder::combinational("status_code");
    let (status, word) = (k.input("status", 1), k.input("word", BEAT_BITS));
    let (status_part, scan_part) = (k.input("status_part", part_bits), k.input("scan_part", part_bits));
    k.wire("beat", status.mux(word.plus(1), k.constant(BEAT_BITS, 0)));
    k.wire("part", status.mux(status_part, scan_part));
    k.finish()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::testbench::{check, random_words, Pipeline};
    use crate::wire::Word;

    #[test]
    fn a_status_beat_has_a_code_and_its_own_subarray() {
        let block = StatusCode::new(3);
        let of = |inputs: &[Word]| match inputs[0].number() {
            0 => vec![Some(Word::from(0)), Some(inputs[3])],
            _ => vec![Some(Word::from((inputs[1].number() + 1) % 4)), Some(inputs[2])],
        };
        check(block.kernel.kernel(), &random_words(500, &[1, BEAT_BITS, 3, 3]), &mut Pipeline::new(0, 2, of));
    }
}
