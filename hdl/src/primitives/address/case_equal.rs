//! Comparison of a count with a value that depends on the case.

use rust_hdl::prelude::*;

use crate::kernel_block;
use crate::language::{Body, Builder, Kernel};
use crate::primitives::address::case_counter::value_by_case;
use crate::primitives::address::counter::count_bits;
use crate::wire::Wire;

/// Tells whether a count is that of the case; combinational.
#[derive(dermis_hdl_derive::Block)]
pub struct CaseEqual {
    /// Index of the case; valid with `value`.
    pub which: Wire<In>,
    /// The count, unsigned; compared in the same cycle.
    pub value: Wire<In>,
    /// `value` is that of case `which`; combinational.
    pub equal: Signal<Out, Bit>,
    kernel: Body,
}

kernel_block!(CaseEqual, inputs [which, value], outputs [equal]);

impl CaseEqual {
    /// `values[case]` is the count of each case; counts have `bits` bits.
    pub fn new(values: &[usize], bits: usize) -> Self {
        let block = CaseEqual {
            which: Wire::new(count_bits(values.len())),
            value: Wire::new(bits),
            equal: Default::default(),
            kernel: Body::default(),
        };
        block.bind(kernel(values, bits))
    }
}

fn kernel(values: &[usize], bits: usize) -> Kernel {
    let k = Builder::combinational("case_equal");
    let (which, value) = (k.input("which", count_bits(values.len())), k.input("value", bits));
    k.wire("equal", value.equals(value_by_case(&k, which, values, bits)));
    k.finish()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::testbench::{check, random_words, Reference};
    use crate::wire::Word;

    const VALUES: [usize; 3] = [0, 5, 11];

    struct Equal;

    impl Reference for Equal {
        fn outputs(&mut self, inputs: &[Word]) -> Vec<Option<Word>> {
            let value = VALUES.get(inputs[0].number() as usize);
            vec![value.map(|&value| Word::from(inputs[1].number() as usize == value))]
        }

        fn clock(&mut self, _: &[Word]) {}
    }

    #[test]
    fn a_count_is_that_of_its_case() {
        let block = CaseEqual::new(&VALUES, 4);
        check(block.kernel.kernel(), &random_words(500, &[2, 4]), &mut Equal);
    }
}
