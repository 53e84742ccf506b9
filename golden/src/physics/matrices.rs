//! Matrices: the part of the computation for a subarray that does not depend on the frame.
//!
//! Cz⁺ is the pseudo-inverse, Ax = Cz⁺Cx, Ay = Cz⁺Cy. Cz is symmetric (the stress under cell j from cell i is that
//! under i from j), so its singular values are the magnitudes of its eigenvalues λ and Cz⁺ = U diag(f(λ)) Uᵀ, f(λ) =
//! 1/λ where the readings carry information ([`crate::spec::scene::inverse`]).
//!
//! r = mu_max · max over θ of ρ(cos θ Ax + sin θ Ay) is the convergence rate of the series in μ. Cx and Cy are
//! antisymmetric; with S = |Cz⁺|^½ the eigenvalues of cos θ Ax + sin θ Ay are those of the antisymmetric S (cos θ Cx +
//! sin θ Cy) S where Cz is positive, and bounded by its 2-norm elsewhere. The norm is convex in (cos θ, sin θ) and even
//! in both, so a few directions of one quadrant are enough: 9 miss at most 1 − cos(π/32) = 0.5 %.
//!
//! The degree follows from r and from its effect on drawn contacts ([`crate::estimate::degree`]), unless the scene sets
//! `search.degree`; it is at least 1 if mu_max > 0.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: sensor | n taxels, n ≤ 2304 | mm |
//! | out: Cz⁺ | n × n | mm² (N per MPa) |
//! | out: Ax, Ay | n × n | – |
//!
//! Everything is computed in the basis of mirror parities ([`crate::physics::symmetry::folded`]), a sixteenth of the work; the
//! mirror symmetry of the array holds to the bit in every matrix, so folding it again is exact.

pub mod cache;
mod inverse;
mod masked;
#[cfg(test)]
mod tests;

use crate::physics::influence::Influence;
use crate::physics::symmetry::folded::{Basis, Operator, EVEN, ODD_X, ODD_Y};
use crate::spec::scene::{Inversion, Medium};
use crate::spec::sensor::{Sensor, SensorError};
use cache::{CacheFile, CachedMatrices};
use faer::Mat;
use inverse::{chain, Inverse};
use thiserror::Error;

/// Maximum taxels of a subarray: the 48 × 48 of the largest sensor. A matrix then takes 42 MB.
pub const MAX_TAXELS: usize = 48 * 48;
/// r from which on no degree is enough.
pub const MAX_RADIUS: f64 = 0.9;

/// The precomputed matrices of one subarray shape.
#[derive(Clone, Debug)]
pub struct Matrices {
    /// The subarray as a sensor.
    pub sensor: Sensor,
    /// Pseudo-inverse of Cz, N/MPa.
    pub cz_pinv: Mat<f64>,
    /// Cz⁺ Cx, without unit.
    pub ax: Mat<f64>,
    /// Cz⁺ Cy, without unit.
    pub ay: Mat<f64>,
    /// Stress per normal force, MPa/N.
    pub cz: Mat<f64>,
    /// Stress per force along x, MPa/N.
    pub cx: Mat<f64>,
    /// Stress per force along y, MPa/N.
    pub cy: Mat<f64>,
    /// Largest over smallest singular value of Cz; infinite when the smallest is 0.
    pub condition: f64,
    /// The rule by which Cz was inverted.
    pub inversion: Inversion,
    /// Effective rank Σ λ f(λ): the number of singular values kept, each weighted by its damping.
    pub rank: f64,
    /// Noise gain ‖Cz⁺‖₂ in N/MPa: the largest ratio of the errors of p₀ and b, both as 2-norms.
    pub gain: f64,
    /// Convergence rate r of the series at the scene's mu_max.
    pub spectral_radius: f64,
    /// Degree of the polynomial in μ.
    pub degree: usize,
    /// Cz⁺, Ax and Ay in a folded basis, for fast products.
    pub folded: FoldedMatrices,
}

/// The matrices that multiply a frame, in the basis of mirror parities, or of the taxels if there is no symmetry.
#[derive(Clone, Debug)]
pub struct FoldedMatrices {
    /// The common basis of the three matrices.
    pub basis: Basis,
    /// Cz⁺.
    pub cz_pinv: Operator,
    /// Cz⁺ Cx, without unit.
    pub ax: Operator,
    /// Cz⁺ Cy, without unit.
    pub ay: Operator,
}

