//! Quad address and lane of a taxel.

use dermis_golden::fixed::CasePlan;
use dermis_golden::spec::partition::Grid;
use dermis_golden::spec::quads::Quads;

use crate::block;
use crate::language::{concat, Block, Builder, Expr, Inside};
use crate::primitives::address::case_counter::{expression_by_case, largest};
use crate::primitives::address::constant_product::times;
use crate::primitives::address::counter::count_bits;

/// How the words of a memory hold the taxels of the array.
#[derive(Clone, Debug)]
pub(crate) struct Places {
    /// Layout and grid of the subarrays, by case.
    pub cases: Vec<(Quads, Grid)>,
    /// Quads of the largest frame.
    frame_quads: usize,
    /// Lanes of a memory word.
    lanes: usize,
}

impl Places {
    /// For the subarrays of each of `cases`, with `lanes` lanes in a memory word.
    pub fn new(cases: &[CasePlan], lanes: usize) -> Self {
        let places = cases.iter().map(|case| (case.layout(), case.grid())).collect();
        Places { cases: places, frame_quads: frame_quads(cases), lanes }
    }

    /// Width of the address of a word.
    pub fn address_bits(&self) -> usize {
        count_bits(self.frame_quads * (Quads::LANES / self.lanes))
    }

    /// Width of the index of a subarray.
    pub fn part_bits(&self) -> usize {
        count_bits(largest(&self.each(|(_, grid)| grid.rows * grid.cols)))
    }

    /// Columns of a subarray, columns of the grid, rows of a subarray, rows of the grid; each by case.
    pub fn counts(&self) -> [Vec<usize>; 4] {
        [
            self.each(|(layout, _)| layout.cols),
            self.each(|(_, grid)| grid.cols),
            self.each(|(layout, _)| layout.rows),
            self.each(|(_, grid)| grid.rows),
        ]
    }

    fn each(&self, of: impl Fn(&(Quads, Grid)) -> usize) -> Vec<usize> {
        self.cases.iter().map(of).collect()
    }

    fn count_bits(&self, of: impl Fn(&(Quads, Grid)) -> usize) -> usize {
        count_bits(largest(&self.each(of)))
    }
}

block! {
    /// Row and column of a taxel in its subarray, and of the subarray in the array, to address, lane and write mask;
    /// combinational. Subarrays follow each other row-major, each with all its quads. A taxel on the middle line of an odd
    /// count is written to several lanes. A memory word holds the four lanes of a quad or, where it holds fewer, the lanes of a
    /// quad follow one another.
    pub struct QuadAddress {
        places: Places,
    }
    ports QuadAddressPorts {
        /// Index of the case; valid with `row`.
        in case_index: count_bits(places.cases.len());
        /// Row of the taxel in its subarray; taken in the same cycle.
        in row: places.count_bits(|(layout, _)| layout.rows);
        /// Column of the taxel in its subarray; valid with `row`.
        in col: places.count_bits(|(layout, _)| layout.cols);
        /// Row of the subarray in the grid of subarrays; valid with `row`.
        in part_row: places.count_bits(|(_, grid)| grid.rows);
        /// Column of the subarray in the grid; valid with `row`.
        in part_col: places.count_bits(|(_, grid)| grid.cols);
        /// Address of the word, over all subarrays; combinational.
        out address: places.address_bits();
        /// Index of the subarray, row-major; combinational.
        out part: places.part_bits();
        /// Lane of the word that the taxel is read from, 2 bits, of a whole quad `{lower half, right half}`; combinational.
        out lane: 2;
        /// Lanes the taxel is written to, one bit each; combinational.
        out mask: 4;
    }
}

impl QuadAddress {
    /// For the layout and the grid of each of `cases`, with `lanes` lanes in a memory word.
    pub fn new(cases: &[CasePlan], lanes: usize) -> Self {
        Places::new(cases, lanes).into()
    }
}

impl From<Places> for QuadAddress {
    fn from(places: Places) -> Self {
        QuadAddress { places }
    }
}

/// Quads of a frame over all subarrays, in the case that has most.
pub fn frame_quads(cases: &[CasePlan]) -> usize {
    largest(&cases.iter().map(|case| case.parts.len() * case.formats.quads).collect::<Vec<_>>())
}

/// Where a taxel is in a subarray's quads.
pub(crate) struct Place<'k> {
    /// Row and column of its quad.
    pub near: [Expr<'k>; 2],
    /// It is in the lower half: the upper bit of the lane from which it is read.
    pub lower: Expr<'k>,
    /// It is in the right half: the lower bit of the lane.
    pub right: Expr<'k>,
    /// The taxel is on the middle line of an odd count, which is its own mirror image: written to both lanes.
    both_rows: Expr<'k>,
    both_cols: Expr<'k>,
}

impl<'k> Place<'k> {
    /// Of the taxel in this row and column of a subarray of `layout`.
    pub fn of(k: &'k Builder, layout: Quads, [row, col]: [Expr<'k>; 2]) -> Place<'k> {
        let (lower, near_row, both_rows) = fold(k, row, layout.rows);
        let (right, near_col, both_cols) = fold(k, col, layout.cols);
        Place { near: [near_row, near_col], lower, right, both_rows, both_cols }
    }
}

/// Address of the quad in this row and column of the quads of `layout`, which begin at address `first`.
pub(crate) fn quad_address_of<'k>(
    k: &'k Builder,
    layout: Quads,
    [row, col]: [Expr<'k>; 2],
    first: Expr<'k>,
) -> Expr<'k> {
    let bits = first.bits();
    (first + times(k, row, layout.quad_cols(), bits) + col).resize(bits)
}

