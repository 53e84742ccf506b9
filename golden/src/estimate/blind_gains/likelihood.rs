//! Likelihood: how probable the readings of a press are under gains, its slope and its information.
//!
//! ```text
//! y ~ N(0, C)        C = M + Σ        M = G S Sᵀ G,  G = diag(exp θ)
//! log L = −½ yᵀC⁻¹y − ½ log|C|
//! slope_t = α_t (M α)_t − (C⁻¹M)_tt        α = C⁻¹y
//! information_tu = (C⁻¹M)_tu (C⁻¹M)_ut + (M C⁻¹M)_tu (C⁻¹)_tu
//! ```
//!
//! S holds the stress of every coefficient of pressure and shear that a press may have, Σ what a press has beside it: noise, what
//! the prior does not describe, a smooth baseline. The information is Fisher's, the mean of the curvature over readings that the
//! model draws, which is positive semidefinite wherever θ is.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: readings y | taxels of the press | of the peak |
//! | in: S, Σ | taxels × coefficients, taxels² | of the peak |
//! | in: θ, log gains | taxels of the array | – |
//! | out: log L, slope, information | 1, taxels, taxels² | – |

use crate::estimate::evidence::cholesky::Cholesky;
use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatRef, Par};

/// A press as the likelihood takes it.
pub(super) struct Modelled {
    /// Taxels that count, ascending row-major indices.
    pub taxels: Vec<usize>,
    /// Their readings, in units of the peak.
    pub y: Vec<f64>,
    /// S.
    pub s: Mat<f64>,
    /// Σ.
    pub rest: Rest,
}

/// Σ = σ² 1 + B Bᵀ, what a press has beside pressure and shear.
pub(super) struct Rest {
    /// σ of each reading, of the peak.
    pub sigma: Vec<f64>,
    /// B, taxels × terms of a baseline, of the peak.
    pub baseline: Mat<f64>,
}

/// Sums over presses at one θ.
pub(super) struct Sums {
    /// log L of each press, without the constant.
    pub values: Vec<f64>,
    /// Slope in θ, of the taxels of the array.
    pub slope: Vec<f64>,
    /// Information of θ, of the taxels of the array squared.
    pub information: Mat<f64>,
    /// Σ αᵀα and Σ tr C⁻¹, which are equal where the readings leave as much noise as Σ has.
    pub left: [f64; 2],
}

/// Cholesky factor of C, M and α of a press; `None` where C is not positive definite.
struct Factored {
    m: Mat<f64>,
    factor: Cholesky,
    alpha: Vec<f64>,
}

impl Modelled {
    fn factored(&self, theta: &[f64]) -> Option<Factored> {
        let gains: Vec<f64> = self.taxels.iter().map(|&t| theta[t].exp()).collect();
        let scaled = Mat::from_fn(self.s.nrows(), self.s.ncols(), |i, j| gains[i] * self.s[(i, j)]);
        let m = product(scaled.as_ref(), scaled.transpose());
        let factor = self.rest.and(&m)?;
        let mut alpha = self.y.clone();
        factor.solve(&mut alpha);
        Some(Factored { m, factor, alpha })
    }

    fn value_of(&self, own: &Factored) -> f64 {
        let square: f64 = self.y.iter().zip(&own.alpha).map(|(y, alpha)| y * alpha).sum();
        -0.5 * (square + own.factor.log_determinant())
    }

    /// log L at `theta`; −∞ where the model is not representable.
    pub fn value(&self, theta: &[f64]) -> f64 {
        self.factored(theta).map_or(f64::NEG_INFINITY, |own| self.value_of(&own))
    }

    /// Adds log L, slope and information at `theta`.
    pub fn add_to(&self, theta: &[f64], sums: &mut Sums) {
        let Some(own) = self.factored(theta) else {
            sums.values.push(f64::NEG_INFINITY);
            return;
        };
        sums.values.push(self.value_of(&own));
        let (inverse, m) = (own.factor.inverse(), own.m.as_ref());
        sums.left[0] += own.alpha.iter().map(|alpha| alpha * alpha).sum::<f64>();
        sums.left[1] += (0..self.y.len()).map(|i| inverse[(i, i)]).sum::<f64>();
        let by = product(inverse.as_ref(), m);
        let both = product(m, by.as_ref());
        for (i, &t) in self.taxels.iter().enumerate() {
            let pulled: f64 = m.col(i).iter().zip(&own.alpha).map(|(m, alpha)| m * alpha).sum();
            sums.slope[t] += own.alpha[i] * pulled - by[(i, i)];
            for (j, &u) in self.taxels.iter().enumerate() {
                sums.information[(u, t)] += by[(i, j)] * by[(j, i)] + both[(j, i)] * inverse[(j, i)];
            }
        }
    }
}

