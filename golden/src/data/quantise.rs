//! Quantise: from stress to the signed codes of a converter, as the hardware receives them.
//!
//! code = round(b / full_scale · M), M = 2^(bits − 1) − 1, halves away from zero, clamped to ±M; lsb = full_scale / M.
//!
//! | | shape | unit | range |
//! |---|---|---|---|
//! | in: stress | taxels | MPa | finite |
//! | out: codes | taxels | LSB | −M … M, symmetric, so that no negation overflows |
//! | out: clipped | taxels | flag | the rounded code was beyond ±M |
//!
//! Feeds `receive` of all models. Finite stress is assumed; frames are checked when loaded.

use crate::spec::scene::largest_code;

/// The codes of one frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Codes {
    /// One signed code per taxel, row-major, in LSBs.
    pub codes: Vec<i32>,
    /// Width of a code with its sign, 2 to 31.
    pub bits: u32,
    /// Stress of the largest code in MPa.
    pub full_scale_MPa: f64,
    /// Whether each taxel is beyond full scale and was clamped.
    pub clipped: Vec<bool>,
}

impl Codes {
    /// Stress of one LSB in MPa.
    pub fn lsb_MPa(&self) -> f64 {
        self.full_scale_MPa / f64::from(largest_code(self.bits))
    }
}

/// Rounds stress in MPa to codes of `bits` bits, 2 to 31, whose largest code means `full_scale_MPa`.
///
/// ```
/// use dermis_golden::data::quantise::quantise;
///
/// let codes = quantise(&[1.0, -0.5, 1.1], 8, 1.0);
/// assert_eq!(codes.codes, [127, -64, 127]);
/// assert_eq!(codes.clipped, [false, false, true]);
/// // Rounding changes a stress within full scale by half an LSB at most.
/// assert!((f64::from(codes.codes[1]) * codes.lsb_MPa() + 0.5).abs() <= codes.lsb_MPa() / 2.0);
/// ```
pub fn quantise(stress_MPa: &[f64], bits: u32, full_scale_MPa: f64) -> Codes {
    let largest = f64::from(largest_code(bits));
    // f64::round takes halves away from zero.
    let ideal = |b: &f64| (b / full_scale_MPa * largest).round();
    Codes {
        codes: stress_MPa.iter().map(|b| ideal(b).clamp(-largest, largest) as i32).collect(),
        bits,
        full_scale_MPa,
        clipped: stress_MPa.iter().map(|b| ideal(b).abs() > largest).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn by_hand_with_eight_bits() {
        let codes = quantise(&[127.0, 0.5, -0.5, 0.49, -127.4, 127.5, -300.0], 8, 127.0);
        assert_eq!(codes.codes, [127, 1, -1, 0, -127, 127, -127]);
        let clipped = [false, false, false, false, false, true, true];
        assert_eq!(codes.clipped, clipped);
        assert_eq!(codes.lsb_MPa(), 1.0);
    }

    proptest! {
        #[test]
        fn half_an_lsb_away_at_most(b in -1.0f64..=1.0, bits in 8u32..=24) {
            let codes = quantise(&[b], bits, 1.0);
            let back = f64::from(codes.codes[0]) * codes.lsb_MPa();
            // Half a step, and the rounding of three operations on values up to 1.
            prop_assert!((back - b).abs() <= 0.5 * codes.lsb_MPa() + 4.0 * f64::EPSILON);
            prop_assert!(!codes.clipped[0]);
        }
    }
}
