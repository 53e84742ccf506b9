//! Cross-check: the estimator `evidence` beside an engine that has another.
//!
//! A search takes every reading as it is, and its forces always explain the stress; a network knows the frames of its
//! training. Neither shows that noise, a baseline or a faulty taxel misled it. The estimator `evidence` leaves what no
//! admissible force explains, whatever the scene's partition, objective and form. So it reads the same frames, which takes
//! longer than the engine does, and its findings become figures and flags of the engine's result.
//!
//! ```text
//! frames ─┬─ engine ──────── result ─────────────┬─ result, with figures and flags
//!         └─ evidence ────── reference ─ Finding ┘  (of the same frame, or of an earlier one: `cross_check_age`)
//! ```
//!
//! | | unit |
//! |---|---|
//! | in: readings of the frames of one result, the result's resultant | the scene's, N |
//! | out: noise, baseline, suspect taxels, what is left | MPa, –, standard deviations |
//! | out: differences of shear and normal force beyond the standard deviation of `evidence` | fraction |

use super::Engine;
use crate::data::frame::Frame;
use crate::estimate::float::{Golden, Past};
use crate::result::checks::Checks;
use crate::result::flags::Flag;
use crate::result::reconstruct::{Diagnostics, Reconstruction, SuspectTaxel};
use crate::spec::partition::Case;
use crate::spec::scene::{EstimatorKind, Form, ObjectiveKind, Scene};

/// Noise found from a frame, relative to its peak, above which the sparse objective cannot determine the shear. The
/// smallest noise that is found is 1e-4 of the peak; 1e-4 is found as at most 1.26e-4, 2e-4 as at least 1.25e-4, on 60 drawn
/// frames of any shape.
const SEARCH_NOISE: f64 = 1.25e-4;
/// Flags of the reference that are the result's, too: they are of the readings.
const OF_READINGS: [Flag; 3] = [Flag::EstimateFailed, Flag::TaxelSuspect, Flag::Misfit];

/// The estimator `evidence` for the frames of an engine that has another.
pub struct CrossCheck {
    golden: Golden,
    /// The engine's scene.
    scene: Scene,
    /// Whether the engine searches with the objective `sparse`, and neither scene nor tare frames give the noise.
    trusts_readings: bool,
}

/// What the cross-check says of one result.
#[derive(Clone, Debug, PartialEq)]
pub struct Finding {
    checks: Checks,
    flags: Vec<Flag>,
    suspects: Vec<SuspectTaxel>,
}

impl CrossCheck {
    /// The cross-check of the results of `engine`; `None` where they have evidence themselves, and for a sensor that the
    /// estimator `evidence` refuses.
    ///
    /// ```
    /// use dermis_golden::{data::frame::Frame, data::generator::converter::Converter, estimate::float::Golden};
    /// use dermis_golden::{engine::CheckedEngine, result::flags::Flag, spec::scene::{EstimatorKind, Scene}};
    ///
    /// let scene = Scene::builtin("sensor-1")?;
    /// let exact = Frame::shipped(&scene).remove(0);
    /// let noisy = Converter { noise: 5e-4, seed: 1, ..Default::default() }.convert(&exact).unwrap();
    /// let search = CheckedEngine::new(Box::new(Golden::with(&scene, EstimatorKind::Search)?));
    /// for (frame, hidden) in [(exact, false), (noisy, true)] {
    ///     let [alone, checked] = [false, true].map(|check| search.result(&[frame.clone()], check));
    ///     assert!(!alone?.flags.contains(&Flag::ShearUnreliable));
    ///     assert_eq!(checked?.flags.contains(&Flag::ShearUnreliable), hidden);
    /// }
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn of(engine: &(impl Engine + ?Sized)) -> Option<CrossCheck> {
        let (scene, input, estimator) = (engine.scene(), engine.input(), engine.estimator());
        if estimator.has_evidence() {
            return None;
        }
        let mut whole = scene.clone();
        whole.partition.case = Case::WHOLE;
        (whole.search.form, whole.search.objective) = (Form::Oblique, ObjectiveKind::Sparse);
        let golden = Golden::with_input(&whole, EstimatorKind::Evidence, input.clone()).ok()?;
        let sparse = estimator == EstimatorKind::Search && scene.search.objective == ObjectiveKind::Sparse;
        Some(CrossCheck { golden, scene: scene.clone(), trusts_readings: sparse && input.noise_MPa() == 0.0 })
    }

