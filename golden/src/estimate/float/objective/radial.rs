//! Radial: the kernels of a bonded layer as a table of cubic pieces, for fast evaluation.
//!
//! gn, gs and their derivatives are tabulated every h/64, with Hermite's cubic in between. Its error is step⁴/384 of
//! the fourth derivative, which is about 200 peaks per h⁴: 3e-8 of the peak, a thousandth of what a fit can resolve.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: r | scalar | h |
//! | out: gn, gs, their derivatives | 2, 2 | per h², per h³, per h more |

use crate::physics::bonded::kernel::{Kernel, REACH};

/// Pieces per h.
const PIECES: usize = 64;
/// Step of the central differences in h: truncation and rounding are both about 1e-10.
const STEP: f64 = 1e-5;

/// Values and derivatives of both kernels at the ends of the pieces.
#[derive(Clone, Debug)]
pub(crate) struct Radial(Vec<[[f64; 2]; 2]>);

impl Radial {
    /// Tabulates a kernel.
    pub fn new(kernel: &Kernel) -> Radial {
        let end = |index: usize| {
            let r = index as f64 / PIECES as f64;
            let (before, after) = (kernel.at((r - STEP).abs()), kernel.at(r + STEP));
            let value = kernel.at(r);
            [0, 1].map(|k| [value[k], (after[k] - before[k]) / (2.0 * STEP)])
        };
        // One more piece, so that r = REACH has an end.
        Radial((0..=REACH as usize * PIECES + 1).map(end).collect())
    }

    /// gn and gs at r.
    pub fn at(&self, r: f64) -> [f64; 2] {
        self.with_slopes(r).0
    }

    /// gn and gs at r, and their derivatives; zero from [`REACH`] on.
    pub fn with_slopes(&self, r: f64) -> ([f64; 2], [f64; 2]) {
        if r.is_nan() || r >= REACH {
            return ([0.0; 2], [0.0; 2]);
        }
        let place = r * PIECES as f64;
        let index = place as usize;
        let t = place - index as f64;
        let (left, right) = (&self.0[index], &self.0[index + 1]);
        let step = 1.0 / PIECES as f64;
        let cubic = |k: usize| {
            let ([a, da], [b, db]) = (left[k], right[k]);
            let (da, db, rise) = (da * step, db * step, b - a);
            let (two, three) = (3.0 * rise - 2.0 * da - db, da + db - 2.0 * rise);
            (a + t * (da + t * (two + t * three)), (da + t * (2.0 * two + 3.0 * t * three)) / step)
        };
        let ((normal, normal_slope), (shear, shear_slope)) = (cubic(0), cubic(1));
        ([normal, shear], [normal_slope, shear_slope])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cubics_follow_the_kernels() {
        let kernel = Kernel::new(0.48);
        let radial = Radial::new(&kernel);
        let peak = kernel.at(0.0);
        for k in 0..2000 {
            let r = 0.0207 * k as f64;
            let (exact, found) = (kernel.at(r), radial.at(r));
            for (axis, peak) in peak.iter().enumerate() {
                assert!((exact[axis] - found[axis]).abs() < 1e-7 * peak.abs(), "{r}");
            }
        }
        assert_eq!(radial.with_slopes(REACH), ([0.0; 2], [0.0; 2]));
    }
}
