//! By network: μ from a trained network, in place of a search; p(μ) is then that of the search.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: b of the whole array | n | MPa |
//! | out: μ with its standard deviations | 2 | – |
//! | out: objective, ln of the density at μ | scalar | – |
//!
//! With `contacts` the network is evaluated for each contact, `float::contacts::by_network`.

use super::array::{Array, EngineInput, Solve};
use super::by_contacts;
use super::error::GoldenError;
use super::estimator::{Clipped, Estimator};
use super::objective::MuEstimate;
use super::pass;
use crate::estimate::learned::{Learned, OneContact};
use crate::physics::matrices::Matrices;
use crate::result::reconstruct::Reconstruction;
use crate::spec::partition::Case;
use crate::spec::scene::{EstimatorKind, Scene};

/// A network that gives one μ for the whole array.
struct ByNetwork {
    network: Learned,
    alive: Vec<bool>,
    array: Array,
}

/// A network that gives each contact a μ.
struct ByNetworkOfContacts {
    network: Learned,
    alive: Vec<bool>,
    array: Array,
}

/// The estimator with the network that a scene names.
///
/// # Errors
/// As [`Learned::of_scene`] and [`Array::new`].
pub(super) fn new(scene: &Scene) -> Result<Box<dyn Estimator>, GoldenError> {
    let network = Learned::of_scene(scene, EstimatorKind::Network)?;
    let (alive, array) = (scene.input.alive(&scene.sensor), Array::new(scene)?);
    Ok(match scene.partition.case {
        Case::Contacts => Box::new(ByNetworkOfContacts { network, alive, array }),
        _ => Box::new(ByNetwork { network, alive, array }),
    })
}

impl Estimator for ByNetwork {
    fn estimate(&self, input: &EngineInput) -> Reconstruction {
        input.finish(self.array.subarrays(input, self.array.whole(), self))
    }

    fn array(&self) -> Option<&Array> {
        Some(&self.array)
    }

    /// The network has been trained on them, and without noise Σp of Cz⁺b hardly depends on the missing tension.
    fn clipped_readings(&self) -> Clipped {
        Clipped::Zero
    }
}

impl Estimator for ByNetworkOfContacts {
    fn estimate(&self, input: &EngineInput) -> Reconstruction {
        by_contacts::by_network(&self.array, input, &self.network, &self.alive)
    }

    fn array(&self) -> Option<&Array> {
        Some(&self.array)
    }

    /// As with one μ.
    fn clipped_readings(&self) -> Clipped {
        Clipped::Zero
    }
}

impl Solve for ByNetwork {
    fn solve(&self, matrices: &Matrices, b: &[f64], mu_max: f64, _: f64) -> (Option<MuEstimate>, Vec<f64>) {
        let output = self.network.shear(&OneContact { b, alive: &self.alive, centre_mm: [0.0; 2] });
        let p = pass::at(matrices, b, output.mean);
        let sum: f64 = p.iter().sum();
        // No candidate is compared: that Σp presses is all that counts.
        match sum > 0.0 && sum.is_finite() {
            true => (Some(MuEstimate::of_network(&output, mu_max)), p),
            false => (None, pass::at(matrices, b, [0.0; 2])),
        }
    }
}
