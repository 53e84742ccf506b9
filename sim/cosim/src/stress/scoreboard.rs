//! Scoreboard: derives the expected output from the accepted input beats.
//!
//! A frame is complete with its last taxel. An earlier `tlast` drops the frame's codes; a missing `tlast` on the last
//! taxel changes nothing. Both set [`FRAMING`] in all subarrays of the next complete frame, which may be the same
//! frame. A reset clears the flag. A sliding mean holds the complete frames since the last early `tlast` or reset; a running
//! zero follows all since the last reset, as [`Prepare::cut`](dermis_golden::fixed::stages::prepare::Prepare::cut) says.
//!
//! Of several arrays each has a state of its own; the array of a frame is that of its first beat.
//!
//! With writable tables a beat may be a byte of an image; the model takes it as the hardware does.

use std::borrow::Cow;
use std::collections::VecDeque;

use dermis_golden::fixed::stages::load::Outcome as Loaded;
use dermis_golden::fixed::stages::prepare::Prepared;
use dermis_golden::fixed::stages::send::{FRAMING, STATUS_BEATS};
use dermis_golden::fixed::{Intake, Model};
use dermis_golden::result::flags::{StatusField, TABLES_REFUSED};

use super::outcome::{Outcome, Violation};
use super::samples::{Code, Sample};

/// Violations reported with text; further ones are only counted.
const REPORTED_VIOLATIONS: usize = 8;
/// Number of violations that ends an experiment.
const VIOLATION_LIMIT: u64 = 100;

/// A complete frame that has not left yet.
struct PendingFrame<'a> {
    sample: Cow<'a, Sample>,
    flagged: bool,
    /// An image came between the codes of a later frame: the status may say already that it is refused.
    may_refuse: bool,
    /// Cycle of its last code, if the cycles of its beats are checked.
    timed: Option<u64>,
    array: usize,
}

/// Input beats accepted so far and output beats due.
pub(super) struct Scoreboard<'a> {
    /// That of each array, with the tables that the hardware has of it.
    models: Vec<Cow<'a, Model>>,
    samples: &'a [Sample],
    /// What the hardware has of the frames of each array so far.
    prepared: Vec<Prepared>,
    /// Array of the current frame.
    array: usize,
    /// Codes accepted of the current frame.
    accepted: usize,
    /// What has come of an image of tables.
    intake: Intake,
    /// Whether a `tlast` was wrong since the last complete frame.
    framing_error: bool,
    pending: VecDeque<PendingFrame<'a>>,
    /// Beats delivered of the oldest pending frame.
    delivered: usize,
    pub(super) outcome: Outcome,
}

