//! Input: from the readings of a real sensor to stress.
//!
//! ```text
//!    frames ── average ── calibrate ── (unipolar: tension for clipped readings) ── stress ── engine ── forces
//!                          b = gain · (reading − zero),  zero = the tare frame, else the table's offset
//! ```
//!
//! | `[input]` | meaning |
//! |---|---|
//! | `average = k` | 2^k frames are averaged into one; the additional bits are kept |
//! | `mean = "sliding"` | every frame gives a result, the mean of all so far, in which older ones fade: [`sliding`](crate::spec::sliding) |
//! | `mean = "adaptive"` | the same, of a length that follows how fast readings change, [`adaptive`] |
//! | `calibration = "table.csv"` | offset and gain of each taxel, [`calibration`] |
//! | `curve = [[u, b], …]` | the characteristic that follows the table, b = c(gain · (reading − zero)), [`curve`] |
//! | `tare = "zero.json"` | frames read without contact, in the readings' unit, [`tare`] |
//! | `dead = [[row, col], …]` | taxels left out of the inverse, whatever they read: [`crate::physics::matrices::Matrices::without`] |
//! | `zero = "running"` | the zero of each taxel follows its readings while nothing presses, [`running_zero`] |
//! | `unipolar = true` | a reading of zero or less is only an upper bound of the stress, filled by [`crate::estimate::float`] |
//!
//! A reading that a frame lacks is described in [`missing`].
//!
//! The table is made from recordings under known loads by [`known_loads`], or of ordinary presses by
//! [`blind_gains`](crate::estimate::blind_gains), the noise from frames without load by [`unloaded`].
//!
//! Paths are relative to the scene's file. The known forces of a frame are passed through unchanged.

pub mod adaptive;
pub mod calibration;
pub mod change_noise;
pub mod curve;
pub mod drift;
pub mod known_loads;
pub mod means;
pub mod memory;
pub mod missing;
pub mod running_zero;
pub mod tare;
#[cfg(test)]
mod tests;
pub mod unloaded;

use crate::data::frame::{Frame, FrameError};
use crate::spec::scene::{InputSpec, MeanKind, Scene};
use calibration::{Calibration, CalibrationError};
use curve::Curve;
use means::Means;
use memory::{Averaged, Memory};
use missing::mean_reading;
use std::borrow::Cow;
use tare::Tare;
use thiserror::Error;

/// A scene's input options with their files loaded.
#[derive(Clone, Debug, PartialEq)]
pub struct Input {
    /// Zero and gain of each taxel, if the scene has a table or a tare frame.
    scale: Option<(Vec<f64>, Vec<f64>)>,
    /// The characteristic behind it, where it is not straight.
    curve: Option<Curve>,
    /// Standard deviation of a calibrated frame in MPa as the scene states it, else 0.
    stated_noise_MPa: f64,
    /// The same of each taxel, from tare frames, and the number of those; `None` where the scene states it.
    taxel_noise_MPa: Option<(Vec<f64>, usize)>,
    /// Columns of the array.
    cols: usize,
    /// The largest |gain|, of which a code and the limit of a running zero are.
    largest_gain: f64,
    spec: InputSpec,
}

