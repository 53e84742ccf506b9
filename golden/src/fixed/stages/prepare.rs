//! Stage `prepare`, before `receive`: calibration, then averaging, where the scene asks for them.
//!
//! ```text
//! code ── calibrate ── average ── receive        s = ⌊gain·(code − zero) / 2^16 + 1/2⌋,  held to code_bits
//!         zero, gain    Σ of 2^k frames           b = Σ s: k bits more, the same full scale
//! ```
//! | word | bits | LSB |
//! |---|---|---|
//! | code | `code_bits` | full scale / (largest gain · (2^(code_bits − 1) − 1)), in the readings' unit |
//! | zero: the tare frame, else the table's offset | `code_bits` | the same |
//! | gain over the largest gain | 18 | 2^−16 |
//! | s | `code_bits` | full scale / (2^(code_bits − 1) − 1) |
//! | b | `input_bits` = `code_bits` + k | that over 2^k |
//!
//! Without a table the gain is 1 and nothing is multiplied. Each sample is rounded once; the sum keeps all its bits.

use crate::fixed::error::FixedError;
use crate::fixed::words::arith::{round_shift, saturate};
use crate::frame::FrameError;
use crate::input::calibration::Calibration;
use crate::input::tare::Tare;
use crate::input::InputError;
use crate::quantise::{largest_code, quantise};
use crate::scene::Scene;

/// Fraction bits of a gain word.
pub const GAIN_FRACTION: u32 = 16;
/// Width of a gain word: the largest is 1.0.
pub const GAIN_BITS: u32 = GAIN_FRACTION + 2;

/// The stage of one scene; without input options it passes the codes on.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Prepare {
    /// Zero of each taxel in codes, if the scene has a tare frame or a table.
    pub zero: Option<Vec<i32>>,
    /// Gain word of each taxel, 2^−16 per LSB, if the scene has a table.
    pub gain: Option<Vec<i32>>,
    /// 2^average frames are added up.
    pub average: u32,
    /// Reading per MPa at the largest gain, in the readings' unit: 1 / (largest |gain|).
    pub reading_per_MPa: f64,
    code_bits: u32,
}

/// Conversion of a scene's readings to MPa, in floating point.
#[derive(Clone)]
pub struct Scale {
    table: Option<Calibration>,
    tare: Option<Vec<f64>>,
    /// Largest |gain|, 1 without a table.
    pub largest: f64,
}

impl Scale {
    /// Readings with a tare frame of zeros and, with `gains`, a table of ones: to count resources without the files.
    pub fn of_tare(taxels: usize, gains: bool) -> Scale {
        let table = gains.then(|| Calibration::identity(taxels));
        Scale { table, tare: Some(vec![0.0; taxels]), largest: 1.0 }
    }

    /// Reads the calibration table and the tare frame that the scene names.
    pub fn new(scene: &Scene) -> Result<Scale, FixedError> {
        let spec = &scene.input;
        let table = spec.calibration.as_ref().map(|path| Calibration::load(path, &scene.sensor)).transpose();
        let table = table.map_err(InputError::from)?;
        let tare = spec.tare.as_ref().map(|path| Ok::<_, FrameError>(Tare::load(path, scene)?.zero));
        let largest = table.as_ref().map_or(1.0, |table| table.gain.iter().fold(0.0f64, |most, g| most.max(g.abs())));
        Ok(Scale { tare: tare.transpose()?, table, largest })
    }
}

impl Prepare {
    /// The stage of a scene; its largest word means `full_scale_MPa`.
    pub fn new(scene: &Scene, scale: Scale, full_scale_MPa: f64) -> Prepare {
        let code_bits = scene.fixed.input_bits;
        let reading_per_MPa = 1.0 / scale.largest;
        let codes = |readings: &[f64]| quantise(readings, code_bits, full_scale_MPa * reading_per_MPa).codes;
        let unit = f64::from(1u32 << GAIN_FRACTION);
        let word = |gain: &f64| (gain / scale.largest * unit).round() as i32;
        let offset = scale.table.as_ref().map(|table| table.offset.as_slice());
        Prepare {
            zero: scale.tare.as_deref().or(offset).map(codes),
            gain: scale.table.as_ref().map(|table| table.gain.iter().map(word).collect()),
            average: scene.input.average,
            reading_per_MPa,
            code_bits,
        }
    }

    /// Largest word of the frame buffer: the largest code times 2^average.
    pub fn largest(&self) -> f64 {
        f64::from(largest_code(self.code_bits)) * f64::from(1u32 << self.average)
    }

    /// One calibrated sample of taxel `taxel`, saturated to `code_bits`.
    pub fn calibrate(&self, taxel: usize, code: i32) -> i64 {
        let zero = self.zero.as_ref().map_or(0, |zero| i64::from(zero[taxel]));
        let difference = i64::from(code) - zero;
        let scaled = match &self.gain {
            Some(gain) => round_shift(difference * i64::from(gain[taxel]), GAIN_FRACTION),
            None => difference,
        };
        saturate(scaled, self.code_bits).0
    }

    /// Calibrates and adds up 2^average frames of codes, given frame after frame; the result is one row-major frame.
    pub fn run(&self, codes: &[i32]) -> Vec<i32> {
        let taxels = codes.len() >> self.average;
        let mut sums = vec![0; taxels];
        for (index, &code) in codes.iter().enumerate() {
            sums[index % taxels] += self.calibrate(index % taxels, code) as i32;
        }
        sums
    }

    /// Latency in cycles between the input stream and `receive`.
    pub fn latency(&self) -> u64 {
        let calibrate = match (&self.zero, &self.gain) {
            (None, None) => 0,
            (_, None) => 2,
            (_, Some(_)) => 4,
        };
        calibrate + if self.average > 0 { 2 } else { 0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn by_hand() {
        let half = 1 << (GAIN_FRACTION - 1);
        let prepare = Prepare {
            zero: Some(vec![10, -3]),
            gain: Some(vec![half, 2 * half]),
            average: 1,
            reading_per_MPa: 1.0,
            code_bits: 8,
        };
        // (15 − 10)/2 = 2.5 rounds to 3; 127 + 3 is held to 127.
        assert_eq!(prepare.run(&[15, 127, 10, -128]), [3, 127 - 125]);
    }
}
