//! By network: μ as a trained network knows it, in the place of a search.
//!
//! p(μ) is then that of the search. The estimator `learned` takes the same μ, but the most probable forces at it.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: b of the whole array | n | MPa |
//! | out: μ with its standard deviations | 2 | – |
//! | out: objective, ln of the density at μ | scalar | – |

use super::objective::{Estimate, Objective, SearchInput};
use crate::estimate::learned::{Learned, LearnedError, OneContact};
use crate::spec::scene::Scene;

/// The network of a scene, asked for the whole array.
pub(super) struct ByNetwork {
    network: Learned,
    alive: Vec<bool>,
}

impl ByNetwork {
    /// The network that a scene names.
    ///
    /// # Errors
    /// As [`Learned::of_scene`].
    pub fn new(scene: &Scene) -> Result<ByNetwork, LearnedError> {
        Ok(ByNetwork { network: Learned::of_scene(scene)?, alive: scene.input.alive(&scene.sensor) })
    }
}

impl Objective for ByNetwork {
    /// No candidate is compared: that Σp presses is all that counts.
    fn score(&self, p: &[f64]) -> Option<f64> {
        let sum: f64 = p.iter().sum();
        (sum > 0.0 && sum.is_finite()).then_some(0.0)
    }

    fn find(&self, input: &SearchInput) -> Option<Estimate> {
        let told = self.network.shear(&OneContact { b: input.b, alive: &self.alive, centre_mm: [0.0; 2] });
        self.score(&input.family.eval(told.mean))?;
        Some(Estimate::of_network(&told, input.mu_max))
    }
}
