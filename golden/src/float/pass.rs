//! Pass: the matrix products, from stress to the consistent family p(μ).
//!
//! (Cz + μ1 Cx + μ2 Cy) p = b, solved as a series p(μ) = Σ v_ij μ1^i μ2^j, i + j ≤ d:
//!
//! ```text
//! v_00 = Cz⁺ b        v_ij = −(Ax v_{i−1,j} + Ay v_{i,j−1})
//! ```
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: b | n | MPa |
//! | out: v_ij | (d + 1)(d + 2)/2 of n | N |
//!
//! 1 + d(d + 1) products of n². The remainder of the series is of the order r^(d+1) ([`crate::matrices`]). Feeds
//! `search` and `force`.

use crate::matrices::Matrices;
use faer::linalg::matmul::matmul;
use faer::linalg::solvers::Solve;
use faer::{Accum, Col, ColMut, ColRef, Mat, Par};

/// The family p(μ) of one subarray and frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Polynomial {
    /// Largest i + j.
    pub degree: usize,
    /// v_ij, row-major in the subarray, by rising i + j and within it by rising j: 00, 10, 01, 20, 11, 02, …
    pub coefficients: Vec<Vec<f64>>,
}

/// Place of v_ij in [`Polynomial::coefficients`].
pub fn place(i: usize, j: usize) -> usize {
    let order = i + j;
    order * (order + 1) / 2 + j
}

/// out += factor · m · v
fn accumulate(m: &Mat<f64>, v: &[f64], factor: f64, out: &mut [f64]) {
    let v = ColRef::from_slice(v);
    matmul(
        ColMut::from_slice_mut(out),
        Accum::Add,
        m,
        v,
        factor,
        Par::Seq,
    );
}

impl Polynomial {
    /// The family for stress `b` in MPa, of the matrices' degree.
    pub fn new(matrices: &Matrices, b: &[f64]) -> Polynomial {
        Polynomial::of_degree(matrices, b, matrices.degree)
    }

    /// The family cut off at a degree; 0 is p₀ alone, for a subarray that is not searched.
    pub fn of_degree(matrices: &Matrices, b: &[f64], degree: usize) -> Polynomial {
        let n = b.len();
        let mut first = vec![0.0; n];
        accumulate(&matrices.cz_pinv, b, 1.0, &mut first);
        let mut coefficients = vec![first];
        for order in 1..=degree {
            for j in 0..=order {
                let i = order - j;
                let mut v = vec![0.0; n];
                if i > 0 {
                    accumulate(&matrices.ax, &coefficients[place(i - 1, j)], -1.0, &mut v);
                }
                if j > 0 {
                    accumulate(&matrices.ay, &coefficients[place(i, j - 1)], -1.0, &mut v);
                }
                coefficients.push(v);
            }
        }
        Polynomial {
            degree,
            coefficients,
        }
    }

    /// v_ij, i + j up to the degree.
    pub fn v(&self, i: usize, j: usize) -> &[f64] {
        &self.coefficients[place(i, j)]
    }

    /// p(μ) in N.
    pub fn eval(&self, mu: [f64; 2]) -> Vec<f64> {
        let mut p = vec![0.0; self.coefficients[0].len()];
        self.eval_into(mu, &mut p);
        p
    }

    /// p(μ) in N, into a vector of n.
    pub fn eval_into(&self, mu: [f64; 2], p: &mut [f64]) {
        p.copy_from_slice(&self.coefficients[0]);
        // Powers of μ of one order: μ1^order, μ1^(order−1) μ2, …, μ2^order.
        let mut terms = self.coefficients.iter().skip(1);
        for order in 1..=self.degree {
            for (j, v) in terms.by_ref().take(order + 1).enumerate() {
                let factor = mu[0].powi((order - j) as i32) * mu[1].powi(j as i32);
                for (p, v) in p.iter_mut().zip(v) {
                    *p += factor * v;
                }
            }
        }
    }
}

