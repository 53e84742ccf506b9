//! Inverse: how the singular values of Cz are inverted.
//!
//! ```text
//! exact      f(λ) = 1/λ             where |λ| > α, else 0          α = n ε max|λ|, rounding
//! tsvd       f(λ) = 1/λ             where |λ| > α, else 0          α = level · max|λ|, at least rounding
//! tikhonov   f(λ) = λ/(λ² + α²)                                    α as for tsvd
//! ```
//!
//! An error e of the readings, relative to the peak, changes the forces by e/λ: singular values below e carry no
//! information. The rounding of a coefficient changes them by 2^−inverse_bits of the largest coefficient, 1/α, in every
//! direction. Where the scene has no level, it is the largest of three floors, the first two relative to full scale:
//! ```text
//! input          2^(−average/2) / ((2^(input_bits − 1) − 1) √12)     rounding of a code, averaged
//! noise          2^(−average/2) noise_floor_MPa / full_scale_MPa     if the scene has both
//! coefficients   2^(7 − inverse_bits)                                their rounding is below 1 % of the forces
//! ```
//!
//! With the default, `tsvd` at that level, a scene whose condition is below 1/level loses nothing: its matrices are
//! those of `exact`, to the bit. With codes of 20 and coefficients of 24 bits that is a condition of 1.3·10⁵, or a
//! square pitch of a quarter of the thickness.
//!
//! | | unit | range |
//! |---|---|---|
//! | in: level | fraction of the largest singular value | above 0, below 1 |
//! | out: f(λ) | 1/λ | at most 1/α, with `tikhonov` 1/(2α) |

use super::field::{choice, table, Kind as _, Number};

/// Kind of pseudo-inverse.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum InverseKind {
    /// All singular values above rounding are inverted.
    Exact,
    /// Truncated: only singular values above the level are inverted.
    #[default]
    Tsvd,
    /// All singular values are inverted, damped around and below the level.
    Tikhonov,
}

impl InverseKind {
    /// Every kind with its name in a scene file.
    pub const NAMES: [(&'static str, InverseKind); 3] =
        [("tsvd", InverseKind::Tsvd), ("tikhonov", InverseKind::Tikhonov), ("exact", InverseKind::Exact)];

    /// Name in a scene file.
    pub fn name(self) -> &'static str {
        match self {
            InverseKind::Exact => "exact",
            InverseKind::Tsvd => "tsvd",
            InverseKind::Tikhonov => "tikhonov",
        }
    }
}

table! {
    /// Table `[inverse]`.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct InverseSpec in "inverse" with defaults {
        /// Kind of pseudo-inverse.
        kind: InverseKind = choice(&InverseKind::NAMES).or(InverseKind::Tsvd).page("stability");
        /// Level relative to the largest singular value; left out with `"exact"`.
        level: Option<f64> = Number::Between(0.0, 1.0).optional("the floor of format and noise").page("stability");
    }
}

/// A kind of pseudo-inverse with its level: the rule that maps λ to f(λ).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Inversion {
    /// Kind of pseudo-inverse.
    pub kind: InverseKind,
    /// Level relative to the largest singular value; 0 with `exact`.
    pub level: f64,
}

impl Inversion {
    /// All singular values above rounding are inverted.
    pub const EXACT: Inversion = Inversion { kind: InverseKind::Exact, level: 0.0 };

    /// f(λ) of `value`, one of `count` singular values or eigenvalues with the largest magnitude `largest`; in 1/λ.
    pub fn invert(&self, value: f64, largest: f64, count: usize) -> f64 {
        // Values below rounding carry no information.
        let alpha = (count as f64 * f64::EPSILON).max(self.level) * largest;
        match self.kind {
            // Divided by λ first, because λ² of a tiny λ underflows.
            InverseKind::Tikhonov if value != 0.0 => 1.0 / (value + alpha * (alpha / value)),
            _ if value.abs() <= alpha => 0.0,
            _ => 1.0 / value,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_by_hand() {
        let rule = |kind| Inversion { kind, level: 0.1 };
        let of = |kind, value| rule(kind).invert(value, 2.0, 4);
        assert_eq!(
            [of(InverseKind::Tsvd, 0.25), of(InverseKind::Tsvd, 0.2), of(InverseKind::Tsvd, -0.5)],
            [4.0, 0.0, -2.0]
        );
        // α = 0.2: 0.2/(0.04 + 0.04), and 0 for 0.
        assert_eq!([of(InverseKind::Tikhonov, 0.2), of(InverseKind::Tikhonov, 0.0)], [2.5, 0.0]);
        assert!(of(InverseKind::Tikhonov, 1e-300) < 1e-298);
        assert_eq!(Inversion::EXACT.invert(1e-10, 2.0, 4), 1e10);
        assert_eq!(Inversion::EXACT.invert(4.0 * f64::EPSILON, 2.0, 4), 0.0);
    }
}
