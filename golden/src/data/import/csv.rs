//! Plain text: lines of numbers, as [`crate::data::text`] reads them.
//!
//! Times since 1970 are taken from the first frame on.

use super::error::{ImportError, Source};
use super::format::Format;
use super::loggers;
use super::recording::{RawFrame, Recording, LARGEST_READING};
use super::units::Unit;
use crate::data::text::{frames, is_date, Stated};

/// Reads a recording of the stated size and layout.
pub(super) fn parse(
    text: &str,
    size: Option<[usize; 2]>,
    layout: &Stated,
    source: &Source,
) -> Result<Recording, ImportError> {
    let logger = loggers::of(text);
    let shape = size.ok_or_else(|| {
        let of =
            logger.as_ref().map_or(String::new(), |logger| format!("; a file of {} does not state it", logger.name));
        source.missing("the size", format!("give it with --size ROWSxCOLS{of}"))
    })?;
    let stated = logger.as_ref().map_or(*layout, |logger| logger.stated(layout));
    let read = frames(text, shape, &stated).map_err(|reason| source.text(reason))?;
    let in_doubt = read.may_be_cut.iter().cloned().chain(read.near_loss_text()).collect();
    let start_ns = read.frames.first().and_then(|frame| frame.time_ns).filter(|ns| is_date(*ns)).unwrap_or(0);
    let mut recorded = Vec::with_capacity(read.frames.len());
    for (index, frame) in read.frames.into_iter().enumerate() {
        if let Some(large) = frame.readings.iter().find(|value| value.abs() > LARGEST_READING) {
            return Err(source.line(frame.line, &large.to_string(), "a number up to 1e9 in magnitude"));
        }
        // Divided, so that they come out as the decimal fractions they are.
        let time_s = frame.time_ns.map(|ns| (ns - start_ns) as f64 / 1e9);
        recorded.push(RawFrame { number: index + 1, time_s, values: frame.readings, stated: None, device: None });
    }
    let layout = read.layout.map(|layout| layout.to_string());
    let left_out = read.left_out.iter().map(|left_out| left_out.reason.to_string()).collect();
    let device = logger.as_ref().map(|logger| logger.name.to_owned());
    // Lines of JSON state it in the name of their field.
    let unit = logger.and_then(|logger| logger.unit).or(layout.is_none().then_some(Unit::MegaPa));
    Ok(Recording { device, unit, layout, left_out, in_doubt, ..Recording::bare(Format::Csv, shape, recorded) })
}
