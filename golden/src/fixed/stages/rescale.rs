//! Stage `rescale`: accumulators to v_ij words, with one exponent per subarray.
//!
//! The bit length of the largest |raw v_00| of the subarray sets the shift that brings v_00 to a full `vector_bits`
//! word; the shift after an A pass is constant. Each word is rounded once and saturated once; saturations are counted.
//! The operands of the next passes are the same words, 4 bits shorter: rounded, and clamped where rounding would exceed
//! the word (an error of one LSB at most, not counted).

use super::pass::Vector;
use crate::fixed::words::arith::{bit_length, magnitude_bits, round_shift, saturate};
use crate::fixed::words::formats::{Formats, SEARCH_EXTRA_BITS};

/// Bit length of the largest raw v_00 of a subarray.
pub fn raw_length(raw: &[[i64; 4]]) -> u32 {
    bit_length(raw.iter().flatten().fold(0, |seen, &acc| seen | magnitude_bits(acc)))
}

/// Right shift from a raw v_00 of `raw_length` bits to the full length of a word.
pub fn shift(formats: &Formats, raw_length: u32) -> u32 {
    raw_length.saturating_sub(formats.full_length())
}

/// Shifts accumulators right by `shift`, rounds and saturates; returns the words and how many saturated.
pub fn rescale(formats: &Formats, accumulators: &[[i64; 4]], shift: u32) -> (Vector, u32) {
    let mut saturations = 0;
    let words = accumulators
        .iter()
        .map(|quad| {
            quad.map(|acc| {
                let (word, clipped) = saturate(round_shift(acc, shift), formats.vector_bits);
                saturations += u32::from(clipped);
                word
            })
        })
        .collect();
    (words, saturations)
}

/// The operands of the next passes: v_ij words rounded to `data_bits`.
pub fn operand(formats: &Formats, words: &[[i64; 4]]) -> Vector {
    words.iter().map(|quad| quad.map(|w| saturate(round_shift(w, SEARCH_EXTRA_BITS), formats.data_bits).0)).collect()
}
