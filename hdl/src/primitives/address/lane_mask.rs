//! Lane mask of a quad: which lanes hold distinct taxels.

use dermis_golden::symmetry::quads::Quads;
use rust_hdl::prelude::*;

use crate::kernel_block;
use crate::language::{Body, Builder, Kernel};
use crate::primitives::address::counter::count_bits;
use crate::wire::Wire;

/// Quad address to lane mask; combinational. All four lanes count, except that of each pair of copies on the middle
/// line of an odd row or column count only one does.
#[derive(LogicBlock)]
pub struct LaneMask {
    /// Index of the case.
    pub which: Wire<In>,
    /// Quad address in the subarray.
    pub address: Wire<In>,
    /// One bit per lane: the lane is counted.
    pub mask: Wire<Out>,
    kernel: Body,
}

kernel_block!(LaneMask, inputs [which, address], outputs [mask]);

/// Lanes of a quad.
const LANES: usize = 4;

impl LaneMask {
    /// `layouts[case]` is the quad layout of the subarrays of each case.
    pub fn new(layouts: &[Quads]) -> Self {
        let quads = layouts.iter().map(Quads::len).max().unwrap_or(1);
        let block = LaneMask {
            which: Wire::new(count_bits(layouts.len())),
            address: Wire::new(count_bits(quads)),
            mask: Wire::new(LANES),
            kernel: Body::default(),
        };
        block.bind(kernel(layouts, count_bits(quads)))
    }
}

/// The mask at an address of `bits` bits; where a case has no quad, all lanes.
fn kernel(layouts: &[Quads], bits: usize) -> Kernel {
    let k = Builder::combinational("lane_mask");
    let (which, address) = (k.input("which", count_bits(layouts.len())), k.input("address", bits));
    let mask = |case: usize, address: usize| {
        let layout = layouts.get(case).filter(|layout| address < layout.len());
        layout.map_or((1 << LANES) - 1, |layout| u64::from(layout.lane_mask(address)))
    };
    let masks = (0..1 << which.bits()).flat_map(|case| (0..1 << bits).map(move |address| mask(case, address)));
    let masks: Vec<u64> = masks.collect();
    k.wire("mask", which.concat(address).table(LANES, &masks));
    k.finish()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::testbench::{check, random_words, Pipeline};
    use crate::wire::Word;

    #[test]
    fn copies_on_a_middle_line_count_once() {
        for sizes in [vec![(8, 8)], vec![(5, 7)], vec![(10, 5), (5, 5), (10, 3)]] {
            let layouts: Vec<Quads> = sizes.iter().map(|&(rows, cols)| Quads { rows, cols }).collect();
            let block = LaneMask::new(&layouts);
            let of = |inputs: &[Word]| {
                let (case, address) = (inputs[0].number() as usize, inputs[1].number() as usize);
                let layout = layouts.get(case).filter(|layout| address < layout.len());
                vec![Some(Word::from(layout.map_or(15, |layout| u64::from(layout.lane_mask(address)))))]
            };
            let widths = [block.which.width(), block.address.width()];
            check(block.kernel.kernel(), &random_words(1000, &widths), &mut Pipeline::new(0, 1, of));
        }
    }
}
