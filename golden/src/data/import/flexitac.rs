//! FlexiTac: what its firmware sends, saved from the serial port byte by byte.
//!
//! | bytes | meaning |
//! |---|---|
//! | `AA 55` | begin of a frame |
//! | rows × cols | counts of 8 bits, row-major |
//!
//! A count may be `AA` too: a frame is one if another begins behind it, or the file ends there. Bytes between frames, as of a file
//! that begins within one, are left out and counted.

use super::error::{ImportError, Source};
use super::format::{frame_bytes, Format, MARK};
use super::recording::{RawFrame, Recording};
use super::units::Unit;

/// Reads a recording of the stated size.
pub(super) fn parse(bytes: &[u8], size: Option<[usize; 2]>, source: &Source) -> Result<Recording, ImportError> {
    let [rows, cols] = size.ok_or_else(|| {
        let of = frame_bytes(bytes).map_or(String::new(), |own| format!("; a frame of this FlexiTac has {own} taxels"));
        source.missing("the size", format!("give it with --size ROWSxCOLS{of}"))
    })?;
    let taxels = rows * cols;
    let (mut at, mut frames, mut between, mut left_out) = (0, Vec::new(), 0usize, Vec::new());
    let mut cut = None;
    while at < bytes.len() {
        let rest = &bytes[at..];
        let body = rest.strip_prefix(MARK).filter(|body| {
            let behind = body.get(taxels..).unwrap_or(&[]);
            behind.is_empty() || behind.starts_with(MARK) || MARK.starts_with(behind)
        });
        let Some(body) = body else {
            (at, between) = (at + 1, between + 1);
            continue;
        };
        if between > 0 {
            left_out.push(format!("{between} bytes before byte {at}"));
            between = 0;
        }
        let Some(counts) = body.get(..taxels) else {
            cut = Some(format!("frame {} has {} of {taxels} counts", frames.len() + 1, body.len()));
            break;
        };
        let values = counts.iter().map(|count| f64::from(*count)).collect();
        frames.push(RawFrame { number: frames.len() + 1, time_s: None, values, stated: None, device: None });
        at += MARK.len() + taxels;
    }
    if frames.is_empty() && cut.is_none() {
        let found = frame_bytes(bytes).map_or("no frame".to_owned(), |own| format!("frames of {own}"));
        return Err(source.field("--size", format!("{rows}x{cols}"), format!("that of the file, which has {found}")));
    }
    if between > 0 {
        left_out.push(format!("{between} bytes at the end"));
    }
    let (unit, bits) = (Some(Unit::Raw), Some(8));
    let device = Some("FlexiTac".to_owned());
    Ok(Recording { device, unit, bits, left_out, cut, ..Recording::bare(Format::Flexitac, [rows, cols], frames) })
}

#[cfg(test)]
mod tests {
    use super::super::{import, ImportError, Imported, Settings};
    use super::*;

    /// Three frames of 2×3 counts; the second has the mark within.
    fn file() -> Vec<u8> {
        [[0, 1, 2, 3, 4, 5], [0, 0xaa, 0x55, 0, 0, 9], [200, 0, 0, 0, 0, 255]]
            .iter()
            .flat_map(|counts| MARK.iter().chain(counts).copied())
            .collect()
    }

    fn read(bytes: &[u8], size: Option<[usize; 2]>, more: Settings) -> Result<Imported, ImportError> {
        let pitch_mm = Some([2.0, 2.0]);
        import("pad.bin", bytes, &Settings { size, pitch_mm, full_scale_MPa: Some(0.255), ..more })
    }

    #[test]
    fn frames_are_told_by_their_marks() {
        let imported = read(&file(), Some([2, 3]), Settings::default()).unwrap();
        let summary = &imported.summary;
        assert_eq!((summary.format, summary.unit), (Format::Flexitac, Unit::Raw));
        assert_eq!(summary.device.as_deref(), Some("FlexiTac"));
        let counts = |k: usize| imported.frames[k].stress_MPa.iter().map(|b| (b * 1e3).round()).collect::<Vec<_>>();
        assert_eq!((imported.frames.len(), counts(1)), (3, vec![0.0, 170.0, 85.0, 0.0, 0.0, 9.0]));
        // The file begins within a frame: the rest of that is left out, and named.
        let stated = || Settings { format: Some(Format::Flexitac), ..Settings::default() };
        let within = read(&file()[4..], Some([2, 3]), stated()).unwrap();
        assert_eq!(
            (within.frames.len(), &within.summary.lines_left_out[..]),
            (2, &["4 bytes before byte 4".to_owned()][..])
        );
        // Four whole frames behind the rest of one are recognised.
        let long = [&file()[4..], &file(), &file()].concat();
        let within = read(&long, Some([2, 3]), Settings::default()).unwrap();
        assert_eq!((within.frames.len(), within.summary.lines_left_out.len()), (8, 1));
        // It ends within one.
        let cut = read(&file()[..20], Some([2, 3]), Settings::default()).unwrap_err().to_string();
        assert!(cut.contains("frame 3 has 2 of 6 counts; --partial takes the 2 frames before that"), "{cut}");
        let partial = read(&file()[..20], Some([2, 3]), Settings { partial: true, ..Settings::default() }).unwrap();
        assert_eq!(partial.frames.len(), 2);
    }

    #[test]
    fn a_size_that_is_missing_or_another_is_named() {
        let missing = read(&file(), None, Settings::default()).unwrap_err().to_string();
        assert_eq!(
            missing,
            "pad.bin: the size is missing; give it with --size ROWSxCOLS; a frame of this FlexiTac has 6 taxels"
        );
        let other = read(&file(), Some([2, 2]), Settings::default()).unwrap_err().to_string();
        assert!(other.starts_with("pad.bin: --size = 2x2 is not allowed") && other.ends_with("frames of 6"), "{other}");
        assert_eq!(frame_bytes(b"\xaa\x55\x00\x01"), None);
    }
}
