//! A recording as its file states it: readings in the file's unit, not yet stress.

use super::error::{ImportError, Source};
use super::format::Format;
use super::units::Unit;
use crate::data::text::{self, Separator};

/// Largest magnitude of a reading, in any unit; beyond it sums would lose their meaning.
pub(super) const LARGEST_READING: f64 = 1e9;
/// Largest number of rows or columns of a recording, before it is cropped.
pub(super) const LARGEST_SIDE: usize = 4096;

/// The device's own figure of a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum DeviceFigure {
    /// Normal force in N.
    Force(f64),
    /// Sum of all readings, in the file's unit.
    Sum(f64),
}

/// One frame of readings.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct RawFrame {
    /// Number as the device counts, from 1.
    pub number: usize,
    /// Time from the start in s, if known.
    pub time_s: Option<f64>,
    /// Readings, row-major; NaN where one is missing.
    pub values: Vec<f64>,
    /// The readings of the file where a correction has changed them.
    pub stated: Option<Vec<f64>>,
    /// The device's own figure, if printed.
    pub device: Option<DeviceFigure>,
}

/// All frames of a file.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Recording {
    pub format: Format,
    /// The device, as the file names it.
    pub device: Option<String>,
    pub rows: usize,
    pub cols: usize,
    /// Pitch along columns and rows in mm, if stated.
    pub pitch_mm: Option<[f64; 2]>,
    /// Unit of the readings, if stated.
    pub unit: Option<Unit>,
    /// Bits of a count, if the format has counts of a known width.
    pub bits: Option<u32>,
    /// Reading at which the device saturates, if stated.
    pub full_scale: Option<f64>,
    /// Sensels without a reading in any frame, row-major; empty before the frames are selected.
    pub missing: Vec<bool>,
    /// Layout of the lines of a plain text.
    pub layout: Option<String>,
    /// Lines of a plain text that hold no frame, with the reason.
    pub left_out: Vec<String>,
    /// Where the file ends too early, in words; the frames are those that are whole.
    pub cut: Option<String>,
    /// Where numbers of a plain text may have lost digits, in words.
    pub in_doubt: Vec<String>,
    pub frames: Vec<RawFrame>,
}

impl Recording {
    /// Frames of a format that states neither device, pitch, unit nor codes.
    pub(super) fn bare(format: Format, [rows, cols]: [usize; 2], frames: Vec<RawFrame>) -> Self {
        Recording {
            format,
            device: None,
            rows,
            cols,
            pitch_mm: None,
            unit: None,
            bits: None,
            full_scale: None,
            missing: Vec::new(),
            layout: None,
            left_out: Vec::new(),
            cut: None,
            in_doubt: Vec::new(),
            frames,
        }
    }
}

/// A reading of a text.
pub(super) fn reading(source: &Source, line: usize, column: usize, text: &str) -> Result<f64, ImportError> {
    let number = text.trim().parse().ok().filter(|value: &f64| is_reading(*value));
    number.ok_or_else(|| source.value(line, column, text, "a number up to 1e9 in magnitude"))
}

/// The reading of a sensel: NaN where it is missing, as [`text::reading`] has it.
pub(super) fn sensel(source: &Source, line: usize, column: usize, cell: &str) -> Result<f64, ImportError> {
    match cell.trim() {
        cell if text::reading(cell).is_some_and(f64::is_nan) => Ok(f64::NAN),
        cell => reading(source, line, column, cell),
    }
}

/// What separates the cells of a line, of a device or of a spreadsheet that has saved its file.
pub(super) fn separator(text: &str) -> Separator {
    match text.contains(';') {
        true => Separator::Semicolon,
        false => Separator::Comma,
    }
}

/// Whether a number is finite and small enough.
pub(super) fn is_reading(value: f64) -> bool {
    value.abs() <= LARGEST_READING
}

/// The number of a last line that has no end, if there is one: the text may be cut within it.
pub(super) fn unfinished(text: &str) -> Option<usize> {
    (!text.is_empty() && !text.ends_with('\n')).then(|| text.lines().count())
}

/// Checks rows or columns against [`LARGEST_SIDE`].
pub(super) fn side(source: &Source, field: &str, text: &str) -> Result<usize, ImportError> {
    let count = text.trim().parse().ok().filter(|count| (1..=LARGEST_SIDE).contains(count));
    count.ok_or_else(|| source.field(field, text, format!("a whole number from 1 to {LARGEST_SIDE}")))
}

/// The unit that a field names.
pub(super) fn unit(source: &Source, field: &str, text: &str) -> Result<Unit, ImportError> {
    Unit::named(text).ok_or_else(|| source.field(field, text, format!("one of {}", Unit::names())))
}
