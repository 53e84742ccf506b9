//! The golden engine: the stages in order, for each subarray of the scene's partition.
//!
//! | case | per frame |
//! |---|---|
//! | rows × columns | each subarray on its own |
//! | adaptive | the whole array first, to find the contacts; then the case that `adaptive` chooses |
//! | contacts | the whole array first; then its regions, each with its own μ |

use super::by_network::ByNetwork;
use super::forces::{force, threshold};
use super::objective::taxels::Taxels;
use super::objective::{of_kind, Estimate, Objective, SearchInput};
use super::orthogonal::{truncation, Orthogonal, OrthogonalError};
use super::pass::Polynomial;
use crate::data::frame::{Forces, Frame, FrameError};
use crate::data::input::{Input, InputError};
use crate::data::quantise::quantise;
use crate::data::reception::{full_scale, noise_floor_codes, receive, Received};
use crate::estimate::deviations::{Deviations, DeviationsError};
use crate::estimate::evidence::Evidence;
use crate::estimate::learned::{Learned, LearnedError};
use crate::estimate::misfit::Misfit;
use crate::physics::matrices::{Matrices, MatricesError};
use crate::result::flags::{frame_flags, Flag};
use crate::result::reconstruct::{assemble, Reconstruction, SubarrayResult};
use crate::spec::partition::{subarrays, Case, PartitionError, Subarray};
use crate::spec::scene::MAX_FLOAT_DEGREE;
use crate::spec::scene::{EstimatorKind, Form, Scene, SceneError};
use thiserror::Error;

/// The golden engine of one scene, its matrices computed.
pub struct Golden {
    pub(super) scene: Scene,
    /// The scene's input options.
    pub(super) input: Input,
    /// The case; for `adaptive` all cases that divide the array, the finest first, the whole array last.
    pub(super) tilings: Vec<Tiling>,
    /// For fits of ellipses: with `adaptive` and `contacts`, without dead taxels and with mu_max > 0.
    pub(super) taxels: Option<Taxels>,
    /// The estimator `evidence`, if the scene takes it.
    pub(super) evidence: Option<Evidence>,
    /// The network that is asked for each contact, with `contacts`.
    pub(super) network: Option<Learned>,
    /// The check of frames for which a network gives μ.
    pub(super) misfit: Option<Misfit>,
    /// Standard deviations of a search, where there is a table.
    pub(super) deviations: Option<Deviations>,
}

/// A partition into equal rectangles with its matrices.
pub(super) struct Tiling {
    pub case: Case,
    pub parts: Vec<Subarray>,
    /// The matrices of every subarray; all rectangles are equal.
    shared: Matrices,
    /// The matrices of each subarray if there are dead taxels, else empty.
    masked: Vec<Matrices>,
    /// The matrices of Eq. 1 as printed, with `search.form = "orthogonal"`.
    orthogonal: Option<Orthogonal>,
    objective: Box<dyn Objective + Send + Sync>,
}

impl Tiling {
    fn matrices(&self, part: usize) -> &Matrices {
        self.masked.get(part).unwrap_or(&self.shared)
    }

    /// Masks the taxels `dead`, [row, col] in the array.
    fn mask(mut self, dead: &[[usize; 2]]) -> Result<Tiling, MatricesError> {
        let own = |part: &Subarray| self.shared.without(&part.local_indices(dead));
        self.masked = match dead {
            [] => Vec::new(),
            _ => self.parts.iter().map(own).collect::<Result<_, _>>()?,
        };
        Ok(self)
    }
}

/// A frame in the forms that the stages need.
pub(super) struct EngineInput<'a> {
    pub stress_MPa: &'a [f64],
    pub codes: &'a [i32],
    pub floor: i32,
    /// Standard deviation of the noise on the stress, for objectives that use it.
    pub noise_MPa: f64,
}

