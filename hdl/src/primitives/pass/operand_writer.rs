//! Write address of finished vectors in the operand memory.

use rust_hdl::prelude::*;

use crate::kernel_block;
use crate::language::{Body, Builder, Kernel, Type};
use crate::primitives::address::case_counter::{largest, value_by_case};
use crate::primitives::address::counter::count_bits;
use crate::wire::Wire;

/// Counts the quads of the v_ij as they arrive: the write address of the current quad, whether it is an operand of a
/// later pass and has to be written, and how many vectors can be read: those that are complete, or, `streamed`, begun.
#[derive(LogicBlock)]
pub struct OperandWriter {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Index of the case; constant from the cycle after `clear` until the next.
    pub which: Wire<In>,
    /// Restarts the counts for the next subarray, with priority over `valid`.
    pub clear: Signal<In, Bit>,
    /// A quad of a v_ij arrives in this cycle.
    pub valid: Signal<In, Bit>,
    /// Write address of the quad; valid with `keep`.
    pub address: Wire<Out>,
    /// Write enable: the quad is an operand of a later pass. Combinational from `valid`.
    pub keep: Signal<Out, Bit>,
    /// Number of operand vectors of this subarray that can be read; includes a vector from the cycle after the `valid`
    /// that makes it readable.
    pub finished: Wire<Out>,
    kernel: Body,
}

kernel_block!(OperandWriter, clock clk, inputs [which, clear, valid], outputs [address, keep, finished]);

impl OperandWriter {
    /// `vectors` operand vectors per subarray, of `quads[case]` quads each; `streamed`, only with two quads or more: a
    /// vector is read from its first quad on, one quad per cycle, while one quad per cycle is written.
    pub fn new(vectors: usize, quads: &[usize], streamed: bool) -> Self {
        let block = OperandWriter {
            clk: Default::default(),
            which: Wire::new(count_bits(quads.len())),
            clear: Default::default(),
            valid: Default::default(),
            address: Wire::new(count_bits(vectors.max(1) * largest(quads))),
            keep: Default::default(),
            finished: Wire::new(count_bits(vectors + 1)),
            kernel: Body::default(),
        };
        block.bind(kernel(vectors, quads, streamed))
    }
}

fn kernel(vectors: usize, quads: &[usize], streamed: bool) -> Kernel {
    let k = Builder::new("operand_writer");
    let which = k.input("which", count_bits(quads.len()));
    let (clear, valid) = (k.input("clear", 1), k.input("valid", 1));
    let most = vectors * largest(quads);
    let (address_bits, finished_bits) = (count_bits(most), count_bits(vectors + 1));
    if vectors == 0 {
        k.comment("No v_ij is an operand of a later pass.");
        let address_bits = count_bits(largest(quads));
        for (port, bits) in [("address", address_bits), ("keep", 1), ("finished", finished_bits)] {
            k.wire(port, k.constant(bits, 0));
        }
        return k.finish();
    }
    let quad = k.state("quad", Type::unsigned(count_bits(largest(quads))), clear, 0);
    let address = k.state("address", Type::unsigned(address_bits), clear, 0);
    let finished = k.state("finished", Type::unsigned(finished_bits), clear, 0);
    let ends: Vec<usize> = quads.iter().map(|quads| quads - 1).collect();
    let last_quad = k.wire("last_quad", quad.equals(value_by_case(&k, which, &ends, quad.bits())));
    let all = finished.is(vectors as u64);
    let full = match streamed {
        true => {
            let full = k.state("full", Type::unsigned(1), clear, 0);
            k.when(valid & last_quad & all, || full.set(k.constant(1, 1)));
            *full
        }
        false => all,
    };
    let keep = k.wire("keep", valid & !full);
    k.when(keep, || {
        quad.set(last_quad.mux(k.constant(quad.bits(), 0), quad.plus(1)));
        k.when(!address.is(most as u64 - 1), || address.set(address.plus(1)));
        let readable = if streamed { quad.is(0) } else { last_quad };
        k.when(readable, || finished.set(finished.plus(1)));
    });
    k.finish()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::testbench::{check, Reference};
    use crate::wire::Word;

    const VECTORS: usize = 3;
    const QUADS: [usize; 2] = [5, 3];

    /// The number of quads written; undefined before the first `clear`.
    struct Count {
        quads: Option<usize>,
        streamed: bool,
    }

    impl Reference for Count {
        fn outputs(&mut self, inputs: &[Word]) -> Vec<Option<Word>> {
            let quads = QUADS[inputs[0].number() as usize];
            let keep = self.quads.map(|seen| inputs[2].number() == 1 && seen < VECTORS * quads);
            vec![
                self.quads.filter(|_| keep == Some(true)).map(|seen| Word::from(seen as u64)),
                self.quads
                    .map(|seen| if self.streamed { seen.div_ceil(quads) } else { seen / quads } as u64)
                    .map(Word::from),
                keep.map(Word::from),
            ]
        }

        fn clock(&mut self, inputs: &[Word]) {
            let keeps = self.outputs(inputs)[2].map(|keep| keep.number() as usize);
            self.quads = match inputs[1].number() {
                0 => self.quads.zip(keeps).map(|(seen, keep)| seen + keep),
                _ => Some(0),
            };
        }
    }

    #[test]
    fn quads_are_counted_to_the_last_vector_of_each_case() {
        let mut random = fastrand::Rng::with_seed(2);
        let mut case = 0;
        let stimulus = (0..3000).map(|cycle| {
            let clear = cycle == 0 || random.u8(..50) == 0;
            let inputs = vec![Word::from(case), clear.into(), (random.u8(..3) > 0).into()];
            // The case changes after `clear` only.
            case = if clear { random.u64(..2) } else { case };
            inputs
        });
        let stimulus: Vec<_> = stimulus.collect();
        for streamed in [false, true] {
            let block = OperandWriter::new(VECTORS, &QUADS, streamed);
            check(block.kernel.kernel(), &stimulus, &mut Count { quads: None, streamed });
        }
    }
}
