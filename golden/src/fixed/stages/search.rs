//! Stage `search`: the (μ1, μ2) that maximise the sparse objective, without a multiplier.
//!
//! Grid coordinates count μ in thirds of mu_max, so the coarse grid is the integers of the disc x² + y² ≤ 9. The
//! polynomial `p(x, y) = Σ w_ij x^i y^j` of every taxel is kept about a moving centre: a step of ±1 is a Taylor shift
//! (additions only), halving the step divides w_ij by 2^(i+j), floored. One sweep over the taxels shifts, evaluates the
//! nine candidates of the 3×3 about the new centre and adds up
//! ```text
//! score = Σ_taxels log2(|p| + ⌊Σp / 2^20⌋) − n log2 Σp        (−Π; the smallest wins)
//! ```
//! with Σp from the sum of the polynomials, shifted alongside. Eight sweeps visit the coarse tiles that cover the disc,
//! seven halve the step. Candidates outside the disc or with Σp ≤ 0 are never chosen. Of candidates with equal scores,
//! the coarse grid chooses the first in row-major order, a halving the centre, then the first in row-major order.

use std::sync::OnceLock;

use crate::fixed::words::arith::bit_length;
use crate::fixed::words::formats::{EPSILON_SHIFT, HALVINGS, LOG_FRACTION, LOG_TABLE_BITS};
use crate::fixed::words::schedule::EXPONENTS;
use crate::spec::quads::Quads;

/// Centres of the coarse tiles: each a diagonal step from the one before, all 29 points of the disc within reach of ±1.
pub const COARSE_CENTRES: [[i32; 2]; 8] = [[1, 1], [0, 2], [-1, 1], [-2, 0], [-1, -1], [0, -2], [1, -1], [2, 0]];

/// Coefficients of one taxel's polynomial in LSBs, in the order of [`EXPONENTS`]; those beyond the degree are zero.
pub type Polynomial = [i64; 10];

/// Index of the centre among the nine candidates, which are row-major: `3·(y + 1) + (x + 1)`.
pub const CENTRE: usize = 4;

/// The best candidate so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Best {
    /// Position in grid steps of the sweep's level, from μ = 0.
    pub position: [i32; 2],
    /// Score in LSBs of 2^−`LOG_FRACTION` bit.
    pub score: i64,
    /// Whether a candidate has been chosen, in the coarse grid or at this level.
    pub taken: bool,
}

/// Result of the search in one subarray.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SearchResult {
    /// The best candidate after each sweep; empty if the search was skipped.
    pub sweeps: Vec<Best>,
    /// μ* in units of mu_max / (3·2^7).
    pub position: [i32; 2],
    /// Score at μ*, `None` if the search was skipped or no candidate was admissible.
    pub score: Option<i64>,
    /// p(μ*) of each quad, in search LSBs.
    pub values: Vec<[i64; 4]>,
}

/// The polynomials of a subarray about one centre.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Block {
    /// One polynomial per quad and lane.
    pub taxels: Vec<[Polynomial; 4]>,
    /// Sum of the polynomials, each taxel counted once.
    pub sum: Polynomial,
}

impl Block {
    /// Sums the polynomials of a subarray; μ = 0 is their centre.
    pub fn new(layout: Quads, taxels: Vec<[Polynomial; 4]>) -> Self {
        let mut sum = [0; 10];
        for (address, quad) in taxels.iter().enumerate() {
            for (lane, w) in quad.iter().enumerate() {
                if layout.lane_mask(address) >> lane & 1 == 1 {
                    sum.iter_mut().zip(w).for_each(|(s, w)| *s += w);
                }
            }
        }
        Block { taxels, sum }
    }

    /// Moves the centre by `by` (each −1, 0 or 1), then halves the grid step if `halving`.
    fn step(&mut self, by: [i32; 2], halving: bool) {
        for w in self.taxels.iter_mut().flatten().chain([&mut self.sum]) {
            *w = taylor_shift(w, i64::from(by[0]), i64::from(by[1]));
            if halving {
                *w = halve(w);
            }
        }
    }

    /// Scores of the nine candidates about the centre, `None` where Σp ≤ 0.
    fn scores(&self, layout: Quads) -> [Option<i64>; 9] {
        let sums = candidates(&self.sum);
        let mut totals = [0; 9];
        for (address, quad) in self.taxels.iter().enumerate() {
            for (lane, w) in quad.iter().enumerate() {
                if layout.lane_mask(address) >> lane & 1 == 1 {
                    let values = candidates(w);
                    for k in 0..9 {
                        totals[k] += log2(values[k].abs() + (sums[k].max(0) >> EPSILON_SHIFT));
                    }
                }
            }
        }
        let taxels = (layout.rows * layout.cols) as i64;
        std::array::from_fn(|k| (sums[k] > 0).then(|| totals[k] - taxels * log2(sums[k])))
    }
}

