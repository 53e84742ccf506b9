//! Quad address and lane of a taxel.

use dermis_golden::fixed::CasePlan;
use dermis_golden::spec::partition::Grid;
use dermis_golden::spec::quads::Quads;
use rust_hdl::prelude::*;

use crate::kernel_block;
use crate::language::{concat, Body, Builder, Expr, Kernel};
use crate::primitives::address::case_counter::{expression_by_case, largest};
use crate::primitives::address::constant_product::times;
use crate::primitives::address::counter::count_bits;
use crate::wire::Wire;

/// Row and column of a taxel in its subarray, and of the subarray in the array, to address, lane and write mask;
/// combinational. Subarrays follow each other row-major, each with all its quads. A taxel on the middle line of an odd
/// count is written to several lanes. A memory word holds the four lanes of a quad or, where it holds fewer, the lanes of a
/// quad follow one another.
#[derive(dermis_hdl_derive::Block)]
pub struct QuadAddress {
    /// Index of the case; valid with `row`.
    pub which: Wire<In>,
    /// Row of the taxel in its subarray; taken in the same cycle.
    pub row: Wire<In>,
    /// Column of the taxel in its subarray; valid with `row`.
    pub col: Wire<In>,
    /// Row of the subarray in the grid of subarrays; valid with `row`.
    pub part_row: Wire<In>,
    /// Column of the subarray in the grid; valid with `row`.
    pub part_col: Wire<In>,
    /// Address of the word, over all subarrays; combinational.
    pub address: Wire<Out>,
    /// Index of the subarray, row-major; combinational.
    pub part: Wire<Out>,
    /// Lane of the word that the taxel is read from, 2 bits, of a whole quad `{lower half, right half}`; combinational.
    pub lane: Wire<Out>,
    /// Lanes the taxel is written to, one bit each; combinational.
    pub mask: Wire<Out>,
    kernel: Body,
}

kernel_block!(QuadAddress, inputs [which, row, col, part_row, part_col], outputs [address, part, lane, mask]);

impl QuadAddress {
    /// For the layout and the grid of each of `cases`, with `lanes` lanes in a memory word.
    pub fn new(cases: &[CasePlan], lanes: usize) -> Self {
        let places: Vec<(Quads, Grid)> = cases.iter().map(|case| (case.layout(), case.grid())).collect();
        QuadAddress::of(&places, frame_quads(cases), lanes)
    }

    fn of(cases: &[(Quads, Grid)], frame_quads: usize, lanes: usize) -> Self {
        let wire =
            |of: fn(&(Quads, Grid)) -> usize| Wire::new(count_bits(largest(&cases.iter().map(of).collect::<Vec<_>>())));
        let parts = cases.iter().map(|(_, grid)| grid.rows * grid.cols).max().unwrap_or(1);
        let block = QuadAddress {
            which: Wire::new(count_bits(cases.len())),
            part_row: wire(|(_, grid)| grid.rows),
            part_col: wire(|(_, grid)| grid.cols),
            part: Wire::new(count_bits(parts)),
            row: wire(|(layout, _)| layout.rows),
            col: wire(|(layout, _)| layout.cols),
            address: Wire::new(count_bits(frame_quads * (Quads::LANES / lanes))),
            lane: Wire::new(2),
            mask: Wire::new(4),
            kernel: Body::default(),
        };
        let kernel = block.kernel_of(cases, frame_quads, lanes);
        block.bind(kernel)
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

impl QuadAddress {
    fn kernel_of(&self, cases: &[(Quads, Grid)], frame_quads: usize, lanes: usize) -> Kernel {
        let k = Builder::combinational("quad_address");
        let which = k.input("which", self.which.width());
        let (row, col) = (k.input("row", self.row.width()), k.input("col", self.col.width()));
        let part = [k.input("part_row", self.part_row.width()), k.input("part_col", self.part_col.width())];
        let (address_bits, part_bits) = (count_bits(frame_quads), self.part.width());
        let place = |&(layout, grid): &(Quads, Grid)| {
            let part = match grid.rows * grid.cols {
                1 => k.constant(part_bits, 0),
                _ => (times(&k, part[0], grid.cols, part_bits) + part[1]).resize(part_bits),
            };
            let first = times(&k, part, layout.len(), address_bits);
            let place = Place::of(&k, layout, [row, col]);
            (part, quad_address_of(&k, layout, place.near, first), place)
        };
        let places: Vec<(Expr, Expr, Place)> = cases.iter().map(place).collect();
        let chosen = |of: for<'k> fn(&(Expr<'k>, Expr<'k>, Place<'k>)) -> Expr<'k>, bits: usize| {
            let each: Vec<Expr> = places.iter().map(of).collect();
            expression_by_case(which, &each).unwrap_or(k.constant(bits, 0))
        };
        let quad = chosen(|(_, address, _)| *address, address_bits);
        let (lower, right) = (chosen(|(.., place)| place.lower, 1), chosen(|(.., place)| place.right, 1));
        // The lane of the quad is the index of the word in it, followed by the lane of the word.
        let address = match lanes {
            1 => quad.concat(lower).concat(right),
            2 => quad.concat(lower),
            _ => quad,
        };
        k.wire("address", address);
        k.wire("part", chosen(|(part, ..)| *part, part_bits));
        let (lower, right) = (k.wire("lower", lower), k.wire("right", right));
        let both_rows = k.wire("both_rows", chosen(|(.., place)| place.both_rows, 1));
        let both_cols = k.wire("both_cols", chosen(|(.., place)| place.both_cols, 1));
        let lane = match lanes {
            1 => k.constant(2, 0),
            2 => right.extend(2),
            _ => lower.concat(right),
        };
        k.wire("lane", lane);
        let (rows, cols) = ([lower | both_rows, !lower | both_rows], [right | both_cols, !right | both_cols]);
        k.wire("mask", concat(&[rows[0] & cols[0], rows[0] & cols[1], rows[1] & cols[0], rows[1] & cols[1]]));
        k.finish()
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
                let mirror = QuadAddress::of(&cases, frame, lanes);
                let mut random = fastrand::Rng::with_seed(20);
                let mut taxel = || {
                    let which = random.usize(..cases.len());
                    let (layout, grid) = cases[which];
                    let limits = [layout.rows, layout.cols, grid.rows, grid.cols];
                    let place = limits.map(|limit| Word::from(random.u64(..limit as u64)));
                    [Word::from(which as u64)].into_iter().chain(place).collect()
                };
                let stimulus: Vec<Vec<Word>> = (0..20000).map(|_| taxel()).collect();
                let of = |inputs: &[Word]| {
                    let [which, row, col, part_row, part_col] = [0, 1, 2, 3, 4].map(|k| inputs[k].number() as usize);
                    let (layout, grid) = cases[which];
                    let (place, part) = (layout.locate(row, col), part_row * grid.cols + part_col);
                    let taxel = 4 * (part * layout.len() + place.address) + place.lane;
                    let mask = usize::from(place.mask);
                    [taxel / lanes, part, taxel % lanes, mask].map(|value| Some(Word::from(value as u64))).into()
                };
                check(mirror.kernel.kernel(), &stimulus, &mut Pipeline::new(0, 4, of));
            }
        }
    }
}
