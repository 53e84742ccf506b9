//! Interval: confidence intervals of 95 % for shares of flips.
//!
//! Of one stage: Wilson's interval for k hits of n, z = 1.96, which stays inside 0 … 1 and is not empty without a hit,
//!
//! ```text
//! l, u = (k + z²/2 ∓ z √(k(n − k)/n + z²/4)) / (n + z²)
//! ```
//! Of several stages with weights w: Newcombe's square-and-add method (MOVER), which for one stage is Wilson's interval,
//!
//! ```text
//! L = Σ w p − √Σ w²(p − l)²        U = Σ w p + √Σ w²(u − p)²        p = k/n
//! ```
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: weight, hits, trials | 3 per stage | –; weights add up to 1 |
//! | out: interval | 2 | fraction |

/// Name of the method in tables.
pub const METHOD: &str = "Wilson's intervals of the stages, added by Newcombe's method (MOVER)";

/// Quantile of the normal distribution for 95 %.
const Z: f64 = 1.959_963_984_540_054;

/// One stage of a share.
#[derive(Clone, Copy, Debug)]
pub struct Stratum {
    /// Weight of the stage; those of all add up to 1.
    pub weight: f64,
    /// Number of hits.
    pub hits: usize,
    /// Number of trials, at least 1.
    pub trials: usize,
}

/// Wilson's interval for `hits` of `trials`.
pub fn wilson(hits: usize, trials: usize) -> [f64; 2] {
    let (k, n) = (hits as f64, trials as f64);
    let half = Z * (k * (n - k) / n + Z * Z / 4.0).sqrt();
    [-half, half].map(|half| ((k + Z * Z / 2.0 + half) / (n + Z * Z)).clamp(0.0, 1.0))
}

/// The interval of the weighted share of all stages.
pub fn weighted(strata: &[Stratum]) -> [f64; 2] {
    let (mut share, mut below, mut above) = (0.0, 0.0, 0.0);
    for Stratum { weight, hits, trials } in strata {
        let own = *hits as f64 / *trials as f64;
        let [low, high] = wilson(*hits, *trials);
        share += weight * own;
        below += (weight * (own - low)).powi(2);
        above += (weight * (high - own)).powi(2);
    }
    [share - below.sqrt(), share + above.sqrt()].map(|end: f64| end.clamp(0.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn near([low, high]: [f64; 2], wanted: [f64; 2]) -> bool {
        (low - wanted[0]).abs() < 5e-5 && (high - wanted[1]).abs() < 5e-5
    }

    /// Newcombe, Statistics in Medicine 17 (1998), 857–872, table I, method 3.
    #[test]
    fn published_intervals_are_found() {
        let published = [
            (81, 263, [0.2553, 0.3662]),
            (15, 148, [0.0624, 0.1605]),
            (0, 20, [0.0000, 0.1611]),
            (1, 29, [0.0061, 0.1718]),
        ];
        for (hits, trials, wanted) in published {
            assert!(near(wilson(hits, trials), wanted), "{hits}/{trials}: {:?}", wilson(hits, trials));
            let [low, high] = wilson(trials - hits, trials);
            assert!(near([1.0 - high, 1.0 - low], wanted), "misses for hits");
            assert!(near(weighted(&[Stratum { weight: 1.0, hits, trials }]), wanted), "one stage");
        }
    }

    #[test]
    fn stages_are_weighted() {
        let stage = |weight: f64, hits: usize| Stratum { weight, hits, trials: 20 };
        // A stage without weight counts for nothing; two without a hit know more than one of them.
        assert!(near(weighted(&[stage(1.0, 0), stage(0.0, 20)]), [0.0, 0.1611]));
        let [low, high] = weighted(&[stage(0.5, 0), stage(0.5, 0)]);
        assert!(low == 0.0 && (high - 0.1611 / 2f64.sqrt()).abs() < 1e-4, "{high}");
    }
}
