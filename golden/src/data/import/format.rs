//! Formats of recordings, and how a file is recognised.

use std::path::Path;

use super::loggers;
use serde::{Deserialize, Serialize};

/// First bytes of a ZIP archive, which an `.npz` file is.
const ZIP_MAGIC: &[u8] = b"PK\x03\x04";
/// Bytes in front of the name of an archive's first file.
const ZIP_NAME: usize = 30;
/// First bytes of an HDF5 file.
pub(super) const HDF5_MAGIC: &[u8] = b"\x89HDF\r\n\x1a\n";
/// Begin of a frame of a FlexiTac.
pub(super) const MARK: &[u8] = b"\xaa\x55";
/// Frames by which a file is recognised.
const RECOGNISED_BY: usize = 3;
/// Longest frame of a FlexiTac that is looked for in a file that begins within one, and the marks that are tried.
const LONGEST_FRAME: usize = 1 << 16;
const MOST_MARKS: usize = 64;
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
        if head.lines().next().is_some_and(is_frame) {
            return Some(Format::Csv);
        }
        if frame_bytes(bytes).is_some() {
            return Some(Format::Flexitac);
        }
        if loggers::of(&head).is_some() {
            return Some(Format::Csv);
        }
        let extension = Path::new(file).extension()?.to_str()?.to_ascii_lowercase();
        match extension.as_str() {
            "csv" | "tsv" | "txt" | "dat" | "ndjson" | "jsonl" => Some(Format::Csv),
            _ => None,
        }
    }
}

/// Bytes of a FlexiTac's frame behind its mark, if a file has some of equal length at its begin; it may begin within a frame.
pub(super) fn frame_bytes(bytes: &[u8]) -> Option<usize> {
    let marks = |bytes: &[u8], most: usize| -> Vec<usize> {
        let all = bytes.windows(MARK.len()).take(most).enumerate().filter(|(_, own)| *own == MARK);
        all.map(|(at, _)| at).take(MOST_MARKS).collect()
    };
    let of = |start: usize| {
        let own = &bytes[start..];
        let is_begin = |at: usize| own[at..].starts_with(MARK);
        // The mark may stand within a frame. A file that begins within one has less than that before it.
        let ends = marks(&own[MARK.len()..], usize::MAX).into_iter().filter(|length| *length > 0);
        let whole = ends.map(|length| (length, length + MARK.len())).filter(|(_, frame)| start < *frame);
        let mut repeated = whole.filter(|(_, frame)| {
            let needed = RECOGNISED_BY + usize::from(start > 0);
            (1..needed).all(|k| k * frame < own.len() && is_begin(k * frame))
        });
        repeated.next().map(|(length, _)| length)
    };
    marks(bytes, LONGEST_FRAME).into_iter().find_map(of)
}

/// Whether a line is a frame in JSON, as streams have them.
fn is_frame(line: &str) -> bool {
    line.trim_start_matches('\u{feff}').trim_start().starts_with('{') && line.contains("\"stress_MPa\"")
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

/// Whether a file is an archive of arrays of NumPy.
pub(super) fn is_npz(bytes: &[u8]) -> bool {
    let first = bytes.get(ZIP_NAME..).unwrap_or(&[]);
    bytes.starts_with(ZIP_MAGIC) && first[..first.len().min(256)].windows(4).any(|own| own == b".npy")
}
