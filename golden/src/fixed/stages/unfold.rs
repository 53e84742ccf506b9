//! Stage `unfold`: parity quads of a v_ij back to taxels, in the units of the μ search.
//!
//! The same butterfly as [`fold`](super::fold). It returns four times the taxels' values, so that the exact result has
//! two more bits and an LSB of a quarter: no normalisation is needed. The matrices of the passes hold A·(4/3)·mu_max
//! while the search counts μ in thirds of mu_max, so v_ij is divided by 4^(i+j): a shift, rounded half up.

use crate::fixed::words::arith::round_shift;
use crate::physics::symmetry::parity::hadamard;

/// Unfolds one v_ij of total degree `degree = i + j` from parities to taxels, in quarters of the parities' LSB.
pub fn unfold(parities: &[[i64; 4]], degree: u32) -> Vec<[i64; 4]> {
    parities.iter().map(|&quad| hadamard(quad).map(|value| round_shift(value, 2 * degree))).collect()
}

#[cfg(test)]
mod tests {
    use super::super::fold::fold;
    use super::*;

    #[test]
    fn unfold_of_fold_is_four_times() {
        let quads = [[5, -7, 11, 2]];
        assert_eq!(unfold(&fold(&quads), 0), [[20, -28, 44, 8]]);
        assert_eq!(unfold(&fold(&quads), 1), quads);
    }
}
