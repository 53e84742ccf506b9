//! Stage `receive`: magnitude and signs of a subarray's codes, gathered until its last taxel has arrived.
//!
//! | in | codes, row-major, `input_bits` signed |
//! |---|---|
//! | out | the OR of all magnitudes (for [`normalise`](super::normalise)), both sign conditions, the same codes as quads |
//!
//! The code of a dead taxel is replaced by 0, and so is a negative one of a unipolar array, which reads no tension: for
//! the magnitude, the signs and the passes.
//!
//! Signs are compared with the noise floor in codes: `c > floor`, `c < −floor`, as in the golden model on the same
//! codes.

use crate::fixed::words::arith::magnitude_bits;
use crate::spec::scene::Condition;

/// Magnitude and signs of a subarray's codes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Received {
    /// OR over all taxels of [`magnitude_bits`], `input_bits − 1` bits.
    pub magnitude: u64,
    /// Some code is above the noise floor.
    pub positive: bool,
    /// Some code is below minus the noise floor.
    pub negative: bool,
}

impl Received {
    /// Whether the subarray meets the scene's condition for a search.
    pub fn meets(&self, condition: Condition) -> bool {
        match condition {
            Condition::Loaded => self.positive || self.negative,
            Condition::BothSigns => self.positive && self.negative,
        }
    }
}

/// The codes of an array with 0 for each of the `dead` taxels (row-major indices) and, if it is `unipolar`, for each
/// negative code.
pub fn mask(codes: &[i32], dead: &[usize], unipolar: bool) -> Vec<i32> {
    let masked = |taxel: usize, code: i32| dead.contains(&taxel) || (unipolar && code < 0);
    codes.iter().enumerate().map(|(taxel, &code)| if masked(taxel, code) { 0 } else { code }).collect()
}

/// Magnitude and signs of one subarray's `codes`; the noise floor `floor` is in codes, ≥ 0.
pub fn receive(codes: &[i32], floor: i32) -> Received {
    codes.iter().fold(Received::default(), |seen, &code| Received {
        magnitude: seen.magnitude | magnitude_bits(i64::from(code)),
        positive: seen.positive | (code > floor),
        negative: seen.negative | (code < -floor),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn by_hand() {
        assert_eq!(receive(&[5, -3, 0], 3), Received { magnitude: 7, positive: true, negative: false });
        assert_eq!(receive(&[0, 0], 0), Received::default());
        assert!(receive(&[-1], 0).negative);
        assert_eq!(mask(&[7, -8, -9], &[1], false), [7, 0, -9]);
        assert_eq!(mask(&[7, 8, -9], &[1], true), [7, 0, 0]);
    }
}
