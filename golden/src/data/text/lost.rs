//! Characters that a link loses where what is left is a number too: frames in doubt.
//!
//! ```text
//! frames as they are read ── compared with the one before ── frames, doubted or not
//! ```

use std::borrow::Cow;

use super::cells::Digits;
use super::read::{Doubt, Read, TextFrame};
use super::{json, Layout};

/// Change of a reading, over the largest of those that no lost character explains: from this one on it may be due to a character that
/// is lost, if the number with that character would have changed by [`NEAR`] at most, or by less than its change over [`NEARER`].
const FAR: f64 = 5.0;
const NEAR: f64 = 2.0;
const NEARER: f64 = 10.0;
/// Least change, over the range of the readings, that is looked at: a smaller one of a reading that moves slowly is that of some lost
/// character too.
const LEAST: f64 = 0.05;
/// Least number of other readings that show what a change of them is.
const OTHERS: usize = 6;
/// Lines before and after one that has lost characters in which one more may be lost where it does not show.
const DOUBTED: usize = 100;

/// Finds frames in which a number may have lost a character: see [`super::Reader`].
#[derive(Clone, Debug, Default)]
pub(super) struct LostCharacters {
    /// Readings with which those of the next frame are compared; of one in doubt that before it.
    before: Vec<f64>,
    /// Readings in doubt of the last frame.
    doubted: Vec<(usize, f64)>,
    /// The first frame, which is compared with the next one.
    first: Option<Box<TextFrame>>,
    /// Number of the last line that has lost characters.
    cut: Option<usize>,
    /// Number of the last line with a reading in doubt.
    suspect: Option<usize>,
    /// Whether numbers so far are written so that a lost digit does not show.
    hides: bool,
}

impl LostCharacters {
    /// The cells of a line are these.
    pub(super) fn note(&mut self, layout: &Layout, cells: &[Cow<str>]) {
        self.hides = self.hides || layout.hides_a_lost_digit(cells);
    }

    /// A line is JSON, whose numbers are as short as they can be.
    pub(super) fn note_json(&mut self) {
        self.hides = true;
    }

    /// The lines so far were whole.
    pub(super) fn forget_cut(&mut self) {
        self.cut = None;
    }

    /// Whether a frame waits for the next one.
    pub(super) fn is_waiting(&self) -> bool {
        self.first.is_some()
    }

    /// What lines up to `last` brought, in their order, with frames in doubt.
    pub(super) fn judge(&mut self, read: Vec<Read>, last: usize, layout: Option<&Layout>) -> Vec<Read> {
        if read.iter().any(|read| matches!(read, Read::LeftOut(left_out) if left_out.reason.cut)) {
            self.cut = Some(last);
        }
        let mut judged = Vec::with_capacity(read.len() + 1);
        for read in read {
            match read {
                Read::Frame(frame) => judged.extend(self.frame(frame, layout).into_iter().map(Read::Frame)),
                Read::LeftOut(_) => {
                    judged.extend(self.waiting());
                    judged.push(read);
                }
                Read::Header(_) => judged.push(read),
            }
        }
        judged
    }

    /// The frame that waits for the next one, which does not come.
    pub(super) fn waiting(&mut self) -> Option<Read> {
        let first = *self.first.take()?;
        Some(Read::Frame(self.judged(first, None)))
    }

    /// The next frame, and one that waited for it.
    fn frame(&mut self, frame: TextFrame, layout: Option<&Layout>) -> Vec<TextFrame> {
        let lines = layout.map_or(1, |layout| layout.lines);
        let is_first = self.before.is_empty() && self.first.is_none();
        let shows = self.hides && frame.readings.len() >= OTHERS + 2 * lines;
        // A program that sends JSON may wait for each answer.
        if is_first && shows && !json::is_json(&frame.written) {
            self.first = Some(Box::new(frame));
            return Vec::new();
        }
        let mut frames = Vec::with_capacity(2);
        if let Some(first) = self.first.take() {
            self.before.clone_from(&frame.readings);
            // Either frame may lack a character.
            let doubt = self.compare(&first, layout, 2 * lines);
            frames.push(self.judged(*first, doubt));
        }
        let doubt = self.compare(&frame, layout, lines);
        frames.push(self.judged(frame, doubt));
        frames
    }

