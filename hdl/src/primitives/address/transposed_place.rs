//! Quad address of a v_ij, with transposed results put back in place.

use dermis_golden::spec::quads::Quads;

use crate::block;
use crate::language::{concat, Block, Builder, Expr, Inside};
use crate::primitives::address::counter::count_bits;

block! {
    /// Address and taxels of a quad; rows and columns are exchanged for the v_ij that were computed transposed.
    /// Combinational.
    pub struct TransposedPlace {
        layout: Quads,
        /// Width of a taxel in bits.
        bits: usize,
        /// Number of the v_ij.
        vectors: usize,
        /// Indices of those that were computed transposed.
        transposed: Vec<usize>,
    }
    ports TransposedPlacePorts {
        /// Index of the v_ij; valid with `address` and `quad`.
        in index: count_bits(*vectors);
        /// The quad's address as computed; taken in the same cycle.
        in address: count_bits(layout.len());
        /// Its four taxels as computed, signed; taken in the same cycle.
        in quad: 4 * bits;
        /// The quad's address in the subarray; combinational from `address`.
        out placed: count_bits(layout.len());
        /// Its four taxels in lane order, signed; combinational from `quad`.
        out taxels: 4 * bits;
    }
}

impl TransposedPlace {
    /// For subarrays of `layout`, taxels of `bits` bits and `vectors` v_ij, of which those listed in `transposed`
    /// arrive with rows and columns exchanged; `None` if there is none.
    pub fn new(layout: Quads, bits: usize, vectors: usize, transposed: Vec<usize>) -> Option<Self> {
        (!transposed.is_empty()).then_some(TransposedPlace { layout, bits, vectors, transposed })
    }
}

impl Block for TransposedPlace {
    fn build<'k>(&self, k: &'k Builder, io: TransposedPlacePorts<Inside<'k>>) {
        let is = self.transposed.iter().map(|&own| io.index.is(own as u64)).reduce(|any, own| any | own);
        let exchange = k.wire("exchange", is.unwrap_or(k.constant(1, 0)));
        let across = |at: usize| if at < self.layout.len() { self.layout.transposed(at) } else { at };
        let table: Vec<u64> = (0..1 << io.address.bits()).map(|at| across(at) as u64).collect();
        let lanes: Vec<Expr> = [3, 1, 2, 0].map(|lane| io.quad.slice(lane * self.bits, self.bits)).into();
        let across = k.wire("across", io.address.table(io.address.bits(), &table));
        io.placed.set(exchange.mux(across, io.address));
        io.taxels.set(exchange.mux(concat(&lanes), io.quad));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::kernel_of;
    use crate::language::testbench::{check, random_words, Pipeline};
    use crate::wire::Word;

    #[test]
    fn transposed_vectors_are_put_back() {
        let (layout, bits, vectors) = (Quads { rows: 6, cols: 6 }, 20, 5);
        let transposed = vec![1, 4];
        let of = |inputs: &[Word]| {
            let (index, address) = (inputs[0].number() as usize, inputs[1].number() as usize);
            if !transposed.contains(&index) {
                return vec![Some(inputs[1]), Some(inputs[2])];
            }
            let placed = (address < layout.len()).then(|| Word::from(layout.transposed(address) as u64));
            let lanes = [0, 2, 1, 3].map(|lane| inputs[2].signed(lane, bits));
            vec![placed, Some(Word::of_fields(&lanes, bits))]
        };
        let stimulus = random_words(2000, &[count_bits(vectors), count_bits(layout.len()), 4 * bits]);
        let block = TransposedPlace::new(layout, bits, vectors, transposed.clone()).unwrap();
        check(&kernel_of(&block), &stimulus, &mut Pipeline::new(0, 2, of));
    }
}