/// The matrices of a subarray cannot be computed or used.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum MatricesError {
    /// A size of the sensor is out of range.
    #[error("sensor.{0}")]
    Sensor(#[from] SensorError),
    /// The subarray has more taxels than the estimator takes: a search [`MAX_TAXELS`].
    #[error("a subarray of {taxels} taxels ({sensor}) is too large: at most {most}; cut it by [partition]")]
    TooLarge {
        /// The subarray as a sensor.
        sensor: Box<Sensor>,
        /// Its number of taxels.
        taxels: usize,
        /// The largest number.
        most: usize,
    },
    /// The lengths are so far apart that the influence of a cell is zero or not a finite number.
    #[error("{sensor}: the influence of a cell on its taxel is not representable")]
    NotFinite {
        /// The subarray as a sensor.
        sensor: Box<Sensor>,
    },
    /// The eigenvalues did not converge.
    #[error("{sensor}: no eigenvalues of Cz found")]
    NotConverged {
        /// The subarray as a sensor.
        sensor: Box<Sensor>,
    },
    /// Too few taxels remain without the dead ones.
    #[error("{sensor}: {dead} masked taxels leave too few readings")]
    TooManyDead {
        /// The subarray as a sensor.
        sensor: Box<Sensor>,
        /// Number of dead taxels in it.
        dead: usize,
    },
    /// The series in μ converges too slowly or not at all.
    #[error(
        "{sensor}: r = {radius:.3} at mu_max = {mu_max} needs a series of more than \
         degree {most}; use search.mu_max = {suggested} or less, or a larger pitch in relation to the thickness"
    )]
    SlowSeries {
        /// The subarray as a sensor.
        sensor: Box<Sensor>,
        /// Convergence rate r.
        radius: f64,
        /// The scene's mu_max.
        mu_max: f64,
        /// Highest degree available.
        most: usize,
        /// The largest mu_max with three decimals for which that degree is enough.
        suggested: f64,
    },
}

/// Refuses an array of sizes out of range, or of more than `most` taxels.
///
/// # Errors
/// [`MatricesError::Sensor`], [`MatricesError::TooLarge`].
pub(crate) fn check_size(sensor: &Sensor, most: usize) -> Result<(), MatricesError> {
    sensor.check()?;
    let taxels = sensor.taxels();
    match taxels > most {
        true => Err(MatricesError::TooLarge { sensor: Box::new(sensor.clone()), taxels, most }),
        false => Ok(()),
    }
}

impl Matrices {
    /// The matrices without a degree, which is 0; [`Matrices::of`] gives them the degree that the series needs.
    pub(crate) fn solved(
        sensor: &Sensor,
        medium: Medium,
        mu_max: f64,
        inversion: Inversion,
    ) -> Result<Matrices, MatricesError> {
        check_size(sensor, MAX_TAXELS)?;
        let boxed = || Box::new(sensor.clone());
        let Influence { cx, cy, cz } = Influence::through(sensor, medium);
        let finite = |m: &Mat<f64>| m.col_iter().all(|col| col.iter().all(|c| c.is_finite()));
        if !(finite(&cx) && finite(&cy) && finite(&cz) && cz[(0, 0)] > 0.0) {
            return Err(MatricesError::NotFinite { sensor: boxed() });
        }
        let basis = Basis::parities(sensor.rows, sensor.cols);
        let file = CacheFile::of(sensor, medium, mu_max, inversion);
        let cached = match file.as_ref().and_then(CacheFile::read) {
            Some(cached) => cached,
            None => {
                let cached = compute(&basis, [&cx, &cy, &cz], mu_max, inversion)
                    .ok_or_else(|| MatricesError::NotConverged { sensor: boxed() })?;
                file.iter().for_each(|file| file.write(&cached));
                cached
            }
        };
        let CachedMatrices { numbers: [condition, rank, gain, spectral_radius], operators: [cz_pinv, ax, ay] } = cached;
        Ok(Matrices {
            sensor: sensor.clone(),
            condition,
            inversion,
            rank,
            gain,
            cz_pinv: basis.unfold_matrix(EVEN, &cz_pinv),
            ax: basis.unfold_matrix(ODD_X, &ax),
            ay: basis.unfold_matrix(ODD_Y, &ay),
            cz,
            cx,
            cy,
            folded: FoldedMatrices { basis, cz_pinv, ax, ay },
            spectral_radius,
            degree: 0,
        })
    }
}

/// Cz⁺, Ax, Ay and r in the folded basis; `None` if the eigenvalues of Cz do not converge.
fn compute(basis: &Basis, [cx, cy, cz]: [&Mat<f64>; 3], mu_max: f64, inversion: Inversion) -> Option<CachedMatrices> {
    let folded = |flip: usize, m: &Mat<f64>| basis.fold_matrix(flip, |i, j| m[(i, j)]);
    let (folded_cx, folded_cy) = (folded(ODD_X, cx), folded(ODD_Y, cy));
    let inverse = Inverse::new(&folded(EVEN, cz), inversion)?;
    let cz_pinv = inverse.power(1);
    let (ax, ay) = (chain(&cz_pinv, &folded_cx), chain(&cz_pinv, &folded_cy));
    let shear = mu_max > 0.0;
    let spectral_radius = if shear { mu_max * inverse.largest_radius(&folded_cx, &folded_cy) } else { 0.0 };
    let numbers = [inverse.condition, inverse.rank, inverse.gain, spectral_radius];
    Some(CachedMatrices { numbers, operators: [cz_pinv, ax, ay] })
}
