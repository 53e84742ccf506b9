//! Comparison of a count with a value that depends on the case.

use crate::block;
use crate::language::{Block, Builder, Inside};
use crate::primitives::address::case_counter::value_by_case;
use crate::primitives::address::counter::count_bits;

block! {
    /// Tells whether a count is that of the case; combinational.
    pub struct CaseEqual {
        values: Vec<usize>,
        bits: usize,
    }
    ports CaseEqualPorts {
        /// Index of the case; valid with `value`.
        in case_index: count_bits(values.len());
        /// The count, unsigned; compared in the same cycle.
        in value: bits;
        /// `value` is that of case `case_index`; combinational.
        out equal;
    }
}

impl CaseEqual {
    /// `values[case]` is the count of each case; counts have `bits` bits.
    pub fn new(values: &[usize], bits: usize) -> Self {
        CaseEqual { values: values.to_vec(), bits }
    }
}

impl Block for CaseEqual {
    fn build<'k>(&self, k: &'k Builder, io: CaseEqualPorts<Inside<'k>>) {
        io.equal.set(io.value.equals(value_by_case(k, io.case_index, &self.values, self.bits)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::kernel_of;
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
        check(&kernel_of(&block), &random_words(500, &[2, 4]), &mut Equal);
    }
}
