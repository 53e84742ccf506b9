//! What lines bring: a frame, a header, or none.

use serde_json::Value;

use super::{Line, NoReadings};

/// A frame of a text.
#[derive(Clone, Debug, PartialEq)]
pub struct TextFrame {
    /// Number of its first line, from 1.
    pub first_line: usize,
    /// Number of its last line.
    pub line: usize,
    /// `id` of a line of JSON.
    pub id: Value,
    /// Time in ns, since 1970 ([`super::is_date`]) or since a moment that the file does not say, if there is one.
    pub time_ns: Option<i64>,
    /// Readings, row-major; NaN where one is missing.
    pub readings: Vec<f64>,
    /// The true force in N, [x, y, normal], of a line of JSON that states it.
    pub resultant_N: Option<[f64; 3]>,
    /// Why a reading may be another one than that which was sent, if one may be: see [`super::Reader`].
    pub doubt: Option<Doubt>,
    /// Its lines, until they have been judged.
    pub(super) written: String,
}

impl TextFrame {
    /// That of a line, without readings.
    pub(super) fn of_line(line: &Line) -> TextFrame {
        TextFrame {
            first_line: line.number,
            line: line.number,
            id: Value::Null,
            time_ns: None,
            readings: Vec::new(),
            resultant_N: None,
            doubt: None,
            written: line.text.to_owned(),
        }
    }
}

/// Why a reading of a frame may be another one than that which was sent.
#[derive(Clone, Debug, PartialEq)]
pub enum Doubt {
    /// The line of this number, at most a hundred lines away, has lost characters, and one that this frame has lost would not show.
    NearLoss(usize),
    /// A reading has changed by far more than the others, and with one more character its number would be nearly that before.
    Reading {
        /// Row-major, from 0.
        taxel: usize,
        /// The number as it is written.
        cell: String,
        /// The reading before.
        before: f64,
    },
}

/// What a line brought.
#[derive(Clone, Debug, PartialEq)]
pub enum Read {
    /// The last line of a frame.
    Frame(TextFrame),
    /// The line of this number stands before the first readings, with names.
    Header(usize),
    /// No frame.
    LeftOut(LeftOut),
}

/// A line, or a frame that begins with it, without readings that can be used.
#[derive(Clone, Debug, PartialEq)]
pub struct LeftOut {
    /// `id` of a line of JSON, as far as it could be read.
    pub id: Value,
    /// Line, cell and reason.
    pub reason: NoReadings,
}
