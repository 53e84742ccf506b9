//! Write address of finished vectors in the operand memory.

use rust_hdl::prelude::*;

use crate::kernel_block;
use crate::language::{Body, Builder, Kernel, Type};
use crate::primitives::address::case_counter::{largest, value_by_case};
use crate::primitives::address::counter::count_bits;
use crate::wire::Wire;

/// LaneMask the quads of the v_ij as they arrive: the write address of the current quad, whether it is an operand of a
/// later pass and has to be written, and how many vectors are complete.
#[derive(LogicBlock)]
pub struct OperandWriter {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Index of the case.
    pub which: Wire<In>,
    /// Restarts the counts for the next subarray, with priority over `valid`.
    pub clear: Signal<In, Bit>,
    /// A quad of a v_ij arrives in this cycle.
    pub valid: Signal<In, Bit>,
    /// Write address of the quad; valid with `keep`.
    pub address: Wire<Out>,
    /// Write enable: the quad is an operand of a later pass. Combinational from `valid`.
    pub keep: Signal<Out, Bit>,
    /// Number of complete operand vectors of this subarray.
    pub finished: Wire<Out>,
    kernel: Body,
}

kernel_block!(OperandWriter, clock clk, inputs [which, clear, valid], outputs [address, keep, finished]);

impl OperandWriter {
    /// `vectors` operand vectors per subarray, of `quads[case]` quads each.
    pub fn new(vectors: usize, quads: &[usize]) -> Self {
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
        block.bind(kernel(vectors, quads))
    }
}

fn kernel(vectors: usize, quads: &[usize]) -> Kernel {
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
    let keep = k.wire("keep", valid & !finished.is(vectors as u64));
    k.when(keep, || {
        quad.set(last_quad.mux(k.constant(quad.bits(), 0), quad.plus(1)));
        k.when(!address.is(most as u64 - 1), || address.set(address.plus(1)));
        k.when(last_quad, || finished.set(finished.plus(1)));
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
    struct Count(Option<usize>);

    impl Reference for Count {
        fn outputs(&mut self, inputs: &[Word]) -> Vec<Option<Word>> {
            let quads = QUADS[inputs[0].number() as usize];
            let keep = self.0.map(|seen| inputs[2].number() == 1 && seen < VECTORS * quads);
            vec![
                self.0.filter(|_| keep == Some(true)).map(|seen| Word::from(seen as u64)),
                self.0.map(|seen| Word::from((seen / quads) as u64)),
                keep.map(Word::from),
            ]
        }

        fn clock(&mut self, inputs: &[Word]) {
            let keeps = self.outputs(inputs)[2].map(|keep| keep.number() as usize);
            self.0 = match inputs[1].number() {
                0 => self.0.zip(keeps).map(|(seen, keep)| seen + keep),
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
        let block = OperandWriter::new(VECTORS, &QUADS);
        check(block.kernel.kernel(), &stimulus.collect::<Vec<_>>(), &mut Count(None));
    }
}
