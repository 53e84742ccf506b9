//! Quad address of a v_ij, with transposed results put back in place.

use dermis_golden::spec::quads::Quads;
use rust_hdl::prelude::*;

use crate::kernel_block;
use crate::language::{concat, Body, Builder, Expr, Kernel};
use crate::primitives::address::counter::count_bits;
use crate::wire::Wire;

/// Address and taxels of a quad; rows and columns are exchanged for the v_ij that were computed transposed.
/// Combinational.
#[derive(dermis_hdl_derive::Block)]
pub struct TransposedPlace {
    /// Index of the v_ij; valid with `address` and `quad`.
    pub index: Wire<In>,
    /// The quad's address as computed; taken in the same cycle.
    pub address: Wire<In>,
    /// Its four taxels as computed, signed; taken in the same cycle.
    pub quad: Wire<In>,
    /// The quad's address in the subarray; combinational from `address`.
    pub placed: Wire<Out>,
    /// Its four taxels in lane order, signed; combinational from `quad`.
    pub taxels: Wire<Out>,
    kernel: Body,
}

kernel_block!(TransposedPlace, inputs [index, address, quad], outputs [placed, taxels]);

impl TransposedPlace {
    /// For subarrays of `layout`, taxels of `bits` bits and `vectors` v_ij, of which those listed in `transposed`
    /// arrive with rows and columns exchanged.
    pub fn new(layout: Quads, bits: usize, vectors: usize, transposed: Vec<usize>) -> Self {
        let block = TransposedPlace {
            index: Wire::new(count_bits(vectors)),
            address: Wire::new(count_bits(layout.len())),
            quad: Wire::new(4 * bits),
            placed: Wire::new(count_bits(layout.len())),
            taxels: Wire::new(4 * bits),
            kernel: Body::default(),
        };
        block.bind(kernel(layout, bits, count_bits(vectors), &transposed))
    }
}

fn kernel(layout: Quads, bits: usize, index_bits: usize, transposed: &[usize]) -> Kernel {
    let k = Builder::combinational("transposed_place");
    let (index, address) = (k.input("index", index_bits), k.input("address", count_bits(layout.len())));
    let quad = k.input("quad", 4 * bits);
    let across = |at: usize| if at < layout.len() { layout.transposed(at) } else { at };
    let is = transposed.iter().map(|&own| index.is(own as u64)).reduce(|any, own| any | own);
    let (placed, taxels) = match is {
        None => (address, quad),
        Some(is) => {
            let exchange = k.wire("exchange", is);
            let table: Vec<u64> = (0..1 << address.bits()).map(|at| across(at) as u64).collect();
            let lanes: Vec<Expr> = [3, 1, 2, 0].map(|lane| quad.slice(lane * bits, bits)).into();
            let across = k.wire("across", address.table(address.bits(), &table));
            (exchange.mux(across, address), exchange.mux(concat(&lanes), quad))
        }
    };
    k.wire("placed", placed);
    k.wire("taxels", taxels);
    k.finish()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::testbench::{check, random_words, Pipeline};
    use crate::wire::Word;

    #[test]
    fn transposed_vectors_are_put_back() {
        let (layout, bits, vectors) = (Quads { rows: 6, cols: 6 }, 20, 5);
        for transposed in [vec![], vec![1, 4]] {
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
            let block = TransposedPlace::new(layout, bits, vectors, transposed.clone());
            check(block.kernel.kernel(), &stimulus, &mut Pipeline::new(0, 2, of));
        }
    }
}
