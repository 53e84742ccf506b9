//! Converter: simulates the readings of a real sensor from a frame.
//!
//! Applied in this order: gains that differ between taxels, drift of the zeros since the tare, noise of the tare; then
//! for each of the averaged frames Gaussian noise, tension clipped to zero (a unipolar sensor), rounding to codes; then
//! the mean of the frames, dead taxels (read zero), stuck taxels (always read the same).
//!
//! ```text
//! reading = mean over frames of round(clip((1 + γ g) b + (δ d − σ t/√tare_frames + σ n) max|b|))
//! ```
//!
//! g, d and t are normal and one per taxel, n one per taxel and frame; averaging reduces only n.
//!
//! | | shape | unit | range |
//! |---|---|---|---|
//! | in: noise σ | scalar | fraction of max \|b\| | standard deviation of one frame, at least 0 |
//! | in: gain spread γ | scalar | fraction of each b | standard deviation, at least 0 |
//! | in: drift δ | scalar | fraction of max \|b\| | standard deviation, at least 0 |
//! | in: bits | scalar | bits | 2 … 24; full scale is the frame's own peak unless given |
//! | in: dead, stuck | lists | \[row, col\], MPa | inside the array |
//! | out: frame | taxels | MPa | known forces are passed through |

use super::GeneratorError;
use crate::data::frame::Frame;
use crate::data::quantise::quantise;
use crate::random::Random;
use crate::spec::sensor::Sensor;

/// Largest number of averaged frames.
const MOST_FRAMES: usize = 100_000;

/// Noise, gains, quantisation and faults of a sensor.
#[derive(Clone, Debug, PartialEq)]
pub struct Converter {
    /// Standard deviation of the noise of one frame as a fraction of the frame's largest |b|, at least 0.
    pub noise: f64,
    /// Standard deviation of the taxels' gains as a fraction, at least 0.
    pub gain_spread: f64,
    /// Standard deviation of the taxels' zeros since the tare as a fraction of the frame's largest |b|, at least 0.
    pub drift: f64,
    /// Frames without contact whose mean is subtracted; their noise remains as an offset of each taxel. 0: none.
    pub tare_frames: usize,
    /// Number of frames whose mean is the reading, each with its own noise; at least 1.
    pub frames: usize,
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
    /// Seed of gains, drift and noise.
    pub seed: u64,
}

