//! Scoreboard: derives the expected output from the accepted input beats.
//!
//! A frame is complete with its last taxel. An earlier `tlast` drops the frame's codes; a missing `tlast` on the last
//! taxel changes nothing. Both set [`FLAG_FRAMING`] in all subarrays of the next complete frame, which may be the same
//! frame. A reset clears the flag. A sliding mean holds the complete frames since the last early `tlast` or reset.

use std::borrow::Cow;
use std::collections::VecDeque;

use dermis_golden::fixed::stages::prepare::Prepared;
use dermis_golden::fixed::stages::send::{FLAG_FRAMING, STATUS_BEATS};
use dermis_golden::fixed::Model;

use super::outcome::{Outcome, Violation};
use super::samples::Sample;

/// Violations reported with text; further ones are only counted.
const REPORTED_VIOLATIONS: usize = 8;
/// Number of violations that ends an experiment.
const VIOLATION_LIMIT: u64 = 100;

/// A complete frame that has not left yet.
struct PendingFrame<'a> {
    sample: Cow<'a, Sample>,
    flagged: bool,
    /// Cycle of its last code, if the cycles of its beats are checked.
    timed: Option<u64>,
}

/// Input beats accepted so far and output beats due.
pub(super) struct Scoreboard<'a> {
    model: &'a Model,
    samples: &'a [Sample],
    /// The frames in a sliding mean.
    mean: Prepared,
    /// Codes accepted of the current frame.
    accepted: usize,
    /// Whether a `tlast` was wrong since the last complete frame.
    framing_error: bool,
    pending: VecDeque<PendingFrame<'a>>,
    /// Beats delivered of the oldest pending frame.
    delivered: usize,
    pub(super) outcome: Outcome,
}

impl<'a> Scoreboard<'a> {
    pub(super) fn new(model: &'a Model, samples: &'a [Sample]) -> Self {
        Scoreboard {
            model,
            samples,
            mean: model.prepare.empty(),
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

    /// Records an accepted code of `sample`; `alone`: sent at full speed, with no other frame in the device.
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
            self.mean = self.model.prepare.empty();
        }
        if at_end && self.accepted == codes.len() {
            self.outcome.frames_in += 1;
            let flagged = std::mem::take(&mut self.framing_error);
            let sample = match self.model.scene.input.slides() {
                false => Cow::Borrowed(&self.samples[sample]),
                true => Cow::Owned(Sample::after(self.model, codes.clone(), &mut self.mean)),
            };
            self.pending.push_back(PendingFrame { sample, flagged, timed: alone.then_some(cycle) });
            self.accepted = 0;
        }
    }

    /// Checks a delivered beat.
    pub(super) fn delivered(&mut self, cycle: u64, data: [i32; 3], last: bool) {
        let Some(frame) = self.pending.front() else {
            return self.violate(cycle, "an output beat without a frame".to_owned());
        };
        let Sample { beats, forces, beat_cycles, .. } = &*frame.sample;
        let (index, flagged) = (self.delivered, frame.flagged);
        let due = frame.timed.map(|at| at + beat_cycles[index]);
        let timed = due.is_some();
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
        if let Some(due) = due.filter(|due| *due != cycle) {
            self.violate(cycle, format!("beat {index} was due in cycle {due}"));
        }
        self.delivered += 1;
        if at_end {
            self.outcome.frames_out += 1;
            self.outcome.timed += u64::from(timed);
            self.outcome.flagged += u64::from(flagged);
            self.pending.pop_front();
            self.delivered = 0;
        }
    }

    /// Discards all frames in the device.
    pub(super) fn reset(&mut self) {
        self.outcome.frames_in -= self.pending.len() as u64;
        (self.accepted, self.delivered, self.framing_error) = (0, 0, false);
        self.mean = self.model.prepare.empty();
        self.pending.clear();
    }
}
