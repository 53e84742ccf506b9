//! Scoreboard: derives the expected output from the accepted input beats.
//!
//! A frame is complete with its last taxel. An earlier `tlast` drops the frame's codes; a missing `tlast` on the last
//! taxel changes nothing. Both set [`FLAG_FRAMING`] in all subarrays of the next complete frame, which may be the same
//! frame. A reset clears the flag. A sliding mean holds the complete frames since the last early `tlast` or reset.
//!
//! With writable tables a beat may be a byte of an image; the model takes it as the hardware does.

use std::borrow::Cow;
use std::collections::VecDeque;

use dermis_golden::fixed::stages::load::{image_bytes, Outcome as Loaded, WORD_BYTES};
use dermis_golden::fixed::stages::prepare::Prepared;
use dermis_golden::fixed::stages::send::{FLAG_FRAMING, STATUS_BEATS, TABLES_REFUSED, TABLES_SHIFT};
use dermis_golden::fixed::Model;

use super::outcome::{Outcome, Violation};
use super::samples::Sample;

/// Violations reported with text; further ones are only counted.
const REPORTED_VIOLATIONS: usize = 8;
/// Number of violations that ends an experiment.
const VIOLATION_LIMIT: u64 = 100;

/// The status beat with the version of the tables.
const TABLES_BEAT: usize = 1;

/// A complete frame that has not left yet.
struct PendingFrame<'a> {
    sample: Cow<'a, Sample>,
    flagged: bool,
    /// An image came between the codes of a later frame: the status may say already that it is refused.
    may_refuse: bool,
    /// Cycle of its last code, if the cycles of its beats are checked.
    timed: Option<u64>,
}

/// Input beats accepted so far and output beats due.
pub(super) struct Scoreboard<'a> {
    /// With the tables that the hardware has.
    model: Cow<'a, Model>,
    samples: &'a [Sample],
    /// The frames in a sliding mean.
    mean: Prepared,
    /// Codes accepted of the current frame.
    accepted: usize,
    /// The bytes of an image that has begun.
    image: Option<Vec<u8>>,
    /// The rest of a refused image follows.
    skipping: bool,
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
            model: Cow::Borrowed(model),
            samples,
            mean: model.prepare.empty(),
            image: None,
            skipping: false,
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

    /// Records an accepted beat, a code of `sample` or a byte of an image; `alone`: sent at full speed, with no other frame in
    /// the device.
    pub(super) fn accepted(&mut self, cycle: u64, sample: usize, (code, last): (i32, bool), alone: bool) {
        if self.model.has_writable_tables() && code >> (self.model.formats().code_bits - 1) == 1 {
            return self.accepted_byte(code as u8, last);
        }
        // A code in an image: its rest will not come.
        self.skipping = false;
        if let Some(image) = self.image.take() {
            self.load(&image);
        }
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
                true => Cow::Owned(Sample::after(&self.model, codes.clone(), &mut self.mean)),
                false if self.model.has_writable_tables() => Cow::Owned(self.samples[sample].with_tables(&self.model)),
                false => Cow::Borrowed(&self.samples[sample]),
            };
            self.pending.push_back(PendingFrame { sample, flagged, may_refuse: false, timed: alone.then_some(cycle) });
            self.accepted = 0;
        }
    }

    fn accepted_byte(&mut self, byte: u8, last: bool) {
        if self.skipping {
            self.skipping = !last;
            return;
        }
        let taxels = self.model.scene.sensor.taxels();
        if self.image.is_none() && !self.accepted.is_multiple_of(taxels) {
            self.model.to_mut().refuse_image();
            self.outcome.images_refused += 1;
            self.skipping = !last;
            self.pending.iter_mut().for_each(|frame| frame.may_refuse = true);
            return;
        }
        let mut image = self.image.take().unwrap_or_default();
        image.push(byte);
        let wrong_head = image.len() == WORD_BYTES && image[..] != self.model.image()[..WORD_BYTES];
        let full = image.len() == image_bytes(taxels);
        if !(last || full || wrong_head) {
            self.image = Some(image);
            return;
        }
        if full && !last {
            // It is longer than it may be.
            image.push(0);
        }
        self.skipping = self.load(&image) != Loaded::Whole && !last;
    }

    /// The hardware has all that it takes of an image.
    fn load(&mut self, image: &[u8]) -> Loaded {
        // What becomes of this one; tables that were not whole before stay so if it is refused.
        let refused = image.len() < WORD_BYTES || image[..WORD_BYTES] != self.model.image()[..WORD_BYTES];
        let outcome = self.model.to_mut().load(image);
        if refused {
            self.outcome.images_refused += 1;
            return Loaded::Refused;
        }
        match outcome {
            Loaded::Whole => self.outcome.images += 1,
            _ => self.outcome.images_broken += 1,
        }
        // The engine is as after a reset.
        (self.accepted, self.framing_error) = (0, false);
        self.mean = self.model.prepare.empty();
        outcome
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
        let is_tables = index >= *forces && (index - forces) % STATUS_BEATS == TABLES_BEAT;
        let refused = (u32::from(TABLES_REFUSED) << TABLES_SHIFT) as i32;
        if frame.may_refuse && is_tables && data[2] & refused != 0 {
            wanted[2] |= refused;
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

    /// Discards all frames in the device; the last byte of an image was accepted in the cycle before.
    pub(super) fn reset(&mut self) {
        self.outcome.frames_in -= self.pending.len() as u64;
        if let Some(mut image) = self.image.take() {
            // The byte taken in the cycle before is not used.
            image.pop();
            if image.len() >= WORD_BYTES {
                self.load(&image);
            }
        }
        if self.model.has_writable_tables() {
            self.model.to_mut().reset();
        }
        self.skipping = false;
        (self.accepted, self.delivered, self.framing_error) = (0, 0, false);
        self.mean = self.model.prepare.empty();
        self.pending.clear();
    }
}
