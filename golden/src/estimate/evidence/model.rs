//! Model: stress, pressure and evidence of contacts whose envelopes are given, as functions of their μ.
//!
//! With F_k the factor of the prior of contact k, w all coefficients and G_a the influence of the cells along axis a,
//!
//! ```text
//! b = H(μ) w + noise        H(μ) = [(Gz + μ1_k Gx + μ2_k Gy) F_k]_k        w ~ N(0, 1)
//! log evidence = −½ yᵀK⁻¹y − ½ log|K|        K = H Hᵀ + T⁻¹,  T the precision of each reading
//! ```
//!
//! K is as large as the array, but H has few columns: with M = 1 + HᵀTH everything follows from M (r × r): the posterior mean
//! M⁻¹HᵀTy of w, its covariance M⁻¹, log|K| = log|M| − log|T| and yᵀK⁻¹y = |w|² + |y − H w|², weighed by T.
//!
//! With d_u = ∂(H w)/∂μ_u, the stress that more shear of a contact adds,
//!
//! ```text
//! slope_u = d_uᵀT(y − H w) − tr(M⁻¹ HᵀT ∂H/∂μ_u)        information_uv = d_uᵀT d_v − d_uᵀTH M⁻¹ HᵀT d_v
//! ```
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: S = [Gz F; Gx F; Gy F] | 3 readings × r | MPa |
//! | in: y, T | readings | MPa, 1/MPa² |
//! | out: w and its covariance M⁻¹ | r, r × r | – |
//! | out: slope and information in μ | 2 × contacts, square of it | – |

use super::cholesky::Cholesky;
use faer::linalg::matmul::matmul;
use faer::linalg::matmul::triangular::{matmul as half_matmul, BlockStructure};
use faer::{Accum, Mat, Par};
use std::cell::OnceCell;

/// Sums of a scalar product that grow side by side.
const LANES: usize = 8;

/// S for the readings in use, and which contact each column belongs to.
pub(super) struct Design {
    /// Gz F, Gx F and Gy F below each other, 3 readings × r, MPa.
    pub s: Mat<f64>,
    /// Contact of each of the r coefficients; those of the baseline, the last ones, are counted to the first contact, as no μ
    /// moves their stress.
    pub contact: Vec<usize>,
    /// Number of coefficients of the baseline.
    pub baseline: usize,
    /// Gx D F and Gy D F below each other, 2 readings × r, MPa: what a spread of 1 adds to S.
    pub spread: Mat<f64>,
}

/// The readings as the model takes them: what each says, and how surely.
#[derive(Clone)]
pub(super) struct Readings {
    /// y in MPa.
    pub y: Vec<f64>,
    /// T in 1/MPa²: 0 where a reading says nothing.
    pub precision: Vec<f64>,
}

/// The posterior at one μ.
pub(super) struct Posterior {
    /// Log evidence, without the constant.
    pub value: f64,
    /// yᵀK⁻¹y.
    pub square: f64,
    /// Posterior mean of w.
    pub w: Vec<f64>,
    /// H.
    h: Mat<f64>,
    /// y − H w.
    left: Vec<f64>,
    factor: Cholesky,
    /// M⁻¹ and H M⁻¹; most candidates for μ do without.
    spread: OnceCell<[Mat<f64>; 2]>,
}

/// Slope of the log evidence in μ, and its information.
pub(super) struct Slope {
    /// Derivative in μ1 and μ2 of each contact.
    pub gradient: Vec<f64>,
    /// Fisher information of μ with w marginalised, 2 contacts × 2 contacts.
    pub information: Mat<f64>,
}

/// Log evidence about the spread θ of one contact, the others' given.
pub(super) struct OfSpread {
    /// Slope in θ.
    pub gradient: f64,
    /// Fisher information of θ.
    pub information: f64,
    /// That of θ with μ1 and μ2 of each contact.
    pub with_mu: Vec<f64>,
}

/// Σ a b.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; LANES];
    let (a, b) = (a.chunks_exact(LANES), b.chunks_exact(LANES));
    let rest: f64 = a.remainder().iter().zip(b.remainder()).map(|(a, b)| a * b).sum();
    a.zip(b).for_each(|(a, b)| (0..LANES).for_each(|k| sums[k] += a[k] * b[k]));
    rest + sums.iter().sum::<f64>()
}

