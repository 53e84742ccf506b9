//! What must leave for what was taken, told from the accepted beats alone.
//!
//! A frame is whole with its last taxel. A `tlast` before that drops what came of it; one that is missing on the last
//! taxel changes nothing. Either is told by [`FLAG_FRAMING`] in all subarrays of the next whole frame, the one it
//! happened in among them, and forgotten by a reset.

use std::collections::VecDeque;

use dermis_golden::fixed::send::{FLAG_FRAMING, STATUS_BEATS};
use serde::Serialize;

use super::{Outcome, Sample};

/// Violations that are kept; the others are counted.
const REPORTED_VIOLATIONS: usize = 8;
/// Violations after which an experiment ends.
const VIOLATION_LIMIT: u64 = 100;

/// Something other than it must be.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Violation {
    /// Cycle of the experiment.
    pub cycle: u64,
    /// What.
    pub rule: String,
}

/// A whole frame that has not left yet.
struct PendingFrame {
    sample: usize,
    flagged: bool,
    /// Cycle of its last code, where the cycles of its beats are promised.
    timed: Option<u64>,
}

/// The accepted beats' account.
pub(super) struct Scoreboard<'a> {
    samples: &'a [Sample],
    /// Codes of the frame that is coming.
    accepted: usize,
    /// A wrong `tlast` since the last whole frame.
    framing_error: bool,
    pending: VecDeque<PendingFrame>,
    /// Beats that have left of the frame in front.
    delivered: usize,
    pub(super) outcome: Outcome,
}

impl<'a> Scoreboard<'a> {
    pub(super) fn new(samples: &'a [Sample]) -> Self {
        Scoreboard {
            samples,
            accepted: 0,
            framing_error: false,
            pending: VecDeque::new(),
            delivered: 0,
            outcome: Outcome::default(),
        }
    }

    pub(super) fn violate(&mut self, cycle: u64, rule: String) {
        self.outcome.violations += 1;
        if self.outcome.first.len() < REPORTED_VIOLATIONS {
            self.outcome.first.push(Violation { cycle, rule });
        }
    }

    pub(super) fn is_over_limit(&self) -> bool {
        self.outcome.violations >= VIOLATION_LIMIT
    }

    pub(super) fn is_empty(&self) -> bool {
        self.pending.is_empty()
    }

    /// A code of `sample` was taken; `alone` where its frame is at full speed and no other is inside.
    pub(super) fn accepted(&mut self, cycle: u64, sample: usize, last: bool, alone: bool) {
        let Sample { codes, taxels, .. } = &self.samples[sample];
        self.accepted += 1;
        let at_end = self.accepted.is_multiple_of(*taxels);
        if last != at_end {
            self.outcome.wrong_tlast += 1;
            self.framing_error = true;
        }
        if last && !at_end {
            self.outcome.cut += 1;
            self.accepted = 0;
        }
        if at_end && self.accepted == codes.len() {
            self.outcome.frames_in += 1;
            let flagged = std::mem::take(&mut self.framing_error);
            self.pending.push_back(PendingFrame { sample, flagged, timed: alone.then_some(cycle) });
            self.accepted = 0;
        }
    }

    /// A beat has left.
    pub(super) fn delivered(&mut self, cycle: u64, data: [i32; 3], last: bool) {
        let Some(frame) = self.pending.front() else {
            return self.violate(cycle, "a beat of no frame".to_owned());
        };
        let Sample { beats, forces, cycles, .. } = &self.samples[frame.sample];
        let (index, flagged, first_due) =
            (self.delivered, frame.flagged, frame.timed.map(|at| at + cycles.first_output));
        let mut wanted = beats[index];
        if flagged && index >= *forces && (index - forces).is_multiple_of(STATUS_BEATS) {
            wanted[2] |= FLAG_FRAMING as i32;
        }
        let at_end = index + 1 == beats.len();
        if data != wanted {
            self.violate(cycle, format!("beat {index}: {wanted:?} expected, got {data:?}"));
        }
        if last != at_end {
            self.violate(cycle, format!("beat {index}: tlast is {last}"));
        }
        if let Some(due) = first_due.map(|first| first + index as u64).filter(|due| *due != cycle) {
            self.violate(cycle, format!("beat {index} was due in cycle {due}"));
        }
        self.delivered += 1;
        if at_end {
            self.outcome.frames_out += 1;
            self.outcome.timed += u64::from(first_due.is_some());
            self.outcome.flagged += u64::from(flagged);
            self.pending.pop_front();
            self.delivered = 0;
        }
    }

    /// What is inside is gone: it was not taken for good.
    pub(super) fn reset(&mut self) {
        self.outcome.frames_in -= self.pending.len() as u64;
        (self.accepted, self.delivered, self.framing_error) = (0, 0, false);
        self.pending.clear();
    }
}
