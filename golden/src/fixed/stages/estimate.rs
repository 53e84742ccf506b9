//! Stage `estimate`: from the accumulators of a layer to the operands of the next one, and from the last to μ.
//!
//! ```text
//! y = round(acc / 2^shift), in the last layer round(acc / 2^(shift + LAST_SHIFT))
//! hidden layer:  images H y, below 0 → 0, saturated to image_bits; operands H of the images
//! last layer:    position of μ1 from row 0, odd in x; of μ2 from row 0, odd in y; ln σ1, ln σ2 from rows 0, 1, even
//! ```
//! A position outside the disc of mu_max is reduced by 1/32, rounded, up to [`REDUCTIONS`] times. Saturated images and
//! outputs are counted. ln σ is in units of 1/384, σ in units of mu_max.

use super::pass::Vector;
use crate::estimate::learned::LN_SIGMA;
pub use crate::estimate::learned::PLACES as OUTPUTS;
use crate::fixed::words::arith::{round_shift, saturate};
use crate::fixed::words::formats::{Formats, MU_STEPS};
use crate::fixed::words::network::{LAST_SHIFT, OUTPUT_BITS, POSITION_BITS};
use crate::physics::symmetry::parity::hadamard;

/// Times that a position may be reduced; a word of [`POSITION_BITS`] on both axes is in the disc after 22.
pub const REDUCTIONS: usize = 24;
/// Cycles of a reduction in hardware, a power of two: squares, their sum, comparison, reduction.
pub const REDUCTION_CYCLES: usize = 4;
/// Right shift of a position to the amount by which it is reduced.
pub const REDUCTION_SHIFT: u32 = 5;

/// μ from the network's last layer, in words.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MuWords {
    /// Position of μ in mu_max/384, [x, y].
    pub position: [i32; 2],
    /// ln of the standard deviation of μ over mu_max in 1/384, [x, y].
    pub ln_sigma: [i32; 2],
    /// Number of outputs that were saturated.
    pub saturations: u32,
}

/// The operands of the next layer from the accumulators of a hidden one, and how many images were saturated.
pub fn images(formats: &Formats, shift: u32, rows: &[[i64; 4]]) -> (Vector, u32) {
    let largest = (1i64 << formats.image_bits()) - 1;
    let mut saturations = 0;
    let quad = |row: &[i64; 4]| {
        let images = hadamard(row.map(|acc| round_shift(acc, shift))).map(|image| {
            saturations += u32::from(image > largest);
            image.clamp(0, largest)
        });
        hadamard(images)
    };
    let operands = rows.iter().map(quad).collect();
    (operands, saturations)
}

/// Range of ln σ in 1/384.
pub fn ln_sigma_range() -> [i64; 2] {
    LN_SIGMA.map(|ln| (f64::from(ln) * MU_STEPS as f64).round() as i64)
}

/// μ from the accumulators of the last layer; `shift` is that of the hidden layers.
pub fn estimate(shift: u32, rows: &[[i64; 4]]) -> MuWords {
    let mut saturations = 0;
    let mut output = |place: usize, bits: u32| {
        let (parity, row) = OUTPUTS[place];
        let (word, clipped) = saturate(round_shift(rows[row][parity], shift + LAST_SHIFT), bits);
        saturations += u32::from(clipped);
        word
    };
    let mut position = [0, 1].map(|axis| output(axis, POSITION_BITS));
    let [least, largest] = ln_sigma_range();
    let ln_sigma = [2, 3].map(|place| output(place, OUTPUT_BITS).clamp(least, largest) as i32);
    for _ in 0..REDUCTIONS {
        position = reduced(position);
    }
    MuWords { position: position.map(|x| x as i32), ln_sigma, saturations }
}

/// A position outside the disc a little closer to it.
pub fn reduced(position: [i64; 2]) -> [i64; 2] {
    match position.map(|x| x * x).iter().sum::<i64>() > MU_STEPS * MU_STEPS {
        true => position.map(|x| x - round_shift(x, REDUCTION_SHIFT)),
        false => position,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn an_output_is_in_its_place() {
        // Rows of the parities even, odd in x, odd in y, odd in both.
        let unit = 1 << LAST_SHIFT;
        let rows = [[-800, 1000, -500, 9], [-4000, 7, 7, 7]].map(|row| row.map(|word| word * unit));
        let found = estimate(3, &rows);
        assert_eq!(found, MuWords { position: [125, -63 + 1], ln_sigma: [-100, -500], saturations: 0 });
        let far = estimate(0, &[[200 * unit, 5000 * unit, 0, 0], [-3000 * unit, 0, 0, 0]]);
        assert_eq!((far.ln_sigma, far.saturations), ([192, -2688], 1));
        assert!(far.position[0] <= MU_STEPS as i32 && far.position[0] > 370, "{far:?}");
    }

    proptest! {
        /// Any output is in the disc at the end, in its direction.
        #[test]
        fn positions_are_in_the_disc(x in -512i64..512, y in -512i64..512) {
            let MuWords { position: [a, b], .. } = estimate(0, &[[0, x << LAST_SHIFT, y << LAST_SHIFT, 0], [0; 4]]);
            let (a, b) = (i64::from(a), i64::from(b));
            prop_assert!(a * a + b * b <= MU_STEPS * MU_STEPS);
            prop_assert!((a * y - b * x).abs() <= 40 * (x.abs() + y.abs()));
            if x * x + y * y <= MU_STEPS * MU_STEPS {
                prop_assert_eq!((a, b), (x, y));
            } else {
                prop_assert!(a * a + b * b > (MU_STEPS - 26).pow(2));
            }
        }
    }

    #[test]
    fn negative_images_are_zero_and_large_ones_saturate() {
        let mut scene = crate::spec::scene::Scene::builtin("sensor-1").unwrap();
        scene.hardware.estimator = Some(crate::spec::scene::EstimatorKind::Network);
        let model = crate::fixed::Model::new(&scene).unwrap();
        let formats = model.formats();
        let largest = (1i64 << formats.image_bits()) - 1;
        // Images (4, 0, 0, 0) of the first, (0, 0, 0, −16) of the second, one too large of the third.
        let rows = [[4, 4, 4, 4], [-16, 16, 16, -16], [4 * largest, 0, 0, 0]];
        let (operands, saturations) = images(formats, 2, &rows);
        assert_eq!(operands, [[4, 4, 4, 4], hadamard([0, 0, 0, 0]), hadamard([largest; 4])]);
        assert_eq!(saturations, 0);
        let (operands, saturations) = images(formats, 2, &[[4 * largest + 4, 0, 0, 0]]);
        assert_eq!((operands, saturations), (vec![hadamard([largest; 4])], 4));
    }
}
