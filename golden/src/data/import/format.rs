//! Formats of recordings, and how a file is recognised.

use std::path::Path;

use super::loggers;
use serde::{Deserialize, Serialize};

/// First bytes of a NumPy file.
pub(super) const NPY_MAGIC: &[u8] = b"\x93NUMPY";

/// Format of a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Format {
    /// Tekscan ASF, or the CSV of the same program.
    Tekscan,
    /// novel LST: printed pictures of an emed platform.
    Lst,
    /// NumPy array.
    Npy,
    /// CSV of XSENSOR.
    Xsensor,
    /// Values separated by commas, semicolons, tabs or spaces, one frame per line.
    Csv,
}

impl Format {
    /// Every format with its name.
    pub const ALL: [(&'static str, Format); 5] = [
        ("tekscan", Format::Tekscan),
        ("lst", Format::Lst),
        ("npy", Format::Npy),
        ("xsensor", Format::Xsensor),
        ("csv", Format::Csv),
    ];

    /// The names of all formats.
    pub fn names() -> [&'static str; 5] {
        Format::ALL.map(|(name, _)| name)
    }

    /// Name in options and summaries.
    pub fn name(self) -> &'static str {
        Format::ALL.iter().find(|(_, format)| *format == self).map_or("", |(name, _)| name)
    }

    /// The format of a file by its first bytes, a plain CSV file by the end of its name.
    pub fn of(file: &str, bytes: &[u8]) -> Option<Format> {
        /// Headers are within this many bytes.
        const HEAD: usize = 4096;
        if bytes.starts_with(NPY_MAGIC) {
            return Some(Format::Npy);
        }
        let head = String::from_utf8_lossy(&bytes[..bytes.len().min(HEAD)]);
        let has_line = |start: &str| head.lines().any(|line| line.trim_start().starts_with(start));
        if has_line("DATA_TYPE") || has_line("ASCII_DATA") {
            return Some(Format::Tekscan);
        }
        if head.contains("Pict-No") || (head.contains("novel") && head.contains("Matrix:")) {
            return Some(Format::Lst);
        }
        if has_line("SENSELS") && has_line("Rows") && has_line("Columns") {
            return Some(Format::Xsensor);
        }
        if loggers::of(&head).is_some() {
            return Some(Format::Csv);
        }
        let extension = Path::new(file).extension()?.to_str()?.to_ascii_lowercase();
        match extension.as_str() {
            "csv" | "tsv" | "txt" | "dat" => Some(Format::Csv),
            _ => None,
        }
    }
}
