//! Run: the entry points of the golden engine. They apply the input options before the engine and the output options
//! after it.
//!
//! | option | here |
//! |---|---|
//! | `input.average`, `input.mean` | [`Golden::run_averaged`]; [`Golden::run`] takes an averaged frame |
//! | `input.calibration`, `input.tare` | readings to stress |
//! | `input.unipolar` | the tension of clipped taxels is estimated, `unipolar` |
//! | `output.forces` | resultants instead of forces per taxel |

use super::array::Array;
use super::error::GoldenError;
use super::estimator::Clipped;
use super::forces::force;
use super::golden::Golden;
use super::over_time::Past;
use super::pass::Polynomial;
use super::unipolar::{fill_clipped, misfit};
use crate::data::frame::Frame;
use crate::data::input::memory::{Averaged, Memory};
use crate::estimate::evidence::LastFit;
use crate::physics::matrices::Matrices;
use crate::result::checks::Checks;
use crate::result::reconstruct::{Reconstruction, Unipolar};
use crate::spec::partition::Subarray;
use crate::spec::scene::{ForceOutput, Scene};

impl Golden {
    /// Reconstructs one frame; its values are readings if the scene has a calibration or tare file, else stress in MPa.
    ///
    /// ```
    /// use dermis_golden::{data::frame::Frame, estimate::float::Golden, spec::scene::Scene};
    ///
    /// let scene = Scene::builtin("sensor-1")?;
    /// let golden = Golden::new(&scene)?;
    /// let frame = Frame::shipped(&scene).into_iter().find(|frame| frame.id == "S1-hs-hertz").ok_or("no frame")?;
    /// let result = golden.run(&frame)?;
    /// let error = result.error.ok_or("no known forces")?;
    /// assert!(error.tangential.unwrap() < 0.03 && error.normal.unwrap() < 0.01);
    /// // Shear is proportional to pressure, by the μ that the estimator found.
    /// let mu = result.subarrays[0].mu;
    /// let bound = 1e-12 * result.resultant_N[2];
    /// assert!((0..100).all(|k| (result.forces_N.fx[k] - mu[0] * result.forces_N.fz[k]).abs() < bound));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`GoldenError::Frame`] if the frame is not of the scene's sensor, [`GoldenError::TooStrong`] if a force is not
    /// finite.
    pub fn run(&self, frame: &Frame) -> Result<Reconstruction, GoldenError> {
        self.run_with_noise(frame, self.input.noise_MPa())
    }

    /// Reconstructs one frame with the given standard deviation of the noise in MPa instead of the scene's noise floor.
    ///
    /// # Errors
    /// As [`Golden::run`].
    pub fn run_with_noise(&self, frame: &Frame, noise_MPa: f64) -> Result<Reconstruction, GoldenError> {
        frame.check(self.scene())?;
        let complete = self.input.complete(std::slice::from_ref(frame));
        let result = self.run_readings(&mut None, std::slice::from_ref(frame), &complete[0], noise_MPa, None)?;
        Ok(self.with_output(result))
    }

    /// The result of the mean of the frames `newest`, or of theirs and of those of which `memory` is.
    pub(super) fn of_mean(
        &self,
        last: &mut Option<LastFit>,
        memory: &Memory,
        newest: &[Frame],
        averaged: &Averaged,
    ) -> Result<Reconstruction, GoldenError> {
        let noise_MPa = self.input.noise_of_mean_MPa(averaged.variance);
        let mut result = self.run_readings(last, newest, &averaged.mean, noise_MPa, memory.drift().share())?;
        (result.extra.mean_frames, result.extra.lag_frames) = (averaged.frames_held, averaged.lag_frames);
        Ok(result)
    }

    /// The result with the forces that the scene asks for.
    pub(super) fn with_output(&self, result: Reconstruction) -> Reconstruction {
        match self.scene().output.forces {
            ForceOutput::Taxels => result,
            ForceOutput::Resultants => result.with_resultants(&self.scene().sensor),
        }
    }

