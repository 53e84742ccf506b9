//! A flip-flop of one bit.

use rust_hdl::prelude::*;

use crate::kernel_block;
use crate::language::{Body, Builder, Type};

/// One bit, one cycle later; 0 after configuration.
#[derive(dermis_hdl_derive::Block)]
pub struct Dff {
    /// Clock; the register changes on its rising edge.
    pub clk: Signal<In, Clock>,
    /// The bit that `q` shows in the next cycle.
    pub d: Signal<In, Bit>,
    /// The bit of the cycle before.
    pub q: Signal<Out, Bit>,
    kernel: Body,
}

kernel_block!(Dff, clock clk, inputs [d], outputs [q]);

impl Default for Dff {
    fn default() -> Self {
        let (clk, d, q) = Default::default();
        let k = Builder::new("dff");
        let bit = k.input("d", 1);
        k.register("q", Type::unsigned(1)).initially(0).set(bit);
        Dff { clk, d, q, kernel: Body::default() }.bind(k.finish())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::testbench::{check, random_words, Pipeline};

    #[test]
    fn a_bit_comes_one_cycle_later() {
        let of = |inputs: &[crate::wire::Word]| vec![Some(inputs[0])];
        check(Dff::default().kernel.kernel(), &random_words(1000, &[1]), &mut Pipeline::new(1, 1, of));
    }
}
