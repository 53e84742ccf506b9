//! Unipolar: sensors that read tension as zero, as force-sensitive resistors do.
//!
//! A reading of zero or less means b ≤ 0, not b = 0. The tension t ≥ 0 of the clipped taxels is unknown, as is μ. Both
//! are chosen by the criterion that determines μ in any frame: few forces that cause all known readings. With g_k(μ)
//! the family of a stress of 1 on taxel k alone,
//!
//! ```text
//! p(μ, t) = p(μ) − Σ t_k g_k(μ),  t ≥ 0                           agrees with the known readings for any t
//! t(μ):  ten times  min over t of Σ p_i² / (p̂_i² + ε²)            p̂ = p/Σp of the previous round, ε from 0.1 to 1e-5
//! μ:     the shared search over Π(p(μ, t(μ))), Π of `sparse`
//! ```
//!
//! The weighted sum replaces Σ log(p̂² + ε²); a large ε first smooths its local minima. A negative t_k is set to zero
//! and the others are solved for again, until none is negative. Both the μ that this search finds and the μ found with
//! t = 0, which may belong to a higher maximum, are then improved: the filled frame's own μ by `sparse` is the next
//! candidate as long as Π rises. The frame with −t in place of the clipped readings is then reconstructed like any
//! other.
//!
//! Each subarray is filled on its own; with `adaptive` and `contacts` the whole array is, with one μ. Of more than
//! [`MAX_CLIPPED`] clipped taxels those with the largest Cz b, near the contacts, are filled; the rest stay zero. A
//! frame of sensor 1 takes 0.2 s at most, of sensor 3 0.7 s, of sensor 4 in 2×2 10 to 23 s.
//!
//! Tangential and normal error with `sparse`, half-space frames with clipped taxels and one contact, median and worst:
//!
//! | sensor (frames) | e_t filled | zeros | unclipped | e_n filled | zeros | unclipped |
//! |---|---|---|---|---|---|---|
//! | sensor-1 (6) | 3.4 %, 7.2 % | 9.3 %, 78.5 % | 1.1 %, 1.8 % | 0.5 %, 1.1 % | 0.4 %, 0.7 % | 0.5 %, 1.0 % |
//! | sensor-2 (8) | 0.9 %, 7.1 % | 5.2 %, 44.5 % | 0.8 %, 5.4 % | 1.1 %, 1.7 % | 0.7 %, 1.7 % | 1.1 %, 1.7 % |
//! | eight-by-eight (4) | 4.1 %, 4.3 % | 6.4 %, 50.9 % | 4.1 %, 16.5 % | 0.7 %, 0.8 % | 0.7 %, 0.8 % | 0.7 %, 0.8 % |
//!
//! Noise affects it as it affects `sparse`: with 1e-4 of the peak the median of sensor 1 is no better than with zeros,
//! with 1e-3 those of sensors 1 and 2 are worse. With several contacts of different μ (sensor 3, `contacts`) it is no
//! better than zeros. The misfit indicates how far to trust a result: the part of the known readings that the
//! compressive forces alone do not explain, since contacts do not pull.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: stress | taxels | MPa, clipped at 0 |
//! | out: stress | taxels | MPa, at most 0 where it was clipped |
//! | out: misfit | scalar | root mean square over the known readings, relative to the peak |

use super::objective::{Objective, Sparse};
use super::pass::Polynomial;
use super::search::search;
use crate::data::frame::{Forces, Frame};
use crate::physics::influence::table;
use crate::physics::matrices::Matrices;
use crate::physics::symmetry::folded::accumulate;
use crate::spec::scene::Scene;
use faer::linalg::matmul::matmul;
use faer::linalg::solvers::Solve;
use faer::{Accum, Col, Mat, Par, Side};

/// Maximum number of clipped taxels of a subarray that are filled; the work grows with its square.
pub const MAX_CLIPPED: usize = 256;
/// Rounds of reweighting.
const ROUNDS: i32 = 10;
/// ε, the fraction of Σp below which a force counts as none: in the first round and in the last.
const SPARSE_SHARES: [f64; 2] = [1e-1, 1e-5];
/// Ridge added to the unit diagonal of the normal equations: above their rounding, n ε.
const RIDGE: f64 = 1e-13;

