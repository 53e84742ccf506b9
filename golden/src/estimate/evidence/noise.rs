//! Noise: its size from what the pressures do not explain, where neither scene nor tare frames state it.
//!
//! Of the readings, Σ T (b − H w)² is left over; noise of the assumed size would leave Σ (1 − T v), v the variance that
//! the posterior still has there (MacKay 1992). Clipped readings count in neither sum.
//!
//! The first round takes what the quietest readings allow: a weak contact beside a strong one must not count as noise.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: readings, stress of the posterior | readings | MPa, 1/MPa² |
//! | out: noise found over noise assumed | 1 | – |

use super::model::Readings;

/// Share of the readings that are taken to be noise alone.
const QUIET: f64 = 0.2;
/// Size of normally distributed noise that this share of it stays below, in standard deviations.
const QUIET_SIZE: f64 = 0.253;

/// The first noise of a frame: as if the smallest fifth of all readings but zeros were noise alone. In units of `b`.
pub(super) fn first(b: impl Iterator<Item = f64>) -> f64 {
    let mut sizes: Vec<f64> = b.map(f64::abs).filter(|b| *b > 0.0).collect();
    let rank = (QUIET * sizes.len() as f64) as usize;
    if rank >= sizes.len() {
        return 0.0;
    }
    let (_, size, _) = sizes.select_nth_unstable_by(rank, f64::total_cmp);
    *size / QUIET_SIZE
}

/// Noise found over the noise assumed in the precision of `readings`; `stress` is mean and variance of the posterior's
/// stress, `counts` tells which readings count: neither clipped nor missing ones.
pub(super) fn ratio(readings: &Readings, counts: impl Fn(usize) -> bool, stress: &[[f64; 2]]) -> f64 {
    let (mut left, mut free) = (0.0, 0.0);
    for (t, [mean, variance]) in stress.iter().enumerate() {
        if counts(t) {
            left += readings.precision[t] * (readings.y[t] - mean).powi(2);
            free += 1.0 - readings.precision[t] * variance;
        }
    }
    (left / free.max(1.0)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimate::evidence::model::Design;
    use crate::random::Random;
    use faer::Mat;

    #[test]
    fn first_noise_by_the_quietest_readings() {
        let mut random = Random::new(7);
        let noise: Vec<f64> = (0..1000).map(|_| 0.03 * random.normal()).collect();
        assert!((first(noise.iter().copied()) / 0.03 - 1.0).abs() < 0.15);
        // A contact on half of the taxels, and a sensor that reads no tension.
        let loaded = noise.iter().enumerate().map(|(k, b)| if k % 2 == 0 { 1.0 } else { b.max(0.0) });
        assert!((0.03..0.15).contains(&first(loaded)));
        assert_eq!((first([0.0; 9].into_iter()), first([].into_iter())), (0.0, 0.0));
    }

    /// Two coefficients, 400 readings of which every fourth is clipped: noise that is assumed three times too small is
    /// found within its own uncertainty, 1/√(2·300), and clipped readings do not disturb it.
    #[test]
    fn noise_is_found_from_unclipped_readings() {
        let count = 400;
        let of = |t: usize, i: usize| if t < count { ((t + 1) as f64 * (i + 1) as f64).sin() } else { 0.0 };
        let s = Mat::from_fn(3 * count, 2, of);
        let design = Design { s, contact: vec![0, 0], baseline: 0, spread: Mat::zeros(2 * count, 2) };
        let clipped: Vec<usize> = (0..count).step_by(4).collect();
        let mut random = Random::new(5);
        let sigma = 0.03;
        let y = (0..count).map(|t| if t % 4 == 0 { 7.0 } else { design.s[(t, 0)] + sigma * random.normal() }).collect();
        let precision = (0..count).map(|t| if t % 4 == 0 { 1e-9 } else { (3.0 / sigma).powi(2) }).collect();
        let readings = Readings { y, precision };
        let mu = [[0.0; 2]];
        let posterior = design.posterior(&readings, &mu).unwrap();
        let found = ratio(&readings, |t| clipped.binary_search(&t).is_err(), &posterior.stress(&readings));
        assert!((found / 3.0 - 1.0).abs() < 0.1, "{found}");
    }
}
