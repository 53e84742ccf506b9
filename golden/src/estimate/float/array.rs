//! Array: a scene's array in its partitions with their matrices, with which the searches compute.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: calibrated stress and its codes | n, n | MPa, LSB |
//! | in: objective of a search | – | – |
//! | out: forces, μ of each subarray | 3 × n, 2 per subarray | N, – |

use super::error::GoldenError;
use super::forces::{force, threshold};
use super::objective::{MuEstimate, Objective, SearchInput};
use super::orthogonal::{truncation, Orthogonal};
use super::pass::Polynomial;
use crate::data::frame::{Forces, Frame};
use crate::data::reception::{receive, SubarrayStats};
use crate::physics::matrices::{Matrices, MatricesError};
use crate::result::flags::Flag;
use crate::result::reconstruct::{assemble, Reconstruction, SubarrayResult};
use crate::spec::partition::{subarrays, Case, Subarray};
use crate::spec::scene::MAX_FLOAT_DEGREE;
use crate::spec::scene::{Form, Scene};

/// The array of a scene, its matrices computed.
pub(super) struct Array {
    /// The case; for `adaptive` all cases that divide the array, the finest first, the whole array last.
    pub tilings: Vec<Tiling>,
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

    /// The forces of Eq. 1 for w: w itself in the oblique form; in the orthogonal form the nearest forces that cause b,
    /// and the truncation error.
    pub fn apply_form(&self, b: &[f64], w: Forces) -> (Forces, Option<f64>) {
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

/// A frame in the forms that the stages need.
pub(super) struct EngineInput<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// Calibrated stress.
    pub frame: &'a Frame,
    /// Its converter's codes.
    pub codes: &'a [i32],
    /// Noise floor in codes.
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
    /// Largest misfit of a subarray's fitted shape, see [`MuEstimate::shape_misfit`].
    pub shape_misfit: Option<f64>,
    /// Largest relative standard deviation of a subarray's shear, see [`MuEstimate::shear_spread`].
    pub shear_spread: Option<f64>,
}

impl Array {
    /// Computes the matrices of a scene's partitions.
    ///
    /// # Errors
    /// [`GoldenError::Partition`], [`GoldenError::Matrices`] or [`GoldenError::Orthogonal`].
    pub fn new(scene: &Scene) -> Result<Array, GoldenError> {
        let tiling = |case: Case| -> Result<Tiling, GoldenError> {
            let parts = subarrays(case, &scene.sensor)?;
            let shape = parts[0].sensor(&scene.sensor);
            let shared = Matrices::of(scene, &shape, MAX_FLOAT_DEGREE)?;
            let orthogonal_form = scene.search.form == Form::Orthogonal;
            let orthogonal = orthogonal_form.then(|| Orthogonal::new(&shared)).transpose()?;
            Ok(Tiling { case, parts, shared, masked: Vec::new(), orthogonal }.mask(&scene.input.dead)?)
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
        Ok(Array { tilings })
    }

    /// The matrices of the first subarray; with `adaptive` and `contacts` those of the whole array.
    pub fn matrices(&self) -> &Matrices {
        self.whole().matrices(0)
    }

    /// The coarsest partition.
    pub fn whole(&self) -> &Tiling {
        &self.tilings[self.tilings.len() - 1]
    }

    /// The subarrays of the coarsest partition with their matrices.
    pub fn parts(&self) -> impl Iterator<Item = (&Subarray, &Matrices)> {
        let whole = self.whole();
        whole.parts.iter().enumerate().map(|(index, part)| (part, whole.matrices(index)))
    }

    /// Solves every subarray of a partition on its own.
    pub fn subarrays(&self, input: &EngineInput, tiling: &Tiling, solve: &dyn Solve) -> CaseOutcome {
        let Scene { sensor, search, threshold: least, .. } = input.scene;
        let mut outcome = CaseOutcome { forces: Forces::zeros(sensor.taxels()), ..CaseOutcome::default() };
        for (index, part) in tiling.parts.iter().enumerate() {
            let received = input.receive(part);
            let b = part.gather(sensor, &input.frame.stress_MPa);
            // With mu_max = 0 nothing is searched: there is no score and no test for compression.
            let searched = received.condition_met && search.mu_max > 0.0;
            let matrices = tiling.matrices(index);
            let (estimate, p) = match searched {
                true => solve.solve(matrices, &b, search.mu_max, input.noise_MPa),
                false => (None, Polynomial::of_degree(matrices, &b, 0).eval([0.0; 2])),
            };
            let w = force(&p, estimate.map_or([0.0; 2], |estimate| estimate.found.mu), 0.0);
            let (x, truncation) = tiling.apply_form(&b, w);
            outcome.truncation.extend(truncation);
            let own = threshold(x, least.min_force_N);
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
}

/// Finds μ of a subarray.
pub(super) trait Solve {
    /// The estimate for stress `b` in MPa, `None` if no μ is admissible, and p in N with its μ or with 0, before the threshold.
    fn solve(&self, matrices: &Matrices, b: &[f64], mu_max: f64, noise_MPa: f64) -> (Option<MuEstimate>, Vec<f64>);
}

/// By the μ that maximises an objective.
pub(super) struct BySearch<'a>(pub &'a dyn Objective);

impl Solve for BySearch<'_> {
    fn solve(&self, matrices: &Matrices, b: &[f64], mu_max: f64, noise_MPa: f64) -> (Option<MuEstimate>, Vec<f64>) {
        let family = Polynomial::new(matrices, b);
        let estimate = self.0.find(&SearchInput { sensor: &matrices.sensor, b, family: &family, mu_max, noise_MPa });
        let p = estimate.map_or_else(|| family.eval([0.0; 2]), |estimate| estimate.pressure(&family));
        (estimate, p)
    }
}

impl EngineInput<'_> {
    /// The result of a case.
    pub fn finish(&self, outcome: CaseOutcome) -> Reconstruction {
        let CaseOutcome { subarrays, forces, flags, truncation, shape_misfit, shear_spread } = outcome;
        let mut result = assemble(self.scene, self.frame, "golden", subarrays, forces, flags);
        result.checks.shape_misfit = shape_misfit;
        result.checks.shear_spread = shear_spread;
        result.extra.truncation = Some(truncation).filter(|truncation| !truncation.is_empty());
        result
    }

    /// What `receive` finds of a subarray.
    pub fn receive(&self, part: &Subarray) -> SubarrayStats {
        let sensor = &self.scene.sensor;
        receive(sensor, part, &part.gather(sensor, self.codes), self.floor, self.scene.partition.condition)
    }

    /// The array as one subarray that is not searched; its μ is the ratio of the resultants.
    pub fn array_of(&self, resultant_N: [f64; 3]) -> SubarrayResult {
        let (rows, cols) = (self.scene.sensor.rows, self.scene.sensor.cols);
        let part = Subarray { row0: 0, col0: 0, rows, cols };
        SubarrayResult::of_regions(&part, &self.receive(&part), resultant_N)
    }
}