impl<'a> Scoreboard<'a> {
    pub(super) fn new(models: &'a [Model], samples: &'a [Sample]) -> Self {
        Scoreboard {
            models: models.iter().map(Cow::Borrowed).collect(),
            samples,
            prepared: models.iter().map(|model| model.prepare.empty()).collect(),
            array: 0,
            intake: Intake::default(),
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

    /// Number of arrays.
    pub(super) fn arrays(&self) -> usize {
        self.models.len()
    }

    /// The model of the array of the current frame.
    fn model(&self) -> &Model {
        &self.models[self.array]
    }

    /// Whether the next beat is the first of a frame.
    pub(super) fn begins(&self) -> bool {
        self.accepted.is_multiple_of(self.model().scene.sensor.taxels())
    }

    /// Whether the array of the next beat counts: it is the first of a frame or of an image.
    pub(super) fn names_array(&self) -> bool {
        self.begins() && !self.intake.is_busy()
    }

    /// Records an accepted beat, a code of `sample` or a byte of an image; `alone`: sent at full speed, with no other frame in
    /// the device.
    pub(super) fn accepted(&mut self, cycle: u64, sample: usize, code: Code, alone: bool) {
        let Code { data, last, array } = code;
        if self.model().has_writable_tables() && data >> (self.model().formats().code_bits - 1) == 1 {
            return self.accepted_byte(data as u8, last, array % self.arrays());
        }
        if self.intake.is_busy() {
            let of = self.intake.array();
            let outcome = self.intake.code(self.models[of].to_mut());
            self.count_image(of, outcome);
        }
        if self.begins() {
            self.array = array % self.arrays();
        }
        let (array, several) = (self.array, self.arrays() > 1);
        let model = &*self.models[array];
        let Sample { codes, taxels, .. } = &self.samples[sample];
        self.accepted += 1;
        let at_end = self.accepted.is_multiple_of(*taxels);
        if last != at_end {
            self.outcome.wrong_tlast += 1;
            self.framing_error = true;
        }
        let has_memory = model.scene.input.has_memory();
        let frame = (self.accepted - 1) / taxels * taxels..self.accepted;
        if last && !at_end {
            self.outcome.cut += 1;
            self.accepted = 0;
            model.prepare.cut(&mut self.prepared[array], &codes[frame.clone()]);
        }
        if at_end && has_memory {
            model.add(&mut self.prepared[array], &codes[frame]);
        }
        if at_end && self.accepted == codes.len() {
            self.outcome.frames_in += 1;
            let flagged = std::mem::take(&mut self.framing_error);
            let sample = match has_memory {
                true => Cow::Owned(Sample::of(model, codes.clone(), &self.prepared[array])),
                false if several || model.has_writable_tables() => Cow::Owned(Sample::new(model, codes.clone())),
                false => Cow::Borrowed(&self.samples[sample]),
            };
            let timed = alone.then_some(cycle);
            self.pending.push_back(PendingFrame { sample, flagged, may_refuse: false, timed, array });
            self.accepted = 0;
        }
    }

    fn accepted_byte(&mut self, byte: u8, last: bool, array: usize) {
        let (in_frame, of) = (!self.begins(), self.intake.array_of_byte(array));
        let outcome = self.intake.byte(self.models[of].to_mut(), byte, last, in_frame);
        if in_frame && outcome.is_some() {
            let own = self.pending.iter_mut().filter(|frame| frame.array == of);
            own.for_each(|frame| frame.may_refuse = true);
        }
        self.count_image(of, outcome);
    }

    /// Counts an image of array `array` that is over. Once tables have been written the engine is as after a reset; of several
    /// arrays only what it has of this one.
    fn count_image(&mut self, array: usize, outcome: Option<Loaded>) {
        let counts = match outcome {
            None => return,
            Some(Loaded::Refused) => {
                self.outcome.images_refused += 1;
                return;
            }
            Some(Loaded::Whole) => &mut self.outcome.images,
            Some(Loaded::Broken) => &mut self.outcome.images_broken,
        };
        *counts += 1;
        if self.arrays() > 1 {
            self.prepared[array] = self.models[array].prepare.empty();
            return;
        }
        (self.accepted, self.framing_error) = (0, false);
        self.empty();
    }

    /// The state of the hardware is that after a reset.
    fn empty(&mut self) {
        self.prepared = self.models.iter().map(|model| model.prepare.empty()).collect();
    }

    /// Checks a delivered beat.
    pub(super) fn delivered(&mut self, cycle: u64, data: [i32; 3], last: bool, array: usize) {
        let Some(frame) = self.pending.front() else {
            return self.violate(cycle, "an output beat without a frame".to_owned());
        };
        let Sample { beats, forces, beat_cycles, .. } = &*frame.sample;
        let (index, flagged) = (self.delivered, frame.flagged);
        let due = frame.timed.map(|at| at + beat_cycles[index]);
        let timed = due.is_some();
        let mut wanted = beats[index];
        let holds = |field: &StatusField| index >= *forces && (index - forces) % STATUS_BEATS == field.beat;
        if flagged && holds(&FRAMING) {
            wanted[FRAMING.word] |= FRAMING.mask() as i32;
        }
        if frame.may_refuse && holds(&TABLES_REFUSED) {
            wanted[TABLES_REFUSED.word] |= data[TABLES_REFUSED.word] & TABLES_REFUSED.mask() as i32;
        }
        let (at_end, of) = (index + 1 == beats.len(), frame.array);
        if array != of {
            self.violate(cycle, format!("beat {index}: tid is {array}, of a frame of array {of}"));
        }
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
        if self.model().has_writable_tables() {
            // The last byte was accepted in the cycle before.
            let of = self.intake.array();
            let outcome = self.intake.reset(self.models[of].to_mut(), 1);
            self.models.iter_mut().for_each(|model| model.to_mut().forget_refusal());
            self.count_image(of, outcome);
        }
        (self.accepted, self.delivered, self.framing_error) = (0, 0, false);
        self.empty();
        self.pending.clear();
    }
}
