//! Stability: the errors of a scene in each number format, from the condition of Cz to the error of the forces.
//!
//! Two frames of known forces, a Hertz pressure p of 1 N, with stress computed in extended precision ([`extended`]): b₀
//! without shear, b with the shear μ p. All errors come from the inverse and the arithmetic. The last lines of the
//! table take p, μ and b from [`references`], computed independently with 50 digits; their b₀ is from [`extended`].
//!
//! ```text
//! forward     ‖Cz⁺b₀ − p‖/‖p‖              in double, single, fixed point
//! residual    ‖b − C x‖/‖b‖                x the forces found, with the searched μ
//! normal      |Σx_z − Σp|/Σp               tangential alike
//! rank, gain  Σ λ f(λ), max |f(λ)|         [`dermis_golden::spec::scene::inverse`]
//! bits        smallest input_bits with forward ≤ double's + 0.01; Cz⁺ four bits wider, same level
//! ```
//!
//! | | |
//! |---|---|
//! | in | a scene with a partition into equal rectangles, of which one is measured |
//! | out | [`StabilityRow`]; errors are fractions, gain in N/MPa |

pub mod extended;
pub mod extreme;
mod settings;
mod single;
#[cfg(test)]
mod tests;
mod truth;

pub use settings::{references, settings, Setting, MU_MAX};
pub use truth::FormatErrors;

use dermis_golden::data::frame::Forces;
use dermis_golden::estimate::float::forces::force;
use dermis_golden::estimate::float::objective::{of_kind, SearchInput};
use dermis_golden::estimate::float::pass::Polynomial;
use dermis_golden::estimate::float::{Golden, GoldenError};
use dermis_golden::fixed::Model;
use dermis_golden::physics::matrices::Matrices;
use dermis_golden::spec::partition::{subarrays, Case};
use dermis_golden::spec::scene::{Medium, Scene};
use dermis_golden::spec::sensor::Sensor;
use serde::Serialize;
use truth::Truth;

/// Fraction of ‖p‖ by which the forward error in fixed point may exceed that in double.
const BITS_ADD: f64 = 0.01;
/// Smallest and largest `fixed.input_bits`.
const BITS: [u32; 2] = [8, 24];
/// Bits by which Cz⁺ is wider than the input; the defaults are 20 and 24.
const INVERSE_MORE: u32 = 4;

/// Properties of a scene's matrices.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Spectrum {
    /// Largest over smallest singular value of Cz.
    pub condition: f64,
    /// Effective rank Σ λ f(λ).
    pub rank: f64,
    /// Noise gain ‖Cz⁺‖₂ in N/MPa.
    pub gain: f64,
    /// Convergence rate r: the largest spectral radius of μ·A; the series converges below 1.
    pub radius: f64,
    /// Degree of the series.
    pub degree: usize,
}

/// One line of the table.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StabilityRow {
    /// The quantity varied, or the scene's name.
    pub group: String,
    /// The measured subarray.
    pub sensor: Sensor,
    /// The medium above it.
    pub medium: Medium,
    /// Kind of inverse.
    pub inverse: &'static str,
    /// Level of the inverse relative to the largest singular value.
    pub level: f64,
    /// Properties of the golden model's matrices; `None` if it rejects the scene.
    pub spectrum: Option<Spectrum>,
    /// Errors of the golden model, in double precision.
    pub double: Option<FormatErrors>,
    /// Errors of the golden model with single precision per frame.
    pub single: Option<FormatErrors>,
    /// Errors of the bit-true model.
    pub fixed: Option<FormatErrors>,
    /// Input bits that the bit-true model needs; `None` if 24 are not enough.
    pub bits: Option<u32>,
    /// Why there is no result of the golden model.
    pub refused: Option<String>,
    /// Why there is no result of the bit-true model.
    pub fixed_refused: Option<String>,
}

