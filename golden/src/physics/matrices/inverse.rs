//! Inverse: the pseudo-inverse of the symmetric Cz, its square root, and the convergence rate of the series in μ.
//!
//! Cz = U diag(λ) Uᵀ for each block of the folded basis; Cz⁺ = U diag(f(λ)) Uᵀ with the scene's f
//! ([`crate::spec::scene::inverse`]).

use crate::physics::symmetry::folded::{Block, Operator};
use crate::spec::scene::Inversion;
use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, Par, Side};
use std::f64::consts::FRAC_PI_2;

/// Number of directions θ from 0 to π/2.
const DIRECTIONS: usize = 9;

/// The product A B, on all cores.
pub(super) fn product(a: &Mat<f64>, b: &Mat<f64>) -> Mat<f64> {
    let mut c = Mat::zeros(a.nrows(), b.ncols());
    matmul(&mut c, Accum::Replace, a, b, 1.0, Par::rayon(0));
    c
}

/// The product A B in the folded basis.
pub(super) fn chain(a: &Operator, b: &Operator) -> Operator {
    let pairs = a.blocks.iter().flat_map(|left| {
        let fits = |right: &&Block| right.row0 == left.col0 && right.entries.nrows() == left.entries.ncols();
        b.blocks.iter().find(fits).map(|right| (left, right))
    });
    let multiply =
        |(left, right): (&Block, &Block)| Block::new(left.row0, right.col0, product(&left.entries, &right.entries));
    Operator { blocks: pairs.map(multiply).collect() }
}

/// Eigenvectors and f(λ) of each block of Cz; f(λ) is zero for those left out.
pub(super) struct Inverse {
    blocks: Vec<(usize, Mat<f64>, Vec<f64>)>,
    /// Largest over smallest |λ|.
    pub(super) condition: f64,
    /// Σ λ f(λ).
    pub(super) rank: f64,
    /// Largest |f(λ)|.
    pub(super) gain: f64,
}

impl Inverse {
    /// Decomposes the folded Cz; `None` if the eigenvalues do not converge.
    pub(super) fn new(cz: &Operator, rule: Inversion) -> Option<Inverse> {
        let mut blocks = Vec::with_capacity(cz.blocks.len());
        for block in &cz.blocks {
            let eigen = block.entries.self_adjoint_eigen(Side::Lower).ok()?;
            let values: Vec<f64> = eigen.S().column_vector().iter().copied().collect();
            blocks.push((block.row0, eigen.U().to_owned(), values));
        }
        let all = || blocks.iter().flat_map(|(_, _, values)| values.iter().map(|v| v.abs()));
        let (largest, smallest) = (all().fold(0.0, f64::max), all().fold(f64::INFINITY, f64::min));
        let count = all().count();
        let (mut rank, mut gain) = (0.0, 0.0f64);
        for value in blocks.iter_mut().flat_map(|(_, _, values)| values) {
            let inverted = rule.invert(*value, largest, count);
            rank += *value * inverted;
            gain = gain.max(inverted.abs());
            *value = inverted;
        }
        Some(Inverse { blocks, condition: largest / smallest, rank, gain })
    }

    /// U diag(f) Uᵀ with f = f(λ) (`root` 1), or |f(λ)|^½ (`root` 2).
    pub(super) fn power(&self, root: u32) -> Operator {
        let power = |(start, vectors, values): &(usize, Mat<f64>, Vec<f64>)| {
            let factor = |k: usize| match root {
                1 => values[k],
                _ => values[k].abs().sqrt(),
            };
            let n = values.len();
            let scaled = Mat::from_fn(n, n, |i, k| vectors[(i, k)] * factor(k));
            Block::new(*start, *start, product(&scaled, &vectors.transpose().to_owned()))
        };
        Operator { blocks: self.blocks.iter().map(power).collect() }
    }

    /// Largest ‖S (cos θ Cx + sin θ Cy) S‖₂ over the directions: r per unit of mu_max.
    pub(super) fn largest_radius(&self, cx: &Operator, cy: &Operator) -> f64 {
        let s = self.power(2);
        let [kx, ky] = [cx, cy].map(|c| chain(&chain(&s, c), &s));
        let n = self.blocks.iter().map(|(_, _, values)| values.len()).sum();
        let radius = |step: usize| {
            let theta = FRAC_PI_2 * step as f64 / (DIRECTIONS - 1) as f64;
            let (sin, cos) = theta.sin_cos();
            norm2(n, |v, image| {
                kx.accumulate(v, cos, image);
                ky.accumulate(v, sin, image);
            })
        };
        (0..DIRECTIONS).map(radius).fold(0.0, f64::max)
    }
}

/// 2-norm of an antisymmetric K, given as `image += K v`, by Lanczos' method on KᵀK = −K², each new vector
/// orthogonalised against all before. The largest eigenvalue of the tridiagonal matrix converges to ‖K‖² from below.
fn norm2(n: usize, apply: impl Fn(&[f64], &mut [f64])) -> f64 {
    const STEPS: usize = 60;
    const ENOUGH: f64 = 1e-7;
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    // A fixed start vector without symmetry, so that it has a component in every parity.
    let mut next: Vec<f64> = (0..n).map(|i| 1.0 + ((i * 37 + 11) % 64) as f64 / 64.0).collect();
    let mut vectors: Vec<Vec<f64>> = Vec::new();
    let (mut diagonal, mut beside): (Vec<f64>, Vec<f64>) = (Vec::new(), Vec::new());
    let mut norm = 0.0;
    for _ in 0..STEPS.min(n) {
        let size = dot(&next, &next).sqrt();
        if size <= f64::EPSILON * norm * norm || size == 0.0 {
            break;
        }
        beside.push(size);
        vectors.push(next.iter().map(|x| x / size).collect());
        let vector = &vectors[vectors.len() - 1];
        let (mut image, mut twice) = (vec![0.0; n], vec![0.0; n]);
        apply(vector, &mut image);
        apply(&image, &mut twice);
        next = twice.iter().map(|x| -x).collect();
        diagonal.push(dot(&next, vector));
        for _ in 0..2 {
            for vector in &vectors {
                let part = dot(&next, vector);
                next.iter_mut().zip(vector).for_each(|(x, v)| *x -= part * v);
            }
        }
        let larger = largest_eigenvalue(&diagonal, &beside[1..]).max(0.0).sqrt();
        let settled = (larger - norm).abs() <= ENOUGH * larger;
        norm = larger;
        if settled {
            break;
        }
    }
    norm
}

/// Largest eigenvalue of a symmetric tridiagonal matrix T by bisection: x is above all of them if the pivots of T − x
/// are all negative.
fn largest_eigenvalue(diagonal: &[f64], beside: &[f64]) -> f64 {
    let edge = |k: usize| if k < beside.len() { beside[k].abs() } else { 0.0 };
    let bound = |k: usize| diagonal[k].abs() + edge(k) + if k > 0 { edge(k - 1) } else { 0.0 };
    let mut high = (0..diagonal.len()).map(bound).fold(0.0, f64::max);
    let mut low = -high;
    for _ in 0..64 {
        let x = (low + high) / 2.0;
        let mut pivot = -1.0;
        let above = (0..diagonal.len()).all(|k| {
            let off = if k > 0 { beside[k - 1] * beside[k - 1] / pivot } else { 0.0 };
            pivot = diagonal[k] - x - off;
            pivot < 0.0
        });
        if above {
            high = x;
        } else {
            low = x;
        }
    }
    high
}
