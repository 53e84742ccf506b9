//! The four-point Hadamard butterfly, registered.

use crate::block;
use crate::language::{concat, Block, Builder, Expr, Inside};

block! {
    /// Four signed fields in, their Hadamard transform one cycle later: four signed sums, two bits wider.
    pub struct Butterfly {
        /// Width of a field.
        bits: usize,
    }
    ports ButterflyPorts {
        clock;
        /// Four signed fields of `bits` bits, one per taxel of the quad; a new quad in every cycle.
        in quad: 4 * bits;
        /// Four signed sums of `bits + 2` bits, field p = parity p; one cycle after `quad`.
        out sums: 4 * (bits + 2);
    }
}

impl Butterfly {
    /// Fields of `bits` bits.
    pub fn new(bits: usize) -> Self {
        Butterfly { bits }
    }
}

impl Block for Butterfly {
    fn build<'k>(&self, k: &'k Builder, io: ButterflyPorts<Inside<'k>>) {
        let field = |lane: usize| {
            let field = io.quad.slice(lane * self.bits, self.bits);
            k.wire(&format!("x{lane}"), field.signed().extend(self.bits + 2).unsigned())
        };
        let [x0, x1, x2, x3] = [0, 1, 2, 3].map(field);
        let sums = [
            add(less(less(x0, x1), x2), x3),
            less(less(add(x0, x1), x2), x3),
            less(add(less(x0, x1), x2), x3),
            add(add(add(x0, x1), x2), x3),
        ];
        io.sums.delay(concat(&sums));
    }
}

/// For each parity whether the taxel in `lane`, 2 bits, is subtracted: where the lanes come one after the other.
pub(crate) fn subtracted<'k>(k: &'k Builder, lane: Expr<'k>) -> [Expr<'k>; 4] {
    [k.constant(1, 0), lane.at(0), lane.at(1), lane.at(0) ^ lane.at(1)]
}

/// a + b modulo two to the power of their width.
fn add<'k>(a: Expr<'k>, b: Expr<'k>) -> Expr<'k> {
    (a + b).low(a.bits())
}

/// a − b modulo two to the power of their width.
fn less<'k>(a: Expr<'k>, b: Expr<'k>) -> Expr<'k> {
    (a - b).low(a.bits())
}

#[cfg(test)]
mod tests {
    use dermis_golden::physics::symmetry::parity::hadamard;

    use super::*;
    use crate::language::kernel_of;
    use crate::language::testbench::{check, random_words, Pipeline};
    use crate::wire::Word;

    #[test]
    fn sums_are_the_transform_of_the_model() {
        const BITS: usize = 11;
        let of = |inputs: &[Word]| {
            let quad = std::array::from_fn(|lane| inputs[0].signed(lane, BITS));
            vec![Some(Word::of_fields(&hadamard(quad), BITS + 2))]
        };
        let block = Butterfly::new(BITS);
        check(&kernel_of(&block), &random_words(2000, &[4 * BITS]), &mut Pipeline::new(1, 1, of));
    }
}
