//! Found noise: the noise of a frame where neither scene nor tare frames state it, for results of the estimator `search`.
//!
//! The objective `sparse` does not show that noise misled it: its forces always explain the stress. The estimator
//! `evidence` leaves what no admissible force explains, and finds the noise from that, whatever the scene's partition,
//! objective and form. It is not run with every reconstruction, since it takes longer than the search itself.
//!
//! | | unit |
//! |---|---|
//! | in: calibrated stress of the reconstructed frame | MPa |
//! | out: standard deviation of the noise, baseline, suspect taxels, flag `shear-unreliable` | MPa |

use crate::data::frame::Frame;
use crate::data::input::Input;
use crate::estimate::evidence::{Estimate, Evidence};
use crate::result::flags::Flag;
use crate::result::reconstruct::Reconstruction;
use crate::spec::partition::Case;
use crate::spec::scene::{EstimatorKind, Form, ObjectiveKind, Scene};

/// Noise found from a frame, relative to its peak, above which the sparse objective cannot determine the shear. The
/// smallest noise that is found is 1e-4 of the peak; 1e-4 is found as at most 1.26e-4, 2e-4 as at least 1.25e-4, on 60 drawn
/// frames of any shape.
pub const FOUND_NOISE_LIMIT: f64 = 1.25e-4;

impl Reconstruction {
    /// Adds what `evidence` finds in the readings beside the contacts, with the flags.
    pub(crate) fn add_findings(&mut self, estimate: &Estimate) {
        self.checks.baseline_MPa = (!estimate.failed).then_some(estimate.baseline_MPa);
        self.checks.residual_outlier = estimate.outlier;
        self.checks.residual_correlation = estimate.residual_correlation;
        self.flags.extend(estimate.failed.then_some(Flag::EstimateFailed));
        self.flags.extend((!estimate.suspects.is_empty()).then_some(Flag::TaxelSuspect));
        self.extra.suspects.clone_from(&estimate.suspects);
    }

    /// Finds the noise of `stress`, the calibrated frame of this result of `estimator`, and flags the shear if it hides it;
    /// `input` has the scene's input options. Leaves
    /// results as they are that do not come from the objective `sparse`, whose noise is stated, or whose sensor the
    /// estimator `evidence` refuses.
    ///
    /// ```
    /// use dermis_golden::{result::flags::Flag, data::frame::Frame, data::generator::converter::Converter, estimate::float::Golden};
    /// use dermis_golden::spec::scene::{EstimatorKind, Scene};
    ///
    /// let scene = Scene::builtin("sensor-1")?;
    /// let exact = Frame::shipped(&scene).remove(0);
    /// let noisy = Converter { noise: 5e-4, seed: 1, ..Default::default() }.convert(&exact).unwrap();
    /// let golden = Golden::with(&scene, EstimatorKind::Search)?;
    /// for (frame, hidden) in [(exact, false), (noisy, true)] {
    ///     let mut result = golden.run(&frame)?;
    ///     assert!(!result.flags.contains(&Flag::ShearUnreliable));
    ///     result.find_noise(&scene, golden.estimator(), golden.input(), &frame);
    ///     assert_eq!(result.flags.contains(&Flag::ShearUnreliable), hidden);
    /// }
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn find_noise(&mut self, scene: &Scene, estimator: EstimatorKind, input: &Input, stress: &Frame) {
        let searched = estimator == EstimatorKind::Search && scene.search.objective == ObjectiveKind::Sparse;
        let mut whole = scene.clone();
        whole.partition.case = Case::WHOLE;
        whole.search.form = Form::Oblique;
        (whole.search.estimator, whole.search.network) = (None, None);
        if !searched || whole.model_estimator() != EstimatorKind::Evidence || input.noise_MPa() > 0.0 {
            return;
        }
        let estimate = Evidence::new(&whole).solve(&stress.stress_MPa, None);
        self.checks.noise_MPa = Some(estimate.noise_MPa);
        self.add_findings(&estimate);
        // The search takes every reading as it is.
        let disturbed = estimate.failed || !estimate.suspects.is_empty() || self.checks.leaves_structure();
        if disturbed || estimate.noise_MPa.max(estimate.baseline_MPa) > FOUND_NOISE_LIMIT * stress.peak_MPa() {
            self.flags.push(Flag::ShearUnreliable);
        }
        self.flags.sort();
        self.flags.dedup();
    }
}