/// Input options or frames cannot be used.
#[derive(Debug, Error)]
pub enum InputError {
    /// The calibration table cannot be used.
    #[error(transparent)]
    Calibration(#[from] CalibrationError),
    /// The tare frame, or a frame to average, cannot be used.
    #[error(transparent)]
    Frame(#[from] FrameError),
    /// The number of frames is not 2^k.
    #[error("scene {scene}: input.average = {average} takes {wanted} frames at a time, got {got}")]
    Count {
        /// The scene's name.
        scene: String,
        /// k.
        average: u32,
        /// 2^k.
        wanted: usize,
        /// Number of frames given.
        got: usize,
    },
}

impl Input {
    /// Loads the calibration table and the tare frame that the scene names; of a scene of several arrays those of the first.
    ///
    /// # Errors
    /// [`InputError`] if the table or tare frame cannot be read or does not fit the sensor.
    pub fn new(scene: &Scene) -> Result<Input, InputError> {
        let scene = &scene.of_array(0);
        let spec = &scene.input;
        let table = spec.calibration.as_ref().map(|path| Calibration::load(path, &scene.sensor)).transpose()?;
        let tare = spec.tare.as_ref().map(|path| Tare::load(path, scene)).transpose()?;
        let stated_noise_MPa = scene.search.noise_floor_MPa();
        let largest_gain = scene.hardware.largest_gain(table.as_ref().map(|table| table.gain.as_slice()));
        let (cols, spec) = (scene.sensor.cols, spec.clone());
        let curve = Curve::new(&spec.curve);
        let input = Input { scale: None, curve, stated_noise_MPa, taxel_noise_MPa: None, cols, largest_gain, spec };
        if table.is_none() && tare.is_none() {
            return Ok(input);
        }
        let Calibration { offset, gain } = table.unwrap_or_else(|| Calibration::identity(scene.sensor.taxels()));
        let Some(Tare { zero, spread, frames: taken }) = tare else {
            return Ok(Input { scale: Some((offset, gain)), ..input });
        };
        let slope = input.slope_without_load();
        let noise =
            |spread: Vec<f64>| (spread.iter().zip(&gain).map(|(s, gain)| s * gain.abs() * slope).collect(), taken);
        let taxel_noise_MPa = spread.filter(|_| stated_noise_MPa == 0.0).map(noise);
        Ok(Input { taxel_noise_MPa, scale: Some((zero, gain)), ..input })
    }

    /// Standard deviation in MPa of a taxel of a calibrated mean, of a sliding one of many frames: as the scene states it,
    /// else as the tare frames show it, the root mean square over the taxels; 0 if neither does.
    pub fn noise_MPa(&self) -> f64 {
        self.noise_of_mean_MPa(self.spec.settled_variance())
    }

    /// The same for a mean of this `variance`, over that of a frame.
    pub fn noise_of_mean_MPa(&self, variance: f64) -> f64 {
        match &self.taxel_noise_MPa {
            // The zero has noise of its own, that of a mean of the tare frames.
            Some((noise, taken)) => root_mean_square(noise) * (variance + 1.0 / *taken as f64).sqrt(),
            None => self.stated_noise_MPa * variance.sqrt(),
        }
    }

    /// The noise of each taxel over that of [`Input::noise_MPa`], where tare frames show it and the scene does not state
    /// it; row-major.
    pub fn noise_shares(&self) -> Option<Vec<f64>> {
        let (noise, _) = self.taxel_noise_MPa.as_ref()?;
        let mean = root_mean_square(noise);
        Some(noise.iter().map(|noise| noise / mean).collect())
    }

    /// The mean of frames, each checked against the scene. Of a block of 2^k frames, id and known forces are those of the
    /// first; else, of all frames since the start, those of the last. Where zeros run, the frames are all since a
    /// reset. A taxel counts in the frames that have its reading; it is missing in the mean if none has it, where its value is
    /// that of [`Input::complete`].
    ///
    /// # Errors
    /// [`InputError::Count`] unless there are 2^k frames, where zeros run a multiple of them, of a mean that slides at least one;
    /// [`InputError::Frame`] if one is not of the scene's sensor.
    pub fn average(&self, scene: &Scene, frames: &[Frame]) -> Result<Frame, InputError> {
        Ok(self.average_after(&mut Memory::default(), scene, frames)?.mean)
    }

    /// The same where `memory` is of the frames before, which is then that after these.
    ///
    /// # Errors
    /// As [`Input::average`].
    pub fn average_after(&self, memory: &mut Memory, scene: &Scene, frames: &[Frame]) -> Result<Averaged, InputError> {
        let (average, wanted, got) = (self.spec.average, self.spec.frames_per_result(), frames.len());
        let count = || InputError::Count { scene: scene.name.clone(), average, wanted, got };
        let fits = match self.spec.has_memory() {
            true => got.is_multiple_of(wanted),
            false => got == wanted,
        };
        frames.iter().try_for_each(|frame| frame.check(scene))?;
        if self.spec.mean == MeanKind::Block {
            let all = self.without_drift(&mut memory.drift, if fits { frames } else { &[] });
            let newest = self.spec.newest(&all);
            let first = newest.first().ok_or_else(count)?;
            let mut mean = Frame { missing: missing_in_all(newest), ..first.clone() };
            let complete = self.complete(newest);
            for (index, b) in mean.stress_MPa.iter_mut().enumerate() {
                // Divided before adding, so that the sum does not overflow.
                *b = complete.iter().map(|frame| frame.stress_MPa[index] / wanted as f64).sum();
            }
            let variance = self.spec.settled_variance();
            return Ok(Averaged { mean, variance, frames_held: None, lag_frames: None });
        }
        let mut averaged = Err(count());
        for frame in frames {
            averaged = Ok(self.slide(memory, frame).0);
        }
        averaged
    }

    /// The mean that slides, with one more frame, and this frame without drift and gaps.
    fn slide(&self, memory: &mut Memory, frame: &Frame) -> (Averaged, Frame) {
        let own = self.without_drift(&mut memory.drift, std::slice::from_ref(frame))[0].clone();
        let complete = self.continued(memory, &own);
        let taxels = frame.stress_MPa.len();
        let means = memory.means.get_or_insert_with(|| Means::new(self.spec.averages(), taxels));
        means.add(&complete.stress_MPa, |taxel| own.lacks(taxel));
        let adapts = self.spec.mean == MeanKind::Adaptive;
        let window = match adapts {
            true => {
                let stress_MPa = self.calibrate(&complete).stress_MPa;
                memory.noise.add(&stress_MPa, taxels - self.spec.dead.len());
                self.window(means, memory.noise.sigma_MPa(), &own)
            }
            false => means.longest(),
        };
        let averaged = Averaged::of_window(means, &window, Frame { missing: means.never_read(), ..own });
        let of_sliding = |averaged| {
            let frames_held = self.spec.frames_held(means.frames());
            Averaged { frames_held, lag_frames: None, ..averaged }
        };
        (if adapts { averaged } else { of_sliding(averaged) }, complete)
    }

    /// A frame with a value for each missing reading: the mean so far, else what the other taxels predict.
    fn continued(&self, memory: &Memory, frame: &Frame) -> Frame {
        let mut own = frame.clone();
        let before = |taxel: usize| memory.means.as_ref().and_then(|means| means.reading(taxel));
        own.missing.retain(|&taxel| before(taxel).map(|mean| own.stress_MPa[taxel] = mean).is_none());
        let complete = self.complete(std::slice::from_ref(&own)).into_owned().pop();
        Frame { missing: frame.missing.clone(), ..complete.unwrap_or(own) }
    }

    /// The frames of a result as a device takes them: with a value for each missing reading, after those of which `memory` is.
    pub fn complete_after(&self, memory: &Memory, frames: &[Frame]) -> Vec<Frame> {
        if self.spec.mean == MeanKind::Block {
            let results = frames.chunks(self.spec.frames_per_result());
            return results.flat_map(|frames| self.complete(frames).into_owned()).collect();
        }
        let mut memory = memory.clone();
        let next = |frame: &Frame| {
            let (_, complete) = self.slide(&mut memory, frame);
            let mut own = frame.clone();
            for &taxel in &frame.missing {
                // The zero of a taxel without a reading has not moved in this frame.
                let moved = memory.drift.moved.get(taxel).unwrap_or(&0.0);
                own.stress_MPa[taxel] = complete.stress_MPa[taxel] + moved;
            }
            own
        };
        frames.iter().map(next).collect()
    }

    /// The frames of a block, of the scene's sensor, with a value for each missing reading: the mean of the frames that have it;
    /// where none has it, it is what the other taxels predict, see [`missing`].
    pub fn complete<'a>(&self, frames: &'a [Frame]) -> Cow<'a, [Frame]> {
        if frames.iter().all(|frame| frame.missing.is_empty()) {
            return Cow::Borrowed(frames);
        }
        let mut all = frames.to_vec();
        let missing: Vec<usize> = (0..all[0].stress_MPa.len()).filter(|k| frames.iter().any(|f| f.lacks(*k))).collect();
        for &taxel in &missing {
            let Some(mean) = mean_reading(frames, taxel) else { continue };
            all.iter_mut().filter(|frame| frame.lacks(taxel)).for_each(|frame| frame.stress_MPa[taxel] = mean);
        }
        // The prediction needs every other value of its frame, which the means have given.
        let nowhere = missing_in_all(frames);
        for frame in all.iter_mut().filter(|_| !nowhere.is_empty()) {
            let own = Frame { missing: nowhere.clone(), ..frame.clone() };
            let stress = missing::complete(&self.spec, self.calibrate(&own)).stress_MPa;
            nowhere.iter().for_each(|&taxel| frame.stress_MPa[taxel] = self.reading(taxel, stress[taxel]));
        }
        Cow::Owned(all)
    }

