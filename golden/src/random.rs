//! Seeded random numbers: SplitMix64 with Box–Muller; the same on every machine and in every version, as drawn frames,
//! trained networks and tables depend on them.

use std::f64::consts::TAU;

use rand_xoshiro::rand_core::{RngCore, SeedableRng};
use rand_xoshiro::SplitMix64;

/// A random number generator.
#[derive(Clone, Debug)]
pub struct Random(SplitMix64);

impl Random {
    /// The generator with a seed.
    pub fn new(seed: u64) -> Random {
        Random(SplitMix64::seed_from_u64(seed))
    }

    fn bits(&mut self) -> u64 {
        self.0.next_u64()
    }

    /// Uniform in `low` … `high`.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        // 53 bits, every one of them exact.
        low + (high - low) * (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// True or false, equally likely.
    pub fn coin(&mut self) -> bool {
        self.bits() >> 63 == 1
    }

    /// One element, all equally likely; `None` if there are none, which draws a number as well.
    pub fn pick<'a, T>(&mut self, of: &'a [T]) -> Option<&'a T> {
        let at = self.between(0.0, of.len() as f64) as usize;
        of.get(at)
    }

    /// Normally distributed with mean 0 and standard deviation 1.
    pub fn normal(&mut self) -> f64 {
        // 1 − u is above 0.
        let radius = (-2.0 * (1.0 - self.between(0.0, 1.0)).ln()).sqrt();
        radius * (TAU * self.between(0.0, 1.0)).cos()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn first_number_of_splitmix_and_moments() {
        // Published first output of SplitMix64 with seed 1234567.
        assert_eq!(Random::new(1_234_567).bits(), 6_457_827_717_110_365_317);
        let mut random = Random::new(7);
        let values: Vec<f64> = (0..20_000).map(|_| random.normal()).collect();
        let mean = values.iter().sum::<f64>() / 2e4;
        let square = values.iter().map(|v| v * v).sum::<f64>() / 2e4;
        // Four standard deviations: 4/√20000 and 4 √(2/20000).
        assert!(mean.abs() < 0.029 && (square - 1.0).abs() < 0.04);
    }
}
