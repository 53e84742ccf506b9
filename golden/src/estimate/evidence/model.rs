//! Model: stress, pressure and evidence of contacts whose envelopes are given, as functions of their μ.
//!
//! With F_k the factor of the prior of contact k, w all coefficients and G_a the influence of the cells along axis a,
//!
//! ```text
//! b = H(μ) w + noise        H(μ) = [(Gz + μ1_k Gx + μ2_k Gy) F_k]_k        w ~ N(0, 1)
//! log evidence = −½ yᵀK⁻¹y − ½ log|K|        K = H Hᵀ + T⁻¹,  T the precision of each reading
//! ```
//!
//! K is as large as the array, but H has few columns: with M = 1 + HᵀTH and u = HᵀTy everything follows from M (r × r),
//! log|K| = log|M| − log|T| and yᵀK⁻¹y = yᵀTy − uᵀM⁻¹u. M and u are polynomials in μ whose coefficients, the blocks of
//! SᵀTS and SᵀTy with S = [Gz F, Gx F, Gy F], are computed once; a candidate μ then costs two r × r factorisations.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: S | readings × 3r | MPa |
//! | in: y, T | readings | MPa, 1/MPa² |
//! | out: w and its covariance M⁻¹ | r, r × r | – |
//! | out: slope and information in μ | 2 × contacts, square of it | – |

use faer::linalg::matmul::matmul;
use faer::linalg::solvers::{DenseSolveCore, Solve};
use faer::{Accum, Col, Mat, Par, Side};

/// S for the readings in use, and which contact each column of a block belongs to.
pub(super) struct Design {
    /// [Gz F, Gx F, Gy F], readings × 3r, MPa.
    pub s: Mat<f64>,
    /// Contact of each of the r coefficients.
    pub contact: Vec<usize>,
}

/// The readings as the model takes them: what each says, and how surely.
#[derive(Clone)]
pub(super) struct Readings {
    /// y in MPa.
    pub y: Vec<f64>,
    /// T in 1/MPa²: 0 where a reading says nothing.
    pub precision: Vec<f64>,
}

/// SᵀTS, SᵀTy and yᵀTy.
pub(super) struct Products<'a> {
    design: &'a Design,
    gram: Mat<f64>,
    right: Vec<f64>,
    square: f64,
    log_precision: f64,
}

/// The posterior at one μ.
pub(super) struct Posterior {
    /// Log evidence, without the constant.
    pub value: f64,
    /// yᵀK⁻¹y.
    pub square: f64,
    /// Posterior mean of w.
    pub w: Vec<f64>,
    /// Posterior covariance of w, M⁻¹.
    pub covariance: Mat<f64>,
    /// (Ga F)ᵀ T H for a = z, x, y: row block a of SᵀTS times the factors of μ.
    rows: [Mat<f64>; 3],
}

/// Slope of the log evidence in μ, and its information.
pub(super) struct Slope {
    /// Derivative in μ1 and μ2 of each contact.
    pub gradient: Vec<f64>,
    /// Fisher information of μ with w marginalised, 2 contacts × 2 contacts.
    pub information: Mat<f64>,
}

/// z + μ1 x + μ2 y, entry by entry.
fn combine(entries: &mut [f64], [z, x, y]: [&[f64]; 3], [mu1, mu2]: [f64; 2]) {
    entries.iter_mut().zip(z).zip(x).zip(y).for_each(|(((entry, z), x), y)| *entry = z + mu1 * x + mu2 * y);
}

impl Design {
    /// Number of coefficients r.
    pub fn rank(&self) -> usize {
        self.contact.len()
    }

    /// H(μ), readings × r.
    pub fn at(&self, mu: &[[f64; 2]]) -> Mat<f64> {
        let r = self.rank();
        let mut h = Mat::zeros(self.s.nrows(), r);
        for (i, &contact) in self.contact.iter().enumerate() {
            combine(h.col_as_slice_mut(i), [0, 1, 2].map(|axis| self.s.col_as_slice(axis * r + i)), mu[contact]);
        }
        h
    }

