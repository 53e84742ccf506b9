//! Stage `prepare`, before `receive`: calibration, then averaging, where the scene asks for them.
//!
//! ```text
//! code ── calibrate ── average ── receive        s = ⌊gain·(code − zero) / 2^16 + 1/2⌋,  held to code_bits
//!         zero, gain    Σ of 2^k frames           b = Σ s: k bits more, the same full scale
//!                       or sliding mean           b ← b + ⌊(2^k s − b − c) / 2^g + 1/2⌋: likewise
//!                       or adaptive mean          that of a window: `adaptive_mean`
//! ```
//! An engine that serves several arrays has a zero, a gain, a drift and a mean for each taxel of each of them; what follows is of one
//! array, [`Prepare::of_array`].
//!
//! Where the zero runs, its drift is taken off `code − zero` ([`running_zero`]). Beside them the codes are checked as they
//! arrive ([`code_check`]).
//!
//! | word | bits | LSB |
//! |---|---|---|
//! | code | `code_bits` | full scale / (largest gain · (2^(code_bits − 1) − 1)), in the readings' unit |
//! | zero: the tare frame, else the table's offset | `code_bits` | the same |
//! | gain over the largest gain | 18 | 2^−16 |
//! | s | `code_bits` | full scale / (2^(code_bits − 1) − 1) |
//! | b | `input_bits` = `code_bits` + k | that over 2^k |
//!
//! Without a table the gain is 1 and nothing is multiplied. Each sample is rounded once; the sum keeps all its bits. A
//! sliding mean ([`sliding`](crate::spec::sliding), with g) is rounded to its k more bits with every frame, which adds as
//! much noise as the converter's own rounding; the first frame, and constant readings from then on, it holds exactly. c is
//! 1 in every second frame, which rounds halves down in place of up, so that they do not add up to a bias.

pub mod adaptive_mean;
pub mod code_check;
pub mod running_zero;

use crate::data::frame::FrameError;
use crate::data::input::calibration::Calibration;
use crate::data::input::tare::Tare;
use crate::data::input::InputError;
use crate::data::quantise::quantise;
use crate::fixed::error::FixedError;
use crate::fixed::words::arith::{round_shift, saturate};
use crate::result::flags::FlagSet;
use crate::spec::scene::largest_code;
use crate::spec::scene::{MeanKind, Scene};
use crate::spec::sliding::gain_shift;
use adaptive_mean::{AdaptiveMean, AdaptiveState};
use code_check::CodeCheck;
use running_zero::{Drift, RunningZero};

/// Fraction bits of a gain word.
pub const GAIN_FRACTION: u32 = 16;
/// Width of a gain word: the largest is 1.0.
pub const GAIN_BITS: u32 = GAIN_FRACTION + 2;

/// The stage of one scene; without input options it passes the codes on.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Prepare {
    /// Zero of each taxel in codes, if the scene has a tare frame or a table; array after array.
    pub zero: Option<Vec<i32>>,
    /// Gain word of each taxel, 2^−16 per LSB, if the scene has a table; 0 for a dead taxel that is written. Array after array.
    pub gain: Option<Vec<i32>>,
    /// k: 2^average frames are added up, or the last gain of a sliding mean is 2^−average; of an adaptive one that of its longest mean.
    pub average: u32,
    /// How frames are averaged.
    pub mean: MeanKind,
    /// The windows of an adaptive mean.
    pub adaptive: Option<AdaptiveMean>,
    /// How zeros follow the readings, if they do.
    pub running: Option<RunningZero>,
    /// How codes are checked, if they are.
    pub check: Option<CodeCheck>,
    /// Reading per MPa at the largest gain, in the readings' unit: 1 / (largest |gain|).
    pub reading_per_MPa: f64,
    code_bits: u32,
    taxels: usize,
}

/// What the stage has made of the frames so far: the words of the frame buffer, and the state for the next frames.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Prepared {
    /// A word per taxel, row-major.
    pub words: Vec<i32>,
    /// Number of frames in them.
    pub frames: usize,
    /// The means of which an adaptive mean is.
    pub adaptive: AdaptiveState,
    /// How far zeros have moved.
    pub drift: Drift,
    /// What the codes of a block of frames raise, or with a sliding mean those of the last one.
    pub raised: FlagSet,
}

/// Conversion of a scene's readings to MPa, in floating point.
#[derive(Clone)]
pub struct Scale {
    /// Of the taxels of all arrays, array after array.
    table: Option<Calibration>,
    tare: Option<Vec<f64>>,
    /// Largest |gain|, of all arrays; 1 without a table.
    pub largest: f64,
}

impl Scale {
    /// Readings of so many taxels, of all arrays together, with a tare frame of zeros and, with `gains`, a table of ones: to count
    /// resources without the files.
    pub fn of_tare(taxels: usize, gains: bool) -> Scale {
        let table = gains.then(|| Calibration::identity(taxels));
        Scale { table, tare: Some(vec![0.0; taxels]), largest: 1.0 }
    }