/// log2 of `x` with [`LOG_FRACTION`] fraction bits: the position of the leading one, and a table over the next
/// [`LOG_TABLE_BITS`] bits whose entries are the logarithms at the middle of their cells. 0 counts as 1.
pub fn log2(x: i64) -> i64 {
    let x = x.max(1);
    let length = bit_length(x as u64);
    let fraction = ((x as u64) << (64 - length)) << 1;
    let cell = (fraction >> (64 - LOG_TABLE_BITS)) as usize;
    (i64::from(length - 1) << LOG_FRACTION) + log_table()[cell]
}

/// Table of the logarithm: `round(2^F log2(1 + (m + 1/2) / 2^T))`.
pub fn log_table() -> &'static [i64] {
    static TABLE: OnceLock<Vec<i64>> = OnceLock::new();
    TABLE.get_or_init(|| {
        let cells = 1u32 << LOG_TABLE_BITS;
        let middle = |m: u32| (f64::from(m) + 0.5) / f64::from(cells);
        (0..cells).map(|m| ((1.0 + middle(m)).log2() * f64::from(1u32 << LOG_FRACTION)).round() as i64).collect()
    })
}

/// The polynomial about a centre moved by (`dx`, `dy`), each −1, 0 or 1: exact, additions only.
pub fn taylor_shift(w: &Polynomial, dx: i64, dy: i64) -> Polynomial {
    let along = |c: [i64; 4], d: i64| {
        [c[0] + d * c[1] + d * d * c[2] + d * c[3], c[1] + 2 * d * c[2] + 3 * d * d * c[3], c[2] + 3 * d * c[3], c[3]]
    };
    // Index of w_ij by rows of equal j.
    let [w00, w10, w01, w20, w11, w02, w30, w21, w12, w03] = *w;
    let [w00, w10, w20, w30] = along([w00, w10, w20, w30], dx);
    let [w01, w11, w21, _] = along([w01, w11, w21, 0], dx);
    let [w02, w12, _, _] = along([w02, w12, 0, 0], dx);
    let [w00, w01, w02, w03] = along([w00, w01, w02, w03], dy);
    let [w10, w11, w12, _] = along([w10, w11, w12, 0], dy);
    let [w20, w21, _, _] = along([w20, w21, 0, 0], dy);
    [w00, w10, w01, w20, w11, w02, w30, w21, w12, w03]
}

/// The polynomial for half the grid step: w_ij / 2^(i+j), floored.
pub fn halve(w: &Polynomial) -> Polynomial {
    std::array::from_fn(|k| w[k] >> (EXPONENTS[k].0 + EXPONENTS[k].1))
}

/// p at the nine candidates about the centre, row-major.
pub fn candidates(w: &Polynomial) -> [i64; 9] {
    let [w00, w10, w01, w20, w11, w02, w30, w21, w12, w03] = *w;
    std::array::from_fn(|k| {
        let (x, y) = ((k % 3) as i64 - 1, (k / 3) as i64 - 1);
        let row0 = w00 + x * (w10 + w30) + x * x * w20;
        let row1 = w01 + x * w11 + x * x * w21;
        let row2 = w02 + x * w12;
        row0 + y * (row1 + w03) + y * y * row2
    })
}

/// Whether grid position `p` at `level` halvings lies in the disc of radius mu_max.
pub fn in_disc(p: [i32; 2], level: u32) -> bool {
    let radius = 3i64 << level;
    i64::from(p[0]).pow(2) + i64::from(p[1]).pow(2) <= radius * radius
}

/// Searches for μ* from `start`, whose centre is μ = 0; without `enabled` only p(0) is returned.
pub fn search(layout: Quads, start: Block, enabled: bool) -> SearchResult {
    let mut best = Best::default();
    let mut kept = start.clone();
    let mut kept_centre = [0, 0];
    let mut sweeps = Vec::new();
    let mut found = false;
    if enabled {
        let mut current = start;
        let mut centre = [0, 0];
        for tile in COARSE_CENTRES {
            current.step(difference(tile, centre), false);
            centre = tile;
            if take(&mut best, current.scores(layout), centre, 0, true) {
                kept.clone_from(&current);
                kept_centre = centre;
            }
            sweeps.push(best);
        }
        found = best.taken;
        for level in 1..=HALVINGS {
            kept.step(difference(best.position, kept_centre), true);
            kept_centre = best.position.map(|p| 2 * p);
            best = Best { position: kept_centre, taken: false, ..best };
            if found {
                take(&mut best, kept.scores(layout), kept_centre, level, false);
            }
            sweeps.push(best);
        }
    }
    kept.step(difference(best.position, kept_centre), false);
    SearchResult {
        sweeps,
        position: best.position,
        score: found.then_some(best.score),
        values: kept.taxels.iter().map(|quad| quad.map(|w| w[0])).collect(),
    }
}