impl Default for Converter {
    fn default() -> Self {
        Converter {
            noise: 0.0,
            gain_spread: 0.0,
            drift: 0.0,
            tare_frames: 0,
            frames: 1,
            unipolar: false,
            bits: None,
            full_scale_MPa: None,
            dead: Vec::new(),
            stuck: Vec::new(),
            seed: 0,
        }
    }
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
        self.offset(&mut frame.stress_MPa, peak, &mut random);
        let mut mean = vec![0.0; frame.stress_MPa.len()];
        for _ in 0..self.frames {
            let one = self.one(&frame.stress_MPa, peak, &mut random);
            mean.iter_mut().zip(one).for_each(|(mean, b)| *mean += b / self.frames as f64);
        }
        frame.stress_MPa = mean;
        self.fail_taxels(&mut frame)?;
        Ok(frame)
    }

    /// The frames of a press as the sensor reads them, in their order: gains and drift are those of the press, drift grows evenly from
    /// none in the first frame, the noise is that of each frame. Shares are of the largest |b| of all; the full scale is `full_scale`
    /// times that unless it is stated. Nothing is averaged.
    ///
    /// # Errors
    /// As [`Converter::convert`].
    pub(super) fn convert_in_order(
        &self,
        frames: &mut [Frame],
        full_scale: f64,
        random: &mut Random,
    ) -> Result<(), GeneratorError> {
        self.check()?;
        let peak = frames.iter().map(Frame::peak_MPa).fold(0.0, f64::max);
        let taxels = frames.first().map_or(0, |frame| frame.stress_MPa.len());
        let mut drawn = |deviation: f64| -> Vec<f64> { (0..taxels).map(|_| deviation * random.normal()).collect() };
        let (gains, drift, tare) = (drawn(self.gain_spread), drawn(self.drift * peak), drawn(self.tare_noise() * peak));
        let full_scale_MPa = self.full_scale_MPa.or((peak > 0.0).then_some(full_scale * peak));
        let each = Converter { full_scale_MPa, ..self.clone() };
        let last = frames.len().saturating_sub(1).max(1) as f64;
        for (number, frame) in frames.iter_mut().enumerate() {
            let stress = frame.stress_MPa.iter().enumerate();
            let grown = number as f64 / last;
            let off: Vec<f64> = stress.map(|(k, b)| b * (1.0 + gains[k]) + grown * drift[k] + tare[k]).collect();
            frame.stress_MPa = each.one(&off, peak, random);
            self.fail_taxels(frame)?;
        }
        Ok(())
    }

    /// Applies what is the same in all averaged frames: gains, drift and the noise of the tare.
    fn offset(&self, stress_MPa: &mut [f64], peak: f64, random: &mut Random) {
        let tare = self.tare_noise();
        // A deviation of zero draws no number.
        for (deviation, share) in [(self.gain_spread, true), (self.drift, false), (tare, false)] {
            for b in stress_MPa.iter_mut().filter(|_| deviation > 0.0) {
                *b += deviation * random.normal() * if share { *b } else { peak };
            }
        }
    }

    /// Standard deviation of the zeros, from the noise of the tare, as a share of the largest |b|.
    fn tare_noise(&self) -> f64 {
        if self.tare_frames > 0 {
            self.noise / (self.tare_frames as f64).sqrt()
        } else {
            0.0
        }
    }

    /// Dead and stuck taxels.
    fn fail_taxels(&self, frame: &mut Frame) -> Result<(), GeneratorError> {
        for taxel in &self.dead {
            let index = index("dead", &frame.sensor, *taxel)?;
            frame.stress_MPa[index] = 0.0;
        }
        for (taxel, reads) in &self.stuck {
            let index = index("stuck", &frame.sensor, *taxel)?;
            frame.stress_MPa[index] = *reads;
        }
        Ok(())
    }

    /// One frame: noise, clipping, codes.
    fn one(&self, stress_MPa: &[f64], peak: f64, random: &mut Random) -> Vec<f64> {
        let noisy = |b: &f64| if self.noise > 0.0 { b + self.noise * peak * random.normal() } else { *b };
        let mut stress_MPa: Vec<f64> = stress_MPa.iter().map(noisy).collect();
        if self.unipolar {
            stress_MPa.iter_mut().for_each(|b| *b = b.max(0.0));
        }
        let Some(bits) = self.bits else { return stress_MPa };
        let peak = stress_MPa.iter().fold(0.0f64, |peak, b| b.abs().max(peak));
        let full_scale = self.full_scale_MPa.unwrap_or(if peak > 0.0 { peak } else { 1.0 });
        let codes = quantise(&stress_MPa, bits, full_scale);
        codes.codes.iter().map(|&code| f64::from(code) * codes.lsb_MPa()).collect()
    }

    fn check(&self) -> Result<(), GeneratorError> {
        let fail = |field, value, allowed| Err(GeneratorError::Option { field, value, allowed });
        for (field, share) in [("noise", self.noise), ("gain_spread", self.gain_spread), ("drift", self.drift)] {
            if !(share >= 0.0 && share.is_finite()) {
                return fail(field, share, "a number of at least 0");
            }
        }
        if !(1..=MOST_FRAMES).contains(&self.frames) {
            return fail("frames", self.frames as f64, "a whole number from 1 to 100000");
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
    use crate::spec::scene::Scene;

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
    fn averaging_leaves_gains_drift_and_the_tares_noise() {
        let frame = frame();
        let peak = frame.peak_MPa();
        let off = |converter: Converter| {
            let read = converter.convert(&frame).unwrap().stress_MPa;
            let squares = read.iter().zip(&frame.stress_MPa).map(|(a, b)| (a - b).powi(2));
            (squares.sum::<f64>() / 400.0).sqrt()
        };
        let sensor = Converter { noise: 0.01, frames: 64, seed: 3, ..Default::default() };
        let rms = (frame.stress_MPa.iter().map(|b| b * b).sum::<f64>() / 400.0).sqrt();
        let cases = [
            (sensor.clone(), 0.01 * peak / 8.0),
            (Converter { drift: 0.02, ..sensor.clone() }, peak * 0.01f64.hypot(0.16) / 8.0),
            (Converter { tare_frames: 16, ..sensor.clone() }, 0.01 * peak * (1.0f64 / 64.0 + 1.0 / 16.0).sqrt()),
            (Converter { noise: 0.0, gain_spread: 0.03, ..sensor }, 0.03 * rms),
        ];
        for (converter, wanted) in cases {
            let text = format!("{converter:?}");
            // Four deviations of an estimate from 400 draws; of gains the largest taxels count most.
            assert!((off(converter) / wanted - 1.0).abs() < 0.2, "{text}");
        }
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
            (Converter { gain_spread: -0.1, ..Default::default() }, "gain_spread = -0.1"),
            (Converter { drift: f64::INFINITY, ..Default::default() }, "drift = inf"),
            (Converter { frames: 0, ..Default::default() }, "frames = 0"),
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
