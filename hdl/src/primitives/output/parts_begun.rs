//! Whether the values of a taxel's subarray have begun to arrive.

use rust_hdl::prelude::*;

use crate::kernel_block;
use crate::language::{Body, Builder, Kernel, Type};
use crate::primitives::address::counter::count_bits;
use crate::wire::Wire;

/// Counts the subarrays of a frame whose values have begun; `open` where `part` is one of them, combinational from `part`.
/// The values are written in an order and at a rate in which each is there when `send` requests it row-major, from then on.
#[derive(dermis_hdl_derive::Block)]
pub struct PartsBegun {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// The values of a subarray begin.
    pub begins: Signal<In, Bit>,
    /// It is the frame's first; valid with `begins`.
    pub first: Signal<In, Bit>,
    /// Index of a subarray; taken in the same cycle.
    pub part: Wire<In>,
    /// Its values have begun in an earlier cycle.
    pub open: Signal<Out, Bit>,
    kernel: Body,
}

kernel_block!(PartsBegun, clock clk, inputs [begins, first, part], outputs [open]);

impl PartsBegun {
    /// For frames of at most `parts` subarrays.
    pub fn new(parts: usize) -> Self {
        let block = PartsBegun {
            clk: Default::default(),
            begins: Default::default(),
            first: Default::default(),
            part: Wire::new(count_bits(parts)),
            open: Default::default(),
            kernel: Body::default(),
        };
        block.bind(kernel(parts))
    }
}

fn kernel(parts: usize) -> Kernel {
    let k = Builder::new("parts_begun");
    let (begins, first) = (k.input("begins", 1), k.input("first", 1));
    let part = k.input("part", count_bits(parts));
    if parts == 1 {
        k.comment("With one subarray nothing is sent before its values.");
        k.wire("open", k.constant(1, 1));
        return k.finish();
    }
    let begun = k.register("begun", Type::unsigned(count_bits(parts + 1)));
    k.when(begins, || begun.set(first.mux(k.constant(begun.bits(), 1), begun.plus(1))));
    k.wire("open", part.resize(begun.bits()).less(*begun));
    k.finish()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::testbench::{check, Reference};
    use crate::wire::Word;

    const PARTS: u64 = 5;

    /// Subarrays begun; undefined before the first frame.
    struct Count(Option<u64>);

    impl Reference for Count {
        fn outputs(&mut self, inputs: &[Word]) -> Vec<Option<Word>> {
            vec![self.0.map(|begun| Word::from(inputs[2].number() < begun))]
        }

        fn clock(&mut self, inputs: &[Word]) {
            self.0 = match [inputs[0].number(), inputs[1].number()] {
                [0, _] => self.0,
                [_, 1] => Some(1),
                _ => self.0.map(|begun| begun + 1),
            };
        }
    }

    #[test]
    fn a_subarray_is_open_once_its_values_have_begun() {
        let mut random = fastrand::Rng::with_seed(4);
        let mut begun = PARTS;
        let stimulus = (0..2000).map(|_| {
            let begins = random.u8(..4) == 0;
            let first = begins && begun == PARTS;
            if begins {
                begun = if first { 1 } else { begun + 1 };
            }
            vec![begins.into(), first.into(), random.u64(..PARTS).into()]
        });
        let stimulus: Vec<Vec<Word>> = stimulus.collect();
        check(PartsBegun::new(PARTS as usize).kernel.kernel(), &stimulus, &mut Count(None));
    }
}