    /// The reading of a taxel whose calibrated stress is `stress_MPa`.
    fn reading(&self, taxel: usize, stress_MPa: f64) -> f64 {
        let stress_MPa = self.curve.as_ref().map_or(stress_MPa, |curve| curve.straight_MPa(stress_MPa));
        self.scale.as_ref().map_or(stress_MPa, |(zero, gain)| stress_MPa / gain[taxel] + zero[taxel])
    }

    /// The stress of a calibrated value, by the scene's curve.
    fn curved(&self, straight_MPa: f64) -> f64 {
        self.curve.as_ref().map_or(straight_MPa, |curve| curve.stress_MPa(straight_MPa))
    }

    /// Stress over calibrated value without load.
    fn slope_without_load(&self) -> f64 {
        self.curve.as_ref().map_or(1.0, Curve::slope_without_load)
    }

    /// The zero of each taxel in the readings' unit, row-major: the scene's tare frame, else the table's offset.
    pub fn zero(&self) -> Option<&[f64]> {
        self.scale.as_ref().map(|(zero, _)| zero.as_slice())
    }

    /// Zero and gain of each taxel, where the scene has a table or tare frames.
    pub(crate) fn table(&self) -> Option<Calibration> {
        self.scale.as_ref().map(|(offset, gain)| Calibration { offset: offset.clone(), gain: gain.clone() })
    }

