//! The four-point Hadamard butterfly, registered.

use rust_hdl::prelude::*;

use crate::kernel_block;
use crate::language::{concat, Body, Builder, Expr, Kernel};
use crate::wire::Wire;

/// Four signed fields in, their Hadamard transform one cycle later: four signed sums, two bits wider.
#[derive(dermis_hdl_derive::Block)]
pub struct Butterfly {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Four signed fields of `bits` bits, one per taxel of the quad; a new quad in every cycle.
    pub quad: Wire<In>,
    /// Four signed sums of `bits + 2` bits, field p = parity p; one cycle after `quad`.
    pub sums: Wire<Out>,
    kernel: Body,
}

kernel_block!(Butterfly, clock clk, inputs [quad], outputs [sums]);

impl Butterfly {
    /// Fields of `bits` bits.
    pub fn new(bits: usize) -> Self {
        let block = Butterfly {
            clk: Default::default(),
            quad: Wire::new(4 * bits),
            sums: Wire::new(4 * (bits + 2)),
            kernel: Body::default(),
        };
        block.bind(kernel(bits))
    }
}

fn kernel(bits: usize) -> Kernel {
    let k = Builder::new("butterfly");
    let (quad, wide) = (k.input("quad", 4 * bits), bits + 2);
    let [x0, x1, x2, x3] = [0, 1, 2, 3]
        .map(|lane| k.wire(&format!("x{lane}"), quad.slice(lane * bits, bits).signed().extend(wide).unsigned()));
    let sums = [
        add(less(less(x0, x1), x2), x3),
        less(less(add(x0, x1), x2), x3),
        less(add(less(x0, x1), x2), x3),
        add(add(add(x0, x1), x2), x3),
    ];
    k.delay("sums", concat(&sums));
    k.finish()
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
        check(block.kernel.kernel(), &random_words(2000, &[4 * BITS]), &mut Pipeline::new(1, 1, of));
    }
}