    /// Reads the calibration tables and the tare frames that the scene names. Where tables are written there is always one, and
    /// the largest gain is that of `hardware.table_range`, so that a code keeps its meaning.
    ///
    /// # Errors
    /// What is wrong with a file; [`FixedError::TableRange`].
    pub fn new(scene: &Scene) -> Result<Scale, FixedError> {
        let files = |array: usize| {
            let array_scene = scene.of_array(array);
            let table = array_scene
                .input
                .calibration
                .as_ref()
                .map(|path| Calibration::load(path, &array_scene.sensor))
                .transpose();
            let tare =
                array_scene.input.tare.as_ref().map(|path| Ok::<_, FrameError>(Tare::load(path, &array_scene)?.zero));
            Ok::<_, FixedError>((table.map_err(InputError::from)?, tare.transpose()?))
        };
        let (mut table, mut tare) = files(0)?;
        for array in 1..scene.hardware.arrays {
            let (of_array, zero) = files(array)?;
            if let (Some(table), Some(of_array)) = (&mut table, of_array) {
                table.offset.extend(of_array.offset);
                table.gain.extend(of_array.gain);
            }
            tare.iter_mut().zip(zero).for_each(|(tare, zero)| tare.extend(zero));
        }
        let largest = scene.hardware.largest_gain(table.as_ref().map(|table| table.gain.as_slice()));
        if !scene.hardware.has_writable_tables() {
            return Ok(Scale { tare, table, largest });
        }
        let table = table.unwrap_or_else(|| Calibration::identity(scene.hardware.arrays * scene.sensor.taxels()));
        let Some([least, most]) = scene.hardware.table_range.gain else {
            return Ok(Scale { tare, table: Some(table), largest });
        };
        let outside = |gain: &f64| !(least..=most).contains(&gain.abs());
        if let Some(taxel) = table.gain.iter().position(outside) {
            let of_array = taxel % scene.sensor.taxels();
            let place = [of_array / scene.sensor.cols, of_array % scene.sensor.cols];
            return Err(FixedError::TableRange { place, gain: table.gain[taxel], allowed: [least, most] });
        }
        Ok(Scale { tare, table: Some(table), largest })
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
        let mut gain: Option<Vec<i32>> = scale.table.as_ref().map(|table| table.gain.iter().map(word).collect());
        if let Some(gain) = gain.as_mut().filter(|_| scene.hardware.has_writable_dead_taxels()) {
            for [row, col] in &scene.input.dead {
                gain[row * scene.sensor.cols + col] = 0;
            }
        }
        let taxels = scene.sensor.taxels();
        let running = RunningZero::of_scene(scene);
        Prepare {
            zero: scale.tare.as_deref().or(offset).map(codes),
            check: CodeCheck::of_scene(scene, gain.as_deref()),
            gain,
            running,
            average: scene.input.longest_average(),
            mean: scene.input.mean,
            adaptive: AdaptiveMean::of_scene(scene),
            reading_per_MPa,
            code_bits,
            taxels,
        }
    }

    /// The stage of array `array` of those that the engine serves, below their number, alone; the same stage where there is one.
    pub fn of_array(&self, array: usize) -> Prepare {
        let own = |words: &Option<Vec<i32>>| {
            let words = words.as_ref()?.chunks(self.taxels).nth(array)?;
            Some(words.to_vec())
        };
        Prepare { zero: own(&self.zero), gain: own(&self.gain), ..self.clone() }
    }

    /// Largest word of the frame buffer: the largest code times 2^average.
    pub fn largest(&self) -> f64 {
        f64::from(largest_code(self.code_bits)) * f64::from(1u32 << self.average)
    }

    /// The calibrated samples of a frame, or the first of them if it ends `early`, each saturated to `code_bits`.
    fn calibrate(&self, drift: &mut Drift, codes: &[i32], early: bool) -> Vec<i64> {
        let zero = |taxel: usize| self.zero.as_ref().map_or(0, |zero| i64::from(zero[taxel]));
        let off: Vec<i64> = codes.iter().enumerate().map(|(taxel, &code)| i64::from(code) - zero(taxel)).collect();
        let direction = |taxel: usize| self.gain.as_ref().map_or(1, |gain| i64::from(gain[taxel].signum()));
        let differences = match &self.running {
            Some(running) => running.follow(drift, &off, direction, early),
            None => off,
        };
        differences.into_iter().enumerate().map(|(taxel, difference)| self.scaled(taxel, difference)).collect()
    }

