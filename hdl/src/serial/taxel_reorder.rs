//! Table between the two orders of the taxels: row-major on the streams, quad by quad in the engine.

use dermis_golden::fixed::plan::resources::Holds;
use dermis_golden::spec::quads::Quads;

use crate::block;
use crate::language::{Block, Builder, Contents, Inside};
use crate::primitives::count_bits;

block! {
    /// `place` follows `index` by one cycle: with `back` the place (4·quad + lane) of a row-major taxel, otherwise the
    /// row-major taxel at a place.
    pub struct TaxelReorder {
        layout: Quads,
    }
    ports TaxelReorderPorts {
        clock;
        /// From row-major to place; if low, from place to row-major.
        in back;
        /// Row-major index, or place; valid with `back`.
        in index: count_bits(4 * layout.len());
        /// Place, or row-major index; one cycle later.
        out place: count_bits(4 * layout.len());
    }
}

impl TaxelReorder {
    /// For an array of `layout`, whose row and column counts are even.
    pub fn new(layout: Quads) -> Self {
        TaxelReorder { layout }
    }
}

impl Block for TaxelReorder {
    fn build<'k>(&self, k: &'k Builder, io: TaxelReorderPorts<Inside<'k>>) {
        let (layout, bits) = (self.layout, io.index.bits());
        let words = |place: usize| {
            let taxel = layout.taxel(place / 4, place % 4);
            [(place, taxel as u64), ((1 << bits) + taxel, place as u64)]
        };
        let words = (0..4 * layout.len()).flat_map(words).collect();
        let places = k.memory("places", 2 << bits, bits, Contents::Words(words)).holds(Holds::TaxelOrder);
        io.place.delay(places.read(io.back.concat(io.index)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::kernel_of;
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
        check(&kernel_of(&TaxelReorder::new(LAYOUT)), &all, &mut Searched(None));
    }
}
