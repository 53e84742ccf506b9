//! Parities: a quad is even or odd under each of the two mirrors.
//!
//! A parity has one bit per mirror, [`FLIP_X`] for left to right and [`FLIP_Y`] for top to bottom; a bit is set where
//! the entry changes its sign under the mirror. A matrix that commutes with the mirrors up to a sign takes an entry of
//! parity p to one of parity p XOR flip.

use std::ops::{Add, Sub};

use crate::spec::quads::Quads;

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

/// The four-point Hadamard butterfly `f_p = Σ_l (−1)^{p·l} x_l`, unnormalised: the words grow by two bits.
///
/// Index `2·(row bit) + (column bit)`: on input the images of a taxel under the two mirrors, on output the parities.
/// Applied twice it multiplies by four, which [`unfold`](crate::fixed::stages::unfold) takes into account.
pub fn hadamard<T: Copy + Add<Output = T> + Sub<Output = T>>(x: [T; 4]) -> [T; 4] {
    let [a, b, c, d] = x;
    [a + b + c + d, a - b + c - d, a + b - c - d, a - b - c + d]
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_transform_by_hand() {
        assert_eq!(hadamard([1, 2, 3, 4]), [10, -2, -4, 0]);
    }

    proptest! {
        #[test]
        fn hadamard_twice_is_four_times(x in prop::array::uniform4(-(1i64 << 30)..(1i64 << 30))) {
            prop_assert_eq!(hadamard(hadamard(x)), x.map(|v| 4 * v));
        }
    }
}
