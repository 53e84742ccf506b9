//! Stage `fold`: quads of mirror images to quads of parities.
//!
//! One butterfly per quad, unnormalised: `input_bits` in, `input_bits + 2` out. The two bits are exact growth: nothing
//! is rounded and nothing overflows. Only the even-even sum reaches −4·2^(input_bits − 1), which fits.

use crate::physics::symmetry::parity::hadamard;

/// Folds quads of normalised codes, `input_bits` wide, into quads of parities, `input_bits + 2` wide.
pub fn fold(quads: &[[i64; 4]]) -> Vec<[i64; 4]> {
    quads.iter().map(|&quad| hadamard(quad)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_symmetric_quad_has_only_the_even_parity() {
        assert_eq!(fold(&[[3, 3, 3, 3]]), [[12, 0, 0, 0]]);
        let low = -(1 << 19);
        assert_eq!(fold(&[[low; 4]])[0][0], -(1 << 21));
    }
}