    /// The sample of taxel `taxel`, saturated to `code_bits`, from what its code is above its zero.
    fn scaled(&self, taxel: usize, difference: i64) -> i64 {
        let scaled = match &self.gain {
            Some(gain) => round_shift(difference * i64::from(gain[taxel]), GAIN_FRACTION),
            None => difference,
        };
        saturate(scaled, self.code_bits).0
    }

    /// No frames yet.
    pub fn empty(&self) -> Prepared {
        let (words, drift) = (vec![0; self.taxels], Drift::new(self.taxels));
        Prepared { words, frames: 0, adaptive: AdaptiveState::default(), drift, raised: FlagSet::default() }
    }

    /// Calibrates frames of codes and adds them to `prepared`, frame after frame, each row-major. A block that is complete
    /// makes room for the next. Every sample is 0 while tables are `incomplete`.
    pub fn add(&self, prepared: &mut Prepared, codes: &[i32], incomplete: bool) {
        for frame in codes.chunks(self.taxels) {
            if self.mean == MeanKind::Block && prepared.frames == 1 << self.average {
                self.restart_mean(prepared);
            }
            let raised = self.check.as_ref().map_or(FlagSet::default(), |check| check.flags(frame));
            let mut samples = self.calibrate(&mut prepared.drift, frame, false);
            if incomplete {
                samples.fill(0);
            }
            let slides = self.mean != MeanKind::Block;
            prepared.raised = if slides { raised } else { prepared.raised | raised };
            if let Some(adaptive) = &self.adaptive {
                prepared.frames += 1;
                let input_bits = self.code_bits + self.average;
                prepared.words = adaptive.add(&mut prepared.adaptive, &samples, prepared.frames, input_bits);
                continue;
            }
            let shift = slides.then(|| gain_shift(prepared.frames + 1, self.average));
            let half_down = (prepared.frames % 2) as i64;
            for (word, sample) in prepared.words.iter_mut().zip(samples) {
                let added = match shift {
                    None => sample,
                    Some(shift) => round_shift((sample << self.average) - i64::from(*word) - half_down, shift),
                };
                // A sum, or a word between two of `input_bits`, which the formats hold below 32.
                *word += added as i32;
            }
            prepared.frames += 1;
        }
    }

    /// What an early `tlast` leaves, which drops a frame after its first `codes`: a mean starts again, a running zero goes on.
    pub fn cut(&self, prepared: &mut Prepared, codes: &[i32]) {
        self.restart_mean(prepared);
        self.calibrate(&mut prepared.drift, codes, true);
    }

    fn restart_mean(&self, prepared: &mut Prepared) {
        prepared.words.fill(0);
        prepared.frames = 0;
        prepared.raised = FlagSet::default();
    }

    /// The words after all `codes` since a reset: 2^average frames, with a running zero a multiple of them; or any number with
    /// a sliding mean.
    pub fn run(&self, codes: &[i32]) -> Prepared {
        let mut prepared = self.empty();
        self.add(&mut prepared, codes, false);
        prepared
    }

    /// Cycles from the last code of a frame to the first that is taken of the next, less one, where `receive` does not wait.
    pub fn occupied(&self) -> u64 {
        self.adaptive.as_ref().map_or(0, AdaptiveMean::latency)
    }

