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

use super::extra::regions;
use super::golden::EngineInput;
use super::{Golden, Reconstruction};
use crate::float::contacts::{Contacts, MeasuredStress, Solver};
use crate::float::force::threshold;
use crate::float::objective::Sparse;
use crate::float::pass::Polynomial;
use crate::float::search::search;
use crate::float::segment::Segments;
use crate::frame::Frame;
use crate::scene::Condition;

impl Golden {
    /// The contacts of a frame with their μ; `None` if no candidate is compressive.
    pub(super) fn find_contacts(&self, input: &EngineInput) -> Option<Contacts> {
        let (scene, matrices) = (&self.scene, self.matrices());
        let family = Polynomial::new(matrices, input.stress_MPa);
        let found = search(&family, scene.search.mu_max, &Sparse::default())?;
        let (mu_max, p0) = (scene.search.mu_max, family.v(0, 0));
        let (b, noise_MPa) = (input.stress_MPa, input.noise_MPa);
        let stress = self.taxels.as_ref().map(|taxels| MeasuredStress { taxels, b, noise_MPa });
        let searched = |segments: &Segments, region: usize| self.meets_condition(input, segments, region);
        let solver = Solver { matrices, mu_max, objective: &Sparse::default(), p0, stress, searched: &searched };
        Some(solver.solve(&family, found))
    }

    /// Whether the taxels of a region meet the scene's condition.
    fn meets_condition(&self, input: &EngineInput, segments: &Segments, region: usize) -> bool {
        let own = || (0..input.codes.len()).filter(move |&k| segments.labels[k] == region).map(|k| input.codes[k]);
        let (above, below) = (own().any(|code| code > input.floor), own().any(|code| code < -input.floor));
        match self.scene.partition.condition {
            Condition::Loaded => above || below,
            Condition::BothSigns => above && below,
        }
    }

    /// Reconstructs a frame with one region per contact.
    pub(super) fn contacts(&self, frame: &Frame, input: &EngineInput) -> Reconstruction {
        let scene = &self.scene;
        let mut outcome = self.subarrays(input, self.whole());
        let Some(contacts) = self.find_contacts(input) else {
            return self.finish(frame, outcome);
        };
        let (x, truncation) = self.whole().apply_form(input.stress_MPa, contacts.forces());
        outcome.truncation = truncation.into_iter().collect();
        let forces = threshold(x, scene.threshold.min_force_N);
        let met: Vec<bool> =
            (0..contacts.segments.count).map(|k| self.meets_condition(input, &contacts.segments, k)).collect();
        let own = regions(&scene.sensor, &contacts, &met, &forces);
        outcome.forces = forces;
        let mut result = self.finish(frame, outcome);
        result.extra.regions = Some(own);
        result.extra.sweeps = Some(contacts.sweeps);
        result.extra.converged = Some(contacts.converged);
        result
    }
}
