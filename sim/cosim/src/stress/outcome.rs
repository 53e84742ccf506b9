//! Counts of an experiment.

use serde::Serialize;

/// A violated requirement.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Violation {
    /// Cycle within the experiment.
    pub cycle: u64,
    /// The violated rule as text.
    pub rule: String,
}

/// Counts of one experiment.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Outcome {
    /// Scene name.
    pub scene: String,
    /// `stalls`, `tlast`, `reset` or `tables`.
    pub experiment: &'static str,
    /// Clock cycles simulated.
    pub cycles: u64,
    /// Cycles in which the device was ready without input, or had a beat waiting for ready.
    pub stalled: u64,
    /// Complete frames accepted and not discarded by a reset.
    pub frames_in: u64,
    /// Frames delivered.
    pub frames_out: u64,
    /// Of these, frames alone at full speed, for which the cycle of every beat was checked.
    pub timed: u64,
    /// Input beats with a wrong `tlast`.
    pub wrong_tlast: u64,
    /// Frames cut short by an early `tlast`, which deliver nothing.
    pub cut: u64,
    /// Frames delivered with the framing flag, as expected.
    pub flagged: u64,
    /// Images of tables that were taken.
    pub images: u64,
    /// Images that were refused: at their first word, or between the codes of a frame.
    pub images_refused: u64,
    /// Images that were refused later, which leave tables that are not whole.
    pub images_broken: u64,
    /// Number of resets.
    pub resets: u64,
    /// Number of cycles of a frame at full speed, at each of which a reset can start.
    #[serde(rename = "reset_places")]
    pub possible_reset_cycles: u64,
    /// Longest reset in cycles.
    pub longest_reset: u64,
    /// Number of violated requirements.
    pub violations: u64,
    /// The first violations.
    pub first: Vec<Violation>,
}
