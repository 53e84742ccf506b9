//! Lines of bounded length, and the frame in a line.

use std::io::{self, BufRead, Read as _};

use dermis_golden::data::frame::Frame;
use dermis_golden::data::text::{Form, Layout, LeftOut, Line, NoReadings, Read, Reader, Stated, TextFrame};
use dermis_golden::result::flags::Flag;
use dermis_golden::spec::sensor::Sensor;
use serde_json::Value;

/// Longest input line in bytes; 65536 taxels of 25 characters take 1.6 MB.
pub const LONGEST_LINE: u64 = 4 << 20;

/// The frame in a line.
#[derive(Debug, PartialEq)]
pub(crate) struct LineFrame {
    /// Null if the line has none.
    pub(crate) id: Value,
    /// With the time that the line states.
    pub(crate) frame: Frame,
    /// Whether a digit may be lost, [`Reader::is_doubtful`].
    pub(crate) doubtful: bool,
}

impl LineFrame {
    /// The flag of a result with this frame, if there is one.
    pub(crate) fn flag(&self) -> Option<Flag> {
        self.doubtful.then_some(Flag::TornFrame)
    }
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

/// The frames of a stream's lines, of JSON or of numbers: [`dermis_golden::data::text`]. Each line is a frame, and the first one with
/// numbers decides their layout.
pub(crate) struct Frames {
    reader: Reader,
    sensor: Sensor,
    /// The layout of the lines so far.
    layout: Option<Layout>,
    note: Option<String>,
}

impl Frames {
    /// Of lines whose layout is `stated`, but for the form: each is a frame.
    pub(crate) fn new(sensor: &Sensor, stated: Stated) -> Frames {
        let reader = Reader::new([sensor.rows, sensor.cols], Stated { form: Some(Form::Line), ..stated });
        Frames { reader, sensor: sensor.clone(), layout: None, note: None }
    }

    /// What is to be said of the last line: a header, or a layout that is not plain.
    pub(crate) fn note(&mut self) -> Option<String> {
        self.note.take()
    }

    /// The frame in a line and its id; `number` names a frame without one. `None` for a comment and a header.
    pub(crate) fn frame(&mut self, line: &[u8], number: u64) -> Result<Option<LineFrame>, NoFrame> {
        let text = std::str::from_utf8(line).map_err(|error| NoFrame { id: Value::Null, reason: error.to_string() })?;
        // A line of its own: it brings one thing at most.
        let line = usize::try_from(number).unwrap_or(usize::MAX);
        let read = self.reader.push(Line { number: line, text }).pop();
        if let Some(layout) = self.reader.layout().filter(|layout| self.layout.as_ref() != Some(*layout)) {
            // What stands above the line was not the header of a file.
            let mut shown = layout.clone();
            shown.first_line = 1;
            self.note = (!layout.is_plain()).then(|| format!("lines from {number} on: {shown}"));
            self.layout = Some(layout.clone());
        }
        match read {
            None => Ok(None),
            Some(Read::Header) => {
                self.note = Some(format!("line {number} is a header"));
                Ok(None)
            }
            Some(Read::LeftOut(LeftOut { id, reason })) => {
                Err(NoFrame { id, reason: NoReadings { line: None, ..reason }.to_string() })
            }
            Some(Read::Frame(TextFrame { id, readings, time_ns, resultant_N, .. })) => {
                let name = match &id {
                    Value::Null => format!("line {number}"),
                    Value::String(name) => name.clone(),
                    other => other.to_string(),
                };
                match Frame::from_stress(&name, &self.sensor, readings) {
                    Ok(frame) => {
                        let frame = Frame { resultant_N, time_ns, ..frame };
                        Ok(Some(LineFrame { id, frame, doubtful: self.reader.is_doubtful() }))
                    }
                    Err(error) => Err(NoFrame { id, reason: error.to_string() }),
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn small() -> Sensor {
        Sensor { rows: 2, cols: 2, pitch_x_mm: 4.0, pitch_y_mm: 4.0, thickness_mm: 3.0 }
    }

    /// The frame of a line that is the only one.
    fn frame(text: &str, number: u64) -> Result<(Value, Frame), NoFrame> {
        let read = Frames::new(&small(), Stated::default()).frame(text.as_bytes(), number).map(Option::unwrap);
        read.map(|LineFrame { id, frame, .. }| (id, frame))
    }

    #[test]
    fn json_and_numbers_give_the_same_frame() {
        let (id, json) = frame("{\"id\": 7, \"stress_MPa\": [0.1, 0, -1e-3, 2]}", 3).unwrap();
        let (none, csv) = frame(" 0.1, 0,-1e-3,2\r\n", 3).unwrap();
        assert_eq!((id, none, csv.id.as_str()), (Value::from(7), Value::Null, "line 3"));
        assert_eq!((json.id.as_str(), json.stress_MPa), ("7", csv.stress_MPa));
    }

    #[test]
    fn missing_readings_are_named_by_every_form() {
        for text in [
            "{\"stress_MPa\": [0.1, null, 0.3, 2]}",
            "{\"stress_MPa\": [0.1, NaN, 0.3, 2]}",
            "0.1,,0.3,2",
            "0.1, nan,0.3,2",
            "0.1;NaN;0.3;2",
            "0.1 null 0.3 2",
        ] {
            let (_, frame) = frame(text, 1).unwrap();
            assert_eq!((frame.missing, frame.stress_MPa), (vec![1], vec![0.1, 0.0, 0.3, 2.0]), "{text}");
        }
    }

    #[test]
    fn what_is_wrong_is_named() {
        let cases = [
            ("1,2,3", "3 values, wanted 4"),
            ("1,x,3,4", "value 2: \"x\" is not a finite number"),
            ("0,1,0,2,0,3,0,4", "8 values, wanted 4; a decimal mark is a point where commas separate values"),
            ("1,inf,3,4", "value 2: \"inf\" is not a finite number"),
            ("{\"stress\": []}", "column 9: unknown field stress; there are id, stress_MPa"),
        ];
        for (text, wanted) in cases {
            let reason = frame(text, 1).unwrap_err().reason;
            assert!(reason.starts_with(wanted), "{text}: {reason}");
        }
        let mut frames = Frames::new(&small(), Stated::default());
        assert_eq!((frames.frame(b"a,b,c,d", 1), frames.note().as_deref()), (Ok(None), Some("line 1 is a header")));
        assert_eq!((frames.frame(b"# a remark", 2), frames.note()), (Ok(None), None));
        assert!(frames.frame(b"1;2;3;4", 3).unwrap().is_some());
        let layout = "lines from 3 on: a frame per line, separated by semicolons, readings in columns 1 to 4";
        assert_eq!(frames.note().as_deref(), Some(layout));
        let other = frames.frame(b"1,2,3,4", 4).unwrap_err().reason;
        assert_eq!(
            other,
            "1 values, wanted 4; this line is separated by commas, those before are separated by semicolons"
        );
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
