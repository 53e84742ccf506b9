//! Integer arithmetic of the bit-true model: shifts, rounding and saturation as the hardware does them.
//!
//! All words are two's complement, sign-extended in an `i64`; the widest, an accumulator, has 48 bits. Rounding is
//! *half up*, `⌊x / 2ˢ + 1/2⌋`: one adder in hardware. At exact ties it is biased by half a unit, which is below every
//! error bound used here.

/// Width of the signed word that holds every integer of magnitude `bound` or less, in bits.
///
/// `bound = 2ᵏ` needs k + 2 bits, because +2ᵏ must fit as well.
pub fn signed_bits(bound: u64) -> u32 {
    64 - bound.leading_zeros() + 1
}

/// Smallest and largest value of a signed word of `bits` bits, 1 to 63.
pub fn range(bits: u32) -> (i64, i64) {
    (-(1i64 << (bits - 1)), (1i64 << (bits - 1)) - 1)
}

/// `x / 2^shift`, rounded half up; `shift` 0 to 62, exact for 0.
pub fn round_shift(x: i64, shift: u32) -> i64 {
    if shift == 0 {
        x
    } else {
        ((x >> (shift - 1)) + 1) >> 1
    }
}

/// Clamps `x` to a signed word of `bits` bits; the flag is true if `x` was out of range.
pub fn saturate(x: i64, bits: u32) -> (i64, bool) {
    let (low, high) = range(bits);
    (x.clamp(low, high), x < low || x > high)
}

/// The ones' complement magnitude of `x`: `x` for `x ≥ 0`, `!x` below.
///
/// Its bit length is the number of magnitude bits that `x` needs. The OR of these words over a block therefore gives
/// the length of its largest entry without a comparator. `-2ᵏ` counts as k bits, as it fits a signed word of k + 1.
pub fn magnitude_bits(x: i64) -> u64 {
    (x ^ (x >> 63)) as u64
}

/// Position of the highest set bit plus one, `64 − leading zeros`; 0 for 0.
pub fn bit_length(x: u64) -> u32 {
    64 - x.leading_zeros()
}

#[cfg(test)]
mod tests {
    use super::*;
    use fixed::types::{I18F14, I32F0, I64F64};
    use proptest::prelude::*;

    #[test]
    fn values_by_hand() {
        assert_eq!(round_shift(5, 1), 3);
        assert_eq!(round_shift(-5, 1), -2);
        assert_eq!(round_shift(-6, 2), -1);
        assert_eq!(saturate(200, 8), (127, true));
        assert_eq!(saturate(-128, 8), (-128, false));
        assert_eq!(bit_length(magnitude_bits(-8)), 3);
        assert_eq!(bit_length(magnitude_bits(8)), 4);
        assert_eq!(signed_bits(8), 5);
    }

    /// ⌊x/2ˢ + 1/2⌋ as the `fixed` crate computes it.
    fn rounded(x: i64, shift: u32) -> i64 {
        let half = I64F64::from_num(0.5);
        ((I64F64::from_num(x) >> shift) + half).floor().to_num()
    }

    proptest! {
        /// The `fixed` crate is the oracle for rounding: x/2ˢ + 1/2, floored, exact in 64 fractional bits.
        #[test]
        fn rounding_agrees_with_fixed(x in -(1i64 << 47)..(1i64 << 47), shift in 0u32..=46) {
            prop_assert_eq!(round_shift(x, shift), rounded(x, shift));
        }

        /// Random words are rarely ties, so these are: odd halves, at every shift.
        #[test]
        fn ties_agree_with_fixed(odd in -(1i64 << 16)..(1i64 << 16), shift in 1u32..=46) {
            let x = (2 * odd + 1) << (shift - 1);
            prop_assert_eq!(round_shift(x, shift), rounded(x, shift));
        }

        /// The end of a stage: rounded and saturated to 18 bits between the stages or 32 bits of force. The flag is set
        /// exactly where a word that wraps would not hold the value.
        #[test]
        fn rounding_into_a_word_agrees_with_fixed(x in -(1i64 << 47)..(1i64 << 47), shift in 0u32..=46) {
            let value = rounded(x, shift);
            let data = I18F14::saturating_from_num(value).floor().to_num::<i64>();
            prop_assert_eq!(saturate(round_shift(x, shift), 18), (data, I18F14::overflowing_from_num(value).1));
            let force = I32F0::saturating_from_num(value).to_num::<i64>();
            let wraps = I32F0::wrapping_from_num(value).to_num::<i64>() != value;
            prop_assert_eq!(saturate(round_shift(x, shift), 32), (force, wraps));
        }

        #[test]
        fn the_measured_length_fits(x in any::<i32>()) {
            let bits = bit_length(magnitude_bits(i64::from(x))) + 1;
            prop_assert!(!saturate(i64::from(x), bits).1);
            prop_assert!(bits == 1 || saturate(i64::from(x), bits - 1).1);
        }
    }
}
