//! Beat code and subarray of the requested beat.

use crate::block;
use crate::language::{Block, Builder, Inside};
use crate::primitives::address::counter::count_bits;

block! {
    /// During the status, beat codes 1 to 3 and the status counter's subarray; otherwise code 0 and the scanned
    /// subarray; combinational. Where each contact has a μ of its own, the subarray of a status is the label of a
    /// contact, from 1 on.
    pub struct StatusCode {
        statuses: usize,
        subarrays: usize,
        /// The first status is that of label 1.
        labels: bool,
    }
    ports StatusCodePorts {
        /// The status is being requested.
        in status;
        /// Index of the status beat within its subarray, 0 to 2, 2 bits; valid with `status`.
        in word: BEAT_BITS;
        /// Subarray whose status is requested; valid with `status`.
        in status_part: count_bits(*statuses);
        /// Subarray of the scanned taxel; valid while `status` is low.
        in scan_part: count_bits(*subarrays);
        /// 0: a force, 1 … 3: a status beat; combinational.
        out beat: BEAT_BITS;
        /// Index of the beat's subarray; combinational.
        out part: count_bits(statuses + usize::from(*labels));
    }
}

/// Width of a beat code in bits.
const BEAT_BITS: usize = 2;

impl StatusCode {
    /// For so many statuses of a frame, and subarrays; `labels`: the first status is that of label 1.
    pub fn new(statuses: usize, subarrays: usize, labels: bool) -> Self {
        StatusCode { statuses, subarrays, labels }
    }
}

impl Block for StatusCode {
    fn build<'k>(&self, k: &'k Builder, io: StatusCodePorts<Inside<'k>>) {
        let [status_part, scan_part] = [io.status_part, io.scan_part].map(|part| part.extend(io.part.bits()));
        io.beat.set(io.status.mux(io.word.plus(1), k.constant(BEAT_BITS, 0)));
        io.part.set(io.status.mux(if self.labels { status_part.plus(1) } else { status_part }, scan_part));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::kernel_of;
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
            check(&kernel_of(&block), &random_words(500, &widths), &mut Pipeline::new(0, 2, of));
        }
    }
}
