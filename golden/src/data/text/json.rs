//! Frames in lines of JSON.

use std::borrow::Cow;

use serde::Deserialize;
use serde_json::value::RawValue;
use serde_json::Value;

use super::read::LeftOut;
use super::{Line, NoReadings, TimeUnit};
use crate::plain_words::JsonError;

/// The field with the readings.
const READINGS: &str = "stress_MPa";

/// A line of JSON.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Request<'t> {
    #[serde(default)]
    pub(super) id: Value,
    pub(super) stress_MPa: Vec<Option<f64>>,
    /// Seconds since any moment, milliseconds since 1970, or ISO 8601.
    /// As it is written: a floating-point number would round the nanoseconds of a date.
    #[serde(default, borrow, alias = "time", alias = "time_s", alias = "t")]
    timestamp: Option<&'t RawValue>,
    #[serde(default)]
    pub(super) time_ns: Option<i64>,
    #[serde(default)]
    pub(super) resultant_N: Option<[f64; 3]>,
}

impl<'t> Request<'t> {
    /// The frame of `taxels` readings in a line without NaN ([`without_nan`]) of this number.
    pub(super) fn of(text: &'t str, number: usize, taxels: usize) -> Result<Request<'t>, LeftOut> {
        let left_out = |id: Value, reason: String, cut: bool| {
            let reason = NoReadings { cut, ..NoReadings::of_line(&Line { number, text }, reason) };
            Err(LeftOut { id, reason })
        };
        let request: Request = match serde_json::from_str(text) {
            Ok(request) => request,
            Err(error) => {
                let JsonError { column, message, .. } = JsonError::new(&error);
                return left_out(Value::Null, format!("column {column}: {message}"), !error.is_data());
            }
        };
        match request.stress_MPa.len() {
            got if got == taxels => Ok(request),
            got => left_out(request.id, format!("{READINGS} has {got} values, wanted {taxels}"), true),
        }
    }

    /// Its time in ns, or one that is to be counted on behind midnight with its unit; `None` without one.
    pub(super) fn time(&self) -> Option<(TimeUnit, i64)> {
        let cell = self.timestamp.map_or("", RawValue::get).trim_matches('"');
        let unit = TimeUnit::of_column(&[cell], None)?;
        Some((unit, unit.ns(cell)?))
    }
}

/// Whether a line is to be read as JSON.
pub(super) fn is_json(text: &str) -> bool {
    text.trim_start().starts_with('{')
}

/// The readings of a line of JSON that is a frame, as they are written.
pub(super) fn cells(text: &str) -> Vec<&str> {
    let list = text.split_once(READINGS).and_then(|(_, rest)| rest.split_once('[')?.1.split_once(']'));
    list.map_or(Vec::new(), |(list, _)| list.split(',').map(str::trim).collect())
}

/// JSON with `null` for `NaN`, which Python writes and JSON does not have; texts in quotes stay.
pub(crate) fn without_nan(text: &str) -> Cow<'_, str> {
    if !text.contains("NaN") {
        return text.into();
    }
    let (mut is_text, mut escaped, mut skip) = (false, false, 0);
    let mut plain = String::with_capacity(text.len() + 16);
    for (at, c) in text.char_indices() {
        if skip > 0 {
            skip -= 1;
        } else if !is_text && text[at..].starts_with("NaN") {
            plain += "null";
            skip = 2;
        } else {
            plain.push(c);
            is_text ^= c == '"' && !escaped;
            escaped = is_text && c == '\\' && !escaped;
        }
    }
    plain.into()
}
