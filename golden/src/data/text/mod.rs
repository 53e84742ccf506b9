//! Frames in text: lines of numbers as loggers, spreadsheets, microcontrollers and other programs write them.
//!
//! ```text
//! text ── lines ── layout, decided once ── cells ── readings, time
//! ```
//!
//! Layout is a property of the file, not of a line: it is found from many lines where there are many ([`Layout::of_lines`]), of a
//! stream from the first, or from up to eight where that leaves it open ([`Reader`]), and can be stated where a guess would be wrong
//! ([`Stated`]). A line of another layout holds no frame and is left out, with its number and the reason.
//!
//! | property | found from |
//! |---|---|
//! | separator | semicolons, tabs, commas or blanks: the first with which lines have the number of cells that the array asks for |
//! | decimal mark | a point; a comma where cells have one and it is not the separator |
//! | header | lines before the first readings; names, or the numbers of columns, as pandas writes them |
//! | columns before or after the readings | names of the header, else what they hold: a time that rises, an index, a text |
//! | a separator behind each line | an empty last cell in every line, one too many |
//! | a frame per line, or a grid of one line per row | the number of cells |
//! | decimals | where zeros at the end show that their number is fixed; a cell with fewer or more has lost or gained characters |
//! | digits before the decimal mark | where zeros in front show that their number is fixed; where others have one, a cell has one too |
//!
//! A digit that a whole number has lost shows nowhere in its line. Where lines of a stream show that the link loses characters, those
//! near them are doubted, and so is a frame in which a reading has changed as a lost character would change it ([`Reader`]); of a
//! whole text such a frame is left out ([`frames`]).
//!
//! | in | a cell is |
//! |---|---|
//! | a number | a reading; finite |
//! | empty, `nan`, `null`, `NA`, `N/A`, `#N/A`, `None`, `B` | a reading that is missing: NaN |
//! | anything else | none: the line is left out |
//!
//! Blank lines and those that begin with `#` are no frames. A list in brackets, as Python and NumPy print it, is a line without them,
//! and a time before an arrow, as the monitor of Arduino puts it, a cell.

mod cells;
mod columns;
mod decode;
mod json;
mod layout;
mod lost;
mod read;
mod reader;
#[cfg(test)]
mod tests;
mod time;
mod whole;

pub(crate) use cells::point;
pub use cells::{reading, Separator};
pub use decode::{decoded, Decoded};
pub(crate) use json::without_nan;
pub use layout::{Form, Layout, Stated};
pub use read::{Doubt, LeftOut, Read, TextFrame};
pub use reader::Reader;
pub(crate) use time::number_ns;
pub use time::{is_date, TimeUnit};
pub use whole::{frames, TextFrames};

use std::fmt;

/// Characters of a cell that are shown in an error.
const SHOWN: usize = 40;

/// A line with readings: its number in the file, from 1, and its text.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Line<'t> {
    /// Number in the file, from 1.
    pub number: usize,
    /// The text without the end of the line.
    pub text: &'t str,
}

impl<'t> Line<'t> {
    /// The lines of a text that may hold readings: not blank, no comment; `skip` lines are left out first.
    pub fn of_text(text: &'t str, skip: usize) -> Vec<Line<'t>> {
        let all = text.lines().enumerate().skip(skip).map(|(index, text)| Line { number: index + 1, text });
        all.filter(Line::may_hold_readings).collect()
    }

    /// Whether it is neither blank nor a comment, nor the begin or end of a list whose frames are on lines of their own.
    pub fn may_hold_readings(&self) -> bool {
        let text = self.text.trim();
        let list = text.trim_end_matches(',');
        let is_edge = !list.is_empty() && list.chars().all(|c| matches!(c, '[' | ']' | '(' | ')'));
        !text.is_empty() && !text.starts_with('#') && !is_edge
    }
}

/// Why a line, or a whole text, holds no frame.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NoReadings {
    /// Line, from 1; `None` for the text as a whole.
    pub line: Option<usize>,
    /// Cell of the line, from 1; `None` for the line as a whole.
    pub cell: Option<usize>,
    /// What is wrong, in words.
    pub reason: String,
    /// Whether characters seem to be lost: more or fewer values than the lines before have, or a number that is cut.
    pub cut: bool,
    /// Whether the columns can be read in several ways: further lines or an option may show which is right.
    pub open: bool,
}

impl NoReadings {
    pub(crate) fn of_text(reason: impl Into<String>) -> NoReadings {
        NoReadings { line: None, cell: None, reason: reason.into(), cut: false, open: false }
    }

    fn of_line(line: &Line, reason: impl Into<String>) -> NoReadings {
        NoReadings { line: Some(line.number), ..NoReadings::of_text(reason) }
    }

    fn of_cell(line: &Line, cell: usize, reason: impl Into<String>) -> NoReadings {
        NoReadings { cell: Some(cell), ..NoReadings::of_line(line, reason) }
    }

    /// The same, where characters seem to be lost.
    fn cut(self) -> NoReadings {
        NoReadings { cut: true, ..self }
    }

    /// `file, line 3, value 2: reason`, with what is known.
    pub fn in_file(&self, file: &str) -> String {
        let comma = if self.line.is_some() || self.cell.is_some() { ", " } else { ": " };
        format!("{file}{comma}{self}")
    }
}

impl fmt::Display for NoReadings {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let parts = [self.line.map(|line| format!("line {line}")), self.cell.map(|cell| format!("value {cell}"))];
        let at: Vec<String> = parts.into_iter().flatten().collect();
        let colon = if at.is_empty() { "" } else { ": " };
        write!(f, "{}{colon}{}", at.join(", "), self.reason)
    }
}

/// A text of at most 40 characters, in quotes.
fn shown(text: &str) -> String {
    format!("{:?}", text.trim().chars().take(SHOWN).collect::<String>())
}
