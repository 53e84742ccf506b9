//! By network: the μ of each contact as a trained network knows it, in the place of searches.
//!
//! The network reads the stress in a window around one contact. In the first round that of the other contacts is in it; in
//! the later ones what the forces found so far say of them is taken out:
//!
//! ```text
//! p₀ ── regions ── window of b around each ── network ── μ of each ── p = p₀ − Ax(m1∘p) − Ay(m2∘p) ─┐
//!          └───────── b_k = b − C f, f the forces on the other regions ◄───────────────────────────────┘
//! ```
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: stress, network | n, – | MPa |
//! | out: p, regions, μ of each with standard deviations | n, n, count × 2 | N, –, – |

use super::{Contacts, Solver};
use crate::float::forces::residual;
use crate::float::objective::Estimate;
use crate::float::segment::{segment, WIDTH};
use crate::learned::{Gaussian, Learned, OneContact};
use crate::reconstruct::Resultant;

/// Rounds in which every contact is asked for its μ.
pub const ROUNDS: usize = 3;

/// Contacts with the standard deviations of their μ.
pub(crate) struct Told {
    /// Regions, μ and p.
    pub contacts: Contacts,
    /// Standard deviation of the μ of each region, [x, y]; `None` where it was not asked.
    pub sigma: Vec<Option<[f64; 2]>>,
}

impl Solver<'_> {
    /// Finds the contacts of the stress `b` in MPa; `alive` says which taxels are not dead.
    pub(crate) fn by_network(&self, network: &Learned, b: &[f64], alive: &[bool]) -> Told {
        let sensor = &self.matrices.sensor;
        let segments = segment(sensor, self.p0, WIDTH);
        let found = vec![None; segments.count];
        let mut contacts = Contacts { segments, found, p: self.p0.to_vec(), sweeps: 0, converged: true };
        let mut sigma = Vec::new();
        for round in 0..ROUNDS {
            if round > 0 {
                contacts = self.with_regions(&contacts, segment(sensor, &contacts.p, WIDTH));
            }
            let ask = |region: usize| {
                let stress = match round {
                    0 => b.to_vec(),
                    _ => self.without_others(&contacts, region, b),
                };
                let centre_mm = self.centre_mm(&contacts, region);
                network.shear(&OneContact { b: &stress, alive, centre_mm })
            };
            let searched = |region: usize| (self.searched)(&contacts.segments, region);
            let told: Vec<Option<Gaussian>> =
                (0..contacts.segments.count).map(|region| searched(region).then(|| ask(region))).collect();
            let found = |told: &Gaussian| Estimate::of_network(told, self.mu_max).found;
            contacts.found = told.iter().map(|told| told.as_ref().map(found)).collect();
            sigma = told.iter().map(|told| told.map(|told| told.sigma)).collect();
            self.relax(&mut contacts);
            contacts.sweeps += 1;
        }
        Told { contacts, sigma }
    }

    /// The stress `b` without that of the forces on the other regions.
    fn without_others(&self, contacts: &Contacts, region: usize, b: &[f64]) -> Vec<f64> {
        let mut others = contacts.forces();
        for taxel in contacts.segments.taxels(region) {
            (others.fx[taxel], others.fy[taxel], others.fz[taxel]) = (0.0, 0.0, 0.0);
        }
        residual(self.matrices, b, &others)
    }

    /// Centre of the compressive forces on a region in mm from the array's centre, which stands for that of none.
    fn centre_mm(&self, contacts: &Contacts, region: usize) -> [f64; 2] {
        let own = Resultant::of(&self.matrices.sensor, &contacts.forces(), contacts.segments.taxels(region));
        own.centre_mm.unwrap_or_default()
    }
}