/// `sum` + `factor` `values`, entry by entry.
fn add(sum: &mut [f64], factor: f64, values: &[f64]) {
    sum.iter_mut().zip(values).for_each(|(sum, value)| *sum += factor * value);
}

/// The entries of `a` times those of `b`.
fn times(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a * b).collect()
}

impl Posterior {
    fn spread(&self) -> &[Mat<f64>; 2] {
        self.spread.get_or_init(|| {
            let inverse = self.factor.inverse();
            let mut stress = Mat::zeros(self.h.nrows(), self.h.ncols());
            matmul(&mut stress, Accum::Replace, &self.h, &inverse, 1.0, Par::Seq);
            [inverse, stress]
        })
    }

    /// Posterior covariance of w, M⁻¹.
    pub fn covariance(&self) -> &Mat<f64> {
        &self.spread()[0]
    }

    /// The stress on every reading: mean in MPa, variance in MPa².
    pub fn stress(&self, readings: &Readings) -> Vec<[f64; 2]> {
        let [_, stress] = self.spread();
        let mut variance = vec![0.0; self.left.len()];
        for i in 0..self.w.len() {
            let entries = self.h.col_as_slice(i).iter().zip(stress.col_as_slice(i));
            variance.iter_mut().zip(entries).for_each(|(sum, (h, s))| *sum += h * s);
        }
        let mean = readings.y.iter().zip(&self.left).map(|(y, left)| y - left);
        mean.zip(variance).map(|(mean, variance)| [mean, variance]).collect()
    }

    /// The stress of the coefficients of which `of` is true, on every reading in MPa.
    pub fn stress_of(&self, of: impl Fn(usize) -> bool) -> Vec<f64> {
        let mut sum = vec![0.0; self.left.len()];
        (0..self.w.len()).filter(|&i| of(i)).for_each(|i| add(&mut sum, self.w[i], self.h.col_as_slice(i)));
        sum
    }
}

impl Design {
    /// Number of coefficients r.
    pub fn rank(&self) -> usize {
        self.contact.len()
    }

    /// Multiplications of one posterior, in order of magnitude: SᵀTS, its factor and its inverse.
    pub fn work(&self) -> u64 {
        let (readings, rank) = (self.s.nrows() as u64 / 3, self.rank() as u64);
        (readings + rank) * rank * rank
    }

    /// Number of unknowns of μ.
    fn unknowns(&self) -> usize {
        2 * self.contact.iter().max().map_or(0, |last| last + 1)
    }

    /// The coefficients of the baseline.
    pub fn of_baseline(&self) -> std::ops::Range<usize> {
        self.rank() - self.baseline..self.rank()
    }

    /// The stress of coefficient `i` along z, x and y.
    fn along_axes(&self, i: usize) -> [&[f64]; 3] {
        let n = self.s.nrows() / 3;
        let all = self.s.col_as_slice(i);
        [0, 1, 2].map(|axis| &all[axis * n..][..n])
    }

    /// H(μ), readings × r.
    fn at(&self, mu: &[[f64; 2]]) -> Mat<f64> {
        let mut h = Mat::zeros(self.s.nrows() / 3, self.rank());
        for (i, &contact) in self.contact.iter().enumerate() {
            let ([z, x, y], [mu1, mu2]) = (self.along_axes(i), mu[contact]);
            let entries = h.col_as_slice_mut(i).iter_mut().zip(z).zip(x).zip(y);
            entries.for_each(|(((h, z), x), y)| *h = z + mu1 * x + mu2 * y);
        }
        h
    }

