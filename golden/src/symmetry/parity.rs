//! Parities: a quad is even or odd under each of the two mirrors.
//!
//! A parity has one bit per mirror, [`FLIP_X`] for left to right and [`FLIP_Y`] for top to bottom; a bit is set where
//! the entry changes its sign under the mirror. A matrix that commutes with the mirrors up to a sign takes an entry of
//! parity p to one of parity p XOR flip.

use super::quads::Quads;

/// Bit of the column parity, which Ax flips.
pub const FLIP_X: usize = 1;
/// Bit of the row parity, which Ay flips.
pub const FLIP_Y: usize = 2;

/// Whether quad `index` has an entry of `parity`: odd parities vanish on the middle line of their mirror.
pub fn has_entry(quads: Quads, index: usize, parity: usize) -> bool {
    let counts = quads.lane_mask(index);
    let own_column = counts & 0b0010 != 0;
    let own_row = counts & 0b0100 != 0;
    (own_column || parity & FLIP_X == 0) && (own_row || parity & FLIP_Y == 0)
}

/// Sign of image `lane` in `parity`: (−1)^(parity·lane).
pub fn sign(parity: usize, lane: usize) -> f64 {
    if (parity & lane).count_ones().is_multiple_of(2) {
        1.0
    } else {
        -1.0
    }
}
