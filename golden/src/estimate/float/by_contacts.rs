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

use super::array::{Array, BySearch, CaseOutcome, EngineInput};
use super::contacts::by_network::NetworkContacts;
use super::contacts::{MeasuredStress, SolvedContacts, Solver};
use super::error::GoldenError;
use super::estimator::Estimator;
use super::forces::threshold;
use super::objective::taxels::Taxels;
use super::objective::{Objective, Sparse};
use super::pass::Polynomial;
use super::search::search;
use crate::data::frame::Forces;
use crate::estimate::learned::Learned;
use crate::estimate::segment::Segments;
use crate::result::flags::Flag;
use crate::result::reconstruct::{shear_spread_of, Reconstruction, Region};
use crate::spec::scene::{Condition, Scene};
use crate::spec::sensor::Sensor;

/// The search by contacts; `taxels` for fits of ellipses.
struct ByContacts {
    taxels: Option<Taxels>,
    array: Array,
}

/// The search by contacts of a scene.
///
/// # Errors
/// As [`Array::new`].
pub(super) fn new(scene: &Scene) -> Result<Box<dyn Estimator>, GoldenError> {
    Ok(Box::new(ByContacts { taxels: taxels(scene), array: Array::new(scene)? }))
}

/// The taxels for fits of ellipses: of an array without dead taxels and with mu_max > 0.
pub(super) fn taxels(scene: &Scene) -> Option<Taxels> {
    let fits = scene.input.dead.is_empty() && scene.search.mu_max > 0.0;
    fits.then(|| Taxels::new(&scene.sensor, scene.medium))
}

impl Array {
    /// The contacts of a frame with their μ; `None` if no candidate is compressive.
    pub(super) fn find_contacts(&self, taxels: Option<&Taxels>, input: &EngineInput) -> Option<SolvedContacts> {
        let (scene, matrices, b) = (input.scene, self.matrices(), &input.frame.stress_MPa);
        let family = Polynomial::new(matrices, b);
        let found = search(&family, scene.search.mu_max, &|p| Sparse::default().score(p))?;
        let (mu_max, p0) = (scene.search.mu_max, family.v(0, 0));
        let stress = taxels.map(|taxels| MeasuredStress { taxels, b, noise_MPa: input.noise_MPa });
        let searched = |segments: &Segments, region: usize| input.meets_condition(segments, region);
        let solver = Solver { matrices, mu_max, objective: &Sparse::default(), p0, stress, searched: &searched };
        Some(solver.solve(&family, found))
    }

    /// The result with one region per contact; `sigma` is the standard deviation of the μ of each, where it is known.
    fn by_region(
        &self,
        input: &EngineInput,
        mut outcome: CaseOutcome,
        contacts: &SolvedContacts,
        sigma: Option<Vec<Option<[f64; 2]>>>,
    ) -> Reconstruction {
        let (x, truncation) = self.whole().apply_form(&input.frame.stress_MPa, contacts.forces());
        outcome.truncation = truncation.into_iter().collect();
        let forces = threshold(x, input.scene.threshold.min_force_N);
        let met: Vec<bool> =
            (0..contacts.segments.count).map(|k| input.meets_condition(&contacts.segments, k)).collect();
        let mut own = regions(&input.scene.sensor, contacts, &met, &forces);
        outcome.forces = forces;
        if let Some(sigma) = sigma {
            outcome.subarrays = vec![input.array_of(outcome.forces.resultant())];
            own = own.into_iter().zip(sigma).map(|(region, sigma)| region.with_sigma(sigma)).collect();
            outcome.shear_spread = shear_spread_of(&own);
        }
        let mut result = input.finish(outcome);
        result.extra.regions = Some(own);
        result.extra.sweeps = Some(contacts.sweeps);
        result.extra.converged = Some(contacts.converged);
        result
    }
}

impl EngineInput<'_> {
    /// Whether the taxels of a region meet the scene's condition.
    fn meets_condition(&self, segments: &Segments, region: usize) -> bool {
        let own = || segments.taxels(region).map(|k| self.codes[k]);
        let (above, below) = (own().any(|code| code > self.floor), own().any(|code| code < -self.floor));
        match self.scene.partition.condition {
            Condition::Loaded => above || below,
            Condition::BothSigns => above && below,
        }
    }
}

impl Estimator for ByContacts {
    fn estimate(&self, input: &EngineInput) -> Reconstruction {
        let array = &self.array;
        let outcome = array.subarrays(input, array.whole(), &BySearch(&Sparse::default()));
        match array.find_contacts(self.taxels.as_ref(), input) {
            Some(contacts) => array.by_region(input, outcome, &contacts, None),
            None => input.finish(outcome),
        }
    }

    fn array(&self) -> Option<&Array> {
        Some(&self.array)
    }
}

/// The result with the μ of each contact that `network` gives; `alive` says which taxels are not dead.
pub(super) fn by_network(array: &Array, input: &EngineInput, network: &Learned, alive: &[bool]) -> Reconstruction {
    let (scene, matrices, b) = (input.scene, array.matrices(), &input.frame.stress_MPa);
    let family = Polynomial::of_degree(matrices, b, 0);
    let (mu_max, p0) = (scene.search.mu_max, family.v(0, 0));
    let searched = |segments: &Segments, region: usize| input.meets_condition(segments, region);
    let solver = Solver { matrices, mu_max, objective: &Sparse::default(), p0, stress: None, searched: &searched };
    let NetworkContacts { contacts, sigma, too_many } =
        solver.by_network(network, b, alive, scene.partition.max_contacts);
    let flags = too_many.then_some(Flag::TooManyContacts).into_iter().collect();
    array.by_region(input, CaseOutcome { flags, ..CaseOutcome::default() }, &contacts, Some(sigma))
}

/// The regions of a frame, from the solved contacts and the reported forces; `met[k]`: whether region k meets the
/// condition.
fn regions(sensor: &Sensor, contacts: &SolvedContacts, met: &[bool], forces: &Forces) -> Vec<Region> {
    let region = |k: usize| Region {
        centroid_condition: met[k],
        mu: contacts.mu(k),
        objective_value: contacts.found[k].map(|found| found.objective),
        ..Region::of_taxels(sensor, forces, contacts.segments.taxels(k).collect())
    };
    (0..contacts.segments.count).map(region).collect()
}
