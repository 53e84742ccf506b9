//! Lines of bounded length, and the frame in a line.

use std::io::{self, BufRead, Read};

use dermis_golden::data::frame::{csv_hint, reading, Frame};
use dermis_golden::spec::sensor::Sensor;
use serde::Deserialize;
use serde_json::Value;

/// Longest input line in bytes; 65536 taxels of 25 characters take 1.6 MB.
pub const LONGEST_LINE: u64 = 4 << 20;
/// Characters of a value that are shown in an error.
const SHOWN: usize = 40;

/// A line of JSON.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Request {
    #[serde(default)]
    id: Value,
    stress_MPa: Vec<Option<f64>>,
}

/// Why a line holds no frame, with its id if that could be read.
#[derive(Debug, PartialEq)]
pub(crate) struct NoFrame {
    pub(crate) id: Value,
    pub(crate) reason: String,
}

/// Reads a line into `line`; `None` at the end, `Some(false)` if the line is too long: it is skipped to its end.
pub(crate) fn read(input: &mut dyn BufRead, line: &mut Vec<u8>) -> io::Result<Option<bool>> {
    line.clear();
    // Bounded, so that an endless line cannot exhaust the memory.
    let read = (&mut *input).take(LONGEST_LINE + 1).read_until(b'\n', line)?;
    if read as u64 <= LONGEST_LINE || line.last() == Some(&b'\n') {
        return Ok((read > 0).then_some(true));
    }
    line.clear();
    loop {
        let part = input.fill_buf()?;
        let end = part.iter().position(|byte| *byte == b'\n');
        let used = end.map_or(part.len(), |end| end + 1);
        input.consume(used);
        if end.is_some() || used == 0 {
            return Ok(Some(false));
        }
    }
}

/// The frame in a line, of JSON or of numbers separated by commas, and its id; `number` names a frame without one.
pub(crate) fn frame(text: &str, number: u64, sensor: &Sensor) -> Result<(Value, Frame), NoFrame> {
    let json = text.trim_start().starts_with('{');
    let hint = || if json { "" } else { csv_hint(text, sensor.taxels(), number == 1) };
    let (id, stress_MPa) = match json {
        true => {
            let request: Request =
                serde_json::from_str(text).map_err(|error| NoFrame { id: Value::Null, reason: error.to_string() })?;
            (request.id, request.stress_MPa.into_iter().map(|reading| reading.unwrap_or(f64::NAN)).collect())
        }
        false => (Value::Null, numbers(text).map_err(|reason| NoFrame { id: Value::Null, reason: reason + hint() })?),
    };
    let name = match &id {
        Value::Null => format!("line {number}"),
        Value::String(name) => name.clone(),
        other => other.to_string(),
    };
    match Frame::from_stress(&name, sensor, stress_MPa) {
        Ok(frame) => Ok((id, frame)),
        Err(error) => Err(NoFrame { id, reason: error.to_string() + hint() }),
    }
}

/// The readings of a line, separated by commas; NaN where one is missing.
fn numbers(text: &str) -> Result<Vec<f64>, String> {
    let number = |(index, cell): (usize, &str)| {
        let shown: String = cell.trim().chars().take(SHOWN).collect();
        let wrong = || format!("value {}: {shown:?} is not a finite number", index + 1);
        reading(cell).ok_or_else(wrong)
    };
    text.split(',').enumerate().map(number).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn small() -> Sensor {
        Sensor { rows: 2, cols: 2, pitch_x_mm: 4.0, pitch_y_mm: 4.0, thickness_mm: 3.0 }
    }

    #[test]
    fn json_and_numbers_give_the_same_frame() {
        let (id, json) = frame("{\"id\": 7, \"stress_MPa\": [0.1, 0, -1e-3, 2]}", 3, &small()).unwrap();
        let (none, csv) = frame(" 0.1, 0,-1e-3,2\r\n", 3, &small()).unwrap();
        assert_eq!((id, none, csv.id.as_str()), (Value::from(7), Value::Null, "line 3"));
        assert_eq!((json.id.as_str(), json.stress_MPa), ("7", csv.stress_MPa));
    }

    #[test]
    fn missing_readings_are_named_by_every_form() {
        for text in
            ["{\"stress_MPa\": [0.1, null, 0.3, 2]}", "0.1,,0.3,2", "0.1, nan,0.3,2", "0.1,NaN,0.3,2", "0.1,null,0.3,2"]
        {
            let (_, frame) = frame(text, 1, &small()).unwrap();
            assert_eq!((frame.missing, frame.stress_MPa), (vec![1], vec![0.1, 0.0, 0.3, 2.0]), "{text}");
        }
    }

    #[test]
    fn what_is_wrong_is_named() {
        let cases = [
            ("1,2,3", "line 1: stress_MPa has 3 values, wanted 4"),
            ("1,x,3,4", "value 2: \"x\" is not a finite number"),
            ("1;2;3;4", "value 1: \"1;2;3;4\" is not a finite number; values are separated by commas"),
            ("0,1;0,2;0,3;0,4", "values are separated by commas, and a decimal mark is a point"),
            ("0,1,0,2,0,3,0,4", "stress_MPa has 8 values, wanted 4; a decimal mark is a point, not a comma"),
            ("a,b,c,d", "value 1: \"a\" is not a finite number; a frame has no header line"),
            ("1,inf,3,4", "value 2: \"inf\" is not a finite number"),
            ("{\"stress\": []}", "unknown field `stress`"),
        ];
        for (text, wanted) in cases {
            let reason = frame(text, 1, &small()).unwrap_err().reason;
            assert!(reason.contains(wanted), "{text}: {reason}");
        }
    }

    #[test]
    fn a_line_that_is_too_long_is_skipped() {
        let long = "1,".repeat(LONGEST_LINE as usize) + "\n";
        let text = format!("first\n{long}last");
        let (mut input, mut line) = (text.as_bytes(), Vec::new());
        assert_eq!(read(&mut input, &mut line).unwrap(), Some(true));
        assert_eq!(read(&mut input, &mut line).unwrap(), Some(false));
        assert!(line.is_empty());
        assert_eq!(read(&mut input, &mut line).unwrap(), Some(true));
        assert_eq!(line, b"last");
        assert_eq!(read(&mut input, &mut line).unwrap(), None);
    }
}
