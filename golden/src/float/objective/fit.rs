//! Fit: Levenberg–Marquardt over a few parameters with linear loads inside (variable projection).
//!
//! min over θ, c of ‖b − G(θ) c‖². For every θ the loads c follow by least squares; the step in θ is Kaufman's: with
//! J = ∂(G c)/∂θ made orthogonal to the columns of G, (JᵀJ + λ diag JᵀJ) δ = Jᵀ(b − G c).
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: b | n | MPa |
//! | in: θ at the start | k, at most 8 | of the model |
//! | out: θ, loads | k, m | of the model |
//! | out: squared misfit | scalar | MPa² |
//!
//! λ falls tenfold after a step that helps and rises tenfold after one that does not.

use nalgebra::{DMatrix, DVector};

/// How long a fit goes on.
#[derive(Clone, Copy, Debug)]
pub(super) struct Effort {
    /// Steps at most; a fit that goes well takes 6 to 15.
    pub steps: usize,
    /// A step that lowers the misfit by a smaller share ends the fit.
    pub gain: f64,
}

/// To the end.
pub(super) const THOROUGH: Effort = Effort { steps: 40, gain: 1e-7 };
/// As long as it goes on well.
pub(super) const STEADY: Effort = Effort { steps: 20, gain: 0.01 };
/// As long as it goes fast: to tell starts that lead somewhere from those that do not.
pub(super) const QUICK: Effort = Effort { steps: 20, gain: 0.05 };

/// λ beyond which no step helps any more.
const MAX_LAMBDA: f64 = 1e8;
/// Added to the normal equations' diagonal, relative, so that loads that cannot be told apart stay finite.
const RIDGE: f64 = 1e-13;

/// A model of stress, linear in its loads.
pub(super) trait Model {
    /// Stress of unit loads: m columns of n.
    fn columns(&mut self, theta: &[f64]) -> DMatrix<f64>;
    /// Derivatives of the stress under loads c with respect to θ: k columns of n.
    fn slopes(&mut self, theta: &[f64], loads: &DVector<f64>) -> DMatrix<f64>;
    /// Moves θ to the nearest admissible point.
    fn confine(&self, theta: &mut [f64]);
}

/// Outcome of a fit.
#[derive(Clone, Debug)]
pub(super) struct Fit {
    pub theta: Vec<f64>,
    pub loads: DVector<f64>,
    /// ‖b − G c‖²
    pub misfit: f64,
    /// Sets of columns computed.
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

    /// J without its part in the columns' span.
    fn project(&self, mut slopes: DMatrix<f64>) -> DMatrix<f64> {
        let inside = self.normal.solve(&self.columns.tr_mul(&slopes));
        slopes -= &self.columns * inside;
        slopes
    }
}

/// Misfit of the best loads at one θ, `None` where the columns are degenerate.
pub(super) fn misfit(model: &mut dyn Model, b: &DVector<f64>, theta: &[f64]) -> Option<f64> {
    let projection = Projection::new(model.columns(theta), b)?;
    Some(projection.misfit()).filter(|misfit| misfit.is_finite())
}

/// Fits from a start; `None` where the model has no finite loads there.
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
