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
use crate::float::objective::Estimate;
use crate::float::search::RADIUS;
use crate::float::segment::{segment, Segments, WIDTH};
use crate::frame::Forces;
use crate::learned::{Gaussian, Learned, OneContact};
use crate::symmetry::folded::accumulate;

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
            let searched = |region: &usize| (self.searched)(&contacts.segments, *region);
            let told: Vec<Option<Gaussian>> = (0..contacts.segments.count)
                .map(|region| {
                    Some(region).filter(searched).map(|region| {
                        let stress = if round == 0 { b.to_vec() } else { self.without_others(&contacts, region, b) };
                        let centre_mm = self.centre_mm(&contacts, region);
                        network.shear(&OneContact { b: &stress, alive, centre_mm })
                    })
                })
                .collect();
            let estimate = |told: &Option<Gaussian>| told.map(|told| self.estimate(&told).found);
            contacts.found = told.iter().map(estimate).collect();
            sigma = told.iter().map(|told| told.map(|told| told.sigma)).collect();
            self.relax(&mut contacts);
            contacts.sweeps += 1;
        }
        Told { contacts, sigma }
    }

    /// What the network says, as an estimate.
    fn estimate(&self, told: &Gaussian) -> Estimate {
        let position = told.mean.map(|mu| (mu * f64::from(RADIUS) / self.mu_max).round() as i32);
        Estimate::told(told.mean, told.sigma, position)
    }

    /// The stress `b` without that of the forces on the other regions.
    fn without_others(&self, contacts: &Contacts, region: usize, b: &[f64]) -> Vec<f64> {
        let Forces { mut fx, mut fy, mut fz } = contacts.forces();
        for (taxel, _) in contacts.segments.labels.iter().enumerate().filter(|(_, label)| **label == region) {
            (fx[taxel], fy[taxel], fz[taxel]) = (0.0, 0.0, 0.0);
        }
        let mut rest = b.to_vec();
        let matrices = self.matrices;
        for (matrix, forces) in [(&matrices.cx, &fx), (&matrices.cy, &fy), (&matrices.cz, &fz)] {
            accumulate(matrix, forces, -1.0, &mut rest);
        }
        rest
    }

    /// Centre of the compressive forces on a region in mm from the array's centre.
    fn centre_mm(&self, contacts: &Contacts, region: usize) -> [f64; 2] {
        let (sensor, Segments { labels, .. }) = (&self.matrices.sensor, &contacts.segments);
        let (mut weight, mut moment) = (f64::MIN_POSITIVE, [0.0; 2]);
        for taxel in (0..labels.len()).filter(|&taxel| labels[taxel] == region) {
            let (at, p) = (sensor.position_mm(taxel / sensor.cols, taxel % sensor.cols), contacts.p[taxel].max(0.0));
            weight += p;
            moment = [moment[0] + p * at[0], moment[1] + p * at[1]];
        }
        moment.map(|moment| moment / weight)
    }
}
