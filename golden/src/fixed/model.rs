//! The bit-true model of one scene: its plan, and the codes of a frame.

use std::ops::Deref;

use super::error::FixedError;
use super::plan::cases::{planned, planned_with};
use super::plan::contents::Plan;
use super::plan::fit_suggestions::fitting;
use super::stages::prepare::Scale;
use crate::data::frame::Frame;
use crate::data::input::memory::{Averaged, Memory};
use crate::data::input::Input;
use crate::data::quantise::{quantise, Codes};
use crate::data::reception::full_scale;
use crate::estimate::deviations::Deviations;
use crate::estimate::float::{Golden, GoldenError};
use crate::spec::scene::{largest_code, EstimatorKind, Scene, SceneError, MAX_DEGREE};

/// The bit-true model of one scene: the stages, run by the [`Plan`] to which the model dereferences, and the input
/// options with their files, read once. Of the plan only the tables that the hardware takes change, by [`Model::load`] and
/// [`Intake`](super::Intake).
#[derive(Clone, Debug)]
pub struct Model {
    plan: Plan,
    /// The scene's input options.
    pub(super) input: Input,
    /// Standard deviations of a search, where there is a table.
    pub(super) deviations: Option<Deviations>,
}

impl Deref for Model {
    type Target = Plan;

    fn deref(&self) -> &Plan {
        &self.plan
    }
}

impl Model {
    /// Computes and quantises the scene's matrices and derives its formats.
    ///
    /// ```
    /// use dermis_golden::{fixed::{Cycles, Model}, data::frame::Frame, spec::scene::Scene};
    ///
    /// let scene = Scene::builtin("eight-by-eight")?;
    /// let frame = Frame::shipped(&scene).remove(0);
    /// let model = Model::new(&scene)?;
    /// let fixed = model.reconstruct(&frame)?.resultant_N;
    /// // The golden model with the estimator that the hardware has.
    /// let golden = model.reference()?.run(&frame)?.resultant_N;
    /// // The normal force differs from the golden model's by less than 0.1 %.
    /// assert!((fixed[2] / golden[2] - 1.0).abs() < 1e-3);
    /// // The same in words, one beat per taxel, and the duration of a frame with a search.
    /// let trace = model.run(&model.readings(&[frame])?);
    /// assert_eq!((trace.beats.len(), trace.cycles), (64, Cycles::longest(&model)));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// The scene asks for something unavailable, its matrices or formats do not exist, or a threshold or noise floor
    /// lacks the full scale. [`FixedError::DoesNotFit`] lists the resources the board lacks and changes that make the
    /// scene fit.
    pub fn new(scene: &Scene) -> Result<Self, FixedError> {
        Model::of_plan(fitting(planned(scene)?)?)
    }

    /// The model that runs this plan. The files of its input options are read here, and never again.
    ///
    /// # Errors
    /// What is wrong with the files that the plan's scene names.
    pub fn of_plan(plan: Plan) -> Result<Self, FixedError> {
        let input = Input::new(&plan.scene)?;
        let deviations = Deviations::of_scene(&plan.scene, plan.scene.hardware_estimator())?;
        Ok(Model { plan, input, deviations })
    }

    /// The model of array `array` of those that this engine serves, alone; of an engine of one array the same model. Codes mean the
    /// same for all arrays, so that the words of each are those that the engine sends for it.
    ///
    /// # Errors
    /// [`SceneError::NoArray`], and as [`Model::of_plan`].
    pub fn of_array(&self, array: usize) -> Result<Self, FixedError> {
        match self.scene.hardware.arrays {
            arrays if array >= arrays => {
                let (file, number) = (self.scene.name.clone(), array.to_string());
                Err(SceneError::NoArray { file, number, arrays }.into())
            }
            1 => Ok(self.clone()),
            _ => Model::of_plan(self.plan.of_array(array)),
        }
    }

    /// The model of the plan as `change` makes it, as [`Model::of_plan`] builds it.
    ///
    /// # Errors
    /// As [`Model::of_plan`].
    pub fn with_changed_plan(self, change: impl FnOnce(&mut Plan)) -> Result<Self, FixedError> {
        let mut plan = self.plan;
        change(&mut plan);
        Model::of_plan(plan)
    }

    /// A variant of this hardware, of which resources are counted: the files that the plan names need not exist. Its input
    /// options are those of this model.
    pub fn variant(&self, plan: Plan) -> Self {
        Model { plan, input: self.input.clone(), deviations: None }
    }

    /// The plan, whose tables change while the engine runs.
    pub(super) fn plan_mut(&mut self) -> &mut Plan {
        &mut self.plan
    }

    /// The floating-point reference: the same scene, full scale included, by the same estimator.
    ///
    /// # Errors
    /// As [`Golden::new`].
    pub fn reference(&self) -> Result<Golden, GoldenError> {
        Golden::reference(&self.scene)
    }

    /// The estimator that the hardware computes.
    pub fn estimator(&self) -> EstimatorKind {
        self.scene.hardware_estimator()
    }

    /// The scene's input options with their files.
    pub fn input(&self) -> &Input {
        &self.input
    }

