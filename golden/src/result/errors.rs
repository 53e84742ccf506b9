//! Errors: the resultant force compared with a reference, by the paper's Eq. 3.
//!
//! e_x = (ref − value)/ref per axis, signed; tangential ‖T − T_ref‖/‖T_ref‖; normal |N − N_ref|/|N_ref|.
//!
//! | | shape | unit | range |
//! |---|---|---|---|
//! | in: reference, value | 3 | N | finite |
//! | out: errors | 5 | fraction | `None` where the reference is below 1 % of ‖ref‖ |

use nalgebra::Vector3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Fraction of ‖ref‖ below which an axis or the shear has no meaningful relative error.
pub const SMALLEST_SHARE: f64 = 0.01;

/// Relative errors of the resultant as fractions.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Errors {
    /// Along x, signed as in Eq. 3.
    pub x1: Option<f64>,
    /// Along y, signed as in Eq. 3.
    pub x2: Option<f64>,
    /// Normal, signed as in Eq. 3.
    pub x3: Option<f64>,
    /// ‖T − T_ref‖/‖T_ref‖ of the shear T = (x, y), ≥ 0.
    pub tangential: Option<f64>,
    /// |N − N_ref|/|N_ref| of the normal force, ≥ 0.
    pub normal: Option<f64>,
}

impl Errors {
    /// Compares a resultant with its reference; both are [x, y, normal] in N.
    ///
    /// ```
    /// use dermis_golden::result::errors::Errors;
    ///
    /// let errors = Errors::new([3.0, -4.0, 10.0], [3.3, -4.4, 9.0]);
    /// let near = |error: Option<f64>, wanted: f64| (error.unwrap() - wanted).abs() < 1e-12;
    /// assert!(near(errors.x1, -0.1) && near(errors.tangential, 0.1) && near(errors.normal, 0.1));
    /// // Without a reference along x there is no relative error.
    /// assert_eq!(Errors::new([0.0, 1.0, 5.0], [1.0, 1.0, 5.0]).x1, None);
    /// ```
    pub fn new(reference: [f64; 3], value: [f64; 3]) -> Errors {
        let (reference, value) = (Vector3::from(reference), Vector3::from(value));
        let least = SMALLEST_SHARE * reference.norm();
        // The second condition excludes a reference of zero.
        let counts = |size: f64| size >= least && size > 0.0;
        // A quotient by a denormal number can overflow: it is no meaningful error either.
        let share = |off: f64, size: f64| Some(off / size).filter(|share| share.is_finite());
        let axis = |k: usize| {
            let off = reference[k] - value[k];
            share(off, reference[k]).filter(|_| counts(reference[k].abs()))
        };
        let shear = reference.xy().norm();
        let off = (value - reference).xy().norm();
        Errors {
            x1: axis(0),
            x2: axis(1),
            x3: axis(2),
            tangential: share(off, shear).filter(|_| counts(shear)),
            normal: axis(2).map(f64::abs),
        }
    }

    /// X1, X2, X3 of Eq. 3.
    pub fn axes(&self) -> [Option<f64>; 3] {
        [self.x1, self.x2, self.x3]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn by_hand() {
        let errors = Errors::new([3.0, -4.0, 10.0], [3.3, -4.4, 9.0]);
        let near = |value: Option<f64>, wanted: f64| (value.unwrap() - wanted).abs() < 1e-14;
        assert!(near(errors.x1, -0.1) && near(errors.x2, -0.1) && near(errors.x3, 0.1));
        assert!(near(errors.tangential, 0.1) && near(errors.normal, 0.1));
    }

    #[test]
    fn axes_without_reference_are_none() {
        let errors = Errors::new([0.0, 0.05, 10.0], [1.0, 1.0, 10.0]);
        assert_eq!((errors.x1, errors.x2, errors.tangential), (None, None, None));
        assert_eq!((errors.x3, errors.normal), (Some(0.0), Some(0.0)));
        let nothing = Errors::new([0.0; 3], [1.0; 3]);
        assert_eq!((nothing.x3, nothing.normal, nothing.tangential), (None, None, None));
    }

    #[test]
    fn equal_forces_have_no_error() {
        let errors = Errors::new([1.0, 2.0, 3.0], [1.0, 2.0, 3.0]);
        assert_eq!(errors.tangential, Some(0.0));
        assert_eq!(errors.x1, Some(0.0));
    }
}
