//! Mismatches between a device and the bit-true model: contents, comparison, counting, text.

use std::collections::BTreeSet;
use std::fmt;

use serde::Serialize;

/// Mismatches kept per frame; the rest are counted.
pub const KEPT_PER_FRAME: usize = 16;

/// One mismatch.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Mismatch {
    /// Device and stimulus, for example `verilator, full speed`.
    pub run: String,
    /// Frame name.
    pub frame: String,
    /// Stage name; `beats` and `status` for the output, `handshake`, `cycles`, `watchdog`.
    pub stage: String,
    /// Index of the word in the stage's stream of this frame.
    pub index: usize,
    /// Row and column of the taxel, for the words of `receive` and `forces`.
    pub taxel: Option<[usize; 2]>,
    /// Cycle of the device's word; none for a missing word.
    pub cycle: Option<u64>,
    /// The model's word; none where no word was expected.
    pub expected: Option<Vec<i64>>,
    /// The device's word; none where it is missing.
    pub got: Option<Vec<i64>>,
    /// The violated rule as text, for handshake, watchdog, cycles and stage names.
    pub rule: Option<String>,
}

impl fmt::Display for Mismatch {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: frame {}, stage {}, word {}", self.run, self.frame, self.stage, self.index)?;
        if let Some([row, col]) = self.taxel {
            write!(f, " (taxel {row},{col})")?;
        }
        if let Some(cycle) = self.cycle {
            write!(f, ", cycle {cycle}")?;
        }
        if let Some(rule) = &self.rule {
            return write!(f, ": {rule}");
        }
        let word = |w: &Option<Vec<i64>>| w.as_ref().map_or("nothing".to_owned(), |w| format!("{w:?}"));
        write!(f, ": expected {}, got {}", word(&self.expected), word(&self.got))
    }
}

/// Result of a comparison.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Findings {
    /// The first [`KEPT_PER_FRAME`] mismatches of every frame.
    pub kept: Vec<Mismatch>,
    /// Number of all mismatches.
    pub count: usize,
    /// Indices of the frames with a mismatch; frame names need not be unique.
    pub unequal: BTreeSet<usize>,
}

impl Findings {
    /// Whether there is no mismatch.
    pub fn is_equal(&self) -> bool {
        self.count == 0
    }

    /// The same findings; frames are numbered without the first `count`, whose own mismatches count with frame 0.
    pub fn without_first(mut self, count: usize) -> Findings {
        self.unequal = self.unequal.into_iter().map(|frame| frame.saturating_sub(count)).collect();
        self
    }

    /// Adds another comparison's findings.
    pub fn extend(&mut self, other: Findings) {
        self.kept.extend(other.kept);
        self.count += other.count;
        self.unequal.extend(other.unequal);
    }
}

/// Where a word of a frame is.
#[derive(Clone, Copy, Debug, Default)]
pub struct WordLocation<'a> {
    /// As in [`Mismatch::stage`].
    pub stage: &'a str,
    /// As in [`Mismatch::index`].
    pub index: usize,
    /// As in [`Mismatch::taxel`].
    pub taxel: Option<[usize; 2]>,
    /// As in [`Mismatch::cycle`].
    pub cycle: Option<u64>,
}

/// Comparison of one frame, with its findings so far.
pub struct FrameComparison<'a> {
    run: &'a str,
    frame: String,
    number: usize,
    findings: Findings,
}

impl<'a> FrameComparison<'a> {
    /// Of the frame with this name and index, in the run with this label.
    pub fn new(run: &'a str, frame: String, number: usize) -> Self {
        FrameComparison { run, frame, number, findings: Findings::default() }
    }

    /// Compares one word; at most one of the two is missing.
    pub fn compare(&mut self, location: WordLocation, expected: Option<Vec<i64>>, got: Option<Vec<i64>>) {
        if expected != got {
            self.add(location, expected, got, None);
        }
    }

    /// Adds a violated rule.
    pub fn add_violation(&mut self, location: WordLocation, rule: String) {
        self.add(location, None, None, Some(rule));
    }

    fn add(&mut self, location: WordLocation, expected: Option<Vec<i64>>, got: Option<Vec<i64>>, rule: Option<String>) {
        let WordLocation { stage, index, taxel, cycle } = location;
        self.findings.count += 1;
        self.findings.unequal.insert(self.number);
        if self.findings.kept.len() < KEPT_PER_FRAME {
            let (run, frame, stage) = (self.run.to_owned(), self.frame.clone(), stage.to_owned());
            self.findings.kept.push(Mismatch { run, frame, stage, index, taxel, cycle, expected, got, rule });
        }
    }

    /// What was found.
    pub fn finish(self) -> Findings {
        self.findings
    }
}
