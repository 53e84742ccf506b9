//! Timing of a scan in cycles of the engine's clock.
//!
//! ```text
//! row    ─X──────────────────────────────────────────────X──
//! CS     ‾‾‾|_first_|‾‾‾‾‾‾‾‾‾|___|‾‾‾|___|‾‾‾‾‾‾|___|‾‾‾‾‾‾‾
//!        gap  frame   row_gap      gap     channel_gap
//! ```
//! The first frame of a row only chooses channel 0; its result is dropped. A frame has one half period of SCLK before its
//! first edge, and two for each bit: frame = (2 · bits + 1) · half.
//!
//! gap ≥ acquisition, CS high, and [`Timing::drain`], so that the codes of a channel have left when the next frame begins.

use thiserror::Error;

use super::AdcScan;

/// A scan that its clock, converter or period does not allow.
#[derive(Clone, Debug, Error, PartialEq)]
#[error("hardware.adc_scan.{field} = {value} is not possible; it must be {expected}")]
pub struct TimingError {
    /// Field of the table.
    pub field: &'static str,
    /// Its value.
    pub value: f64,
    /// What is possible.
    pub expected: String,
}

/// Times in cycles of the clock.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Timing {
    /// Half a period of SCLK, ≥ 2.
    pub half: u64,
    /// CS low: a frame.
    pub frame: u64,
    /// CS high between two samples of a channel, and from the switch of a row to its first frame.
    pub gap: u64,
    /// CS high where the channel changes.
    pub channel_gap: u64,
    /// CS high before the first sample of a row.
    pub row_gap: u64,
    /// A row.
    pub row: u64,
    /// All rows.
    pub scan: u64,
    /// From one scan to the next.
    pub period: u64,
}

/// Fewest cycles of a period of SCLK: of half a period, one is for the delay of pins and wires.
const LEAST_CYCLES: f64 = 4.0;
/// Longest gap and period in cycles, which the counters hold.
const MOST_CYCLES: f64 = (1u64 << 30) as f64;

impl Timing {
    /// Cycles from the end of a frame until the codes of `converters` converters have been taken by a receiver that waits.
    pub fn drain(converters: usize) -> u64 {
        converters as u64 + 5
    }

    /// The timing of `scan` over `rows` rows at `clock_MHz`.
    ///
    /// # Errors
    /// [`TimingError`]: SCLK too fast for the converter or the clock, times beyond the counters, a period shorter than the
    /// scan.
    pub fn new(scan: &AdcScan, rows: usize, clock_MHz: f64) -> Result<Timing, TimingError> {
        let converter = &scan.converter;
        let refuse = |field, value, expected| Err(TimingError { field, value, expected });
        let most = converter.most_sclk_MHz.min(clock_MHz / LEAST_CYCLES);
        if scan.sclk_MHz > most {
            let why = format!("at most {most}: {} at {clock_MHz} MHz", converter.name);
            return refuse("sclk_MHz", scan.sclk_MHz, why);
        }
        let long = [
            ("row_settling_us", scan.row_settling_us),
            ("channel_settling_us", scan.channel_settling_us),
            ("period_us", scan.period_us),
            ("sclk_MHz", 1.0 / scan.sclk_MHz),
        ];
        if let Some((field, us)) = long.into_iter().find(|(_, us)| us * clock_MHz > MOST_CYCLES) {
            return match field {
                "sclk_MHz" => refuse(field, scan.sclk_MHz, format!("at least {}", clock_MHz / MOST_CYCLES)),
                _ => refuse(field, us, format!("at most {}", MOST_CYCLES / clock_MHz)),
            };
        }
        // A billionth less, so that what divides exactly is not rounded up.
        let cycles = |ns: f64| (ns * clock_MHz / 1e3 - 1e-9).ceil().max(0.0) as u64;
        let half = cycles(500.0 / scan.sclk_MHz).max(cycles(converter.cs_setup_ns));
        let frame = (2 * u64::from(converter.frame_bits) + 1) * half;
        let gap = cycles(converter.acquisition_ns.max(converter.cs_high_ns)).max(Timing::drain(scan.converters));
        let channel_gap = gap.max(cycles(1e3 * scan.channel_settling_us));
        let row_gap = channel_gap.max(cycles(1e3 * scan.row_settling_us).saturating_sub(gap + frame));
        let (channels, samples) = (scan.channels as u64, scan.samples() as u64);
        let row = gap
            + frame
            + row_gap
            + frame
            + (channels - 1) * (channel_gap + frame)
            + channels * (samples - 1) * (gap + frame);
        let all = rows as u64 * row;
        let period = (scan.period_us * clock_MHz).round() as u64;
        let needs = all + Timing::drain(scan.converters);
        if period < needs {
            let why = format!("at least {}: {needs} cycles at {clock_MHz} MHz", needs as f64 / clock_MHz);
            return refuse("period_us", scan.period_us, why);
        }
        Ok(Timing { half, frame, gap, channel_gap, row_gap, row, scan: all, period })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spec::adc::CONVERTERS;

    fn mat() -> AdcScan {
        AdcScan {
            converter: CONVERTERS[0],
            converters: 1,
            channels: 8,
            sclk_MHz: 12.5,
            row_settling_us: 10.0,
            channel_settling_us: 0.5,
            average: 2,
            period_us: 1000.0,
        }
    }

    #[test]
    fn by_hand() {
        // 100 MHz: SCLK 12.5 MHz is 8 cycles, a frame 33 · 4, the gap 156 ns.
        let timing = Timing::new(&mat(), 8, 100.0).unwrap();
        assert_eq!((timing.half, timing.frame, timing.gap), (4, 132, 16));
        assert_eq!((timing.channel_gap, timing.row_gap), (50, 1000 - 16 - 132));
        let row = 1000 + 132 + 7 * (50 + 132) + 8 * 3 * (16 + 132);
        assert_eq!((timing.row, timing.scan, timing.period), (row, 8 * row, 100_000));
    }

    #[test]
    fn what_is_impossible_says_what_it_takes() {
        let message = |change: fn(&mut AdcScan), clock_MHz: f64| {
            let mut scan = mat();
            change(&mut scan);
            Timing::new(&scan, 8, clock_MHz).unwrap_err().to_string()
        };
        let text = message(|scan| scan.sclk_MHz = 20.0, 100.0);
        assert_eq!(text, "hardware.adc_scan.sclk_MHz = 20 is not possible; it must be at most 16: max11125 at 100 MHz");
        assert!(message(|scan| scan.sclk_MHz = 12.5, 24.0).contains("at most 6: max11125 at 24 MHz"));
        let text = message(|scan| scan.period_us = 100.0, 100.0);
        assert!(text.contains("period_us = 100") && text.contains("at least 476.7: 47670 cycles"), "{text}");
        assert!(message(|scan| scan.period_us = 1e9, 100.0).contains("at most 10737418.24"));
        assert!(message(|scan| scan.sclk_MHz = 1e-12, 100.0).contains("at least 0.0000000931"));
        let mut least = mat();
        least.period_us = 476.7;
        assert_eq!(Timing::new(&least, 8, 100.0).unwrap().period, 47_670);
    }
}
