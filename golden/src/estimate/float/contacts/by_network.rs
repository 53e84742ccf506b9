//! By network: the μ of each contact from a trained network, in place of searches.
//!
//! The network reads the stress in a window around each contact, that of its neighbours included: it was trained on arrays
//! with several contacts.
//!
//! ```text
//! p₀ ── regions ── window of b around each ── network ── μ of each ── p = p₀ − Ax(m1∘p) − Ay(m2∘p)
//! ```
//! To take the neighbours' stress out, as their forces say, and to evaluate again does not help: the errors of the neighbours
//! come back as stress that no contact causes. With three rounds of that, the errors of three contacts of sensor 3 at 0.2 % noise were
//! 1.2 times (median) and 1.4 times (nine of ten) as large, and without noise no smaller.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: stress, network | n, – | MPa |
//! | out: p, regions, μ of each with standard deviations | n, n, count × 2 | N, –, – |

use super::{SolvedContacts, Solver};
use crate::estimate::float::objective::MuEstimate;
use crate::estimate::learned::{Gaussian, Learned, OneContact};
use crate::estimate::segment::{basins, WIDTH};
use crate::result::reconstruct::Resultant;

/// Contacts with the standard deviations of their μ.
pub(crate) struct NetworkContacts {
    /// Regions, μ and p.
    pub contacts: SolvedContacts,
    /// Standard deviation of the μ of each region, [x, y]; `None` where the network was not evaluated.
    pub sigma: Vec<Option<[f64; 2]>>,
    /// Whether there are more contacts than the network may be evaluated for.
    pub too_many: bool,
}

impl Solver<'_> {
    /// Finds the contacts of the stress `b` in MPa; `alive` says which taxels are not dead. The network is evaluated for at most
    /// `most` of them, those with the largest loads.
    pub(crate) fn by_network(&self, network: &Learned, b: &[f64], alive: &[bool], most: usize) -> NetworkContacts {
        let found = basins(&self.matrices.sensor, self.p0, WIDTH);
        let (largest, overflow) = (found.by_load(), found.overflow);
        let segments = found.segments;
        let mut contacts = SolvedContacts {
            found: vec![None; segments.count],
            segments,
            p: self.p0.to_vec(),
            sweeps: 1,
            converged: true,
        };
        let evaluate = |region: usize| {
            let centre_mm = self.centre_mm(&contacts, region);
            network.shear(&OneContact { b, alive, centre_mm })
        };
        let is_large = |region: usize| largest.iter().take(most).any(|large| *large == region);
        let searched = |region: usize| is_large(region) && (self.searched)(&contacts.segments, region);
        let outputs: Vec<Option<Gaussian>> =
            (0..contacts.segments.count).map(|region| searched(region).then(|| evaluate(region))).collect();
        let found = |output: &Gaussian| MuEstimate::of_network(output, self.mu_max).found;
        contacts.found = outputs.iter().map(|output| output.as_ref().map(found)).collect();
        self.relax(&mut contacts);
        let sigma = outputs.iter().map(|output| output.map(|output| output.sigma)).collect();
        NetworkContacts { too_many: overflow || contacts.segments.count > most, contacts, sigma }
    }

    /// Centre of the compressive forces on a region in mm from the array's centre, which stands for that of none.
    fn centre_mm(&self, contacts: &SolvedContacts, region: usize) -> [f64; 2] {
        let own = Resultant::of(&self.matrices.sensor, &contacts.forces(), contacts.segments.taxels(region));
        own.centre_mm.unwrap_or_default()
    }
}