/// Results of all subarrays of a case.
#[derive(Default)]
pub(super) struct CaseOutcome {
    pub subarrays: Vec<SubarrayResult>,
    pub forces: Forces,
    pub flags: Vec<Flag>,
    /// Truncation error of each subarray, with the orthogonal form.
    pub truncation: Vec<f64>,
    /// Largest misfit of a subarray's fitted shape, see [`Estimate::shape_misfit`].
    pub shape_misfit: Option<f64>,
    /// Largest relative standard deviation of a subarray's shear, see [`Estimate::shear_spread`].
    pub shear_spread: Option<f64>,
}

/// A scene or frame cannot be reconstructed.
#[derive(Debug, Error)]
pub enum GoldenError {
    /// The scene asks for something this version does not implement.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The partition does not fit the array.
    #[error(transparent)]
    Partition(#[from] PartitionError),
    /// The matrices of a subarray cannot be computed or used.
    #[error(transparent)]
    Matrices(#[from] MatricesError),
    /// The matrices of Eq. 1 as printed cannot be computed.
    #[error(transparent)]
    Orthogonal(#[from] OrthogonalError),
    /// The frame is not of the scene's sensor, or not finite.
    #[error(transparent)]
    Frame(#[from] FrameError),
    /// A file named by the input options cannot be used, or the frames do not fit them.
    #[error(transparent)]
    Input(#[from] InputError),
    /// The network that the scene names cannot be used.
    #[error(transparent)]
    Learned(#[from] LearnedError),
    /// The table of standard deviations that the scene names cannot be used.
    #[error(transparent)]
    Deviations(#[from] DeviationsError),
    /// The stress is so large that its forces are not finite.
    #[error("frame {frame}: peak stress {peak_MPa:e} MPa gives forces beyond the range of numbers")]
    TooStrong {
        /// The frame's id.
        frame: String,
        /// Its largest |b|.
        peak_MPa: f64,
    },
}

/// The estimator of a scene that takes another one than the search. `auto` asks a network only if it was trained for the
/// scene's physics.
fn evidence(scene: &Scene) -> Result<Option<Evidence>, LearnedError> {
    let advised = |combined| Ok(Some(Evidence::new(scene).advised_by(Learned::of_scene(scene)?, combined)));
    match scene.estimator() {
        EstimatorKind::Search | EstimatorKind::Network => Ok(None),
        EstimatorKind::Learned => advised(false),
        _ if scene.search.estimator == EstimatorKind::Auto && scene.search.network.is_some() => match advised(true) {
            Err(LearnedError::Mismatch { .. }) => Ok(Some(Evidence::new(scene))),
            other => other,
        },
        _ => Ok(Some(Evidence::new(scene))),
    }
}

impl Golden {
    /// Computes the matrices of a scene: milliseconds for 20 × 20 taxels, two seconds for the largest subarrays.
    ///
    /// # Errors
    /// Any [`GoldenError`] except `Frame` and `TooStrong`.
    pub fn new(scene: &Scene) -> Result<Golden, GoldenError> {
        scene.require_golden()?;
        // With `contacts` the network is asked for each contact, else it is the objective of the whole array.
        let asked = scene.estimator() == EstimatorKind::Network && scene.partition.case == Case::Contacts;
        let network = asked.then(|| Learned::of_scene(scene)).transpose()?;
        let tiling = |case: Case| -> Result<Tiling, GoldenError> {
            let parts = subarrays(case, &scene.sensor)?;
            let shape = parts[0].sensor(&scene.sensor);
            let shared = Matrices::of(scene, &shape, MAX_FLOAT_DEGREE)?;
            let orthogonal_form = scene.search.form == Form::Orthogonal;
            let orthogonal = orthogonal_form.then(|| Orthogonal::new(&shared)).transpose()?;
            let objective = match scene.estimator() {
                EstimatorKind::Network if network.is_none() => Box::new(ByNetwork::new(scene)?),
                _ => of_kind(scene.search.objective, &shape, scene.medium),
            };
            Ok(Tiling { case, parts, shared, masked: Vec::new(), orthogonal, objective }.mask(&scene.input.dead)?)
        };
        let cases = match scene.partition.case {
            // The finest case first, the whole array last.
            Case::Adaptive => {
                let mut cases = scene.partition.choices(&scene.sensor);
                cases.rotate_left(1);
                cases
            }
            Case::Contacts => vec![Case::WHOLE],
            grid @ Case::Grid(_) => vec![grid],
        };
        let tilings = cases.into_iter().map(tiling).collect::<Result<_, _>>()?;
        let by_contact = scene.partition.case.grid().is_none();
        let fits = by_contact && scene.input.dead.is_empty() && scene.search.mu_max > 0.0;
        let taxels = fits.then(|| Taxels::new(&scene.sensor, scene.medium));
        let input = Input::new(scene)?;
        let evidence = evidence(scene)?.map(|evidence| match input.noise_shares() {
            None => evidence,
            Some(shares) => evidence.with_noise_shares(shares),
        });
        let (misfit, deviations) = (Misfit::of_scene(scene)?, Deviations::of_scene(scene)?);
        Ok(Golden { scene: scene.clone(), input, tilings, taxels, evidence, network, misfit, deviations })
    }

    /// The matrices of the first subarray; with `adaptive` and `contacts` those of the whole array.
    pub fn matrices(&self) -> &Matrices {
        self.whole().matrices(0)
    }

    /// The coarsest partition.
    pub(super) fn whole(&self) -> &Tiling {
        &self.tilings[self.tilings.len() - 1]
    }

    /// The subarrays of the coarsest partition with their matrices.
    pub(super) fn parts(&self) -> impl Iterator<Item = (&Subarray, &Matrices)> {
        let whole = self.whole();
        whole.parts.iter().enumerate().map(|(index, part)| (part, whole.matrices(index)))
    }

    /// Reconstructs calibrated stress. The forces come from the stress, the condition from its codes.
    ///
    /// # Errors
    /// [`GoldenError::Frame`] if the frame is not of the scene's sensor, [`GoldenError::TooStrong`] if a force is not
    /// finite.
    pub(super) fn reconstruct_stress(&self, frame: &Frame, noise_MPa: f64) -> Result<Reconstruction, GoldenError> {
        let scene = &self.scene;
        frame.check(scene)?;
        let codes = quantise(&frame.stress_MPa, scene.fixed.input_bits, full_scale(scene, frame));
        let floor = noise_floor_codes(scene, &codes);
        let input = EngineInput { stress_MPa: &frame.stress_MPa, codes: &codes.codes, floor, noise_MPa };
        let mut result = match (&self.evidence, scene.partition.case) {
            (Some(evidence), _) => self.by_evidence(evidence, frame, &input),
            (None, Case::Grid(_)) => self.finish(frame, self.subarrays(&input, self.whole())),
            (None, Case::Adaptive) => self.adaptive(frame, &input),
            (None, Case::Contacts) => self.contacts(frame, &input),
        };
        if !result.resultant_N.iter().all(|sum| sum.is_finite()) {
            let (frame, peak_MPa) = (frame.id.clone(), frame.peak_MPa());
            return Err(GoldenError::TooStrong { frame, peak_MPa });
        }
        result.flags.extend(frame_flags(scene, frame, &codes, noise_MPa));
        result.flags.sort();
        result.flags.dedup();
        Ok(result)
    }

    pub(super) fn finish(&self, frame: &Frame, outcome: CaseOutcome) -> Reconstruction {
        let CaseOutcome { subarrays, forces, flags, truncation, shape_misfit, shear_spread } = outcome;
        let mut result = assemble(&self.scene, frame, "golden", subarrays, forces, flags);
        result.checks.shape_misfit = shape_misfit;
        result.checks.shear_spread = shear_spread;
        result.extra.truncation = Some(truncation).filter(|truncation| !truncation.is_empty());
        result
    }

    pub(super) fn receive(&self, input: &EngineInput, part: &Subarray) -> Received {
        let codes = part.gather(&self.scene.sensor, input.codes);
        receive(&self.scene.sensor, part, &codes, input.floor, self.scene.partition.condition)
    }

    /// Solves every subarray of a partition on its own.
    pub(super) fn subarrays(&self, input: &EngineInput, tiling: &Tiling) -> CaseOutcome {
        let sensor = &self.scene.sensor;
        let mut outcome = CaseOutcome { forces: Forces::zeros(sensor.taxels()), ..CaseOutcome::default() };
        for (index, part) in tiling.parts.iter().enumerate() {
            let received = self.receive(input, part);
            let b = part.gather(sensor, input.stress_MPa);
            // With mu_max = 0 nothing is searched: there is no score and no test for compression.
            let searched = received.condition_met && self.scene.search.mu_max > 0.0;
            let (estimate, w) = self.solve(tiling, index, &b, searched, input.noise_MPa);
            let (x, truncation) = tiling.apply_form(&b, w);
            outcome.truncation.extend(truncation);
            let own = threshold(x, self.scene.threshold.min_force_N);
            let misfit = estimate.and_then(|estimate| estimate.shape_misfit(&b, input.noise_MPa));
            outcome.shape_misfit = [outcome.shape_misfit, misfit].into_iter().flatten().reduce(f64::max);
            let spread = estimate.and_then(|estimate| estimate.shear_spread());
            outcome.shear_spread = [outcome.shear_spread, spread].into_iter().flatten().reduce(f64::max);
            if searched && estimate.is_none() {
                outcome.flags.push(Flag::NoCompression);
            }
            part.scatter(sensor, &own.fx, &mut outcome.forces.fx);
            part.scatter(sensor, &own.fy, &mut outcome.forces.fy);
            part.scatter(sensor, &own.fz, &mut outcome.forces.fz);
            let found = estimate.map(|estimate| estimate.found);
            let (mu, objective) = (found.map_or([0.0; 2], |found| found.mu), found.map(|found| found.objective));
            let mu_sigma = estimate.and_then(|estimate| estimate.sigma);
            let own = SubarrayResult::new(part, &received, mu, objective);
            outcome.subarrays.push(SubarrayResult { mu_sigma, ..own });
        }
        outcome
    }

    /// Solves one subarray: polynomial, search if the condition is met, forces before the threshold.
    fn solve(
        &self,
        tiling: &Tiling,
        part: usize,
        b: &[f64],
        condition_met: bool,
        noise_MPa: f64,
    ) -> (Option<Estimate>, Forces) {
        let matrices = tiling.matrices(part);
        if !condition_met {
            let family = Polynomial::of_degree(matrices, b, 0);
            return (None, force(family.v(0, 0), [0.0; 2], 0.0));
        }
        let family = Polynomial::new(matrices, b);
        let (sensor, mu_max) = (&matrices.sensor, self.scene.search.mu_max);
        let estimate = tiling.objective.find(&SearchInput { sensor, b, family: &family, mu_max, noise_MPa });
        let mu = estimate.map_or([0.0; 2], |estimate| estimate.found.mu);
        let p = estimate.map_or_else(|| family.eval(mu), |estimate| estimate.pressure(&family));
        (estimate, force(&p, mu, 0.0))
    }
}

impl Tiling {
    /// The forces of Eq. 1 for w: w itself in the oblique form; in the orthogonal form the nearest forces that cause b,
    /// and the truncation error.
    pub(super) fn apply_form(&self, b: &[f64], w: Forces) -> (Forces, Option<f64>) {
        match &self.orthogonal {
            None => (w, None),
            Some(orthogonal) => {
                let x = orthogonal.apply(b, &w);
                let off = truncation(&x, &w);
                (x, Some(off))
            }
        }
    }
}
