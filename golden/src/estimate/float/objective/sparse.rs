//! The objective `sparse`: force on few taxels.

use super::estimate::Objective;

/// ε of the floating-point model. Of 400 fresh frames of sensor 1 (`dermis table sensor-1 --case 0 --fresh 400`) nine
/// of ten have an error of at most 8 % with 2⁻¹⁷, 6 % with 2⁻¹⁹, 5 % with 2⁻²⁰; with a smaller ε frames of partial slip
/// become worse. The integers of the hardware resolve 2⁻¹⁷.
pub const EPSILON: f64 = 1.0 / (1 << 19) as f64;
/// Number of values multiplied before a logarithm is taken. With ε = 2⁻¹⁹ a product of 8 is at least 2⁻¹⁵², far from
/// underflow.
const CHUNK: usize = 8;

/// The default objective: force on few taxels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sparse {
    /// Fraction of Σp below which a force counts as none, above 0.
    pub epsilon: f64,
}

impl Default for Sparse {
    fn default() -> Self {
        Sparse { epsilon: EPSILON }
    }
}

impl Objective for Sparse {
    fn score(&self, p: &[f64]) -> Option<f64> {
        let sum: f64 = p.iter().sum();
        if !(sum > 0.0 && sum.is_finite()) {
            return None;
        }
        let share = |p: &f64| self.epsilon + p.abs() / sum;
        let logs = p.chunks(CHUNK).map(|chunk| {
            // The logarithm of the product is the sum of the logarithms; outside the normal range these are taken one
            // by one.
            let product: f64 = chunk.iter().map(share).product();
            if product.is_normal() {
                product.log2()
            } else {
                chunk.iter().map(|p| share(p).log2()).sum()
            }
        });
        Some(-logs.sum::<f64>())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Products of 8 carry 8 roundings each, in bits 8 ε/ln 2 per chunk, below 1e-14; sums of scores around 1000 add
    /// ε·1000.
    const SCORE_TOLERANCE: f64 = 1e-12;

    fn plain(epsilon: f64, p: &[f64]) -> f64 {
        let sum: f64 = p.iter().sum();
        -p.iter().map(|p| (epsilon + p.abs() / sum).log2()).sum::<f64>()
    }

    #[test]
    fn by_hand() {
        let objective = Sparse { epsilon: 0.25 };
        // Shares 1.25 − 1, 0.25: −(log2 (0.25 + 0.75) + log2 (0.25 + 0.25)) = 1.
        assert_eq!(objective.score(&[3.0, 1.0]), Some(1.0));
    }

    #[test]
    fn pulling_forces_have_no_score() {
        let objective = Sparse::default();
        for p in [[1.0, -1.0], [0.0, 0.0], [-1.0, 0.5], [f64::NAN, 1.0], [f64::INFINITY, 1.0]] {
            assert_eq!(objective.score(&p), None);
        }
    }

    #[test]
    fn concentrated_beats_spread() {
        let objective = Sparse::default();
        let mut peak = vec![0.0; 100];
        peak[17] = 1.0;
        assert!(objective.score(&peak) > objective.score(&[0.01; 100]));
        assert!(objective.score(&peak).unwrap() <= 1900.0);
    }

    #[test]
    fn extreme_shares_do_not_overflow() {
        // Forces of ±1e200 that leave a sum of 1: shares beyond the range of a product of 8.
        let p = [1e200, -1e200, 1e200, -1e200, 1.0];
        let score = Sparse::default().score(&p).unwrap();
        assert!((score - plain(EPSILON, &p)).abs() < 1e-9);
    }

    proptest! {
        #[test]
        fn chunks_equal_single_logs(p in proptest::collection::vec(-1.0f64..1.5, 1..60), k in -20i32..20) {
            let scaled: Vec<f64> = p.iter().map(|p| p * 2f64.powi(k)).collect();
            let score = Sparse::default().score(&p);
            prop_assert_eq!(score, Sparse::default().score(&scaled));
            if let Some(score) = score {
                let plain = plain(EPSILON, &p);
                prop_assert!((score - plain).abs() <= SCORE_TOLERANCE * plain.abs().max(1.0));
            }
        }
    }
}