    /// The frame with its doubt, its own or that near a loss, and without its text.
    fn judged(&mut self, frame: TextFrame, doubt: Option<Doubt>) -> TextFrame {
        if doubt.is_some() {
            // One alone may be a reading that has changed so.
            let before = self.suspect.replace(frame.line);
            self.cut =
                before.filter(|line| frame.line.abs_diff(*line) <= DOUBTED).map_or(self.cut, |_| Some(frame.line));
        }
        let near = || self.cut.filter(|line| self.hides && frame.line.abs_diff(*line) <= DOUBTED).map(Doubt::NearLoss);
        TextFrame { doubt: doubt.or_else(near), written: String::new(), ..frame }
    }

    /// Compares a frame with the readings before, and is ready for the next one; at most so many readings are `lacking` a character.
    fn compare(&mut self, frame: &TextFrame, layout: Option<&Layout>, lacking: usize) -> Option<Doubt> {
        for (taxel, doubted) in self.doubted.drain(..) {
            let now = frame.readings.get(taxel).copied().unwrap_or(f64::NAN);
            // A reading that stays has changed.
            if (now - doubted).abs() < (now - self.before[taxel]).abs() {
                self.before[taxel] = doubted;
            }
        }
        let doubted = match self.before.len() == frame.readings.len() {
            true => self.doubted(frame, layout, lacking),
            false => Vec::new(),
        };
        self.before.resize(frame.readings.len(), f64::NAN);
        for (taxel, now) in frame.readings.iter().enumerate() {
            if doubted.iter().any(|(own, _)| *own == taxel) {
                self.doubted.push((taxel, *now));
            } else if !now.is_nan() {
                self.before[taxel] = *now;
            }
        }
        let (taxel, cell) = doubted.into_iter().next()?;
        Some(Doubt::Reading { taxel, cell, before: self.before[taxel] })
    }

    /// Readings that may lack a character, as they are written, that which has changed most first. The largest changes, as many as may
    /// be `lacking` one, say nothing of the others.
    fn doubted(&self, frame: &TextFrame, layout: Option<&Layout>, lacking: usize) -> Vec<(usize, String)> {
        let changes = self.before.iter().zip(&frame.readings).map(|(before, now)| (now - before).abs());
        let mut changes: Vec<(f64, usize)> =
            changes.enumerate().filter(|(_, change)| !change.is_nan()).map(|(taxel, change)| (change, taxel)).collect();
        if changes.len() < lacking + OTHERS {
            return Vec::new();
        }
        let (most, other, _) = changes.select_nth_unstable_by(lacking, |a, b| b.0.total_cmp(&a.0));
        most.sort_by(|a, b| b.0.total_cmp(&a.0));
        let other = other.0;
        let [low, high] = self.before.iter().fold([f64::MAX, f64::MIN], |[low, high], b| [low.min(*b), high.max(*b)]);
        let least = (LEAST * (high - low)).max(FAR * other);
        if most[0].0 <= least {
            return Vec::new();
        }
        let written = Written::of(frame, layout);
        let scale = other.max(written.digits.step(written.cells.iter().map(Cow::as_ref)));
        let far = most.iter().filter(|(change, _)| *change > least.max(FAR * scale));
        let doubted = far.filter_map(|(change, taxel)| {
            let cell = written.cells.get(*taxel)?;
            let near = (NEAR * scale).max(change / NEARER);
            let would_be = written.digits.would_be(cell, self.before[*taxel], near);
            would_be.then(|| (*taxel, cell.to_string()))
        });
        doubted.collect()
    }
}

/// The readings of a frame as they are written.
struct Written<'t> {
    digits: Cow<'t, Digits>,
    cells: Vec<Cow<'t, str>>,
}

impl<'t> Written<'t> {
    fn of(frame: &'t TextFrame, layout: Option<&'t Layout>) -> Written<'t> {
        match layout.filter(|_| !json::is_json(&frame.written)) {
            Some(layout) => {
                let cells = frame.written.lines().flat_map(|line| layout.readings_as_written(line)).collect();
                Written { digits: Cow::Borrowed(&layout.digits), cells }
            }
            None => {
                let cells = json::cells(&frame.written).into_iter().map(Cow::Borrowed).collect();
                Written { digits: Cow::Owned(Digits::of_json()), cells }
            }
        }
    }
}
