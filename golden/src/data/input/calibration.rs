//! Calibration: offset and gain of every taxel, from a CSV file.
//!
//! The first line is `row,col,offset,gain`; then one line per taxel in any order: b = gain · (reading − offset). Blank
//! lines and lines that start with `#` are ignored.
//!
//! | | shape | unit | range |
//! |---|---|---|---|
//! | offset | taxels | unit of the readings | finite |
//! | gain | taxels | MPa per unit of the readings | finite, not zero |

use crate::spec::sensor::Sensor;
use std::fs::File;
use std::io::Read;
use std::path::Path;
use thiserror::Error;

/// First line of a table.
pub const HEADER: &str = "row,col,offset,gain";
/// Largest file in bytes; 256 × 256 lines of 60 characters take 4 MB.
const LARGEST_FILE: u64 = 16 << 20;

/// Offset and gain of each taxel, row-major.
#[derive(Clone, Debug, PartialEq)]
pub struct Calibration {
    /// Readings without contact, in their own unit.
    pub offset: Vec<f64>,
    /// MPa per unit of the readings, not zero.
    pub gain: Vec<f64>,
}

/// A calibration table cannot be used.
#[derive(Debug, Error)]
pub enum CalibrationError {
    /// The file cannot be read as text.
    #[error("{file}: cannot be read: {source}")]
    Unreadable {
        /// Path as given.
        file: String,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// The file is larger than a table may be.
    #[error("{file}: over {limit} bytes, too large for a calibration table")]
    TooLarge {
        /// Path as given.
        file: String,
        /// Largest size in bytes.
        limit: u64,
    },
    /// A line of the table is invalid.
    #[error("{file}, line {line}: {value:?} is not allowed; it must be {allowed}")]
    Line {
        /// Path as given.
        file: String,
        /// Line, from 1.
        line: usize,
        /// The text found.
        value: String,
        /// The allowed values, in words.
        allowed: String,
    },
    /// Some taxels have no line.
    #[error("{file}: no line for taxel {row},{col}; {missing} of {taxels} taxels are missing")]
    Missing {
        /// Path as given.
        file: String,
        /// Row of the first of them.
        row: usize,
        /// Column of the first of them.
        col: usize,
        /// Number of taxels without a line.
        missing: usize,
        /// Number of taxels of the sensor.
        taxels: usize,
    },
}

impl Calibration {
    /// The table for readings in MPa: offset 0, gain 1.
    pub fn identity(taxels: usize) -> Calibration {
        Calibration { offset: vec![0.0; taxels], gain: vec![1.0; taxels] }
    }

    /// The table as text, which [`Calibration::parse`] reads back to the same numbers.
    pub fn to_csv(&self, sensor: &Sensor) -> String {
        let line = |(k, (offset, gain)): (usize, (&f64, &f64))| {
            format!("{},{},{offset},{gain}\n", k / sensor.cols, k % sensor.cols)
        };
        let lines: String = self.offset.iter().zip(&self.gain).enumerate().map(line).collect();
        format!("{HEADER}\n{lines}")
    }

    /// Reads the table of a sensor from a file.
    ///
    /// # Errors
    /// Any [`CalibrationError`].
    pub fn load(path: &Path, sensor: &Sensor) -> Result<Calibration, CalibrationError> {
        let file = path.display().to_string();
        let mut bytes = Vec::new();
        let read = File::open(path).and_then(|handle| handle.take(LARGEST_FILE + 1).read_to_end(&mut bytes));
        let text = read.and_then(|_| {
            String::from_utf8(bytes).map_err(|error| std::io::Error::new(std::io::ErrorKind::InvalidData, error))
        });
        match text {
            Err(source) => Err(CalibrationError::Unreadable { file, source }),
            Ok(text) if text.len() as u64 > LARGEST_FILE => {
                Err(CalibrationError::TooLarge { file, limit: LARGEST_FILE })
            }
            Ok(text) => Calibration::parse(&text, &file, sensor),
        }
    }

    /// Reads the table of a sensor from text; `file` names it in errors.
    ///
    /// # Errors
    /// [`CalibrationError::Line`] or [`CalibrationError::Missing`].
    pub fn parse(text: &str, file: &str, sensor: &Sensor) -> Result<Calibration, CalibrationError> {
        let mut values: Vec<Option<[f64; 2]>> = vec![None; sensor.taxels()];
        let filled = text.lines().enumerate().map(|(index, line)| (index + 1, line.trim()));
        let mut filled = filled.filter(|(_, line)| !line.is_empty() && !line.starts_with('#'));
        let wrong = |line: usize, value: &str, allowed: String| CalibrationError::Line {
            file: file.to_string(),
            line,
            value: value.chars().take(40).collect(),
            allowed,
        };
        let (line, header) = filled.next().unwrap_or((1, ""));
        if header.split(',').map(str::trim).ne(HEADER.split(',')) {
            return Err(wrong(line, header, format!("the header {HEADER}")));
        }
        for (line, row) in filled {
            let cells: Vec<&str> = row.split(',').map(str::trim).collect();
            let [row_text, col_text, offset, gain] = cells[..] else {
                return Err(wrong(line, row, format!("four values, {HEADER}")));
            };
            let index = |text: &str, name: &str, count: usize| {
                let index = text.parse().ok().filter(|index: &usize| *index < count);
                index.ok_or_else(|| wrong(line, text, format!("a {name} from 0 to {}", count - 1)))
            };
            let number = |text: &str| text.parse().ok().filter(|number: &f64| number.is_finite());
            let (row, col) = (index(row_text, "row", sensor.rows)?, index(col_text, "col", sensor.cols)?);
            let offset = number(offset).ok_or_else(|| wrong(line, offset, "a finite offset".to_string()))?;
            let gain = number(gain).filter(|gain| *gain != 0.0).ok_or_else(|| {
                wrong(
                    line,
                    gain,
                    "a finite gain other than 0 (list a taxel that reads nothing in input.dead)".to_string(),
                )
            })?;
            let place = &mut values[row * sensor.cols + col];
            if place.is_some() {
                return Err(wrong(line, &format!("{row},{col}"), "a taxel that has no line yet".to_string()));
            }
            *place = Some([offset, gain]);
        }
        if let Some(first) = values.iter().position(Option::is_none) {
            return Err(CalibrationError::Missing {
                file: file.to_string(),
                row: first / sensor.cols,
                col: first % sensor.cols,
                missing: values.iter().filter(|value| value.is_none()).count(),
                taxels: sensor.taxels(),
            });
        }
        let column = |k: usize| values.iter().flatten().map(|pair| pair[k]).collect();
        Ok(Calibration { offset: column(0), gain: column(1) })
    }
}
