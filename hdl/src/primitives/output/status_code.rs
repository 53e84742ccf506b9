//! Beat code and subarray of the requested beat.

use rust_hdl::prelude::*;

use crate::kernel_block;
use crate::language::{Body, Builder, Kernel};
use crate::primitives::address::counter::count_bits;
use crate::wire::Wire;

/// During the status, beat codes 1 to 3 and the status counter's subarray; otherwise code 0 and the scanned subarray;
/// combinational. Where each contact has a μ of its own, the subarray of a status is the label of a contact, from 1 on.
#[derive(dermis_hdl_derive::Block)]
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
    /// For so many statuses of a frame, and subarrays; `labels`: the first status is that of label 1.
    pub fn new(statuses: usize, subarrays: usize, labels: bool) -> Self {
        let shape = Shape { statuses, subarrays, labels };
        let block = StatusCode {
            status: Default::default(),
            word: Wire::new(BEAT_BITS),
            status_part: Wire::new(count_bits(statuses)),
            scan_part: Wire::new(count_bits(subarrays)),
            beat: Wire::new(BEAT_BITS),
            part: Wire::new(shape.part_bits()),
            kernel: Body::default(),
        };
        block.bind(shape.kernel())
    }
}

/// What decides the circuit.
#[derive(Clone, Copy)]
struct Shape {
    statuses: usize,
    subarrays: usize,
    labels: bool,
}

impl Shape {
    fn part_bits(self) -> usize {
        count_bits(self.statuses + usize::from(self.labels))
    }

    fn kernel(self) -> Kernel {
        let k = Builder::combinational("status_code");
        let (status, word) = (k.input("status", 1), k.input("word", BEAT_BITS));
        let status_part = k.input("status_part", count_bits(self.statuses)).extend(self.part_bits());
        let scan_part = k.input("scan_part", count_bits(self.subarrays)).extend(self.part_bits());
        k.wire("beat", status.mux(word.plus(1), k.constant(BEAT_BITS, 0)));
        k.wire("part", status.mux(if self.labels { status_part.plus(1) } else { status_part }, scan_part));
        k.finish()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::testbench::{check, random_words, Pipeline};
    use crate::wire::Word;

    #[test]
    fn a_status_beat_has_a_code_and_its_own_subarray() {
        for (subarrays, labels) in [(8, false), (1, true)] {
            let block = StatusCode::new(8, subarrays, labels);
            let of = |inputs: &[Word]| match inputs[0].number() {
                0 => vec![Some(Word::from(0)), Some(inputs[3])],
                _ => {
                    let part = inputs[2].number() + u64::from(labels);
                    vec![Some(Word::from((inputs[1].number() + 1) % 4)), Some(Word::from(part))]
                }
            };
            let widths = [1, BEAT_BITS, 3, count_bits(subarrays)];
            check(block.kernel.kernel(), &random_words(500, &widths), &mut Pipeline::new(0, 2, of));
        }
    }
}
