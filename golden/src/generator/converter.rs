//! Converter: simulates the readings of a real sensor from a frame.
//!
//! Applied in this order: Gaussian noise, tension clipped to zero (a unipolar sensor), rounding to codes, dead taxels
//! (read zero), stuck taxels (always read the same).
//!
//! | | shape | unit | range |
//! |---|---|---|---|
//! | in: noise | scalar | fraction of max \|b\| | standard deviation, at least 0 |
//! | in: bits | scalar | bits | 2 … 24; full scale is the frame's own peak unless given |
//! | in: dead, stuck | lists | \[row, col\], MPa | inside the array |
//! | out: frame | taxels | MPa | known forces are passed through |

use super::GeneratorError;
use crate::frame::Frame;
use crate::quantise::quantise;
use crate::random::Random;
use crate::sensor::Sensor;

/// Noise, quantisation and faults of a sensor.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Converter {
    /// Standard deviation of the noise as a fraction of the frame's largest |b|, at least 0.
    pub noise: f64,
    /// Whether tension reads as zero.
    pub unipolar: bool,
    /// Width of the converter's codes, 2 to 24; `None`: not quantised.
    pub bits: Option<u32>,
    /// Stress of the largest code in MPa, above 0; `None` takes the frame's peak.
    pub full_scale_MPa: Option<f64>,
    /// Taxels that read zero, [row, col].
    pub dead: Vec<[usize; 2]>,
    /// Taxels that always read the same stress, [row, col] and MPa.
    pub stuck: Vec<([usize; 2], f64)>,
    /// Seed of the noise.
    pub seed: u64,
}

impl Converter {
    /// The frame as the sensor reads it; the same seed gives the same noise.
    ///
    /// # Errors
    /// [`GeneratorError::Option`] for an option out of range, [`GeneratorError::Taxel`] for a taxel outside the array.
    pub fn convert(&self, frame: &Frame) -> Result<Frame, GeneratorError> {
        self.check()?;
        let mut frame = frame.clone();
        let peak = frame.peak_MPa();
        let mut random = Random::new(self.seed);
        for b in &mut frame.stress_MPa {
            if self.noise > 0.0 {
                *b += self.noise * peak * random.normal();
            }
            if self.unipolar {
                *b = b.max(0.0);
            }
        }
        if let Some(bits) = self.bits {
            let peak = frame.peak_MPa();
            let full_scale = self.full_scale_MPa.unwrap_or(if peak > 0.0 { peak } else { 1.0 });
            let codes = quantise(&frame.stress_MPa, bits, full_scale);
            frame.stress_MPa = codes.codes.iter().map(|&code| f64::from(code) * codes.lsb_MPa()).collect();
        }
        for taxel in &self.dead {
            let index = index("dead", &frame.sensor, *taxel)?;
            frame.stress_MPa[index] = 0.0;
        }
        for (taxel, reads) in &self.stuck {
            let index = index("stuck", &frame.sensor, *taxel)?;
            frame.stress_MPa[index] = *reads;
        }
        Ok(frame)
    }

    fn check(&self) -> Result<(), GeneratorError> {
        let fail = |field, value, allowed| Err(GeneratorError::Option { field, value, allowed });
        if !(self.noise >= 0.0 && self.noise.is_finite()) {
            return fail("noise", self.noise, "a number of at least 0");
        }
        if let Some(bits) = self.bits.filter(|bits| !(2..=24).contains(bits)) {
            return fail("bits", f64::from(bits), "a whole number from 2 to 24");
        }
        if let Some(mpa) = self.full_scale_MPa.filter(|mpa| !(*mpa > 0.0 && mpa.is_finite())) {
            return fail("full_scale_MPa", mpa, "a number above 0");
        }
        match self.stuck.iter().find(|(_, reads)| !reads.is_finite()) {
            Some((_, reads)) => fail("stuck", *reads, "a finite number of MPa"),
            None => Ok(()),
        }
    }
}

fn index(field: &'static str, sensor: &Sensor, [row, col]: [usize; 2]) -> Result<usize, GeneratorError> {
    let Sensor { rows, cols, .. } = *sensor;
    if row < rows && col < cols {
        Ok(row * cols + col)
    } else {
        Err(GeneratorError::Taxel { field, row, col, rows, cols })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Scene;

    fn frame() -> Frame {
        Frame::eq2(&Scene::builtin("sensor-3").unwrap().sensor)
    }

    #[test]
    fn noise_has_its_size_and_its_seed() {
        let (frame, noise) = (frame(), Converter { noise: 0.01, seed: 5, ..Default::default() });
        let noisy = noise.convert(&frame).unwrap();
        assert_eq!(noisy, noise.convert(&frame).unwrap());
        assert_ne!(noisy, Converter { seed: 6, ..noise }.convert(&frame).unwrap());
        let squares = noisy.stress_MPa.iter().zip(&frame.stress_MPa).map(|(a, b)| (a - b).powi(2));
        let deviation = (squares.sum::<f64>() / 400.0).sqrt() / frame.peak_MPa();
        // 400 draws estimate a deviation to 1/√800 = 3.5 %; four times that.
        assert!((deviation / 0.01 - 1.0).abs() < 0.14, "{deviation}");
    }

    #[test]
    fn clipping_codes_and_faults() {
        let converter = Converter {
            unipolar: true,
            bits: Some(8),
            dead: vec![[2, 3]],
            stuck: vec![([0, 1], -0.5)],
            ..Default::default()
        };
        let frame = converter.convert(&frame()).unwrap();
        assert_eq!((frame.stress_MPa[43], frame.stress_MPa[1]), (0.0, -0.5));
        let lsb = frame.peak_MPa().min(1.0);
        assert!(lsb > 0.0 && frame.stress_MPa.iter().skip(2).all(|b| *b >= 0.0));
    }

    #[test]
    fn refusals_name_option_and_value() {
        let cases = [
            (Converter { noise: f64::NAN, ..Default::default() }, "noise = NaN"),
            (Converter { bits: Some(25), ..Default::default() }, "bits = 25"),
            (Converter { full_scale_MPa: Some(0.0), ..Default::default() }, "full_scale_MPa = 0"),
            (
                Converter { dead: vec![[20, 0]], ..Default::default() },
                "dead: taxel 20,0 is outside the array of 20 rows",
            ),
            (Converter { stuck: vec![([0, 0], f64::INFINITY)], ..Default::default() }, "stuck = inf"),
        ];
        for (converter, wanted) in cases {
            let text = converter.convert(&frame()).unwrap_err().to_string();
            assert!(text.contains(wanted), "{text}");
        }
    }
}
