//! Stage `relax`: p(μ) at the μ of the network, by fixed-point steps with the matrices of the passes.
//!
//! ```text
//! p ← v_00 − (μ1 Ax + μ2 Ay) p        from p = v_00, as many steps as the polynomial of a search has degrees
//! ```
//! In exact arithmetic this is that polynomial's value. The products take p times μ, the position of μ in mu_max/384 over
//! 512: the matrices hold A·(4/3)·mu_max. Each operand is rounded once, each sum saturated once; saturations are counted.

use super::pass::Vector;
use super::rescale::operand;
use crate::fixed::words::arith::{round_shift, saturate};
use crate::fixed::words::formats::Formats;

/// Right shift of an operand times a position.
pub const POSITION_SHIFT: u32 = 9;

/// An operand times μ.
pub fn scaled(quad: [i64; 4], position: i64) -> [i64; 4] {
    quad.map(|word| round_shift(word * position, POSITION_SHIFT))
}

/// The sum of v_00 and the rescaled products of a step, its operands, and the number of words that saturated.
pub fn relax(formats: &Formats, first: &[[i64; 4]], products: &[[i64; 4]]) -> (Vector, Vector, u32) {
    let mut saturations = 0;
    let sums: Vector = first
        .iter()
        .zip(products)
        .map(|(first, product)| {
            [0, 1, 2, 3].map(|parity| {
                let (word, clipped) = saturate(first[parity] + product[parity], formats.vector_bits);
                saturations += u32::from(clipped);
                word
            })
        })
        .collect();
    let operands = operand(formats, &sums);
    (sums, operands, saturations)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_operand_is_scaled_by_the_position() {
        // 384/512 of the word, half up.
        assert_eq!(scaled([512, -512, 3, -2], 384), [384, -384, 2, -1]);
        assert_eq!(scaled([131_071, 1, 0, 0], -384), [-98_303, -1, 0, 0]);
    }
}
