//! Stage `forces`: p(μ*) to forces in the units of the output stream.
//!
//! ```text
//! μ = (X·mu_step) / 2^MU_ROUND                fx = μ1 p,  fy = μ2 p,  fz = p
//! ```
//! Each is a product with a fraction of `mu_fraction` bits (fz with the factor 1.0), shifted right by the fraction and
//! the subarray's exponent together: rounded once, saturated to 32 bits, saturations counted. Where |fz| is below the
//! threshold, all three are zero.

use crate::fixed::words::arith::{round_shift, saturate};
use crate::fixed::words::formats::{Formats, FORCE_BITS, MU_ROUND};

/// The μ word of a search position (in mu_max/384): μ with `mu_fraction` fraction bits.
pub fn mu_word(formats: &Formats, position: i32) -> i64 {
    round_shift(i64::from(position) * formats.mu_step, MU_ROUND)
}

/// The force on one taxel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Force {
    /// fx, fy, fz in force LSBs.
    pub words: [i32; 3],
    /// How many of the three words saturated.
    pub saturations: u32,
}

/// The force of a taxel with p = `value` (in search LSBs), μ words `mu`, right shift `shift`, `threshold` in force
/// LSBs.
pub fn force(formats: &Formats, value: i64, mu: [i64; 2], shift: u32, threshold: i64) -> Force {
    let products = [value * mu[0], value * mu[1], value << formats.mu_fraction];
    let rounded = products.map(|product| saturate(round_shift(product, shift), FORCE_BITS));
    let saturations = rounded.iter().map(|&(_, clipped)| u32::from(clipped)).sum();
    if rounded[2].0.abs() < threshold {
        return Force { words: [0; 3], saturations };
    }
    Force { words: rounded.map(|(word, _)| word as i32), saturations }
}