    /// Latency in cycles between the input stream and `receive`.
    pub fn latency(&self) -> u64 {
        let calibrate = match (&self.zero, &self.gain) {
            (None, None) if self.running.is_none() => 0,
            (_, None) => 2,
            (_, Some(_)) => 4,
        };
        let running = if self.running.is_some() { 2 } else { 0 };
        let average = match self.mean {
            MeanKind::Block if self.average == 0 => 0,
            MeanKind::Block => 2,
            MeanKind::Sliding => 3,
            MeanKind::Adaptive => self.adaptive.as_ref().map_or(0, AdaptiveMean::latency),
        };
        calibrate + running + average
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;
    use crate::spec::sliding::most_frames;

    #[test]
    fn by_hand() {
        let half = 1 << (GAIN_FRACTION - 1);
        let prepare = Prepare {
            zero: Some(vec![10, -3]),
            gain: Some(vec![half, 2 * half]),
            average: 1,
            code_bits: 8,
            taxels: 2,
            ..Prepare::default()
        };
        // (15 − 10)/2 = 2.5 rounds to 3; 127 + 3 is held to 127.
        let (drift, raised) = (Drift::new(2), FlagSet::default());
        let of = Prepared { words: vec![3, 127 - 125], frames: 2, adaptive: AdaptiveState::default(), drift, raised };
        assert_eq!(prepare.run(&[15, 127, 10, -128]), of);
        let sliding = Prepare { zero: None, gain: None, average: 2, mean: MeanKind::Sliding, taxels: 1, ..prepare };
        let mut words = sliding.empty();
        let mut after = |code: i32| {
            sliding.add(&mut words, &[code], false);
            (words.words[0], words.frames)
        };
        // 4 · 10; + (4 · 13 − 40 − 1)/2 = 5.5 to 6; + (4 · −5 − 46)/4 = −16.5 rounds to −16; + (0 − 30 − 1)/4 = −7.75 to −8.
        assert_eq!([10, 13, -5, 0].map(&mut after), [(40, 1), (46, 2), (30, 3), (22, 4)]);
    }

    /// Each array has the words of its own files; codes mean the same in all, those of the largest gain.
    #[test]
    fn arrays_have_files_of_their_own() {
        let folder = tempfile::tempdir().unwrap();
        let mut scene = Scene::builtin("eight-by-eight").unwrap();
        let path = |array: &str| folder.path().join(format!("table-{array}.csv"));
        scene.hardware.arrays = 2;
        (scene.input.calibration, scene.input.full_scale_MPa) = (Some(path("{array}")), Some(1.0));
        for (array, gain) in [("0", 0.5), ("1", 2.0)] {
            let table = Calibration { offset: vec![gain / 10.0; 64], gain: vec![gain; 64] };
            std::fs::write(path(array), table.to_csv(&scene.sensor)).unwrap();
        }
        let scale = Scale::new(&scene).unwrap();
        assert_eq!(scale.largest, 2.0);
        let all = Prepare::new(&scene, scale, 1.0);
        let [zeros, gains] = [&all.zero, &all.gain].map(|words| words.as_ref().unwrap());
        assert_eq!((zeros.len(), gains[0], gains[127]), (128, 1 << (GAIN_FRACTION - 2), 1 << GAIN_FRACTION));
        let second = all.of_array(1);
        assert_eq!(second.zero.as_deref(), Some(&zeros[64..]));
        assert_eq!(second.of_array(0), second);
        // An offset of four times that of the first, both rounded.
        assert!((zeros[64] - 4 * zeros[0]).abs() <= 2, "{} {}", zeros[64], zeros[0]);
        let own = scene.of_array(1);
        assert_eq!((own.hardware.arrays, own.input.calibration.clone()), (1, Some(path("1"))));
        assert_eq!(own.of_array(0), own);
        std::fs::remove_file(path("1")).unwrap();
        assert!(Scale::new(&scene).err().unwrap().to_string().contains("table-1.csv"));
    }

    /// Noise falls to σ²/(2^(k+1) − 1), where σ² is that of the readings and twice that of rounding, 1/12 each.
    #[test]
    fn a_sliding_mean_has_the_stated_noise() {
        let mut random = Random::new(22);
        for (average, spread) in [(3, 1.0), (5, 4.0), (8, 30.0)] {
            let taxels = 2000;
            let prepare = Prepare { average, mean: MeanKind::Sliding, code_bits: 20, taxels, ..Prepare::default() };
            // Levels between two codes, so that the converter's rounding is noise too.
            let level = |taxel: usize| 1000.3 + taxel as f64 / taxels as f64;
            let mut prepared = prepare.empty();
            let most = most_frames(average);
            for _ in 0..5 * most {
                let code = |taxel| (level(taxel) + spread * random.normal()).round() as i32;
                let codes: Vec<i32> = (0..taxels).map(code).collect();
                prepare.add(&mut prepared, &codes, false);
            }
            let words = prepared.words.iter().enumerate();
            let errors: Vec<f64> =
                words.map(|(k, word)| f64::from(*word) * 0.5f64.powi(average as i32) - level(k)).collect();
            let mean = errors.iter().sum::<f64>() / taxels as f64;
            let variance = errors.iter().map(|error| error * error).sum::<f64>() / taxels as f64;
            let wanted = (spread * spread + 2.0 / 12.0) / most as f64;
            // 2000 draws estimate a variance to √(2/2000) = 3 % and the mean to σ/√2000; four times that.
            assert!((variance / wanted - 1.0).abs() < 0.13, "{average}: {variance} {wanted}");
            assert!(mean.abs() < 4.0 * (wanted / taxels as f64).sqrt(), "{average}: {mean}");
        }
    }

    /// From the first frame on; after a step, up to half a code remains.
    #[test]
    fn a_sliding_mean_holds_constant_readings() {
        let prepare = Prepare { average: 4, mean: MeanKind::Sliding, code_bits: 12, taxels: 2, ..Prepare::default() };
        let mut prepared = prepare.empty();
        for _ in 0..40 {
            prepare.add(&mut prepared, &[-2048, 777], false);
            assert_eq!(prepared.words, [-2048 << 4, 777 << 4]);
        }
        for _ in 0..300 {
            prepare.add(&mut prepared, &[2047, -1000], false);
        }
        let off = |(word, code): (&i32, i32)| (word - (code << 4)).abs();
        assert!(prepared.words.iter().zip([2047, -1000]).map(off).all(|off| off <= 8), "{prepared:?}");
    }
}