    /// What it says of the result with this resultant in N, [x, y, normal], of `frames`, the readings of one result, after those of
    /// which `past` is; `None` for frames that `evidence` refuses.
    pub fn finding(&self, frames: &[Frame], past: &mut Past, resultant_N: [f64; 3]) -> Option<Finding> {
        let reference = self.golden.run_after(past, frames).ok()?;
        let checks = reference.checks;
        let mut flags: Vec<Flag> = reference.flags.iter().copied().filter(|flag| OF_READINGS.contains(flag)).collect();
        let disturbed = !flags.is_empty() || checks.leaves_structure();
        let most = checks.noise_MPa.into_iter().chain(checks.baseline_MPa).fold(0.0, f64::max);
        if self.trusts_readings && (disturbed || most > SEARCH_NOISE * checks.peak_MPa) {
            flags.push(Flag::ShearUnreliable);
        }
        let failed = flags.contains(&Flag::EstimateFailed);
        let [tangential_difference, normal_difference] =
            if failed { [None; 2] } else { differences(&reference, resultant_N).map(Some) };
        let checks = Checks { tangential_difference, normal_difference, ..checks };
        Some(Finding { checks, flags, suspects: reference.extra.suspects })
    }

    /// Adds figures and flags to the result with this resultant in N of `frames`, as [`CrossCheck::finding`] finds them.
    pub fn check(&self, frames: &[Frame], resultant_N: [f64; 3], result: &mut Diagnostics) {
        if let Some(finding) = self.finding(frames, &mut Past::default(), resultant_N) {
            self.add(&finding, 0, result);
        }
    }

    /// Adds what `finding` says, of a result `age` results ago, to one of this engine's.
    pub fn add(&self, finding: &Finding, age: u64, result: &mut Diagnostics) {
        let (own, found) = (*result.checks, &finding.checks);
        result.flags.extend(&finding.flags);
        result.suspects.clone_from(&finding.suspects);
        let checks = Checks {
            noise_MPa: own.noise_MPa.or(found.noise_MPa),
            misfit_probability: own.misfit_probability.or(found.misfit_probability),
            shear_spread: own.shear_spread.or(found.shear_spread),
            baseline_MPa: found.baseline_MPa,
            residual_outlier: found.residual_outlier,
            residual_correlation: found.residual_correlation,
            tangential_difference: found.tangential_difference,
            normal_difference: found.normal_difference,
            cross_check_age: Some(age),
            ..own
        };
        result.add_checks(&self.scene, checks);
    }
}

/// Differences of the shear and of the normal force from those of `reference` beyond its standard deviations, over the
/// larger of the two; of the shear at least over 5 % of the normal force.
fn differences(reference: &Reconstruction, value_N: [f64; 3]) -> [f64; 2] {
    let ([x, y, normal], [rx, ry, reference_N]) = (value_N, reference.resultant_N);
    let [sx, sy, sz] = reference.sigma_N().unwrap_or_default();
    let largest_N = normal.abs().max(reference_N.abs());
    let shear_N = x.hypot(y).max(rx.hypot(ry)).max(LEAST_SHEAR * largest_N);
    let share =
        |off_N: f64, sigma_N: f64, size_N: f64| if size_N > 0.0 { (off_N - sigma_N).max(0.0) / size_N } else { 0.0 };
    [share((x - rx).hypot(y - ry), sx.hypot(sy), shear_N), share((normal - reference_N).abs(), sz, largest_N)]
}

/// Ratio to the normal force below which a difference of shear does not count in full.
const LEAST_SHEAR: f64 = 0.05;