    /// The posterior at μ, one pair per contact; `None` if it is not representable.
    pub fn posterior(&self, readings: &Readings, mu: &[[f64; 2]]) -> Option<Posterior> {
        let Readings { y, precision } = readings;
        let (h, r) = (self.at(mu), self.rank());
        let root: Vec<f64> = precision.iter().map(|t| t.sqrt()).collect();
        let mut scaled = h.clone();
        (0..r).for_each(|i| scaled.col_as_slice_mut(i).iter_mut().zip(&root).for_each(|(h, root)| *h *= root));
        let mut m = Mat::zeros(r, r);
        let (half, whole) = (BlockStructure::TriangularLower, BlockStructure::Rectangular);
        half_matmul(&mut m, half, Accum::Replace, scaled.transpose(), whole, &scaled, whole, 1.0, Par::Seq);
        (0..r).for_each(|i| m[(i, i)] += 1.0);
        let factor = Cholesky::new(m)?;
        let weighted = times(precision, y);
        let mut w: Vec<f64> = (0..r).map(|i| dot(h.col_as_slice(i), &weighted)).collect();
        factor.solve(&mut w);
        let mut left = y.clone();
        (0..r).for_each(|i| add(&mut left, -w[i], h.col_as_slice(i)));
        let square = dot(&w, &w) + dot(&times(precision, &left), &left);
        let log_precision: f64 = precision.iter().filter(|t| **t > 0.0).map(|t| t.ln()).sum();
        let value = -0.5 * (square + factor.log_determinant() - log_precision);
        value.is_finite().then(|| Posterior { value, square, w, h, left, factor, spread: OnceCell::new() })
    }

    /// For each unknown of μ, contact by contact, the derivative d of the stress times T.
    fn derivatives(&self, readings: &Readings, posterior: &Posterior) -> Vec<[Vec<f64>; 2]> {
        let mut all = vec![vec![0.0; readings.y.len()]; self.unknowns()];
        for (i, &contact) in self.contact.iter().enumerate() {
            let [_, along @ ..] = self.along_axes(i);
            (0..2).for_each(|axis| add(&mut all[2 * contact + axis], posterior.w[i], along[axis]));
        }
        all.into_iter().map(|d| [times(&readings.precision, &d), d]).collect()
    }

    /// HᵀT d for each of the derivatives.
    fn cross(&self, posterior: &Posterior, derivatives: &[[Vec<f64>; 2]]) -> Mat<f64> {
        let of = |i: usize, u: usize| dot(posterior.h.col_as_slice(i), &derivatives[u][0]);
        Mat::from_fn(self.rank(), derivatives.len(), of)
    }

    /// Derivative of the posterior mean w in each unknown of μ, r × unknowns.
    pub fn drift(&self, readings: &Readings, posterior: &Posterior) -> Mat<f64> {
        let cross = self.cross(posterior, &self.derivatives(readings, posterior));
        let left = times(&readings.precision, &posterior.left);
        let right = Mat::from_fn(self.rank(), cross.ncols(), |i, u| {
            let own = if self.contact[i] == u / 2 { dot(self.along_axes(i)[1 + u % 2], &left) } else { 0.0 };
            own - cross[(i, u)]
        });
        let mut drift = Mat::zeros(self.rank(), cross.ncols());
        matmul(&mut drift, Accum::Replace, posterior.covariance(), &right, 1.0, Par::Seq);
        drift
    }

    /// Slope and information at the μ of `posterior`.
    pub fn slope(&self, readings: &Readings, posterior: &Posterior) -> Slope {
        let derivatives = self.derivatives(readings, posterior);
        let mut gradient: Vec<f64> = derivatives.iter().map(|[weighted, _]| dot(weighted, &posterior.left)).collect();
        let [covariance, stress] = posterior.spread();
        for (i, &contact) in self.contact.iter().enumerate() {
            let (weighted, [_, along @ ..]) = (times(&readings.precision, stress.col_as_slice(i)), self.along_axes(i));
            (0..2).for_each(|axis| gradient[2 * contact + axis] -= dot(&weighted, along[axis]));
        }
        let (cross, unknowns) = (self.cross(posterior, &derivatives), derivatives.len());
        let mut known = Mat::zeros(self.rank(), unknowns);
        matmul(&mut known, Accum::Replace, covariance, &cross, 1.0, Par::Seq);
        let information = Mat::from_fn(unknowns, unknowns, |u, v| {
            dot(&derivatives[u][0], &derivatives[v][1]) - dot(cross.col_as_slice(u), known.col_as_slice(v))
        });
        Slope { gradient, information }
    }

    /// Adds `change` to the spread of contact `k`.
    pub fn add_spread(&mut self, k: usize, change: f64) {
        let n = self.s.nrows() / 3;
        for i in (0..self.rank()).filter(|i| self.contact[*i] == k) {
            add(&mut self.s.col_as_slice_mut(i)[n..], change, self.spread.col_as_slice(i));
        }
    }

