//! Support bound: the smallest covariance of the forces of contacts whose supports are known and whose pressure is
//! smooth.
//!
//! Unknown are the force F_k = (Tx, Ty, N) of each contact and the shape of its pressure: the true pressure q (of unit
//! load) times 1 + g, g a Gaussian process of deviation 0.3 and length 4/3 h whose change of the load is zero. With
//! modes L of the covariance of q g, K = L Lᵀ, and the stress per point force B,
//!
//! ```text
//! b = Σ_k Σ_axes F_axis G_axis + M a + noise      G_axis = B_axis q      M = (Tx Bx + Ty By + N Bz) L      a ~ N(0, 1)
//! J = [G M]ᵀ W [G M] + diag(0, 1)                 W = 1/(σ² + γ² b²) on the taxels that are read
//! cov(F) ≥ (J⁻¹)_FF
//! ```
//!
//! the hybrid Cramér–Rao bound: unbiased in F, averaged over a. A taxel that a unipolar sensor clips is not read.
//! Where the contact is costs nothing here, so that an estimator that must find it can be worse by a factor.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: contacts, noise σ, gain spread γ | – | mm, N, MPa, – |
//! | out: covariance of [Tx, Ty, N] per contact | 3k × 3k | N² |

use dermis_golden::data::frame::Contact;
use dermis_golden::data::generator::support::{Kernels, Support};
use dermis_golden::data::generator::GeneratorError;
use nalgebra::{DMatrix, DVector};

/// Standard deviation of g.
const DEVIATION: f64 = 0.3;
/// Length of g in units of the depth.
const LENGTH: f64 = 4.0 / 3.0;
/// Smallest noise over max |b|, so that gains alone leave the taxels without stress a finite weight.
const LEAST_NOISE: f64 = 1e-6;
/// Share of the variance that the modes left out have together.
const LEFT_OUT: f64 = 1e-6;

/// What a sensor adds to the stress.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    /// Standard deviation of the noise in MPa.
    pub noise_MPa: f64,
    /// Standard deviation of the gains.
    pub gain_spread: f64,
    /// Whether tension reads as zero.
    pub unipolar: bool,
}

/// The derivatives of a frame's stress.
pub struct SupportBound {
    /// Stress without noise in MPa.
    b_MPa: Vec<f64>,
    /// [G M].
    derivatives: DMatrix<f64>,
    forces: usize,
}

impl SupportBound {
    /// The derivatives for some contacts; `b_MPa` is their exact stress, `h_mm` the depth of the taxels.
    ///
    /// # Errors
    /// [`GeneratorError`] of a contact that cannot be used.
    pub(crate) fn new(
        kernels: &Kernels,
        h_mm: f64,
        contacts: &[Contact],
        b_MPa: Vec<f64>,
    ) -> Result<SupportBound, GeneratorError> {
        let supports = contacts.iter().map(Support::new).collect::<Result<Vec<_>, _>>()?;
        let taxels = kernels.taxels();
        let mut columns: Vec<DVector<f64>> = Vec::new();
        for support in &supports {
            for axis in 0..3 {
                let unit = [0, 1, 2].map(|k| if k == axis { 1.0 } else { 0.0 });
                let nodes = || support.at_mm.iter().zip(&support.share);
                let stress = |t: usize| nodes().map(|(at, q)| q * kernels.stress_MPa(t, *at, unit)).sum::<f64>();
                columns.push(DVector::from_fn(taxels, |t, _| stress(t)));
            }
        }
        for support in &supports {
            let nodes = support.at_mm.len();
            let stress =
                DMatrix::from_fn(taxels, nodes, |t, k| kernels.stress_MPa(t, support.at_mm[k], support.force_N));
            columns.extend(modes(support, LENGTH * h_mm).iter().map(|mode| &stress * mode));
        }
        Ok(SupportBound { b_MPa, derivatives: DMatrix::from_columns(&columns), forces: 3 * supports.len() })
    }

    /// The bound's covariance in N²; zero without noise, `None` if the forces cannot be told apart.
    pub fn covariance(&self, reading: Reading) -> Option<DMatrix<f64>> {
        let (forces, all) = (self.forces, self.derivatives.ncols());
        let Reading { noise_MPa, gain_spread, unipolar } = reading;
        if noise_MPa == 0.0 && gain_spread == 0.0 {
            return Some(DMatrix::zeros(forces, forces));
        }
        let least = LEAST_NOISE * self.b_MPa.iter().fold(0.0f64, |peak, b| b.abs().max(peak));
        let weight = |b: f64| match unipolar && b <= 0.0 {
            true => 0.0,
            false => noise_MPa.max(least).hypot(gain_spread * b).recip(),
        };
        let mut weighted = self.derivatives.clone();
        for (mut row, b) in weighted.row_iter_mut().zip(&self.b_MPa) {
            row *= weight(*b);
        }
        let mut information = weighted.tr_mul(&weighted);
        (forces..all).for_each(|k| information[(k, k)] += 1.0);
        // Scaled to a diagonal of 1: forces and modes have different units.
        let scale: Vec<f64> = (0..all).map(|k| information[(k, k)].sqrt().recip()).collect();
        let scaled = DMatrix::from_fn(all, all, |i, k| information[(i, k)] * scale[i] * scale[k]);
        let inverse = scaled.cholesky()?.inverse();
        Some(DMatrix::from_fn(forces, forces, |i, k| inverse[(i, k)] * scale[i] * scale[k]))
    }
}

/// L of one support: the modes of q g with zero load, by Cholesky with pivots.
fn modes(support: &Support, length_mm: f64) -> Vec<DVector<f64>> {
    let (at, q) = (&support.at_mm, &support.share);
    let kernel = |i: usize, k: usize| {
        let distance = (at[i][0] - at[k][0]).hypot(at[i][1] - at[k][1]) / length_mm;
        DEVIATION * DEVIATION * q[i] * q[k] * (-distance * distance / 2.0).exp()
    };
    let mut left = DMatrix::from_fn(at.len(), at.len(), kernel);
    // The part that changes the load is taken out.
    let load = left.column_sum();
    let variance = load.sum();
    left -= &load * load.transpose() / variance;
    let enough = LEFT_OUT * left.trace();
    let mut modes = Vec::new();
    while modes.len() < at.len() && left.trace() > enough {
        let (pivot, most) = left.diagonal().argmax();
        if most <= 0.0 {
            break;
        }
        let mode = left.column(pivot) / most.sqrt();
        left -= &mode * mode.transpose();
        modes.push(mode);
    }
    modes
}