impl Rest {
    /// M + Σ, factored; `None` where it is not positive definite.
    pub fn and(&self, m: &Mat<f64>) -> Option<Cholesky> {
        let mut sum = m.clone();
        matmul(sum.as_mut(), Accum::Add, &self.baseline, self.baseline.transpose(), 1.0, Par::Seq);
        self.sigma.iter().enumerate().for_each(|(i, sigma)| sum[(i, i)] += sigma * sigma);
        Cholesky::new(sum)
    }
}

impl Sums {
    /// No press yet, of an array of so many taxels.
    pub fn none(taxels: usize) -> Sums {
        Sums { values: Vec::new(), slope: vec![0.0; taxels], information: Mat::zeros(taxels, taxels), left: [0.0; 2] }
    }

    /// With the sums over further presses.
    pub fn and(mut self, other: Sums) -> Sums {
        self.values.extend(other.values);
        self.slope.iter_mut().zip(&other.slope).for_each(|(sum, own)| *sum += own);
        self.information += &other.information;
        self.left = [0, 1].map(|k| self.left[k] + other.left[k]);
        self
    }
}

/// A B on one core: presses share the cores.
pub(super) fn product(a: MatRef<f64>, b: MatRef<f64>) -> Mat<f64> {
    let mut product = Mat::zeros(a.nrows(), b.ncols());
    matmul(product.as_mut(), Accum::Replace, a, b, 1.0, Par::Seq);
    product
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    fn modelled(random: &mut Random) -> Modelled {
        let s = Mat::from_fn(4, 3, |_, _| random.normal());
        let rest = Rest { sigma: vec![0.08f64.sqrt(); 4], baseline: Mat::from_fn(4, 1, |_, _| 0.1) };
        Modelled { taxels: vec![0, 2, 3, 4], y: (0..4).map(|_| random.normal()).collect(), s, rest }
    }

    /// The slope is the derivative of the value, and without a reading of a taxel there is none.
    #[test]
    fn slope_by_differences() {
        let own = modelled(&mut Random::new(3));
        let theta = [0.1, 0.0, -0.2, 0.05, 0.3];
        let mut sums = Sums::none(5);
        own.add_to(&theta, &mut sums);
        assert!((sums.values[0] - own.value(&theta)).abs() < 1e-12);
        for t in 0..5 {
            let moved =
                |by: f64| own.value(&std::array::from_fn::<f64, 5, _>(|k| theta[k] + if k == t { by } else { 0.0 }));
            let slope = (moved(1e-5) - moved(-1e-5)) / 2e-5;
            assert!((sums.slope[t] - slope).abs() < 1e-6 * (1.0 + slope.abs()), "{t}: {} {slope}", sums.slope[t]);
        }
        assert_eq!((sums.slope[1], sums.information[(1, 1)]), (0.0, 0.0));
    }

    /// The information is the covariance of the slope over readings that the model draws.
    #[test]
    fn information_by_draws() {
        let mut random = Random::new(5);
        let mut own = modelled(&mut random);
        let theta = [0.1, 0.0, -0.2, 0.05, 0.3];
        let root = {
            // C = L Lᵀ by columns of S and of the rest, which is 0.08 on the diagonal and 0.01 everywhere.
            let gains: Vec<f64> = own.taxels.iter().map(|&t| f64::exp(theta[t])).collect();
            let s = own.s.clone();
            move |random: &mut Random| -> Vec<f64> {
                let w: Vec<f64> = (0..3).map(|_| random.normal()).collect();
                let common = 0.1 * random.normal();
                let own = |i: usize| (0..3).map(|j| gains[i] * s[(i, j)] * w[j]).sum::<f64>();
                (0..4).map(|i| own(i) + common + 0.08f64.sqrt() * random.normal()).collect()
            }
        };
        let draws = 40_000;
        let mut covariance = Mat::<f64>::zeros(5, 5);
        let mut information = Mat::zeros(5, 5);
        for _ in 0..draws {
            own.y = root(&mut random);
            let mut sums = Sums::none(5);
            own.add_to(&theta, &mut sums);
            covariance += Mat::from_fn(5, 5, |i, j| sums.slope[i] * sums.slope[j] / f64::from(draws));
            information = sums.information;
        }
        let largest = (0..5).map(|i| information[(i, i)]).fold(0.0, f64::max);
        for i in 0..5 {
            // Products of normal readings have heavy tails: a tenth of the largest.
            (0..5).for_each(|j| assert!((covariance[(i, j)] - information[(i, j)]).abs() < 0.1 * largest, "{i} {j}"));
        }
    }
}
