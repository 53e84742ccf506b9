//! The golden engine: an estimator between the input options and the checks of its results.
//!
//! | case | per frame |
//! |---|---|
//! | rows × columns | each subarray on its own |
//! | adaptive | the whole array first, to find the contacts; then the case that `adaptive` chooses |
//! | contacts | the whole array first; then its regions, each with its own μ |

use super::array::{Array, EngineInput};
use super::error::GoldenError;
use super::estimator::Estimator;
use super::template::Influences;
use super::{adaptive, by_contacts, by_evidence, by_network, by_subarray};
use crate::data::frame::Frame;
use crate::data::input::Input;
use crate::data::quantise::quantise;
use crate::data::reception::{full_scale, noise_floor_codes};
use crate::estimate::deviations::Deviations;
use crate::estimate::evidence::LastFit;
use crate::estimate::learned::LearnedError;
use crate::estimate::misfit::Misfit;
use crate::physics::matrices::Matrices;
use crate::result::flags::frame_flags;
use crate::result::reconstruct::Reconstruction;
use crate::spec::partition::Case;
use crate::spec::scene::{EstimatorKind, MeanKind, Scene};

/// The golden engine of one scene.
pub struct Golden {
    /// The scene; it states the estimator.
    scene: Scene,
    /// The scene's input options.
    pub(super) input: Input,
    /// Name of the estimator.
    kind: EstimatorKind,
    /// What estimates the forces.
    pub(super) estimator: Box<dyn Estimator>,
    /// The check of frames for which a network gives μ.
    pub(super) misfit: Option<Misfit>,
    /// Standard deviations of a search, where there is a table.
    pub(super) deviations: Option<Deviations>,
    /// What a remembered pressure takes, where the mean is adaptive.
    pub(super) influences: Option<Influences>,
}

/// The estimator `kind` for a scene with these input options: the table of names.
fn estimator(kind: EstimatorKind, scene: &Scene, input: &Input) -> Result<Box<dyn Estimator>, GoldenError> {
    Ok(match kind {
        EstimatorKind::Search => match scene.partition.case {
            Case::Grid(_) => by_subarray::new(scene)?,
            Case::Adaptive => adaptive::new(scene)?,
            Case::Contacts => by_contacts::new(scene)?,
        },
        EstimatorKind::Network => by_network::new(scene)?,
        EstimatorKind::Evidence | EstimatorKind::EvidenceNetwork | EstimatorKind::Combined => {
            by_evidence::new(kind, scene, input)?
        }
    })
}

impl Golden {
    /// The engine with the scene's estimator, [`Scene::model_estimator`]. A search computes the matrices of the scene:
    /// milliseconds for 20 × 20 taxels, two seconds for the largest subarrays.
    ///
    /// Where the scene does not state the estimator and its network was trained for something else, `evidence` takes the
    /// place of `combined`; [`Golden::estimator`] says so.
    ///
    /// # Errors
    /// Any [`GoldenError`] except `Frame` and `TooStrong`.
    pub fn new(scene: &Scene) -> Result<Golden, GoldenError> {
        match (Golden::with(scene, scene.model_estimator()), scene.search.estimator) {
            (Err(GoldenError::Learned(LearnedError::Mismatch { .. })), None) => {
                Golden::with(scene, EstimatorKind::Evidence)
            }
            (built, _) => built,
        }
    }

    /// The reference of the scene's hardware: the engine with the hardware's estimator, [`Scene::hardware_estimator`].
    ///
    /// # Errors
    /// As [`Golden::new`].
    pub fn reference(scene: &Scene) -> Result<Golden, GoldenError> {
        Golden::with(scene, scene.hardware_estimator())
    }

    /// The engine with this estimator in the place of the scene's.
    ///
    /// # Errors
    /// As [`Golden::new`].
    pub fn with(scene: &Scene, kind: EstimatorKind) -> Result<Golden, GoldenError> {
        scene.estimated_by(kind).require_golden()?;
        Golden::with_input(scene, kind, Input::new(scene)?)
    }

    /// The same with input options that are loaded already.
    ///
    /// # Errors
    /// As [`Golden::new`].
    pub(crate) fn with_input(scene: &Scene, kind: EstimatorKind, input: Input) -> Result<Golden, GoldenError> {
        let scene = &scene.estimated_by(kind);
        scene.require_golden()?;
        let estimator = estimator(kind, scene, &input)?;
        let (misfit, deviations) = (Misfit::of_scene(scene, kind)?, Deviations::of_scene(scene, kind)?);
        let remembers = scene.input.mean == MeanKind::Adaptive && scene.input.template;
        let influences = remembers.then(|| Influences::new(&scene.sensor, scene.medium));
        Ok(Golden { scene: scene.clone(), input, kind, estimator, misfit, deviations, influences })
    }

    /// The estimator.
    pub fn estimator(&self) -> EstimatorKind {
        self.kind
    }

    /// The scene; it states the estimator.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// The scene's input options with their files.
    pub fn input(&self) -> &Input {
        &self.input
    }

    /// The matrices of the first subarray; with `adaptive` and `contacts` those of the whole array. `None` of an estimator with
    /// evidence, which needs none.
    pub fn matrices(&self) -> Option<&Matrices> {
        self.estimator.array().map(Array::matrices)
    }

    /// Reconstructs calibrated stress. The forces come from the stress, the condition from its codes.
    ///
    /// # Errors
    /// [`GoldenError::Frame`] if the frame is not of the scene's sensor, [`GoldenError::TooStrong`] if a force is not
    /// finite.
    pub(super) fn reconstruct_stress(
        &self,
        last: &mut Option<LastFit>,
        frame: &Frame,
        noise_MPa: f64,
    ) -> Result<Reconstruction, GoldenError> {
        let scene = self.scene();
        frame.check(scene)?;
        let codes = quantise(&frame.stress_MPa, scene.fixed.input_bits, full_scale(scene, frame));
        let floor = noise_floor_codes(scene, &codes);
        let input = EngineInput { scene, frame, codes: &codes.codes, floor, noise_MPa };
        let mut result = self.estimator.estimate_after(&input, last);
        if !result.resultant_N.iter().all(|sum| sum.is_finite()) {
            let (frame, peak_MPa) = (frame.id.clone(), frame.peak_MPa());
            return Err(GoldenError::TooStrong { frame, peak_MPa });
        }
        result.flags.extend(frame_flags(scene, self.kind, frame, &codes, noise_MPa));
        result.flags.sort();
        result.flags.dedup();
        Ok(result)
    }
}
