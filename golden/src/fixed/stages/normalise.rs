//! Stage `normalise`: block floating point on the input.
//!
//! Every code of a subarray is shifted left by the same `s = input_bits − 1 − length(max |c|)`, so that the largest one
//! fills the word. The shift is exact; [`forces`](super::forces) takes the exponent back. For a subarray of zeros the
//! shift is `input_bits − 1`, without effect.

use crate::fixed::words::arith::bit_length;

/// The left shift, 0 to `input_bits − 1`, for a subarray; `magnitude` is the OR of its codes'
/// [`magnitude_bits`](crate::fixed::words::arith::magnitude_bits).
pub fn shift(magnitude: u64, input_bits: u32) -> u32 {
    input_bits - 1 - bit_length(magnitude)
}

/// Shifts every code left by `shift`; the words stay `input_bits` wide.
pub fn normalise<T: Copy + Into<i64>>(quads: &[[T; 4]], shift: u32) -> Vec<[i64; 4]> {
    quads.iter().map(|quad| quad.map(|code| code.into() << shift)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixed::words::arith::{magnitude_bits, range};
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_largest_code_fills_the_word(codes in prop::array::uniform4(-(1i64 << 19)..(1i64 << 19))) {
            let magnitude = codes.iter().fold(0, |m, &c| m | magnitude_bits(c));
            let [quad] = normalise(&[codes], shift(magnitude, 20))[..] else { unreachable!() };
            let (low, high) = range(20);
            prop_assert!(quad.iter().all(|&c| (low..=high).contains(&c)));
            prop_assert!(magnitude == 0 || quad.iter().any(|&c| magnitude_bits(c) >> 18 == 1));
        }
    }
}