fn difference(to: [i32; 2], from: [i32; 2]) -> [i32; 2] {
    [to[0] - from[0], to[1] - from[1]]
}

/// Replaces `best` by the best of the nine candidates about `centre` if that is better; returns whether it did.
fn take(best: &mut Best, scores: [Option<i64>; 9], centre: [i32; 2], level: u32, coarse: bool) -> bool {
    let mut changed = false;
    // After a halving the centre is compared first, so that it wins ties.
    let order = if coarse { [0, 1, 2, 3, 4, 5, 6, 7, 8] } else { [4, 0, 1, 2, 3, 5, 6, 7, 8] };
    for k in order {
        let position = [centre[0] + k % 3 - 1, centre[1] + k / 3 - 1];
        let Some(score) = scores[k as usize].filter(|_| in_disc(position, level)) else { continue };
        let earlier = coarse && (position[1], position[0]) < (best.position[1], best.position[0]);
        if !best.taken || score < best.score || (score == best.score && earlier) {
            *best = Best { position, score, taken: true };
            changed = true;
        }
    }
    changed
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn direct(w: &Polynomial, x: i64, y: i64) -> i64 {
        (0..10).map(|k| w[k] * x.pow(EXPONENTS[k].0) * y.pow(EXPONENTS[k].1)).sum()
    }

    #[test]
    fn the_tiles_cover_the_disc_in_diagonal_steps() {
        let mut at = [0, 0];
        let mut covered = std::collections::HashSet::new();
        for tile in COARSE_CENTRES {
            let step = difference(tile, at);
            assert!(step.iter().all(|d| d.abs() <= 1), "{step:?}");
            at = tile;
            covered.extend((-1..=1).flat_map(|y| (-1..=1).map(move |x| [tile[0] + x, tile[1] + y])));
        }
        let disc = (-3..=3).flat_map(|y| (-3..=3).map(move |x| [x, y])).filter(|&p| in_disc(p, 0));
        assert_eq!(disc.clone().count(), 29);
        assert!(disc.into_iter().all(|p| covered.contains(&p)));
    }

    #[test]
    fn logarithms_by_hand() {
        assert_eq!(log2(0), log2(1));
        // 1 stands for the cell 1 … 1 + 1/16, of which the table holds the middle: 2^6 log2(1 + 1/32) = 2.84.
        assert_eq!(log2(1), 3);
        assert_eq!(log2(1 << 20), 20 * 64 + 3);
    }

    proptest! {
        /// Moving the centre is exact: the shifted polynomial is the old one about the new centre.
        #[test]
        fn taylor_shift_is_exact(w in prop::array::uniform10(-(1i64 << 24)..(1i64 << 24)), dx in -1i64..=1, dy in -1i64..=1) {
            let moved = taylor_shift(&w, dx, dy);
            for (x, y) in [(0, 0), (2, 1), (-3, 2), (1, -1)] {
                prop_assert_eq!(direct(&moved, x, y), direct(&w, x + dx, y + dy));
            }
        }

        #[test]
        fn candidates_are_the_polynomial(w in prop::array::uniform10(-(1i64 << 24)..(1i64 << 24))) {
            let values = candidates(&w);
            for (k, &value) in values.iter().enumerate() {
                prop_assert_eq!(value, direct(&w, (k % 3) as i64 - 1, (k / 3) as i64 - 1));
            }
        }

        /// Halving floors each of the nine non-constant terms: p at ±1 about the centre differs by at most nine LSBs
        /// from p at ±1/2.
        #[test]
        fn halving_is_within_its_guard(w in prop::array::uniform10(-(1i64 << 24)..(1i64 << 24)), x in -1i64..=1, y in -1i64..=1) {
            let exact: f64 = (0..10)
                .map(|k| w[k] as f64 * (x as f64 / 2.0).powi(EXPONENTS[k].0 as i32) * (y as f64 / 2.0).powi(EXPONENTS[k].1 as i32))
                .sum();
            prop_assert!((direct(&halve(&w), x, y) as f64 - exact).abs() <= 9.0);
        }

        /// The table's logarithm is within half a cell: log2(1 + 1/16) / 2 plus rounding.
        #[test]
        fn logarithm_is_within_half_a_cell(x in 64i64..(1i64 << 50)) {
            let error = log2(x) as f64 / 64.0 - (x as f64).log2();
            prop_assert!(error.abs() <= (1.0f64 + 1.0 / 16.0).log2() / 2.0 + 1.0 / 64.0, "{error}");
        }
    }

    #[test]
    fn nothing_is_taken_without_compression() {
        let layout = Quads { rows: 2, cols: 2 };
        let tension = Block::new(layout, vec![[[-1000, 3, 4, 0, 0, 0, 0, 0, 0, 0]; 4]]);
        let found = search(layout, tension, true);
        assert_eq!((found.position, found.score), ([0, 0], None));
        assert_eq!(found.values, vec![[-1000; 4]]);
    }
}
