//! Formats of recordings, and how a file is recognised.

use std::path::Path;

use super::loggers;
use serde::{Deserialize, Serialize};

/// First bytes of an HDF5 file.
pub(super) const HDF5_MAGIC: &[u8] = b"\x89HDF\r\n\x1a\n";
/// Begin of a frame of a FlexiTac.
pub(super) const MARK: &[u8] = b"\xaa\x55";
/// Frames by which a file is recognised.
const RECOGNISED_BY: usize = 3;
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
    /// Serial bytes of a FlexiTac.
    Flexitac,
    /// CSV of PaXini's PXSR.
    Paxini,
    /// Messages of XELA's server.
    Xela,
    /// Values separated by commas, semicolons, tabs or spaces, one frame per line.
    Csv,
}

impl Format {
    /// Every format with its name.
    pub const ALL: [(&'static str, Format); 8] = [
        ("tekscan", Format::Tekscan),
        ("lst", Format::Lst),
        ("npy", Format::Npy),
        ("xsensor", Format::Xsensor),
        ("flexitac", Format::Flexitac),
        ("paxini", Format::Paxini),
        ("xela", Format::Xela),
        ("csv", Format::Csv),
    ];

    /// The names of all formats.
    pub fn names() -> [&'static str; 8] {
        Format::ALL.map(|(name, _)| name)
    }

    /// Whether a file may have several sensors, each with a name.
    pub(super) fn has_sensors(self) -> bool {
        matches!(self, Format::Paxini | Format::Xela)
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
        if head.lines().next().is_some_and(is_paxini_header) {
            return Some(Format::Paxini);
        }
        if head.lines().next().is_some_and(is_xela_message) {
            return Some(Format::Xela);
        }
        if frame_bytes(bytes).is_some() {
            return Some(Format::Flexitac);
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

/// Bytes of a FlexiTac's frame behind its mark, if a file begins with some of equal length.
pub(super) fn frame_bytes(bytes: &[u8]) -> Option<usize> {
    let body = bytes.strip_prefix(MARK)?;
    let is_begin = |start: usize| bytes[start..].starts_with(MARK);
    let ends = body.windows(MARK.len()).enumerate().filter(|(_, own)| *own == MARK).map(|(at, _)| at);
    // The mark may stand within a frame.
    ends.filter(|own| *own > 0).find(|own| {
        (1..RECOGNISED_BY).all(|k| k * (own + MARK.len()) < bytes.len() && is_begin(k * (own + MARK.len())))
    })
}

/// Whether a line is the header of PaXini's CSV.
pub(super) fn is_paxini_header(line: &str) -> bool {
    line.trim_start_matches(['\u{feff}', '"']).starts_with("Timestamp") && line.contains("-NxN-Z[")
}

/// Whether a line is a message of XELA's server with readings, or the greeting before them.
pub(super) fn is_xela_message(line: &str) -> bool {
    line.trim_start().starts_with('{')
        && line.contains("\"message\"")
        && (line.contains("\"taxels\"") || line.contains("Welcome"))
}