    /// Limit of a running zero in readings; `None` where zeros are fixed.
    fn zero_limit(&self) -> Option<f64> {
        let per_reading = self.largest_gain * self.slope_without_load();
        self.spec.running_zero().map(|running| running.limit_MPa / per_reading)
    }

    /// The largest share of the stated full scale that the frames of one reconstruction reach; `None` if the scene
    /// states none. Counted are, of every live taxel, each reading and its zero at the largest gain, as the converter's
    /// code holds them, and each calibrated reading.
    pub fn full_scale_share(&self, readings: &[Frame]) -> Option<f64> {
        let full_scale_MPa = self.spec.full_scale_MPa?;
        let unity = (Vec::new(), Vec::new());
        let (zeros, gains) = self.scale.as_ref().unwrap_or(&unity);
        let (zero, gain) = (|k: usize| *zeros.get(k).unwrap_or(&0.0), |k: usize| *gains.get(k).unwrap_or(&1.0));
        let largest_gain = gains.iter().map(|gain| gain.abs()).reduce(f64::max).unwrap_or(1.0);
        let share = |frame: &Frame| {
            let dead = |k: usize| self.spec.is_dead([k / frame.sensor.cols, k % frame.sensor.cols]);
            let live = |k: &usize| !dead(*k) && !frame.lacks(*k);
            let stress = |k: usize| {
                let reading = frame.stress_MPa[k];
                let code = largest_gain * reading.abs().max(zero(k).abs());
                code.max(self.curved(gain(k) * (reading - zero(k))).abs())
            };
            (0..frame.stress_MPa.len()).filter(live).map(stress).fold(0.0, f64::max) / full_scale_MPa
        };
        Some(readings.iter().map(share).fold(0.0, f64::max))
    }

    /// 1 where readings rise with the load, −1 where the table's gains have them fall.
    pub(crate) fn sign(&self) -> f64 {
        let gains = self.scale.iter().flat_map(|(_, gain)| gain);
        if gains.sum::<f64>() < 0.0 {
            -1.0
        } else {
            1.0
        }
    }

    /// The options themselves.
    pub(crate) fn spec(&self) -> &InputSpec {
        &self.spec
    }

    /// Converts readings to stress in MPa: b = gain · (reading − zero), the readings themselves without table and tare
    /// frame, behind them the curve. Dead taxels become 0.
    pub fn calibrate(&self, frame: &Frame) -> Frame {
        #[cfg(test)]
        tests::CALIBRATIONS.with(|count| count.set(count.get() + 1));
        let mut frame = frame.clone();
        if let Some((zero, gain)) = &self.scale {
            for (b, (zero, gain)) in frame.stress_MPa.iter_mut().zip(zero.iter().zip(gain)) {
                *b = gain * (*b - zero);
            }
        }
        if self.curve.is_some() {
            frame.stress_MPa.iter_mut().for_each(|b| *b = self.curved(*b));
        }
        frame.mask_dead(&self.spec.dead)
    }
}

/// The taxels whose reading no frame has, ascending.
fn missing_in_all(frames: &[Frame]) -> Vec<usize> {
    let first = frames.first().map_or(&[][..], |first| &first.missing);
    first.iter().copied().filter(|taxel| frames.iter().all(|frame| frame.lacks(*taxel))).collect()
}

fn root_mean_square(values: &[f64]) -> f64 {
    (values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64).sqrt()
}
