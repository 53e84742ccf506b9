//! Bits on the line from a fraction of a bit per clock cycle, so that any bit rate fits any clock.

/// Most fraction bits of a bit's phase.
const FRACTION: u32 = 16;

/// A phase counts fractions of a bit, in as few bits as its steps need.
#[derive(Clone, Copy, Debug)]
pub struct Phase {
    /// Fraction bits.
    pub fraction: u32,
    /// Half a bit.
    pub half: u32,
    /// What a clock cycle adds.
    pub increment: u32,
}

impl Phase {
    /// For `baud` bit/s. At 3 Mbit/s and 100 MHz the increment is off by 4·10⁻⁵, a bit in 25 000.
    pub fn new(baud: u32, clock_hz: u32) -> Self {
        let increment = (f64::from(baud) / f64::from(clock_hz) * f64::from(1 << FRACTION)).round() as u32;
        let zeros = increment.trailing_zeros().min(FRACTION - 1);
        let fraction = FRACTION - zeros;
        Phase { fraction, half: 1 << (fraction - 1), increment: increment >> zeros }
    }
}