    /// The stress of the posterior at μ on every reading: mean in MPa, variance in MPa².
    pub fn stress(&self, posterior: &Posterior, mu: &[[f64; 2]]) -> Vec<[f64; 2]> {
        let h = self.at(mu);
        let spread = &h * &posterior.covariance;
        let of = |t: usize, other: &dyn Fn(usize) -> f64| (0..self.rank()).map(|i| h[(t, i)] * other(i)).sum();
        (0..h.nrows()).map(|t| [of(t, &|i| posterior.w[i]), of(t, &|i| spread[(t, i)])]).collect()
    }
}

impl<'a> Products<'a> {
    /// The products of a design and readings.
    pub fn new(design: &'a Design, readings: &Readings) -> Products<'a> {
        let (n, wide) = (design.s.nrows(), design.s.ncols());
        let Readings { y, precision } = readings;
        let scaled = Mat::from_fn(n, wide, |t, i| precision[t].sqrt() * design.s[(t, i)]);
        let mut gram = Mat::zeros(wide, wide);
        matmul(&mut gram, Accum::Replace, scaled.transpose(), &scaled, 1.0, Par::Seq);
        let weighted = Col::from_fn(n, |t| precision[t] * y[t]);
        let right: Vec<f64> = (design.s.transpose() * weighted).iter().copied().collect();
        let square = y.iter().zip(precision).map(|(y, t)| t * y * y).sum();
        let log_precision = precision.iter().filter(|t| **t > 0.0).map(|t| t.ln()).sum();
        Products { design, gram, right, square, log_precision }
    }

    /// Column `j` of SᵀTS, rows of block `a` (z, x, y).
    fn column(&self, a: usize, j: usize) -> &[f64] {
        let r = self.design.rank();
        &self.gram.col_as_slice(j)[a * r..][..r]
    }

    /// The posterior at μ, one pair per contact; `None` if it is not representable.
    pub fn at(&self, mu: &[[f64; 2]]) -> Option<Posterior> {
        let (design, r) = (self.design, self.design.rank());
        let shares: Vec<[f64; 2]> = design.contact.iter().map(|&contact| mu[contact]).collect();
        let rows = [0, 1, 2].map(|a| {
            let mut rows = Mat::zeros(r, r);
            for (j, &mu) in shares.iter().enumerate() {
                combine(rows.col_as_slice_mut(j), [0, 1, 2].map(|b| self.column(a, b * r + j)), mu);
            }
            rows
        });
        let mut m = Mat::zeros(r, r);
        for j in 0..r {
            let [z, x, y] = rows.each_ref().map(|rows| rows.col_as_slice(j));
            let entries = m.col_as_slice_mut(j).iter_mut().zip(z).zip(x).zip(y).zip(&shares);
            entries.for_each(|((((entry, z), x), y), [mu1, mu2])| *entry = z + mu1 * x + mu2 * y);
            m[(j, j)] += 1.0;
        }
        let of = |i: usize| self.right[i] + shares[i][0] * self.right[r + i] + shares[i][1] * self.right[2 * r + i];
        let u = Col::from_fn(r, of);
        let factor = m.llt(Side::Lower).ok()?;
        let w = factor.solve(&u);
        let explained: f64 = w.iter().zip(u.iter()).map(|(w, u)| w * u).sum();
        let square = (self.square - explained).max(0.0);
        let lower = factor.L();
        let log_m = 2.0 * (0..r).map(|i| lower[(i, i)].ln()).sum::<f64>();
        let value = -0.5 * (square + log_m - self.log_precision);
        let w: Vec<f64> = w.iter().copied().collect();
        value.is_finite().then(|| Posterior { value, square, w, covariance: factor.inverse(), rows })
    }

    /// For each unknown of μ, contact by contact: HᵀT of the derivative of the stress (r × unknowns), and the part of
    /// HᵀT(y − H w) that its own columns see (r × unknowns).
    fn derivatives(&self, posterior: &Posterior, unknowns: usize) -> [Mat<f64>; 2] {
        let (contact, r) = (&self.design.contact, self.design.rank());
        let Posterior { w, rows, .. } = posterior;
        let (mut cross, mut left) = (Mat::<f64>::zeros(r, unknowns), Mat::<f64>::zeros(r, unknowns));
        for axis in [0, 1] {
            let mut stress = vec![0.0; r];
            for j in 0..r {
                let mut sums = vec![0.0; unknowns / 2];
                for (i, entry) in rows[axis + 1].col_as_slice(j).iter().enumerate() {
                    stress[i] += entry * w[j];
                    sums[contact[i]] += entry * w[i];
                }
                sums.into_iter().enumerate().for_each(|(contact, sum)| cross[(j, 2 * contact + axis)] = sum);
            }
            for (i, stress) in stress.into_iter().enumerate() {
                left[(i, 2 * contact[i] + axis)] = self.right[(axis + 1) * r + i] - stress;
            }
        }
        [cross, left]
    }

    /// Derivative of the posterior mean w in each unknown of μ, r × unknowns.
    pub fn drift(&self, posterior: &Posterior, unknowns: usize) -> Mat<f64> {
        let [cross, left] = self.derivatives(posterior, unknowns);
        &posterior.covariance * (left - cross)
    }

    /// Slope and information at the μ of `posterior`.
    pub fn slope(&self, posterior: &Posterior) -> Slope {
        let (contact, r) = (&self.design.contact, self.design.rank());
        let unknowns = 2 * contact.iter().max().map_or(0, |last| last + 1);
        let Posterior { w, covariance, rows, .. } = posterior;
        let [cross, left] = self.derivatives(posterior, unknowns);
        let mut gradient = vec![0.0; unknowns];
        for (axis, rows) in [(0, &rows[1]), (1, &rows[2])] {
            // The covariance is symmetric: its rows are its columns.
            let mut trace = vec![0.0; r];
            for j in 0..r {
                let entries = trace.iter_mut().zip(rows.col_as_slice(j)).zip(covariance.col_as_slice(j));
                entries.for_each(|((trace, entry), covariance)| *trace += entry * covariance);
            }
            for (i, trace) in trace.into_iter().enumerate() {
                let unknown = 2 * contact[i] + axis;
                gradient[unknown] += w[i] * left[(i, unknown)] - trace;
            }
        }
        let inner = cross.transpose() * (covariance * &cross);
        // Row by row.
        let mut information = vec![0.0; unknowns * unknowns];
        for (a, b) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            for i in 0..r {
                // SᵀTS is symmetric, too.
                let of = &mut information[unknowns * (2 * contact[i] + a)..][..unknowns];
                for (j, entry) in self.column(b + 1, (a + 1) * r + i).iter().enumerate() {
                    of[2 * contact[j] + b] += w[i] * entry * w[j];
                }
            }
        }
        let information = Mat::from_fn(unknowns, unknowns, |i, j| information[unknowns * i + j] - inner[(i, j)]);
        Slope { gradient, information }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two contacts with two coefficients each, six readings.
    fn setting() -> (Design, Readings) {
        let s = Mat::from_fn(6, 12, |t, i| ((3 * t + 5 * i) as f64).sin());
        let y = (0..6).map(|t| (t as f64).cos()).collect();
        (Design { s, contact: vec![0, 0, 1, 1] }, Readings { y, precision: vec![4.0, 3.0, 0.0, 2.0, 9.0, 1.0] })
    }

    /// Evidence, slope and information agree with K as it is written.
    #[test]
    fn agrees_with_the_large_matrix() {
        let (design, readings) = setting();
        let products = Products::new(&design, &readings);
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
        let posterior = products.at(&mu).unwrap();
        assert!((posterior.value - direct(&mu)).abs() < 1e-12);
        let slope = products.slope(&posterior);
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
    }
}
