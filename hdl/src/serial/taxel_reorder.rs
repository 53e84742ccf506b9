//! Table between the two orders of the taxels: row-major on the streams, quad by quad in the engine.

use dermis_golden::fixed::plan::resources::Holds;
use dermis_golden::spec::quads::Quads;
use rust_hdl::prelude::*;

use crate::kernel_block;
use crate::language::{Body, Builder, Contents, Kernel, Type};
use crate::primitives::count_bits;
use crate::wire::Wire;

/// `place` follows `index` by one cycle: with `back` the place (4·quad + lane) of a row-major taxel, otherwise the
/// row-major taxel at a place.
#[derive(dermis_hdl_derive::Block)]
pub struct TaxelReorder {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// From row-major to place; if low, from place to row-major.
    pub back: Signal<In, Bit>,
    /// Row-major index, or place; valid with `back`.
    pub index: Wire<In>,
    /// Place, or row-major index; one cycle later.
    pub place: Wire<Out>,
    kernel: Body,
}

kernel_block!(TaxelReorder, clock clk, inputs [back, index], outputs [place]);

impl TaxelReorder {
    /// For an array of `layout`, whose row and column counts are even.
    pub fn new(layout: Quads) -> Self {
        let bits = count_bits(4 * layout.len());
        let block = TaxelReorder {
            clk: Default::default(),
            back: Default::default(),
            index: Wire::new(bits),
            place: Wire::new(bits),
            kernel: Body::default(),
        };
        block.bind(kernel(layout, bits))
    }
}

fn kernel(layout: Quads, bits: usize) -> Kernel {
    let k = Builder::new("taxel_reorder");
    let (back, index) = (k.input("back", 1), k.input("index", bits));
    let words = |place: usize| {
        let taxel = layout.taxel(place / 4, place % 4);
        [(place, taxel as u64), ((1 << bits) + taxel, place as u64)]
    };
    let words = (0..4 * layout.len()).flat_map(words).collect();
    let places = k.memory("places", 2 << bits, bits, Contents::Words(words)).holds(Holds::TaxelOrder);
    k.register("place", Type::unsigned(bits)).set(places.read(back.concat(index)));
    k.finish()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::testbench::{check, Reference};
    use crate::wire::Word;

    const LAYOUT: Quads = Quads { rows: 6, cols: 4 };

    struct Searched(Option<u64>);

    impl Reference for Searched {
        fn outputs(&mut self, _: &[Word]) -> Vec<Option<Word>> {
            vec![self.0.map(Word::from)]
        }

        fn clock(&mut self, inputs: &[Word]) {
            let index = inputs[1].number() as usize;
            let taxel = |place: usize| LAYOUT.taxel(place / 4, place % 4);
            self.0 = match inputs[0].number() {
                0 => Some(taxel(index) as u64),
                _ => (0..24).position(|place| taxel(place) == index).map(|place| place as u64),
            };
        }
    }

    #[test]
    fn both_orders_of_the_taxels_are_found() {
        let all: Vec<Vec<Word>> = (0..48).map(|at| vec![Word::from(at / 24), Word::from(at % 24)]).collect();
        check(TaxelReorder::new(LAYOUT).kernel.kernel(), &all, &mut Searched(None));
    }
}
