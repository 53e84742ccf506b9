//! Change: by how much the force of each contact differs from that of a result.

use super::output::Wrench;
use super::{Reconstruction, Resultant};
use crate::data::frame::Frame;
use crate::result::checks::{largest_spread, relative_spread, Checks};
use crate::result::errors::Errors;
use crate::result::flags::Flag;
use crate::spec::scene::Scene;

/// A change of the force of a contact.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ForceChange {
    /// The change in N, [x, y, normal].
    pub force_N: [f64; 3],
    /// The change of its variance in N², [x, y, normal]; below 0 where more is known of the changed force.
    pub variance_N2: [f64; 3],
    /// Share of each taxel in it, row-major over the array; their sum is 1.
    pub shares: Vec<f64>,
}

impl Reconstruction {
    /// Changes the forces, those of each contact by its own, in the order of [`Reconstruction::contacts`]; where no contacts are told
    /// apart there is one change, of the array as one subarray. `frame` has the known forces.
    pub(crate) fn change(&mut self, scene: &Scene, frame: &Frame, changes: &[ForceChange]) {
        for change in changes {
            let forces = &mut self.forces_N;
            for (axis, change_N) in [&mut forces.fx, &mut forces.fy, &mut forces.fz].into_iter().zip(change.force_N) {
                axis.iter_mut().zip(&change.shares).for_each(|(force, share)| *force += share * change_N);
            }
        }
        for (contact, change) in self.extra.contacts.iter_mut().flatten().zip(changes) {
            contact.force_N = sum(contact.force_N, change.force_N);
            contact.sigma_N = std::array::from_fn(|axis| changed(contact.sigma_N[axis], change.variance_N2[axis]));
            contact.mu = ratio(contact.force_N);
            for (axis, covariance) in [(0, 0), (1, 2)] {
                let variance = &mut contact.mu_covariance[covariance];
                *variance = (*variance + change.variance_N2[axis] / contact.force_N[2].powi(2)).max(0.0);
            }
        }
        for (region, change) in self.extra.regions.iter_mut().flatten().zip(changes) {
            region.load_N = sum(region.load_N, change.force_N);
            region.mu = ratio(region.load_N);
            region.shear_sigma_N = all_changed(region.shear_sigma_N, change.variance_N2);
            region.mu_sigma = region.shear_sigma_N.map(|sigma| sigma.map(|sigma| sigma / region.load_N[2].abs()));
            let centre = Resultant::of(&scene.sensor, &self.forces_N, region.taxels.iter().copied());
            region.centre_mm = centre.centre_mm;
        }
        self.resultant_N = self.forces_N.resultant();
        self.extra.wrench = Wrench::of(&scene.sensor, &self.forces_N);
        self.error = frame.resultant_N.map(|truth| Errors::new(truth, self.resultant_N));
        if let [whole] = self.subarrays.as_mut_slice() {
            whole.mu = ratio(self.resultant_N);
            if let ([change], true) = (changes, whole.shear_sigma_N.is_some()) {
                whole.shear_sigma_N = all_changed(whole.shear_sigma_N, change.variance_N2);
                whole.mu_sigma = whole.shear_sigma_N.map(|sigma| sigma.map(|sigma| sigma / self.resultant_N[2].abs()));
            }
        }
        self.flags.retain(|flag| *flag != Flag::ShearNotResolved);
        let checks = Checks { shear_spread: self.shear_spread(), ..self.checks };
        self.add_checks(scene, checks);
    }

    /// Standard deviation of the shear over its size, the largest of all contacts with a share of the load; `None` where none is known.
    pub(crate) fn shear_spread(&self) -> Option<f64> {
        let spread = |[x, y, normal]: [f64; 3], sigma: Option<[f64; 2]>| {
            (normal, sigma.map(|sigma| relative_spread([x, y], sigma, normal)))
        };
        let all = match self.contacts() {
            Some(contacts) => contacts.iter().map(|own| spread(own.force_N, own.shear_sigma_N)).collect(),
            None => self.subarrays.iter().map(|own| spread(self.resultant_N, own.shear_sigma_N)).collect::<Vec<_>>(),
        };
        largest_spread(&all)
    }
}

fn sum(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|axis| a[axis] + b[axis])
}

/// Shear over normal force; 0 where nothing presses.
fn ratio([x, y, normal]: [f64; 3]) -> [f64; 2] {
    if normal > 0.0 {
        [x / normal, y / normal]
    } else {
        [0.0; 2]
    }
}

/// The standard deviation whose variance has changed.
fn changed(sigma_N: f64, variance_N2: f64) -> f64 {
    (sigma_N * sigma_N + variance_N2).max(0.0).sqrt()
}

/// Standard deviations of the shear whose variances have changed.
fn all_changed(sigma_N: Option<[f64; 2]>, variance_N2: [f64; 3]) -> Option<[f64; 2]> {
    sigma_N.map(|sigma| std::array::from_fn(|axis| changed(sigma[axis], variance_N2[axis])))
}
