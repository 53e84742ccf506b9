//! Which estimator a scene takes, for the floating-point model and for the hardware.
//!
//! | | stated | else |
//! |---|---|---|
//! | floating-point model | `search.estimator` | [`Scene::model_estimator`] |
//! | hardware, bit-true model | `hardware.estimator` | [`Scene::choose_for_hardware`], whose reason the program prints |

use super::{EstimatorKind, Scene};

/// Stated noise over full scale below which the search is nearer to the truth than a network. On 200 drawn frames on sensor-1
/// its median e_t is 1.8 % without noise and 3.9 % at 1e-5; that of the network is 3.1 and 3.2 %.
const QUIET: f64 = 1e-5;

impl Scene {
    /// The estimator of the floating-point model: `search.estimator`; without it `evidence` where that implements the scene,
    /// `combined` where the scene names a network too, else `search`.
    pub fn model_estimator(&self) -> EstimatorKind {
        match (self.search.estimator, self.evidence_refusal(), &self.search.network) {
            (Some(stated), ..) => stated,
            (None, Some(_), _) => EstimatorKind::Search,
            (None, None, None) => EstimatorKind::Evidence,
            (None, None, Some(_)) => EstimatorKind::Combined,
        }
    }

    /// The estimator of the hardware and its bit-true model: `hardware.estimator`, else [`Scene::choose_for_hardware`].
    pub fn hardware_estimator(&self) -> EstimatorKind {
        self.hardware.estimator.unwrap_or_else(|| self.choose_for_hardware().0)
    }

    /// What the hardware takes without `hardware.estimator`, `network` or `search`, and why. The one nearest to a stated
    /// `search.estimator`; else the network where the scene names one and states, by `noise_floor_MPa`, noise that a real
    /// array has. A network that was trained for something else, or that the board cannot hold, is an error then.
    pub fn choose_for_hardware(&self) -> (EstimatorKind, String) {
        let noise_MPa = self.search.noise_floor_MPa() * self.input.noise_share();
        let quiet = self.input.full_scale_MPa.is_some_and(|full| noise_MPa < QUIET * full);
        let search = |why: &str| (EstimatorKind::Search, why.to_owned());
        if let Some(stated) = self.search.estimator {
            return (stated.in_hardware(), format!("the scene states search.estimator = {}", stated.name()));
        }
        match self.require_network() {
            _ if self.search.network.is_none() => search("the scene names no network"),
            _ if noise_MPa == 0.0 => search("the scene states no noise"),
            _ if quiet => search("the stated noise is below 1e-5 of full scale"),
            Err(refused) => search(&refused.to_string()),
            Ok(()) => (EstimatorKind::Network, "the scene states noise and names a network".to_owned()),
        }
    }

    /// The scene with its hardware's estimator stated, so that no later change of the scene changes the choice.
    pub fn with_chosen_hardware(mut self) -> Scene {
        self.hardware.estimator = Some(self.hardware_estimator());
        self
    }

    /// The scene whose floating-point model has this estimator.
    pub fn estimated_by(&self, estimator: EstimatorKind) -> Scene {
        let mut scene = self.clone();
        scene.search.estimator = Some(estimator);
        scene
    }
}
