//! Misfit: how far a frame is from those on which a network was trained.
//!
//! A network answers any frame. Contacts press, and μ is theirs: what no compressive forces with the network's μ cause, no
//! frame of the training had, but for noise, gains, and cells as large as the taxels.
//!
//! ```text
//! r = b − (Cz + μ1 Cx + μ2 Cy) p,   p ≥ 0 with the smallest |r|
//! misfit = |r| / √(n σ² + (0.1 |b|)²) / limit                               above 1: unlike the training
//! ```
//!
//! σ is the noise as the scene states it, at most, and where none is stated, the largest of the training, 2 % of max |b|. A
//! reading of 0 on a unipolar array counts if p presses there. With the true σ the misfit of drawn frames hardly depends on
//! the noise. The limit is measured after the training (`dermis_study::noise::misfit_limit`) and stands in the network's file;
//! without one there is no check.
//!
//! What contacts can cause is not found: an offset of all taxels looks like a contact larger than the array, a thicker
//! cover like a larger contact.
//!
//! p is that of [`STEPS`] steps of the accelerated projected gradient (Beck and Teboulle 2009, FISTA), in units of max |b|
//! and in single precision, `fit`: the same for the golden model and for what hardware sent, whose μ differ by its LSB.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: calibrated stress, noise | taxels, scalar | MPa |
//! | in: μ of each taxel, from a result | taxels × 2 | – |
//! | out: misfit over its limit | scalar | – |

mod fit;
mod kernels;
#[cfg(test)]
mod tests;

pub use fit::STEPS;

use crate::data::frame::Frame;
use crate::estimate::learned::{Learned, LearnedError, NOISE};
use crate::result::reconstruct::Reconstruction;
use crate::spec::scene::{EstimatorKind, Scene};
use crate::spec::sensor::Sensor;
use fit::{Fit, Readings};
use kernels::Kernels;

/// Share of |b| that forces on cells as large as the taxels leave, and gains that differ.
const CELLS: f64 = 0.1;

/// The check for one scene.
#[derive(Clone, Debug)]
pub struct Misfit {
    sensor: Sensor,
    kernels: Kernels,
    alive: Vec<bool>,
    unipolar: bool,
    limit: f64,
}

impl Misfit {
    /// The check of the network that alone gives μ to this estimator of a scene; `None` without one, or where its file has no
    /// limit.
    ///
    /// # Errors
    /// As [`Learned::misfit_limit`].
    pub fn of_scene(scene: &Scene, estimator: EstimatorKind) -> Result<Option<Misfit>, LearnedError> {
        if !estimator.mu_of_network() {
            return Ok(None);
        }
        Ok(Learned::misfit_limit(scene)?.map(|limit| Misfit::new(scene, limit)))
    }

    /// The check with this limit.
    pub fn new(scene: &Scene, limit: f64) -> Misfit {
        let sensor = scene.sensor.clone();
        let kernels = Kernels::new(&sensor, scene.medium);
        Misfit { alive: scene.input.alive(&sensor), sensor, kernels, unipolar: scene.input.unipolar, limit }
    }

    /// The misfit of the calibrated `frame` of a result, over its limit; `noise_MPa` is the stated standard deviation of a
    /// taxel, 0 if none is. `None` where the condition of the scene is not met, so that the network was not evaluated.
    pub fn of(&self, result: &Reconstruction, frame: &Frame, noise_MPa: f64) -> Option<f64> {
        self.of_stress(&frame.stress_MPa, &self.mu_of_taxels(result)?, noise_MPa)
    }

    /// The μ of each taxel, that of its contact, of the nearest one, or of the array; `None` if the network was not evaluated.
    pub fn mu_of_taxels(&self, result: &Reconstruction) -> Option<Vec<[f64; 2]>> {
        let n = self.sensor.taxels();
        let whole = result.subarrays.iter().find(|own| own.centroid_condition)?;
        // Of records of contacts, whose taxels are only counted, and of contacts that share their taxels.
        let nearest = |all: Vec<([f64; 2], [f64; 2])>| -> Option<Vec<[f64; 2]>> {
            let of_taxel = |taxel: usize| {
                let [x, y] = self.sensor.position_mm(taxel / self.sensor.cols, taxel % self.sensor.cols);
                let off = |[u, v]: [f64; 2]| (x - u).hypot(y - v);
                all.iter().min_by(|a, b| off(a.0).total_cmp(&off(b.0))).map(|own| own.1)
            };
            (0..n).map(of_taxel).collect()
        };
        if let Some(regions) = &result.extra.regions {
            if regions.iter().any(|region| region.taxel_count > region.taxels.len()) {
                return nearest(regions.iter().filter_map(|region| Some((region.centre_mm?, region.mu))).collect());
            }
            let mut mu = vec![[0.0; 2]; n];
            let own = regions.iter().flat_map(|region| region.taxels.iter().map(|&taxel| (taxel, region.mu)));
            own.for_each(|(taxel, own)| mu[taxel] = own);
            return Some(mu);
        }
        if let Some(contacts) = result.extra.contacts.as_ref().filter(|contacts| !contacts.is_empty()) {
            return nearest(contacts.iter().map(|contact| (contact.centre_mm, contact.mu)).collect());
        }
        // 0 where no forces press.
        Some(vec![whole.mu; n])
    }

    /// The misfit of stress `b` in MPa for the μ of each taxel.
    fn of_stress(&self, b: &[f64], mu: &[[f64; 2]], noise_MPa: f64) -> Option<f64> {
        let read = |t: usize| match self.alive[t] {
            true if self.unipolar => b[t].max(0.0),
            true => b[t],
            false => 0.0,
        };
        let n = b.len();
        let peak = (0..n).map(|t| read(t).abs()).fold(0.0, f64::max);
        if !(peak > 0.0 && peak.is_finite()) {
            return None;
        }
        let scaled: Vec<f32> = (0..n).map(|t| (read(t) / peak) as f32).collect();
        let size = scaled.iter().map(|b| f64::from(*b).powi(2)).sum::<f64>().sqrt();
        let readings = Readings { b: &scaled, alive: &self.alive, unipolar: self.unipolar };
        let left = f64::from(Fit::new(&self.kernels.of_cells(mu), &readings).left());
        let largest = NOISE[1];
        let sigma = if noise_MPa > 0.0 { (noise_MPa / peak).min(largest) } else { largest };
        let live = self.alive.iter().filter(|alive| **alive).count() as f64;
        Some(left / (live.sqrt() * sigma).hypot(CELLS * size) / self.limit)
    }
}
