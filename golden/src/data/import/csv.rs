//! Plain CSV: one frame per line, a value per taxel in the order of the rows.
//!
//! Values are separated by commas, semicolons, tabs or spaces, whichever the last line has; with any but commas, a
//! comma is a decimal point. With one value more than taxels the first is the time in s. Lines that start with
//! `#` and a first line that begins with a name are skipped. `B`, `NaN`, `null` and empty cells are missing
//! readings.

use super::error::{ImportError, Source};
use super::format::Format;
use super::recording::{reading, sensel, RawFrame, Recording};
use crate::data::frame;
use csv::{ReaderBuilder, StringRecord};

/// Reads a recording of `size` rows and columns.
pub(super) fn parse(text: &str, size: Option<[usize; 2]>, source: &Source) -> Result<Recording, ImportError> {
    let [rows, cols] = size.ok_or_else(|| source.missing("the size", "give it with --size ROWSxCOLS"))?;
    let (taxels, separator) = (rows * cols, separator(text));
    let mut reader = ReaderBuilder::new()
        .delimiter(separator)
        .comment(Some(b'#'))
        .flexible(true)
        .has_headers(false)
        .from_reader(text.as_bytes());
    let mut frames: Vec<RawFrame> = Vec::new();
    for (index, record) in reader.records().enumerate() {
        let record = record.map_err(|error| source.field("CSV", error, "values and separators"))?;
        let line = record.position().map_or(0, |position| usize::try_from(position.line()).unwrap_or(0));
        let cells: Vec<String> = cells(&record, separator);
        if cells.is_empty() || (index == 0 && is_names(&cells)) {
            continue;
        }
        let timed = cells.len() == taxels + 1;
        if cells.len() != taxels && !timed {
            let got = cells.len();
            let whole = record.iter().collect::<Vec<_>>().join(",");
            return Err(source.line(line, &whole, format!("{taxels} values, --size {rows}x{cols}, not {got}")));
        }
        let time_s = if timed { Some(reading(source, line, 1, &cells[0])?) } else { None };
        let sensels = cells.iter().enumerate().skip(usize::from(timed));
        let values = sensels.map(|(index, cell)| sensel(source, line, index + 1, cell)).collect::<Result<_, _>>()?;
        frames.push(RawFrame { number: frames.len() + 1, time_s, values, device: None });
    }
    Ok(Recording::bare(Format::Csv, [rows, cols], frames))
}

/// The separator of the last line, which has values even where the first has names.
fn separator(text: &str) -> u8 {
    let line = text.lines().rev().find(|line| !line.trim().is_empty()).unwrap_or("");
    [b';', b'\t', b','].into_iter().find(|byte| line.contains(char::from(*byte))).unwrap_or(b' ')
}

/// The cells of a line with decimal points.
fn cells(record: &StringRecord, separator: u8) -> Vec<String> {
    let cells = record.iter().map(str::trim).filter(|cell| separator != b' ' || !cell.is_empty());
    cells.map(|cell| if separator == b',' { cell.to_string() } else { cell.replace(',', ".") }).collect()
}

/// Whether a first line has names: its first cell begins with a letter and is not a missing reading.
fn is_names(cells: &[String]) -> bool {
    let name = |cell: &str| cell.starts_with(char::is_alphabetic) && cell != "B" && frame::reading(cell).is_none();
    cells.first().is_some_and(|cell| name(cell))
}