/// The stress of a subarray with tension in place of its clipped readings.
pub(crate) struct Filled {
    /// Stress in MPa, row-major in the subarray.
    pub stress_MPa: Vec<f64>,
    /// Number of candidates for μ.
    pub evaluations: usize,
}

/// Estimates the tension of the readings `clipped` (indices in the subarray) of `b` in MPa, which has no negative
/// values.
pub(crate) fn fill_clipped(matrices: &Matrices, b: Vec<f64>, mut clipped: Vec<usize>, mu_max: f64) -> Filled {
    let n = b.len();
    if clipped.len() > MAX_CLIPPED {
        let mut reach = vec![0.0; n];
        accumulate(&matrices.cz, &b, 1.0, &mut reach);
        clipped.sort_by(|k, l| reach[*l].total_cmp(&reach[*k]));
        clipped.truncate(MAX_CLIPPED);
    }
    if clipped.is_empty() || b.iter().all(|b| *b <= 0.0) {
        return Filled { stress_MPa: b, evaluations: 0 };
    }
    let (family, objective, sparse) = (stacked(matrices, &b, &clipped), TensionObjective { n }, Sparse::default());
    let by_sparse = |b: &[f64]| search(&Polynomial::new(matrices, b), mu_max, &|p| sparse.score(p));
    let (mut best, mut evaluations) = (Filled { stress_MPa: b.clone(), evaluations: 0 }, 0);
    let mut highest = f64::NEG_INFINITY;
    for start in [search(&family, mu_max, &|p| objective.score(p)), by_sparse(&b)] {
        let mut next = start;
        // Each iteration but the last has a higher score, so the loop ends.
        while let Some(found) = next {
            evaluations += found.evaluations;
            let Some((score, tension)) =
                objective.score_with_tension(&family.eval(found.mu)).filter(|(score, _)| *score > highest)
            else {
                break;
            };
            highest = score;
            clipped.iter().zip(tension).for_each(|(k, t)| best.stress_MPa[*k] = -t);
            next = by_sparse(&best.stress_MPa);
        }
    }
    Filled { evaluations, ..best }
}

/// p(μ) and all g_k(μ), concatenated.
fn stacked(matrices: &Matrices, b: &[f64], clipped: &[usize]) -> Polynomial {
    let mut stack = Polynomial::new(matrices, b);
    for &k in clipped {
        let mut unit = vec![0.0; b.len()];
        unit[k] = 1.0;
        let own = Polynomial::new(matrices, &unit);
        stack.coefficients.iter_mut().zip(&own.coefficients).for_each(|(all, own)| all.extend(own));
    }
    stack
}

/// The objective `sparse` for the forces with the best tension.
struct TensionObjective {
    /// Number of cells.
    n: usize,
}

impl Objective for TensionObjective {
    fn score(&self, stack: &[f64]) -> Option<f64> {
        self.score_with_tension(stack).map(|(score, _)| score)
    }
}

impl TensionObjective {
    /// Π and t of a candidate; `None` unless Σp is above zero.
    fn score_with_tension(&self, stack: &[f64]) -> Option<(f64, Vec<f64>)> {
        let (p, tension) = self.solve(stack)?;
        Some((Sparse::default().score(&p)?, tension))
    }

    /// p and t of a candidate; `None` unless Σp is above zero.
    fn solve(&self, stack: &[f64]) -> Option<(Vec<f64>, Vec<f64>)> {
        let (first, columns) = stack.split_at(self.n);
        let mut p = first.to_vec();
        let mut tension = Vec::new();
        for round in 0..ROUNDS {
            let sum = Some(p.iter().sum::<f64>()).filter(|sum| *sum > 0.0 && sum.is_finite())?;
            let share =
                SPARSE_SHARES[0] * (SPARSE_SHARES[1] / SPARSE_SHARES[0]).powf(f64::from(round) / f64::from(ROUNDS - 1));
            let weights: Vec<f64> = p.iter().map(|p| (p / sum).hypot(share).recip()).collect();
            tension = nonnegative_least_squares(first, columns, &weights)?;
            p.copy_from_slice(first);
            for (column, t) in columns.chunks(self.n).zip(&tension).filter(|(_, t)| **t > 0.0) {
                p.iter_mut().zip(column).for_each(|(p, g)| *p -= t * g);
            }
        }
        Some((p, tension))
    }
}