    /// Slope and information in the spread of contact `k`, at the μ of `posterior`.
    pub fn of_spread(&self, readings: &Readings, posterior: &Posterior, mu: &[[f64; 2]], k: usize) -> OfSpread {
        let n = self.s.nrows() / 3;
        let [covariance, stress] = posterior.spread();
        let (mut added, mut trace) = (vec![0.0; n], 0.0);
        for i in (0..self.rank()).filter(|i| self.contact[*i] == k) {
            let (x, y) = self.spread.col_as_slice(i).split_at(n);
            let mut column = vec![0.0; n];
            [x, y].into_iter().zip(mu[k]).for_each(|(along, mu)| add(&mut column, mu, along));
            trace += dot(&times(&readings.precision, stress.col_as_slice(i)), &column);
            add(&mut added, posterior.w[i], &column);
        }
        let of_mu = self.derivatives(readings, posterior);
        let own = [[times(&readings.precision, &added), added]];
        let (cross, cross_mu) = (self.cross(posterior, &own), self.cross(posterior, &of_mu));
        let mut known = Mat::zeros(self.rank(), 1);
        matmul(&mut known, Accum::Replace, covariance, &cross, 1.0, Par::Seq);
        let [[weighted, added]] = &own;
        let known = known.col_as_slice(0);
        OfSpread {
            gradient: dot(weighted, &posterior.left) - trace,
            information: dot(weighted, added) - dot(cross.col_as_slice(0), known),
            with_mu: (0..of_mu.len())
                .map(|u| dot(weighted, &of_mu[u][1]) - dot(cross_mu.col_as_slice(u), known))
                .collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two contacts with two coefficients each, six readings.
    fn setting() -> (Design, Readings) {
        // Row t of block a, column i.
        let s = Mat::from_fn(18, 4, |row, i| ((3 * (row % 6) + 5 * (4 * (row / 6) + i)) as f64).sin());
        let spread = Mat::from_fn(12, 4, |row, i| 0.3 * ((5 * row + 3 * i) as f64).cos());
        let y = (0..6).map(|t| (t as f64).cos()).collect();
        (
            Design { s, contact: vec![0, 0, 1, 1], baseline: 0, spread },
            Readings { y, precision: vec![4.0, 3.0, 0.0, 2.0, 9.0, 1.0] },
        )
    }

    /// Evidence, slope and information agree with K as it is written.
    #[test]
    fn agrees_with_the_large_matrix() {
        let (design, readings) = setting();
        let mu = [[0.3, -0.2], [0.1, 0.4]];
        let direct = |mu: &[[f64; 2]]| {
            let h = design.at(mu);
            let known: Vec<usize> = (0..6).filter(|&t| readings.precision[t] > 0.0).collect();
            let k = nalgebra::DMatrix::from_fn(5, 5, |i, j| {
                let (t, s) = (known[i], known[j]);
                (0..4).map(|c| h[(t, c)] * h[(s, c)]).sum::<f64>()
                    + if i == j { 1.0 / readings.precision[t] } else { 0.0 }
            });
            let y = nalgebra::DVector::from_fn(5, |i, _| readings.y[known[i]]);
            let factor = k.cholesky().unwrap();
            -0.5 * y.dot(&factor.solve(&y)) - factor.l().diagonal().map(f64::ln).sum()
        };
        let posterior = design.posterior(&readings, &mu).unwrap();
        assert!((posterior.value - direct(&mu)).abs() < 1e-12);
        let slope = design.slope(&readings, &posterior);
        for unknown in 0..4 {
            let moved = |by: f64| {
                let mut mu = mu;
                mu[unknown / 2][unknown % 2] += by;
                direct(&mu)
            };
            let difference = (moved(1e-5) - moved(-1e-5)) / 2e-5;
            assert!((slope.gradient[unknown] - difference).abs() < 1e-8, "{unknown}");
            assert!(slope.information[(unknown, unknown)] > 0.0);
        }
        for k in [0, 1] {
            let of_spread = design.of_spread(&readings, &posterior, &mu, k);
            let value = |by: f64| {
                let mut moved = setting().0;
                moved.add_spread(k, by);
                moved.posterior(&readings, &mu).unwrap().value
            };
            let difference = (value(1e-5) - value(-1e-5)) / 2e-5;
            assert!((of_spread.gradient - difference).abs() < 1e-8 && of_spread.information > 0.0, "{k}");
            assert_eq!(of_spread.with_mu.len(), 4);
        }
    }
}
