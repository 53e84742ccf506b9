//! Baseline: the paper's algorithm as it is printed, as a reference for run time and accuracy.
//!
//! For every candidate μ the dense C† and I − C†C are multiplied (Eq. 1), and a general-purpose optimiser searches for
//! μ: the Nelder–Mead simplex instead of Matlab's `fmincon`. Objective, family w(μ), disc and condition are those of
//! the golden model, so that the run times compare the algorithms and the errors differ by the search alone.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: frame | n, case 0 to 3 or rows × columns | MPa |
//! | out: forces | 3 × n | N |

use argmin::core::{CostFunction, Error, Executor};
use argmin::solver::neldermead::NelderMead;
use dermis_golden::data::frame::{Forces, Frame};
use dermis_golden::data::quantise::quantise;
use dermis_golden::data::reception::{full_scale, noise_floor_codes, receive};
use dermis_golden::estimate::float::forces::{force, threshold};
use dermis_golden::estimate::float::objective::{Objective, Sparse};
use dermis_golden::estimate::float::orthogonal::Orthogonal;
use dermis_golden::estimate::float::pass::Polynomial;
use dermis_golden::estimate::float::GoldenError;
use dermis_golden::physics::matrices::Matrices;
use dermis_golden::spec::partition::{subarrays, Subarray};
use dermis_golden::spec::scene::Scene;
use dermis_golden::spec::scene::MAX_FLOAT_DEGREE;

/// Cost outside the disc and where Σp is not above zero: larger than any negative score.
const REFUSED: f64 = 1e9;
/// Convergence tolerance: standard deviation of the simplex's costs in bits.
const SETTLED: f64 = 1e-6;
/// Maximum number of steps of the simplex.
const STEPS: u64 = 200;

/// The paper's algorithm for a scene: its matrices.
pub struct Baseline {
    scene: Scene,
    parts: Vec<Subarray>,
    matrices: Matrices,
    orthogonal: Orthogonal,
}

/// The cost function: Eq. 1 for one frame of one subarray.
struct Eq1Cost<'a> {
    orthogonal: &'a Orthogonal,
    family: &'a Polynomial,
    b: &'a [f64],
    mu_max: f64,
}

impl Eq1Cost<'_> {
    fn forces(&self, mu: [f64; 2]) -> Forces {
        self.orthogonal.apply(self.b, &force(&self.family.eval(mu), mu, 0.0))
    }
}

impl CostFunction for Eq1Cost<'_> {
    type Param = Vec<f64>;
    type Output = f64;

    fn cost(&self, mu: &Vec<f64>) -> Result<f64, Error> {
        if mu[0].hypot(mu[1]) > self.mu_max {
            return Ok(REFUSED);
        }
        Ok(Sparse::default().score(&self.forces([mu[0], mu[1]]).fz).map_or(REFUSED, |score| -score))
    }
}

impl Baseline {
    /// Computes C† and I − C†C with the scene's `[inverse]`; takes seconds for subarrays of 20 × 20.
    ///
    /// # Errors
    /// As [`dermis_golden::estimate::float::Golden::new`]; [`GoldenError::Orthogonal`] if a subarray has more than
    /// [`dermis_golden::estimate::float::orthogonal::MAX_TAXELS`] taxels; [`GoldenError::Partition`] if the case depends on the frame.
    pub fn new(scene: &Scene) -> Result<Baseline, GoldenError> {
        scene.require_golden()?;
        let parts = subarrays(scene.partition.case, &scene.sensor)?;
        let matrices = Matrices::of(scene, &parts[0].sensor(&scene.sensor), MAX_FLOAT_DEGREE)?;
        let orthogonal = Orthogonal::new(&matrices)?;
        Ok(Baseline { scene: scene.clone(), parts, matrices, orthogonal })
    }

    /// Forces of one frame in N, row-major.
    ///
    /// # Errors
    /// [`GoldenError::Frame`] if the frame is not of the scene's sensor.
    pub fn run(&self, frame: &Frame) -> Result<Forces, GoldenError> {
        let Scene { sensor, search, .. } = &self.scene;
        frame.check(&self.scene)?;
        let codes = quantise(&frame.stress_MPa, self.scene.fixed.input_bits, full_scale(&self.scene, frame));
        let floor = noise_floor_codes(&self.scene, &codes);
        let mut forces = Forces::zeros(sensor.taxels());
        for part in &self.parts {
            let own = part.gather(sensor, &codes.codes);
            let searched = receive(sensor, part, &own, floor, self.scene.partition.condition).condition_met;
            let x = self.subarray(&part.gather(sensor, &frame.stress_MPa), searched && search.mu_max > 0.0);
            let x = threshold(x, self.scene.threshold.min_force_N);
            part.scatter(sensor, &x.fx, &mut forces.fx);
            part.scatter(sensor, &x.fy, &mut forces.fy);
            part.scatter(sensor, &x.fz, &mut forces.fz);
        }
        Ok(forces)
    }

