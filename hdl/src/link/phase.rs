//! Bit timing on the line: a fraction of a bit per clock cycle, so that any bit rate fits any clock.

/// Most fraction bits of the phase of a bit.
const FRACTION: usize = 16;

/// Phase accumulator that counts fractions of a bit, with as few bits as its increment needs.
#[derive(Clone, Copy, Debug)]
pub struct Phase {
    /// Fraction bits: one bit on the line is 2^`fraction`.
    pub fraction: usize,
    /// Half a bit.
    pub half: u64,
    /// Increment per clock cycle.
    pub increment: u64,
}

impl Phase {
    /// For `baud` bit/s at a clock of `clock_hz` Hz. At 3 Mbit/s and 100 MHz the relative error of the bit rate is
    /// 4·10⁻⁵.
    pub fn new(baud: u32, clock_hz: u32) -> Self {
        let increment = (f64::from(baud) / f64::from(clock_hz) * (1u64 << FRACTION) as f64).round() as u64;
        let zeros = (increment.trailing_zeros() as usize).min(FRACTION - 1);
        let fraction = FRACTION - zeros;
        Phase { fraction, half: 1 << (fraction - 1), increment: increment >> zeros }
    }
}