/// Measures one rectangle of a scene's partition; scenes that a model rejects are reported in the row.
///
/// # Errors
/// [`GoldenError`]: a partition that does not divide the array, or a frame that does not fit the scene.
pub fn measure(setting: &Setting) -> Result<StabilityRow, GoldenError> {
    let Setting { group, scene, frame } = setting;
    let case = Some(scene.partition.case).filter(|case| case.grid().is_some()).unwrap_or(Case::WHOLE);
    let shape = subarrays(case, &scene.sensor)?[0].sensor(&scene.sensor);
    let mut scene = scene.clone();
    (scene.sensor, scene.partition.case) = (shape, Case::WHOLE);
    // Input options and the threshold are reset: full scale is the frame's peak, no known force is dropped.
    (scene.input, scene.threshold.min_force_N) = (Default::default(), 0.0);
    let rule = scene.inversion();
    let mut row = StabilityRow {
        group: group.clone(),
        sensor: scene.sensor.clone(),
        medium: scene.medium,
        inverse: rule.kind.name(),
        level: rule.level,
        spectrum: None,
        double: None,
        single: None,
        fixed: None,
        bits: None,
        refused: None,
        fixed_refused: None,
    };
    match Golden::reference(&scene) {
        Ok(golden) => fill(&mut row, &scene, &golden, &Truth::of(&scene, frame.as_ref()))?,
        Err(error) => row.refused = Some(error.to_string()),
    }
    Ok(row)
}

/// Fills the row of a scene that the golden model accepts.
fn fill(row: &mut StabilityRow, scene: &Scene, golden: &Golden, truth: &Truth) -> Result<(), GoldenError> {
    let Some(matrices) = golden.matrices() else { return Ok(()) };
    let Matrices { condition, rank, gain, spectral_radius: radius, degree, .. } = *matrices;
    row.spectrum = Some(Spectrum { condition, rank, gain, radius, degree });
    let normal_only = Polynomial::of_degree(matrices, &truth.unsheared.stress_MPa, 0);
    let forces = golden.run(&truth.sheared)?.forces_N;
    let forward = truth.forward(normal_only.v(0, 0));
    row.double = Some(truth.figures(matrices, forward, &forces));
    row.single = Some(truth.figures(
        matrices,
        truth.forward(single::family(matrices, &truth.unsheared.stress_MPa, 0).v(0, 0)),
        &in_single(scene, matrices, &truth.sheared.stress_MPa),
    ));
    match Model::without_fit_check(scene).and_then(|model| model.reconstruct(&truth.sheared)) {
        Ok(result) => {
            let own = fixed_forward(scene, truth, scene.fixed.input_bits);
            row.fixed = own.map(|forward| truth.figures(matrices, forward, &result.forces_N));
            row.bits = bits(scene, truth, forward + BITS_ADD);
        }
        Err(error) => row.fixed_refused = Some(error.to_string()),
    }
    Ok(())
}

/// The forces found in single precision.
fn in_single(scene: &Scene, matrices: &Matrices, b: &[f64]) -> Forces {
    let family = single::family(matrices, b, matrices.degree);
    let (sensor, mu_max) = (&scene.sensor, scene.search.mu_max);
    let objective = of_kind(scene.search.objective, sensor, scene.medium);
    let found = objective.find(&SearchInput { sensor, b, family: &family, mu_max, noise_MPa: 0.0 });
    let mu = found.map_or([0.0; 2], |estimate| estimate.found.mu);
    force(&found.map_or_else(|| family.eval(mu), |estimate| estimate.pressure(&family)), mu, 0.0)
}

/// ‖Cz⁺b₀ − p‖/‖p‖ of the bit-true model without search, for codes of `bits` bits and the scene's own inverse.
fn fixed_forward(scene: &Scene, truth: &Truth, bits: u32) -> Option<f64> {
    let mut scene = scene.clone();
    // The level is kept: the question is how many bits the same matrices need.
    scene.inverse.level = Some(scene.inversion().level).filter(|level| *level > 0.0);
    scene.search.mu_max = 0.0;
    if bits != scene.fixed.input_bits {
        scene.fixed.input_bits = bits;
        scene.fixed.inverse_bits = (bits + INVERSE_MORE).max(scene.fixed.coef_bits);
    }
    let result = Model::without_fit_check(&scene).ok()?.reconstruct(&truth.unsheared).ok()?;
    Some(truth.forward(&result.forces_N.fz))
}

/// Smallest number of input bits with a forward error of at most `most`, by bisection.
fn bits(scene: &Scene, truth: &Truth, most: f64) -> Option<u32> {
    let enough = |bits: u32| fixed_forward(scene, truth, bits).is_some_and(|forward| forward <= most);
    let [mut low, mut high] = BITS;
    if !enough(high) {
        return None;
    }
    while low < high {
        let middle = (low + high) / 2;
        if enough(middle) {
            high = middle;
        } else {
            low = middle + 1;
        }
    }
    Some(high)
}
