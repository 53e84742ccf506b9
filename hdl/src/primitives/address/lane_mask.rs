//! Lane mask of a quad, or of a part of it: which lanes hold distinct taxels.

use dermis_golden::spec::quads::Quads;

use crate::block;
use crate::language::{Block, Builder, Expr, Inside, Interface};
use crate::primitives::address::counter::count_bits;

block! {
    /// Quad address to lane mask; combinational. All four lanes count, except that of each pair of copies on the middle
    /// line of an odd row or column count only one does. Where a quad takes several steps, the address is
    /// `{quad, step}`.
    pub struct LaneMask {
        /// Quad layout of the subarrays of each case.
        layouts: Vec<Quads>,
        /// Lanes of a step.
        lanes: usize,
    }
    ports LaneMaskPorts {
        /// Index of the case; valid with `address`.
        in case_index: count_bits(layouts.len());
        /// Address of the step in the subarray; taken in the same cycle.
        in address: count_bits(layouts.iter().map(Quads::len).max().unwrap_or(1) * (Quads::LANES / lanes));
        /// One bit per lane, which is counted; combinational from `address`.
        out mask: lanes;
    }
}

impl LaneMask {
    /// `layouts[case]` is the quad layout of the subarrays of each case; a step has `lanes` lanes.
    pub fn new(layouts: &[Quads], lanes: usize) -> Self {
        LaneMask { layouts: layouts.to_vec(), lanes }
    }

    /// The mask of the step `address` of case `case_index`, by instance `name`; without instance and address where each lane always
    /// counts.
    pub fn of<'k>(
        &self,
        k: &'k Builder,
        name: &str,
        case_index: Expr<'k>,
        address: impl FnOnce() -> Expr<'k>,
    ) -> Expr<'k> {
        let all = (1 << self.lanes) - 1;
        let steps = 0..1 << self.widths().address;
        if self.layouts.iter().all(|layout| steps.clone().all(|step| mask(Some(layout), self.lanes, step) == all)) {
            return k.constant(self.lanes, all);
        }
        let instance = k.instance(name, self);
        instance.case_index.set(case_index);
        instance.address.set(address());
        instance.mask
    }
}

impl Block for LaneMask {
    fn build<'k>(&self, _: &'k Builder, io: LaneMaskPorts<Inside<'k>>) {
        let steps = 0..1 << io.address.bits();
        let cases = (0..1 << io.case_index.bits()).map(|case| self.layouts.get(case));
        let masks = cases.flat_map(|layout| steps.clone().map(move |step| mask(layout, self.lanes, step)));
        io.mask.set(io.case_index.concat(io.address).table(self.lanes, &masks.collect::<Vec<u64>>()));
    }
}

/// The mask of step `step` of `lanes` lanes; where a case has no quad, all lanes.
fn mask(layout: Option<&Quads>, lanes: usize, step: usize) -> u64 {
    let (address, first) = (step * lanes / Quads::LANES, step * lanes % Quads::LANES);
    let layout = layout.filter(|layout| address < layout.len());
    layout.map_or(u64::MAX, |layout| u64::from(layout.lane_mask(address)) >> first) & ((1 << lanes) - 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::kernel_of;
    use crate::language::testbench::{check, random_words, Pipeline};
    use crate::wire::Word;

    #[test]
    fn copies_on_a_middle_line_count_once() {
        for sizes in [vec![(8, 8)], vec![(5, 7)], vec![(10, 5), (5, 5), (10, 3)]] {
            let layouts: Vec<Quads> = sizes.iter().map(|&(rows, cols)| Quads { rows, cols }).collect();
            for lanes in [4, 2, 1] {
                let block = LaneMask::new(&layouts, lanes);
                let of = |inputs: &[Word]| {
                    let (case, step) = (inputs[0].number() as usize, inputs[1].number() as usize);
                    // Lane by lane: a copy is a taxel that another lane of the quad holds too, of which the first counts.
                    let counts = |lane: usize| {
                        let (address, lane) = (step * lanes / 4, step * lanes % 4 + lane);
                        let layout = layouts.get(case).filter(|layout| address < layout.len());
                        let first = |layout: &Quads| {
                            let taxel = layout.taxel(address, lane);
                            (0..lane).all(|other| layout.taxel(address, other) != taxel)
                        };
                        layout.is_none_or(first)
                    };
                    let mask: u64 = (0..lanes).map(|lane| u64::from(counts(lane)) << lane).sum();
                    vec![Some(Word::from(mask))]
                };
                let steps = layouts.iter().map(Quads::len).max().unwrap() * (Quads::LANES / lanes);
                let widths = [layouts.len(), steps].map(count_bits);
                check(&kernel_of(&block), &random_words(1000, &widths), &mut Pipeline::new(0, 1, of));
            }
        }
    }
}
