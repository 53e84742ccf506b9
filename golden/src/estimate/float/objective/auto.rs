//! Auto: the objective is chosen to fit the frame.
//!
//! Shear and an asymmetric pressure cause similar normal stress. With noise, only a prior on the shape can tell them
//! apart; without noise, a wrong prior does harm. The frame decides which prior holds: a fit explains it if the misfit
//! is no larger than the stated noise σ and the error of the quadrature cause,
//!
//! ```text
//! misfit ≤ n (σ² + (1.5·10⁻⁴ max|b|)²) (1 + 4 √(2/n))
//! ```
//!
//! | order | used if |
//! |---|---|
//! | `patch` | it explains the frame |
//! | `sparse` | σ ≤ 5·10⁻⁵ max\|b\|: any shape |
//! | `symmetric` | it explains the frame, or its misfit is below that of `patch` |
//! | `patch` | otherwise |
//!
//! σ is the noise after averaging. If the scene states too small a σ, a noisy frame is taken for one of another shape.

use super::estimate::{MuEstimate, Objective, SearchInput};
use super::fit::misfit_limit;
use super::patch::Patch;
use super::sparse::Sparse;
use super::symmetric::Symmetric;
use crate::estimate::float::search::SearchResult;
use crate::result::flags::SPARSE_NOISE_LIMIT;
use crate::spec::scene::Medium;
use crate::spec::sensor::Sensor;

/// The objective `auto`.
#[derive(Clone, Debug)]
pub struct Auto {
    sparse: Sparse,
    symmetric: Symmetric,
    patch: Patch,
}

impl Auto {
    /// The objective for subarrays of the shape of `sensor` under `medium`.
    pub fn new(sensor: &Sensor, medium: Medium) -> Auto {
        let (symmetric, patch) = (Symmetric::new(sensor, medium), Patch::new(sensor, medium));
        Auto { sparse: Sparse::default(), symmetric, patch }
    }
}

impl Objective for Auto {
    /// The score of `sparse`.
    fn score(&self, p: &[f64]) -> Option<f64> {
        self.sparse.score(p)
    }