    /// The model with a polynomial of the given degree, 1 to 3, in place of the one the series needs.
    ///
    /// # Errors
    /// As [`Model::new`], but a board that is too small is no error.
    pub fn of_degree(scene: &Scene, degree: usize) -> Result<Self, FixedError> {
        Model::of_plan(planned_with(scene, Scale::new(scene)?, Some(degree.clamp(1, MAX_DEGREE)))?)
    }

    /// The model of a scene, whether it fits its board or not.
    pub fn without_fit_check(scene: &Scene) -> Result<Self, FixedError> {
        Model::of_plan(planned(scene)?)
    }

    /// The model for `frames`: if the scene needs a full scale and has none, it takes the frames' largest |b|, one
    /// scale for all of them.
    ///
    /// # Errors
    /// As [`Model::new`].
    pub fn for_frames(scene: &Scene, frames: &[Frame]) -> Result<Self, FixedError> {
        // The estimator is chosen for the scene as it stands, before a full scale is filled in.
        let mut scene = scene.clone().with_chosen_hardware();
        let needs = scene.search.noise_floor_MPa() > 0.0
            || scene.threshold.min_force_N > 0.0
            || scene.hardware.states_limits_of_each_array()
            || scene.input.longest_average() > 0
            || scene.scaled_input().is_some();
        if needs && scene.input.full_scale_MPa.is_none() {
            let gain = Scale::new(&scene)?.largest;
            let peak = |frame: &Frame| frame.clone().mask_dead(&scene.input.dead).peak_MPa();
            let mut largest = gain * frames.iter().map(peak).fold(0.0, f64::max);
            for frame in frames.iter().filter(|frame| !frame.missing.is_empty()) {
                frame.check(&scene)?;
                largest = largest.max(gain * peak(&Input::new(&scene)?.complete(std::slice::from_ref(frame))[0]));
            }
            let codes = f64::from(largest_code(scene.fixed.input_bits));
            // The largest reading takes the code before the last, which would count as saturated. Frames of zeros fit
            // any scale; 1 MPa is also the default of a single frame.
            scene.input.full_scale_MPa = Some(if largest > 0.0 { largest * (codes / (codes - 1.0)) } else { 1.0 });
        }
        Model::new(&scene)
    }

    /// The stress that [`Model::reconstruct_averaged`] reconstructs: the calibrated mean of 2^average frames, or the sliding
    /// one of all frames, in MPa; where zeros run, the frames are all since a reset.
    ///
    /// # Errors
    /// [`InputError`](crate::data::input::InputError) unless there are 2^average frames, of a sliding mean at least one, all of
    /// the scene's sensor.
    pub fn stress(&self, frames: &[Frame]) -> Result<Frame, FixedError> {
        Ok(self.stress_after(&mut Memory::default(), frames)?.0)
    }

    /// The same after frames of which `memory` is, which is then that after these; and its variance over that of a frame.
    pub(super) fn stress_after(&self, memory: &mut Memory, frames: &[Frame]) -> Result<(Frame, f64), FixedError> {
        let Averaged { mean, variance, .. } = self.input.average_after(memory, &self.scene, frames)?;
        Ok((self.input.calibrate(&mean), variance))
    }

    /// The converter's codes for the frames of one reconstruction, frame after frame, row-major.
    ///
    /// # Errors
    /// As [`Model::stress`].
    pub fn readings(&self, frames: &[Frame]) -> Result<Vec<i32>, FixedError> {
        let full_scale_MPa = full_scale(&self.scene, &self.stress(frames)?);
        Ok(self.readings_after(&Memory::default(), full_scale_MPa, frames))
    }

    /// The same after frames of which `memory` is, where the stress in MPa of the largest code is known.
    pub(super) fn readings_after(&self, memory: &Memory, full_scale_MPa: f64, frames: &[Frame]) -> Vec<i32> {
        let full_scale = full_scale_MPa * self.prepare.reading_per_MPa;
        let codes = |frame: Frame| quantise(&frame.stress_MPa, self.formats().code_bits, full_scale).codes;
        self.input.complete_after(memory, frames).into_iter().flat_map(codes).collect()
    }

    /// The readings that have these codes, as a frame named `id`: the other way round than [`Model::readings`], for codes that the
    /// hardware has scanned. `None` where full scale follows the frame, or for another number of codes.
    pub fn readings_of(&self, id: &str, codes: &[i32]) -> Option<Frame> {
        let lsb = self.scene.input.full_scale_MPa? * self.prepare.reading_per_MPa
            / f64::from(largest_code(self.formats().code_bits));
        let readings = codes.iter().map(|code| f64::from(*code) * lsb).collect();
        Frame::from_stress(id, &self.scene.sensor, readings).ok()
    }

    /// The codes of a frame of stress, from a converter without input options.
    ///
    /// # Errors
    /// [`FrameError`](crate::data::frame::FrameError) if the frame's sensor is not the scene's.
    pub fn codes(&self, frame: &Frame) -> Result<Codes, FixedError> {
        frame.check(&self.scene)?;
        Ok(quantise(&frame.stress_MPa, self.formats().code_bits, full_scale(&self.scene, frame)))
    }
}
