//! Whether the values of a taxel's subarray have begun to arrive.

use crate::block;
use crate::language::{Block, Builder, Inside, Type};
use crate::primitives::address::counter::count_bits;

block! {
    /// Counts the subarrays of a frame whose values have begun; `open` where `part` is one of them, combinational from
    /// `part`. The values are written in an order and at a rate in which each is there when `send` requests it
    /// row-major, from then on.
    pub struct PartsBegun {
        /// Subarrays of the largest frame.
        parts: usize,
    }
    ports PartsBegunPorts {
        clock;
        /// The values of a subarray begin.
        in begins;
        /// It is the frame's first; valid with `begins`.
        in first;
        /// Index of a subarray; taken in the same cycle.
        in part: count_bits(*parts);
        /// Its values have begun in an earlier cycle.
        out open;
    }
}

impl PartsBegun {
    /// For frames of at most `parts` subarrays; `None` with one subarray, of which nothing is sent before its values.
    pub fn new(parts: usize) -> Option<Self> {
        (parts > 1).then_some(PartsBegun { parts })
    }
}

impl Block for PartsBegun {
    fn build<'k>(&self, k: &'k Builder, io: PartsBegunPorts<Inside<'k>>) {
        let begun = k.register("begun", Type::unsigned(count_bits(self.parts + 1)));
        k.when(io.begins, || begun.set(io.first.mux(k.constant(begun.bits(), 1), begun.plus(1))));
        io.open.set(io.part.resize(begun.bits()).less(*begun));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::kernel_of;
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
        check(&kernel_of(&PartsBegun::new(PARTS as usize).unwrap()), &stimulus, &mut Count(None));
    }
}