    /// Reconstructs `mean`, the average of the frames `readings`, which have been checked; `zero_share` as in [`Checks`].
    fn run_readings(
        &self,
        last: &mut Option<LastFit>,
        readings: &[Frame],
        mean: &Frame,
        noise_MPa: f64,
        zero_share: Option<f64>,
    ) -> Result<Reconstruction, GoldenError> {
        let scene = self.scene();
        let frame = self.input.calibrate(mean);
        let (filled, report) = match (scene.input.unipolar, self.estimator.clipped_readings()) {
            (false, _) | (true, Clipped::AsRead) => (frame.clone(), None),
            (true, Clipped::Zero) => (clipped(&frame), None),
            (true, Clipped::Filled) => self.filled(&frame),
        };
        let mut result = self.reconstruct_stress(last, &filled, noise_MPa)?;
        let misfit = |report| Unipolar { misfit: misfit(scene, &frame, &result.forces_N), ..report };
        result.extra.unipolar = report.map(misfit);
        let checks = Checks {
            network_misfit: self.misfit.as_ref().and_then(|misfit| misfit.of(&result, &frame, noise_MPa)),
            load_ratio: self.load_ratio(&filled, &result),
            zero_share,
            ..result.figures(scene, &frame).with_readings(&self.input, readings)
        };
        result.add_checks(scene, checks);
        result.add_missing(scene, &frame, readings);
        if let Some(deviations) = &self.deviations {
            deviations.add(&mut result, scene, &frame, noise_MPa);
        }
        Ok(result)
    }

    /// Σ fz over that of the stress without shear, Σ Cz⁺b after the threshold; `None` unless the latter presses, and of an estimator
    /// whose load does not come from Cz⁺b.
    fn load_ratio(&self, frame: &Frame, result: &Reconstruction) -> Option<f64> {
        let scene = self.scene();
        let normal = |(part, matrices): (&Subarray, &Matrices)| {
            let family = Polynomial::of_degree(matrices, &part.gather(&scene.sensor, &frame.stress_MPa), 0);
            force(family.v(0, 0), [0.0; 2], scene.threshold.min_force_N).fz.iter().sum::<f64>()
        };
        let without_shear: f64 = self.estimator.array()?.parts().map(normal).sum();
        let ratio = result.resultant_N[2] / without_shear;
        (without_shear > 0.0).then_some(ratio)
    }

    /// The frame with tension in place of clipped readings, and its report without the misfit.
    fn filled(&self, frame: &Frame) -> (Frame, Option<Unipolar>) {
        let Scene { sensor, input, search, .. } = self.scene();
        let mut filled = clipped(frame);
        let mut report = Unipolar { clipped: 0, pulled: 0, evaluations: 0, misfit: 0.0 };
        for (part, matrices) in self.estimator.array().into_iter().flat_map(Array::parts) {
            let b = part.gather(sensor, &filled.stress_MPa);
            let dead = part.local_indices(&input.dead);
            let clipped: Vec<usize> = (0..b.len()).filter(|k| b[*k] == 0.0 && !dead.contains(k)).collect();
            report.clipped += clipped.len();
            let own = fill_clipped(matrices, b, clipped, search.mu_max);
            report.pulled += own.stress_MPa.iter().filter(|b| **b < 0.0).count();
            report.evaluations += own.evaluations;
            part.scatter(sensor, &own.stress_MPa, &mut filled.stress_MPa);
        }
        (filled, Some(report))
    }

    /// Averages 2^k frames, k the scene's `input.average`, and reconstructs their mean; known forces are those of the
    /// first. With a mean that slides the frames are all those since the start, and known forces those of the last; where zeros
    /// run, they are all those since the start too, and the last 2^k are averaged.
    ///
    /// ```
    /// use dermis_golden::{data::frame::Frame, data::generator::converter::Converter, estimate::float::Golden, spec::scene::Scene};
    ///
    /// let mut scene = Scene::builtin("sensor-1")?;
    /// scene.input.average = 4;
    /// let frame = Frame::shipped(&scene).remove(1);
    /// let noisy = |seed| Converter { noise: 0.01, seed, ..Default::default() }.convert(&frame).unwrap();
    /// let frames: Vec<Frame> = (0..16).map(noisy).collect();
    /// let golden = Golden::new(&scene)?;
    /// let normal = golden.run_averaged(&frames)?.error.and_then(|error| error.normal);
    /// assert!(normal.ok_or("no known forces")? < 0.03);
    /// assert!(golden.run_averaged(&frames[1..]).is_err());
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// As [`Golden::run`]; [`GoldenError::Input`] unless there are 2^k frames.
    pub fn run_averaged(&self, frames: &[Frame]) -> Result<Reconstruction, GoldenError> {
        self.run_after(&mut Past::default(), frames)
    }

    /// The stress in MPa that [`Golden::run_averaged`] reconstructs: the calibrated mean of 2^k frames.
    ///
    /// # Errors
    /// [`GoldenError::Input`] unless there are 2^k frames, of a sliding mean at least one, all of the scene's sensor.
    pub fn stress(&self, frames: &[Frame]) -> Result<Frame, GoldenError> {
        Ok(self.input.calibrate(&self.input.average(self.scene(), frames)?))
    }
}

/// The frame as a unipolar array reads it: no tension.
fn clipped(frame: &Frame) -> Frame {
    let mut clipped = frame.clone();
    clipped.stress_MPa.iter_mut().for_each(|b| *b = b.max(0.0));
    clipped
}