/// The field of a memory word of `lanes` fields that belongs to `lane`, 2 bits.
pub(crate) fn lane_of<'k>(word: Expr<'k>, lanes: usize, lane: Expr<'k>) -> Expr<'k> {
    let bits = word.bits() / lanes;
    let of = |lane: usize| word.slice(lane * bits, bits);
    let pair = |first: usize| lane.at(0).mux(of(first + 1), of(first));
    match lanes {
        1 => of(0),
        2 => pair(0),
        _ => lane.at(1).mux(pair(2), pair(0)),
    }
}

impl Block for QuadAddress {
    fn build<'k>(&self, k: &'k Builder, io: QuadAddressPorts<Inside<'k>>) {
        let Places { cases, frame_quads, lanes } = &self.places;
        let (address_bits, part_bits) = (count_bits(*frame_quads), io.part.bits());
        let place = |&(layout, grid): &(Quads, Grid)| {
            let part = match grid.rows * grid.cols {
                1 => k.constant(part_bits, 0),
                _ => (times(k, io.part_row, grid.cols, part_bits) + io.part_col).resize(part_bits),
            };
            let first = times(k, part, layout.len(), address_bits);
            let place = Place::of(k, layout, [io.row, io.col]);
            (part, quad_address_of(k, layout, place.near, first), place)
        };
        let places: Vec<(Expr, Expr, Place)> = cases.iter().map(place).collect();
        let chosen = |of: for<'p> fn(&(Expr<'p>, Expr<'p>, Place<'p>)) -> Expr<'p>, bits: usize| {
            let each: Vec<Expr> = places.iter().map(of).collect();
            expression_by_case(io.case_index, &each).unwrap_or(k.constant(bits, 0))
        };
        let quad = chosen(|(_, address, _)| *address, address_bits);
        let (lower, right) = (chosen(|(.., place)| place.lower, 1), chosen(|(.., place)| place.right, 1));
        // The lane of the quad is the index of the word in it, followed by the lane of the word.
        io.address.set(match lanes {
            1 => quad.concat(lower).concat(right),
            2 => quad.concat(lower),
            _ => quad,
        });
        io.part.set(chosen(|(part, ..)| *part, part_bits));
        let (lower, right) = (k.wire("lower", lower), k.wire("right", right));
        let both_rows = k.wire("both_rows", chosen(|(.., place)| place.both_rows, 1));
        let both_cols = k.wire("both_cols", chosen(|(.., place)| place.both_cols, 1));
        io.lane.set(match lanes {
            1 => k.constant(2, 0),
            2 => right.extend(2),
            _ => lower.concat(right),
        });
        let (rows, cols) = ([lower | both_rows, !lower | both_rows], [right | both_cols, !right | both_cols]);
        io.mask.set(concat(&[rows[0] & cols[0], rows[0] & cols[1], rows[1] & cols[0], rows[1] & cols[1]]));
    }
}

/// For line `at` of `count`: whether it is in the second half, its image in the first half, whether it is in the middle.
fn fold<'k>(k: &'k Builder, at: Expr<'k>, count: usize) -> (Expr<'k>, Expr<'k>, Expr<'k>) {
    let number = |value: usize| k.constant(at.bits(), value as u64);
    let beyond = number((count - 1) / 2).less(at);
    let near = beyond.mux((number(count - 1) - at).low(at.bits()), at);
    let middle = if count % 2 == 1 { at.equals(number(count / 2)) } else { k.constant(1, 0) };
    (beyond, near, middle)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::kernel_of;
    use crate::language::testbench::{check, Pipeline};
    use crate::wire::Word;

    #[test]
    fn taxels_are_placed_as_in_the_layout() {
        for (sizes, grids) in
            [(vec![(8, 8)], vec![(1, 1)]), (vec![(5, 7), (10, 7), (5, 14)], vec![(2, 3), (1, 3), (2, 1)])]
        {
            let cases: Vec<(Quads, Grid)> = sizes
                .iter()
                .zip(&grids)
                .map(|(&(rows, cols), &grid)| (Quads { rows, cols }, Grid { rows: grid.0, cols: grid.1 }))
                .collect();
            let largest = |of: fn(&(Quads, Grid)) -> usize| cases.iter().map(of).max().unwrap();
            let frame = largest(|(layout, grid)| layout.len() * grid.rows * grid.cols);
            for lanes in [4, 2, 1] {
                let mirror = QuadAddress { places: Places { cases: cases.clone(), frame_quads: frame, lanes } };
                let mut random = fastrand::Rng::with_seed(20);
                let mut taxel = || {
                    let case_index = random.usize(..cases.len());
                    let (layout, grid) = cases[case_index];
                    let limits = [layout.rows, layout.cols, grid.rows, grid.cols];
                    let place = limits.map(|limit| Word::from(random.u64(..limit as u64)));
                    [Word::from(case_index as u64)].into_iter().chain(place).collect()
                };
                let stimulus: Vec<Vec<Word>> = (0..20000).map(|_| taxel()).collect();
                let of = |inputs: &[Word]| {
                    let [case_index, row, col, part_row, part_col] =
                        [0, 1, 2, 3, 4].map(|k| inputs[k].number() as usize);
                    let (layout, grid) = cases[case_index];
                    let (place, part) = (layout.locate(row, col), part_row * grid.cols + part_col);
                    let taxel = 4 * (part * layout.len() + place.address) + place.lane;
                    let mask = usize::from(place.mask);
                    [taxel / lanes, part, taxel % lanes, mask].map(|value| Some(Word::from(value as u64))).into()
                };
                check(&kernel_of(&mirror), &stimulus, &mut Pipeline::new(0, 4, of));
            }
        }
    }
}
