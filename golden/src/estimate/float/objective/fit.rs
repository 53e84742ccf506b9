//! Fit: Levenberg–Marquardt over a few parameters, the loads eliminated by linear least squares (variable projection).
//!
//! min over θ, c of ‖b − G(θ) c‖². For every θ the loads c follow from least squares; the step in θ is Kaufman's: with
//! J = ∂(G c)/∂θ made orthogonal to the columns of G, (JᵀJ + λ diag JᵀJ) δ = Jᵀ(b − G c).
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: b | n | MPa |
//! | in: initial θ | k, at most 8 | of the model |
//! | out: θ, loads | k, m | of the model |
//! | out: squared misfit | scalar | MPa² |
//!
//! λ is divided by 10 after a step that reduces the misfit and multiplied by 10 after one that does not.

use nalgebra::{DMatrix, DVector};

/// Stopping criteria of a fit.
#[derive(Clone, Copy, Debug)]
pub(super) struct Effort {
    /// Maximum number of steps; a good fit takes 6 to 15.
    pub steps: usize,
    /// The fit ends with a step that reduces the misfit by a smaller fraction.
    pub gain: f64,
}

/// Until convergence.
pub(super) const THOROUGH: Effort = Effort { steps: 40, gain: 1e-7 };
/// As long as a step gains 1 %.
pub(super) const STEADY: Effort = Effort { steps: 20, gain: 0.01 };
/// As long as a step gains 5 %: to sort out bad starts.
pub(super) const QUICK: Effort = Effort { steps: 20, gain: 0.05 };

/// Largest λ; beyond it no step reduces the misfit.
const MAX_LAMBDA: f64 = 1e8;
/// Relative ridge on the diagonal of the normal equations, so that indistinguishable loads stay finite.
const RIDGE: f64 = 1e-13;

/// Error of the quadratures of the fit and of simulated frames, relative to the peak.
const OWN_ERROR: f64 = 1.5e-4;
/// Standard deviations of χ² up to which a misfit counts as noise.
const DEVIATIONS: f64 = 4.0;

/// A stress model that is linear in its loads.
pub(super) trait Model {
    /// Stress of unit loads: m columns of n.
    fn columns(&mut self, theta: &[f64]) -> DMatrix<f64>;
    /// Derivatives of the stress under loads c by θ: k columns of n.
    fn slopes(&mut self, theta: &[f64], loads: &DVector<f64>) -> DMatrix<f64>;
    /// Clamps θ to its admissible range.
    fn confine(&self, theta: &mut [f64]);
}

/// Result of a fit.
#[derive(Clone, Debug)]
pub(super) struct Fit {
    pub theta: Vec<f64>,
    pub loads: DVector<f64>,
    /// ‖b − G c‖²
    pub misfit: f64,
    /// Number of evaluations of the columns.
    pub evaluations: usize,
}

/// The least-squares loads at one θ.
struct Projection {
    columns: DMatrix<f64>,
    normal: nalgebra::Cholesky<f64, nalgebra::Dyn>,
    loads: DVector<f64>,
    rest: DVector<f64>,
}

impl Projection {
    fn new(columns: DMatrix<f64>, b: &DVector<f64>) -> Option<Projection> {
        let mut normal = columns.tr_mul(&columns);
        for k in 0..normal.nrows() {
            normal[(k, k)] *= 1.0 + RIDGE;
        }
        let normal = normal.cholesky()?;
        let loads = normal.solve(&columns.tr_mul(b));
        let rest = b - &columns * &loads;
        Some(Projection { columns, normal, loads, rest })
    }

    fn misfit(&self) -> f64 {
        self.rest.norm_squared()
    }

    /// J made orthogonal to the columns.
    fn project(&self, mut slopes: DMatrix<f64>) -> DMatrix<f64> {
        let inside = self.normal.solve(&self.columns.tr_mul(&slopes));
        slopes -= &self.columns * inside;
        slopes
    }
}

/// Largest squared misfit in MPa² with which a fit explains b.
pub(crate) fn misfit_limit(b: &[f64], noise_MPa: f64) -> f64 {
    let peak = b.iter().fold(0.0f64, |peak, b| b.abs().max(peak));
    let n = b.len() as f64;
    let variance = noise_MPa.powi(2) + (OWN_ERROR * peak).powi(2);
    n * variance * (1.0 + DEVIATIONS * (2.0 / n).sqrt())
}

/// Squared misfit of the best loads at one θ; `None` where the columns are linearly dependent.
pub(super) fn misfit(model: &mut dyn Model, b: &DVector<f64>, theta: &[f64]) -> Option<f64> {
    let projection = Projection::new(model.columns(theta), b)?;
    Some(projection.misfit()).filter(|misfit| misfit.is_finite())
}

/// Fits θ from `start`; `None` where the model has no finite loads there.
pub(super) fn fit(model: &mut dyn Model, b: &DVector<f64>, start: &[f64], effort: Effort) -> Option<Fit> {
    let mut theta = start.to_vec();
    model.confine(&mut theta);
    let mut best = Projection::new(model.columns(&theta), b)?;
    let (mut evaluations, mut lambda) = (1, 1e-3);
    for _ in 0..effort.steps {
        let slopes = best.project(model.slopes(&theta, &best.loads));
        let (curvature, downhill) = (slopes.tr_mul(&slopes), slopes.tr_mul(&best.rest));
        let before = best.misfit();
        while lambda < MAX_LAMBDA {
            let mut damped = curvature.clone();
            for k in 0..damped.nrows() {
                damped[(k, k)] += lambda * curvature[(k, k)] + f64::MIN_POSITIVE;
            }
            let Some(step) = damped.cholesky().map(|damped| damped.solve(&downhill)) else {
                lambda *= 10.0;
                continue;
            };
            let mut candidate: Vec<f64> = theta.iter().zip(&step).map(|(theta, step)| theta + step).collect();
            model.confine(&mut candidate);
            evaluations += 1;
            match Projection::new(model.columns(&candidate), b).filter(|p| p.misfit() < best.misfit()) {
                Some(better) => {
                    (theta, best) = (candidate, better);
                    lambda = (lambda * 0.1).max(1e-9);
                    break;
                }
                None => lambda *= 10.0,
            }
        }
        if before - best.misfit() <= effort.gain * before {
            break;
        }
    }
    let misfit = best.misfit();
    misfit.is_finite().then_some(Fit { theta, loads: best.loads, misfit, evaluations })
}
