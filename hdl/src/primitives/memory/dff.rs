//! A flip-flop of one bit.

use crate::block;
use crate::language::{Block, Builder, Inside};

block! {
    /// One bit, one cycle later; 0 after configuration.
    #[derive(Default)]
    pub struct Dff {}
    ports DffPorts {
        clock;
        /// The bit that `q` shows in the next cycle.
        in d;
        /// The bit of the cycle before.
        out q;
    }
}

impl Block for Dff {
    fn build<'k>(&self, _: &'k Builder, io: DffPorts<Inside<'k>>) {
        io.q.register().initially(0).set(io.d);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::kernel_of;
    use crate::language::testbench::{check, random_words, Pipeline};

    #[test]
    fn a_bit_comes_one_cycle_later() {
        let of = |inputs: &[crate::wire::Word]| vec![Some(inputs[0])];
        check(&kernel_of(&Dff {}), &random_words(1000, &[1]), &mut Pipeline::new(1, 1, of));
    }
}
