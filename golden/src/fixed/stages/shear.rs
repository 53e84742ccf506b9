//! Stage `shear`: p times the μ of each taxel's contact, the operands of the next step of `relax`.
//!
//! ```text
//! operand of p ── butterfly, rounded by 4 ── times μ1 of the contact ── butterfly ── operand for Ax
//!                                        └── times μ2 of the contact ── butterfly ── operand for Ay
//! ```
//! μ is the position in mu_max/384 over 512, as for one contact; a taxel of no contact has none. The butterfly is that of
//! `fold`, unnormalised: without a μ, both together return the operand. What does not fit is saturated and counted.

use super::pass::{times, Vector};
use crate::estimate::segment::NONE;
use crate::fixed::words::arith::{round_shift, saturate};
use crate::fixed::words::formats::Formats;
use crate::physics::symmetry::parity::hadamard;

/// Cycles from the cycle in which all quads of p are there to the first operand.
pub const LATENCY: u64 = 9;

/// Cycles from that cycle to the last operand of an array of `quads` quads, one operand per cycle.
pub fn cycles(quads: usize) -> u64 {
    LATENCY + 2 * quads as u64 - 1
}

/// Right shift from the sum of four parities to their mean.
pub const MEAN: u32 = 2;

/// The operands for Ax and Ay from those of p, and how many words were saturated; `labels` has the contact of each lane of a
/// quad, `positions` the μ of each contact, the first of which is number 1.
pub fn shear(formats: &Formats, p: &[[i64; 4]], labels: &[[usize; 4]], positions: &[[i64; 2]]) -> ([Vector; 2], u32) {
    let mut saturations = 0;
    let position = |label: usize| if label == NONE { [0; 2] } else { positions[label - 1] };
    let operands = [0, 1].map(|axis| {
        let of = |(quad, labels): (&[i64; 4], &[usize; 4])| {
            let taxels = hadamard(*quad).map(|sum| round_shift(sum, MEAN));
            let sheared = std::array::from_fn(|lane| times(taxels[lane], position(labels[lane])[axis]));
            hadamard(sheared).map(|sum| {
                let (word, clipped) = saturate(sum, formats.data_bits);
                saturations += u32::from(clipped);
                word
            })
        };
        p.iter().zip(labels).map(of).collect()
    });
    (operands, saturations)
}

#[cfg(test)]
mod tests {
    use super::super::pass::scaled;
    use super::*;
    use crate::spec::scene::Scene;
    use proptest::prelude::*;
    use std::sync::LazyLock;

    static FORMATS: LazyLock<Formats> = LazyLock::new(|| {
        crate::fixed::Model::new(&Scene::builtin("sensor-1-noisy").unwrap()).unwrap().formats().clone()
    });

    #[test]
    fn each_taxel_has_the_mu_of_its_contact() {
        let formats = &*FORMATS;
        // Taxels 1000, -400, 0, 40 as the operand that `fold` makes of them.
        let p = [hadamard([1000, -400, 0, 40])];
        let (operands, saturations) = shear(formats, &p, &[[1, 2, 0, 2]], &[[384, 0], [-256, 128]]);
        // The parities are four times the mean's, and 384/512 of 1000 is 750.
        assert_eq!(operands[0], [hadamard([750, 200, 0, -20])]);
        assert_eq!((&operands[1], saturations), (&vec![hadamard([0, -100, 0, 10])], 0));
        let large = 1 << (formats.data_bits - 1);
        let (operands, saturations) = shear(formats, &[[large - 1, 0, 0, 0]], &[[1; 4]], &[[384; 2]]);
        assert_eq!((operands[0][0][0], saturations), (3 * large / 4, 0));
        let (operands, saturations) = shear(formats, &[[large - 1; 4]], &[[1, 0, 0, 0]], &[[384; 2]]);
        assert_eq!((operands[1][0], saturations), ([3 * large / 4 - 1; 4], 0));
        // Contacts that pull against each other: half the word on each taxel, all of one sign after μ.
        let [a, b] = [large - 1, 1 - large];
        let (operands, saturations) = shear(formats, &[[a, a, a, b]], &[[1, 1, 1, 2]], &[[384; 2], [-384; 2]]);
        assert_eq!((operands[0][0][0], saturations), (large - 1, 2));
    }

    proptest! {
        /// With one μ for all taxels the operands are those of p times μ, up to rounding.
        #[test]
        fn one_mu_for_all_is_that_of_one_contact(
            quad in prop::array::uniform4(-30_000i64..30_000),
            position in prop::array::uniform2(-384i64..=384),
        ) {
            let ([x, y], _) = shear(&FORMATS, &[quad], &[[1; 4]], &[position]);
            for (own, position) in [x[0], y[0]].into_iter().zip(position) {
                let wanted = scaled(quad, position);
                prop_assert!((0..4).all(|k| (own[k] - wanted[k]).abs() <= 6), "{own:?} {wanted:?}");
            }
        }
    }
}
