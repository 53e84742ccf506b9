//! Plain text: lines of numbers, as [`crate::data::text`] reads them.
//!
//! Times since 1970 are taken from the first frame on.

use super::error::{ImportError, Source};
use super::format::Format;
use super::recording::{RawFrame, Recording, LARGEST_READING};
use super::Settings;
use crate::data::text::{frames, is_date};

/// Reads a recording of the stated size.
pub(super) fn parse(text: &str, settings: &Settings, source: &Source) -> Result<Recording, ImportError> {
    let shape = settings.size.ok_or_else(|| source.missing("the size", "give it with --size ROWSxCOLS"))?;
    let read = frames(text, shape, &settings.layout).map_err(|reason| source.text(reason))?;
    let start_ns = read.frames.first().and_then(|frame| frame.time_ns).filter(|ns| is_date(*ns)).unwrap_or(0);
    let mut own = Vec::with_capacity(read.frames.len());
    for (index, frame) in read.frames.into_iter().enumerate() {
        if let Some(large) = frame.readings.iter().find(|value| value.abs() > LARGEST_READING) {
            return Err(source.line(frame.line, &large.to_string(), "a number up to 1e9 in magnitude"));
        }
        let time_s = frame.time_ns.map(|ns| (ns - start_ns) as f64 * 1e-9);
        own.push(RawFrame { number: index + 1, time_s, values: frame.readings, device: None });
    }
    let layout = read.layout.map(|layout| layout.to_string());
    let left_out = read.left_out.iter().map(|left_out| left_out.reason.to_string()).collect();
    Ok(Recording { layout, left_out, ..Recording::bare(Format::Csv, shape, own) })
}