/// p(μ) without series, from (Cz + μ1 Cx + μ2 Cy) p = b by LU with row exchanges: n³/3 products, for checking.
pub fn solve_direct(matrices: &Matrices, b: &[f64], mu: [f64; 2]) -> Vec<f64> {
    let Matrices { cx, cy, cz, .. } = matrices;
    let sum = Mat::from_fn(cz.nrows(), cz.ncols(), |i, j| {
        cz[(i, j)] + mu[0] * cx[(i, j)] + mu[1] * cy[(i, j)]
    });
    let p: Col<f64> = sum.partial_piv_lu().solve(ColRef::from_slice(b));
    p.iter().copied().collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::float::objective::{Objective, Sparse};
    use crate::frame::Frame;
    use crate::reference::values;
    use crate::scene::Scene;

    /// Against numpy: both sides round a solve of condition 20 on stress of 9 digits given alike.
    const REFERENCE: f64 = 1e-9;

    fn setting(sensor: &str, frame: &str) -> (Matrices, Vec<f64>) {
        let scene = Scene::builtin(sensor).unwrap();
        let frame = Frame::shipped(&scene)
            .into_iter()
            .find(|f| f.id == frame)
            .unwrap();
        let matrices = Matrices::new(&scene.sensor, scene.search.mu_max).unwrap();
        (matrices, frame.stress_MPa)
    }

    fn agree(got: &[f64], wanted: &[f64]) {
        let size = wanted.iter().fold(0.0f64, |size, w| w.abs().max(size));
        for (got, wanted) in got.iter().zip(wanted) {
            assert!(
                (got - wanted).abs() <= REFERENCE * size,
                "{got:e} {wanted:e}"
            );
        }
    }

    #[test]
    fn places_are_in_order() {
        let order = [
            (0, 0),
            (1, 0),
            (0, 1),
            (2, 0),
            (1, 1),
            (0, 2),
            (3, 0),
            (2, 1),
        ];
        for (k, (i, j)) in order.into_iter().enumerate() {
            assert_eq!(place(i, j), k);
        }
    }

    #[test]
    fn agrees_with_the_reference_family() {
        for r in &values().family {
            let (matrices, b) = setting(&r.sensor, &r.frame);
            let family = Polynomial::new(&matrices, &b);
            agree(family.v(0, 0), &r.p0);
            agree(family.v(1, 0), &r.v10);
            agree(family.v(0, 1), &r.v01);
            agree(family.v(2, 1), &r.v21);
            agree(&[family.v(0, 0).iter().sum()], &[r.p0_sum]);
            for at in &r.at {
                let p = solve_direct(&matrices, &b, at.mu);
                agree(&p, &at.p_first_ten);
                agree(&[p.iter().sum()], &[at.p_sum]);
                let score = Sparse { epsilon: 1e-5 }.score(&p).unwrap();
                agree(&[score], &[at.sparse_exact]);
            }
        }
    }

    #[test]
    fn series_differs_from_the_solve_by_its_truncation() {
        let (matrices, b) = setting("sensor-1", "S1-hs-hertz");
        let norm = |p: &[f64]| p.iter().map(|p| p * p).sum::<f64>().sqrt();
        let family = Polynomial::new(&matrices, &b);
        for mu in [[0.0, 0.0], [0.26, 0.145], [-0.4, 0.3], [0.0, 0.6]] {
            let direct = solve_direct(&matrices, &b, mu);
            let off: Vec<f64> = family
                .eval(mu)
                .iter()
                .zip(&direct)
                .map(|(p, q)| p - q)
                .collect();
            // Ratio of terms at this μ, r in proportion; the terms that are left out sum to ratio^4/(1 − ratio).
            let ratio = matrices.spectral_radius * mu[0].hypot(mu[1]) / 0.6;
            let bound = ratio.powi(4) / (1.0 - ratio) + 1e-13;
            assert!(
                norm(&off) <= bound * norm(&direct),
                "{mu:?}: {:e}",
                norm(&off) / norm(&direct)
            );
        }
    }

    #[test]
    fn family_meets_the_stress() {
        let (m, b) = setting("eight-by-eight", "S8-hs-random-1");
        let mu = [0.3, -0.2];
        let p = solve_direct(&m, &b, mu);
        let mut rest: Vec<f64> = b.iter().map(|b| -b).collect();
        accumulate(&m.cz, &p, 1.0, &mut rest);
        accumulate(&m.cx, &p, mu[0], &mut rest);
        accumulate(&m.cy, &p, mu[1], &mut rest);
        let peak = b.iter().fold(0.0f64, |peak, b| b.abs().max(peak));
        assert!(rest.iter().all(|r| r.abs() < 1e-13 * peak));
    }

    /// Eq. 1 as printed: x = C†b + (I − C†C) w with w = (μ1 p, μ2 p, p) gives w back when p is the family's.
    #[test]
    fn orthogonal_form_is_the_same() {
        let (m, b) = setting("eight-by-eight", "S8-hs-random-1");
        let n = b.len();
        let mu = [0.25, 0.15];
        let p = solve_direct(&m, &b, mu);
        let c = Mat::from_fn(n, 3 * n, |i, k| [&m.cx, &m.cy, &m.cz][k / n][(i, k % n)]);
        let w = Col::from_fn(3 * n, |k| [mu[0], mu[1], 1.0][k / n] * p[k % n]);
        let pinv = c.thin_svd().unwrap().pseudoinverse();
        let x = &pinv * ColRef::from_slice(&b) + &w - &pinv * (&c * &w);
        assert!((x - &w).norm_l2() <= 1e-13 * w.norm_l2());
    }

    /// Frames made by the cell model itself: what is lost is rounding times condition.
    #[test]
    fn stiff_frames_come_back() {
        for (h, bound) in [(1, 1e-13), (3, 1e-9), (5, 1e-7)] {
            let path = format!(
                "{}/data/reference/stiff-8x8-h{h}.json",
                env!("CARGO_MANIFEST_DIR")
            );
            let frame = Frame::load(path, None).unwrap();
            let [t1, t2, n] = frame.resultant_N.unwrap();
            // The series of the stiffest would not converge; the solve does not need it.
            let matrices = Matrices::new(&frame.sensor, 0.0).unwrap();
            let p = solve_direct(&matrices, &frame.stress_MPa, [t1 / n, t2 / n]);
            let truth = frame.cell_forces_N.unwrap().fz;
            let off = p
                .iter()
                .zip(&truth)
                .map(|(p, q)| (p - q).abs())
                .fold(0.0, f64::max);
            assert!(
                off < bound,
                "h {h}: {off:e}, condition {:e}",
                matrices.condition
            );
        }
    }
}