    fn find(&self, input: &SearchInput) -> Option<MuEstimate> {
        let peak = input.b.iter().fold(0.0f64, |peak, b| b.abs().max(peak));
        let most = misfit_limit(input.b, input.noise_MPa);
        // The objective of a fit is its negative misfit.
        let explains = |estimate: &MuEstimate| -estimate.found.objective <= most;
        let mut evaluations = 0;
        let mut counted = |estimate: Option<MuEstimate>| {
            evaluations += estimate.map_or(0, |estimate| estimate.found.evaluations);
            estimate.map(|mut estimate| {
                estimate.found.evaluations = evaluations;
                estimate
            })
        };
        let patch = counted(self.patch.find(input));
        if patch.as_ref().is_some_and(explains) {
            return patch;
        }
        if input.noise_MPa <= SPARSE_NOISE_LIMIT * peak {
            return counted(self.sparse.find(input)).or(patch);
        }
        let symmetric = counted(self.symmetric.find(input));
        match (patch, symmetric) {
            (Some(patch), Some(symmetric)) if patch.found.objective > symmetric.found.objective => {
                counted(Some(MuEstimate { found: SearchResult { evaluations: 0, ..patch.found }, ..patch }))
            }
            (patch, symmetric) => symmetric.or(patch),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::frame::Frame;
    use crate::estimate::float::pass::Polynomial;
    use crate::physics::matrices::Matrices;
    use crate::spec::scene::Scene;

    /// The estimate of `auto` and those of the three objectives it chooses from.
    struct Four {
        auto: Option<MuEstimate>,
        patch: Option<MuEstimate>,
        sparse: Option<MuEstimate>,
        symmetric: Option<MuEstimate>,
    }

    /// All four estimates for a frame of `sensor-2`; `noise` is stated as a fraction of its peak.
    fn four(matrices: &Matrices, frame: &Frame, noise: f64) -> Four {
        let b = frame.stress_MPa.as_slice();
        let family = Polynomial::new(matrices, b);
        let sensor = &frame.sensor;
        let input = SearchInput { sensor, b, family: &family, mu_max: 0.6, noise_MPa: noise * frame.peak_MPa() };
        Four {
            auto: Auto::new(sensor, Medium::HalfSpace).find(&input),
            patch: Patch::new(sensor, Medium::HalfSpace).find(&input),
            sparse: Sparse::default().find(&input),
            symmetric: Symmetric::new(sensor, Medium::HalfSpace).find(&input),
        }
    }

    fn evaluations(estimates: &[Option<MuEstimate>]) -> usize {
        estimates.iter().flatten().map(|estimate| estimate.found.evaluations).sum()
    }

    /// Whether two estimates are equal except for their number of evaluations.
    fn same(a: Option<MuEstimate>, b: Option<MuEstimate>) -> bool {
        let bare =
            |estimate: MuEstimate| MuEstimate { found: SearchResult { evaluations: 0, ..estimate.found }, ..estimate };
        a.map(bare) == b.map(bare)
    }

    fn frames() -> (Matrices, Vec<Frame>) {
        let scene = Scene::builtin("sensor-2").unwrap();
        (Matrices::new(&scene.sensor, 0.6).unwrap(), Frame::shipped(&scene))
    }

    fn named(frames: &[Frame], id: &str) -> Frame {
        frames.iter().find(|frame| frame.id == id).unwrap().clone()
    }

    #[test]
    fn a_patch_that_explains_the_frame_is_taken() {
        let (matrices, frames) = frames();
        let found = four(&matrices, &named(&frames, "S2-hs-hertz"), 0.0);
        assert!(found.auto.is_some() && found.auto == found.patch);
    }

    #[test]
    fn another_shape_without_noise_is_left_to_sparse() {
        let (matrices, frames) = frames();
        let found = four(&matrices, &named(&frames, "S2-hs-ring"), 0.0);
        assert!(found.auto.is_some() && same(found.auto, found.sparse));
        assert_eq!(evaluations(&[found.auto]), evaluations(&[found.patch, found.sparse]));
    }

    #[test]
    fn another_shape_with_noise_goes_to_the_smaller_misfit() {
        let (matrices, frames) = frames();
        // Above the limit of `sparse`, but too small to explain the misfit of a wrong shape.
        let noise = 2.0 * SPARSE_NOISE_LIMIT;
        let (mut symmetric, mut patch) = (0, 0);
        let ring = named(&frames, "S2-hs-ring");
        for frame in &frames {
            // Each frame as it is, and with a ring added, which neither fits.
            let mut two = frame.clone();
            two.stress_MPa.iter_mut().zip(ring.stress_MPa.iter().rev()).for_each(|(b, other)| *b += 0.5 * other);
            for frame in [frame, &two] {
                let found = four(&matrices, frame, noise);
                let objective =
                    |estimate: Option<MuEstimate>| estimate.map_or(f64::NEG_INFINITY, |e| e.found.objective);
                if found.auto == found.patch {
                    continue;
                }
                let all = evaluations(&[found.patch, found.symmetric]);
                assert_eq!(evaluations(&[found.auto]), all, "{}", frame.id);
                if objective(found.patch) > objective(found.symmetric) {
                    assert!(same(found.auto, found.patch), "{}", frame.id);
                    patch += 1;
                } else {
                    assert!(same(found.auto, found.symmetric), "{}", frame.id);
                    symmetric += 1;
                }
            }
        }
        assert!(symmetric > 0 && patch > 0, "{symmetric} {patch}");
    }

    #[test]
    fn stress_that_pulls_has_no_estimate() {
        let (matrices, frames) = frames();
        let mut frame = named(&frames, "S2-hs-hertz");
        frame.stress_MPa.iter_mut().for_each(|b| *b = -*b);
        for noise in [0.0, 0.01] {
            assert_eq!(four(&matrices, &frame, noise).auto, None, "{noise}");
        }
    }

    #[test]
    fn it_scores_as_sparse_does() {
        let (_, frames) = frames();
        let p = [0.5, 2.0, -0.1, 1.0];
        assert_eq!(Auto::new(&frames[0].sensor, Medium::HalfSpace).score(&p), Sparse::default().score(&p));
    }
}