/// The t ≥ 0 with the smallest ‖weights · (p − G t)‖, except that entries once set to zero stay zero; `None` without a
/// solution.
fn nonnegative_least_squares(p: &[f64], columns: &[f64], weights: &[f64]) -> Option<Vec<f64>> {
    let (n, count) = (p.len(), columns.len() / p.len());
    let mut g = Mat::from_fn(n, count, |i, k| weights[i] * columns[k * n + i]);
    // Columns are scaled to norm 1, so that the ridge has the same effect on each.
    let norms: Vec<f64> = g.col_iter().map(|col| col.norm_l2().max(f64::MIN_POSITIVE)).collect();
    g.col_iter_mut().zip(&norms).for_each(|(col, norm)| col.iter_mut().for_each(|g| *g /= norm));
    let mut gram = Mat::zeros(count, count);
    matmul(&mut gram, Accum::Replace, g.transpose(), &g, 1.0, Par::Seq);
    let right = g.transpose() * Col::from_fn(n, |i| weights[i] * p[i]);
    let mut tension = vec![0.0; count];
    let mut free: Vec<usize> = (0..count).collect();
    // Each iteration but the last removes a taxel, so the loop ends.
    while !free.is_empty() {
        let own =
            Mat::from_fn(free.len(), free.len(), |i, j| gram[(free[i], free[j])] + if i == j { RIDGE } else { 0.0 });
        let found = own.llt(Side::Lower).ok()?.solve(Col::from_fn(free.len(), |i| right[free[i]]));
        if found.iter().all(|t| *t >= 0.0) {
            free.iter().zip(found.iter()).for_each(|(&k, t)| tension[k] = t / norms[k]);
            break;
        }
        let mut kept = found.iter().map(|t| *t > 0.0);
        free.retain(|_| kept.next() == Some(true));
    }
    Some(tension)
}

/// Root mean square difference of the readings above zero and the stress of the compressive forces, relative to the
/// peak.
pub(crate) fn misfit(scene: &Scene, frame: &Frame, forces: &Forces) -> f64 {
    let peak = frame.peak_MPa();
    let known: Vec<usize> = (0..frame.stress_MPa.len()).filter(|&k| frame.stress_MPa[k] > 0.0).collect();
    let cols = scene.sensor.cols;
    let known: Vec<usize> = known.into_iter().filter(|k| !scene.input.dead.contains(&[k / cols, k % cols])).collect();
    if known.is_empty() {
        return 0.0;
    }
    let stress = pressing_stress(scene, forces);
    let squares: f64 = known.iter().map(|&k| (stress[k] - frame.stress_MPa[k]).powi(2)).sum();
    (squares / known.len() as f64).sqrt() / peak
}

/// Stress in MPa of the compressive forces on the cells.
fn pressing_stress(scene: &Scene, forces: &Forces) -> Vec<f64> {
    let (cols, table) = (scene.sensor.cols, table(&scene.sensor, scene.medium));
    let mut stress = vec![0.0; table.len()];
    for (cell, fz) in forces.fz.iter().enumerate().filter(|(_, fz)| **fz > 0.0) {
        let (row, col) = (cell / cols, cell % cols);
        for (taxel, b) in stress.iter_mut().enumerate() {
            let (r, c) = (taxel / cols, taxel % cols);
            let [x, y, z] = table[r.abs_diff(row) * cols + c.abs_diff(col)];
            let (x, y) = (if c < col { -x } else { x }, if r < row { -y } else { y });
            *b += forces.fx[cell] * x + forces.fy[cell] * y + fz * z;
        }
    }
    stress
}