    fn subarray(&self, b: &[f64], searched: bool) -> Forces {
        let mu_max = self.scene.search.mu_max;
        let family = &Polynomial::new(&self.matrices, b);
        let problem = || Eq1Cost { orthogonal: &self.orthogonal, family, b, mu_max };
        let mu = if searched { simplex(problem(), mu_max) } else { [0.0; 2] };
        problem().forces(mu)
    }
}

/// The μ to which the simplex converges; no shear if it fails.
fn simplex(problem: Eq1Cost, mu_max: f64) -> [f64; 2] {
    let corners = vec![vec![0.0, 0.0], vec![mu_max / 3.0, 0.0], vec![0.0, mu_max / 3.0]];
    let run = || -> Result<Option<Vec<f64>>, Error> {
        let solver = NelderMead::new(corners).with_sd_tolerance(SETTLED)?;
        Ok(Executor::new(problem, solver).configure(|state| state.max_iters(STEPS)).run()?.state.best_param)
    };
    run().ok().flatten().map_or([0.0; 2], |mu| [mu[0], mu[1]])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stability::settings;
    use dermis_golden::estimate::float::Golden;
    use dermis_golden::result::errors::Errors;
    use dermis_golden::spec::partition::Case;
    use dermis_golden::spec::scene::InverseKind;

    #[test]
    fn agrees_with_the_golden_model() {
        let scene = Scene::builtin("sensor-1").unwrap();
        let (baseline, golden) = (Baseline::new(&scene).unwrap(), Golden::reference(&scene).unwrap());
        let frame = &Frame::shipped(&scene)[1];
        let (forces, result) = (baseline.run(frame).unwrap(), golden.run(frame).unwrap());
        let error = Errors::new(result.resultant_N, forces.resultant());
        // Half a step of the golden grid, 0.6/384, and the series' truncation of 2e-3, against μ around 0.3.
        assert!(error.tangential.unwrap() < 0.02, "{error:?}");
        assert!(error.normal.unwrap() < 0.002, "{error:?}");
    }

    /// Truncated singular values of C† do not return: on an ill-conditioned array an error of the readings has an
    /// effect a thousand times smaller than with the exact inverse.
    #[test]
    fn the_inverse_is_the_scenes() {
        let stiff = settings().into_iter().find(|s| s.scene.sensor.thickness_mm == 10.0).unwrap();
        let mut scene = stiff.scene;
        scene.search.mu_max = 0.0;
        let taxels = scene.sensor.taxels();
        let stress = |off: f64| {
            let values = (0..taxels).map(|t| 1.0 + off * if (t / 8 + t % 8) % 2 == 0 { 1.0 } else { -1.0 });
            Frame::from_stress("stiff", &scene.sensor, values.collect()).unwrap()
        };
        let (even, rough) = (stress(0.0), stress(1e-6));
        let moved = [InverseKind::Tsvd, InverseKind::Exact].map(|kind| {
            let mut scene = scene.clone();
            scene.inverse.kind = kind;
            let baseline = Baseline::new(&scene).unwrap();
            let pairs = baseline.run(&even).unwrap().fz.into_iter().zip(baseline.run(&rough).unwrap().fz);
            pairs.fold(0.0f64, |most, (a, b)| most.max((a - b).abs()))
        });
        assert!(1e3 * moved[0] < moved[1], "{moved:?}");
    }

    #[test]
    fn large_subarrays_and_cases_without_rectangles_are_rejected() {
        let mut scene = Scene::builtin("sensor-4").unwrap();
        scene.partition.case = Case::WHOLE;
        assert!(matches!(Baseline::new(&scene), Err(GoldenError::Orthogonal(_))));
        scene.partition.case = Case::Contacts;
        assert!(matches!(Baseline::new(&scene), Err(GoldenError::Partition(_))));
    }
}
