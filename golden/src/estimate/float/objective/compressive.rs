//! Compressive: the paper's constraint i) alone.
//!
//! Π = −Σ min(p, 0)²/(Σp)², at most 0. It is flat around its maximum, so it hardly depends on the shear: a baseline.

use super::estimate::Objective;

/// The objective `compressive`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Compressive;

impl Objective for Compressive {
    fn score(&self, p: &[f64]) -> Option<f64> {
        let sum: f64 = p.iter().sum();
        // Quotients are squared, not forces: squares of large forces overflow.
        let pulling = |p: &f64| (p.min(0.0) / sum).powi(2);
        (sum > 0.0 && sum.is_finite()).then(|| -p.iter().map(pulling).sum::<f64>())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn by_hand() {
        assert_eq!(Compressive.score(&[3.0, -1.0, 0.0]), Some(-0.25));
        assert_eq!(Compressive.score(&[3.0, 1.0]), Some(0.0));
        assert_eq!(Compressive.score(&[1e200, -1e200, 1e200]), Some(-1.0));
        for pulling in [[1.0, -1.0], [0.0, 0.0], [f64::NAN, 1.0], [f64::INFINITY, 1.0]] {
            assert_eq!(Compressive.score(&pulling), None);
        }
    }
}
