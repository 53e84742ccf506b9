//! Stage `normalise`: block floating point on the input.
//!
//! Every code of a subarray is shifted left by the same `s = input_bits − 1 − length(max |c|)`, so that the largest one
//! uses the whole word. The shift is exact; the exponent is kept for [`force`](super::force). A subarray
//! of zeros shifts by `input_bits − 1`, which leaves it zero.

use super::arith::bit_length;

/// The left shift for a subarray whose magnitudes' OR is `magnitude`; 0..=`input_bits − 1`.
pub fn shift(magnitude: u64, input_bits: u32) -> u32 {
    input_bits - 1 - bit_length(magnitude)
}

/// Shifts every quad; the words keep `input_bits` bits.
pub fn normalise(quads: &[[i64; 4]], shift: u32) -> Vec<[i64; 4]> {
    quads.iter().map(|quad| quad.map(|code| code << shift)).collect()
}

#[cfg(test)]
mod tests {
    use super::super::arith::{magnitude_bits, range};
    use super::*;
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
