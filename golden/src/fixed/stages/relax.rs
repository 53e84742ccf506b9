//! Stage `relax`: p(μ) at the μ of the network, by fixed-point steps with the matrices of the passes.
//!
//! ```text
//! p ← v_00 − (μ1 Ax + μ2 Ay) p        from p = v_00, as many steps as the polynomial of a search has degrees
//! ```
//! In exact arithmetic this is that polynomial's value. The products take p times μ, the position of μ in mu_max/384 over
//! 512: the matrices hold A·(4/3)·mu_max. Each operand is rounded once, each sum saturated once; saturations are counted.

use super::pass::Vector;
use super::rescale::operand;
use crate::fixed::words::arith::saturate;
use crate::fixed::words::formats::Formats;

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
    use crate::fixed::words::arith::range;

    #[test]
    fn sums_saturate_and_are_counted() {
        let model = crate::fixed::Model::new(&crate::spec::scene::Scene::builtin("sensor-1-noisy").unwrap()).unwrap();
        let formats = model.formats();
        let (least, most) = range(formats.vector_bits);
        let (sums, operands, saturations) = relax(formats, &[[most, least, 32, -7]], &[[1, -1, 15, 7]]);
        assert_eq!((sums, saturations), (vec![[most, least, 47, 0]], 2));
        // Sixteen of a word's LSBs, rounded; the largest word would round beyond the operand.
        assert_eq!(operands, [[range(formats.data_bits).1, range(formats.data_bits).0, 3, 0]]);
    }
}
