//! Contacts: the result of `partition.case = "contacts"`, one region and one μ for each contact.
//!
//! ```text
//! whole array, one μ ── float::contacts ── regions, their μ and p ── Eq. 1, threshold ── forces, load of each region
//! ```
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: frame | n | MPa |
//! | out: forces | 3 × n | N |
//! | out: regions | μ, centre, load, taxels | –, mm, N |

use super::contacts::by_network::Told;
use super::contacts::{Contacts, MeasuredStress, Solver};
use super::forces::threshold;
use super::golden::{CaseOutcome, EngineInput, Golden};
use super::objective::Objective;
use super::objective::Sparse;
use super::pass::Polynomial;
use super::search::search;
use crate::data::frame::{Forces, Frame};
use crate::estimate::learned::Learned;
use crate::estimate::segment::Segments;
use crate::result::flags::Flag;
use crate::result::reconstruct::{shear_spread_of, Reconstruction, Region};
use crate::spec::scene::Condition;
use crate::spec::sensor::Sensor;

impl Golden {
    /// The contacts of a frame with their μ; `None` if no candidate is compressive.
    pub(super) fn find_contacts(&self, input: &EngineInput) -> Option<Contacts> {
        let (scene, matrices) = (&self.scene, self.matrices());
        let family = Polynomial::new(matrices, input.stress_MPa);
        let found = search(&family, scene.search.mu_max, &|p| Sparse::default().score(p))?;
        let (mu_max, p0) = (scene.search.mu_max, family.v(0, 0));
        let (b, noise_MPa) = (input.stress_MPa, input.noise_MPa);
        let stress = self.taxels.as_ref().map(|taxels| MeasuredStress { taxels, b, noise_MPa });
        let searched = |segments: &Segments, region: usize| self.meets_condition(input, segments, region);
        let solver = Solver { matrices, mu_max, objective: &Sparse::default(), p0, stress, searched: &searched };
        Some(solver.solve(&family, found))
    }

    /// The contacts of a frame with the μ that the network knows.
    fn ask_contacts(&self, network: &Learned, input: &EngineInput) -> Told {
        let (scene, matrices) = (&self.scene, self.matrices());
        let family = Polynomial::of_degree(matrices, input.stress_MPa, 0);
        let (mu_max, p0) = (scene.search.mu_max, family.v(0, 0));
        let searched = |segments: &Segments, region: usize| self.meets_condition(input, segments, region);
        let solver = Solver { matrices, mu_max, objective: &Sparse::default(), p0, stress: None, searched: &searched };
        let alive = scene.input.alive(&scene.sensor);
        solver.by_network(network, input.stress_MPa, &alive, scene.partition.max_contacts)
    }

    /// Whether the taxels of a region meet the scene's condition.
    fn meets_condition(&self, input: &EngineInput, segments: &Segments, region: usize) -> bool {
        let own = || segments.taxels(region).map(|k| input.codes[k]);
        let (above, below) = (own().any(|code| code > input.floor), own().any(|code| code < -input.floor));
        match self.scene.partition.condition {
            Condition::Loaded => above || below,
            Condition::BothSigns => above && below,
        }
    }

    /// Reconstructs a frame with one region per contact.
    pub(super) fn contacts(&self, frame: &Frame, input: &EngineInput) -> Reconstruction {
        let scene = &self.scene;
        let (mut outcome, contacts, sigma) = match &self.network {
            Some(network) => {
                let Told { contacts, sigma, too_many } = self.ask_contacts(network, input);
                let mut outcome = CaseOutcome::default();
                outcome.flags.extend(too_many.then_some(Flag::TooManyContacts));
                (outcome, contacts, Some(sigma))
            }
            None => {
                let outcome = self.subarrays(input, self.whole());
                match self.find_contacts(input) {
                    Some(contacts) => (outcome, contacts, None),
                    None => return self.finish(frame, outcome),
                }
            }
        };
        let (x, truncation) = self.whole().apply_form(input.stress_MPa, contacts.forces());
        outcome.truncation = truncation.into_iter().collect();
        let forces = threshold(x, scene.threshold.min_force_N);
        let met: Vec<bool> =
            (0..contacts.segments.count).map(|k| self.meets_condition(input, &contacts.segments, k)).collect();
        let mut own = regions(&scene.sensor, &contacts, &met, &forces);
        outcome.forces = forces;
        if let Some(sigma) = sigma {
            outcome.subarrays = vec![self.array_of(input, outcome.forces.resultant())];
            own = own.into_iter().zip(sigma).map(|(region, sigma)| region.with_sigma(sigma)).collect();
            outcome.shear_spread = shear_spread_of(&own);
        }
        let mut result = self.finish(frame, outcome);
        result.extra.regions = Some(own);
        result.extra.sweeps = Some(contacts.sweeps);
        result.extra.converged = Some(contacts.converged);
        result
    }
}

/// The regions of a frame, from the solved contacts and the reported forces; `met[k]`: whether region k meets the
/// condition.
fn regions(sensor: &Sensor, contacts: &Contacts, met: &[bool], forces: &Forces) -> Vec<Region> {
    let region = |k: usize| Region {
        centroid_condition: met[k],
        mu: contacts.mu(k),
        objective_value: contacts.found[k].map(|found| found.objective),
        ..Region::of_taxels(sensor, forces, contacts.segments.taxels(k).collect())
    };
    (0..contacts.segments.count).map(region).collect()
}
