//! One subarray: the stages from frame buffer to force memory.
//!
//! ```text
//! receive ── normalise ── fold ── v_00 ─┬─ v_ij of the polynomial ── search
//!                                       ├─ network: one μ ── steps of relax
//!                                       └─ contacts: a μ for each ── steps of relax
//! ```

use super::contacts::{Contact, FrameContacts};
use super::passes::{Passes, Streams};
use super::plan::contents::{CasePlan, Plan};
use super::stages::pass::Operands;
use super::stages::search::SearchResult;
use super::stages::send::ln_sigma_word;
use super::stages::{fold, forces, normalise, receive};
use super::words::formats::force_shift;

/// The result for a subarray and the words that each stage passed on.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SubarrayTrace {
    /// Whether the scene's condition is met.
    pub condition: bool,
    /// Left shift of `normalise`.
    pub normalise: u32,
    /// Right shift of `rescale`.
    pub rescale: u32,
    /// Number of words that `rescale` saturated, with a network also `estimate`, `shear` and `relax`.
    pub saturations: u32,
    /// Result of the search, with p(μ*).
    pub found: SearchResult,
    /// The contacts, where each has a μ of its own.
    pub contacts: Option<FrameContacts>,
    /// What each stage passed on.
    pub streams: Streams,
}

/// Content of a status that concerns μ.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MuStatus {
    /// Position of μ in mu_max/384, [x, y].
    pub position: [i32; 2],
    /// Whether the scene's condition is met.
    pub condition: bool,
    /// Score of the search, or the word of two ln σ; `None` if μ was not found.
    pub score: Option<i32>,
    /// Whether there are more contacts than get a μ.
    pub more_contacts: bool,
}

impl SubarrayTrace {
    /// What the statuses say: of the subarray, or of each of its `most` contacts, nothing of those beyond the last.
    pub fn mu_statuses(&self, most: usize) -> Vec<MuStatus> {
        let Some(contacts) = &self.contacts else {
            let score = self.found.score.map(|score| score as i32);
            let (position, condition) = (self.found.position, self.condition);
            return vec![MuStatus { position, condition, score, ..MuStatus::default() }];
        };
        let of = |contact: &Contact| MuStatus {
            position: contact.position,
            condition: contact.condition,
            score: contact.condition.then(|| ln_sigma_word(contact.ln_sigma)),
            ..MuStatus::default()
        };
        let slot = |slot| contacts.all.get(slot).map(of).unwrap_or_default();
        (0..most).map(|at| MuStatus { more_contacts: contacts.overflow, ..slot(at) }).collect()
    }

    /// Computes the subarray with these `codes`, row-major in it.
    pub fn new(plan: &Plan, case: &CasePlan, codes: &[i32]) -> Self {
        let CasePlan { formats, quantised, .. } = case;
        let layout = case.layout();
        let received = receive::receive(codes, plan.noise_floor());
        let condition = received.meets(plan.scene.partition.condition);
        let left = normalise::shift(received.magnitude, formats.input_bits);
        let normalised = normalise::normalise(&layout.pack(codes), left);
        let folded = fold::fold(&normalised);
        let operands = Operands::of_input(&folded, formats);
        let mut passes = Passes {
            plan,
            formats,
            quantised,
            layout,
            operands,
            shift: 0,
            saturations: 0,
            streams: Streams { normalised, folded, ..Streams::default() },
        };
        let (found, contacts) = match (&quantised.network, &plan.by_contact) {
            (None, _) => (passes.search(condition && plan.searches()), None),
            (Some(network), None) => (passes.by_network(network, condition), None),
            (Some(network), Some(plan)) => {
                let (contacts, values) = passes.by_contact(network, plan, codes);
                let found = SearchResult { values, ..SearchResult::default() };
                (found, Some(contacts))
            }
        };
        let Passes { shift, saturations, streams, .. } = passes;
        SubarrayTrace { condition, normalise: left, rescale: shift, saturations, found, contacts, streams }
    }

    /// Forces of the subarray's taxels, row-major in it; `threshold` is in force LSBs.
    pub fn forces(&self, case: &CasePlan, threshold: i64) -> Vec<forces::Force> {
        let formats = &case.formats;
        let word = |position: [i32; 2]| position.map(|x| forces::mu_word(formats, x));
        // The μ of each label; with one μ all taxels have the first.
        let (mu, labels): (Vec<[i64; 2]>, _) = match &self.contacts {
            None => (vec![word(self.found.position)], None),
            Some(contacts) => {
                let all = contacts.all.iter().map(|contact| word(contact.position));
                ([[0; 2]].into_iter().chain(all).collect(), Some(&contacts.labels))
            }
        };
        let label = |taxel: usize| labels.map_or(0, |labels| labels[taxel]);
        let shift = force_shift(formats, self.normalise, self.rescale);
        let values = case.layout().unpack(&self.found.values);
        let force = |(taxel, value)| forces::force(formats, value, mu[label(taxel)], shift, threshold);
        values.into_iter().enumerate().map(force).collect()
    }
}
