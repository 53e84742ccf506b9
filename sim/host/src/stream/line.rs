//! Lines of bounded length, and the frame in a line.

use std::borrow::Cow;
use std::io::{self, BufRead, Read as _};

use dermis_golden::data::frame::Frame;
use dermis_golden::data::recording::RecordedFrame;
use dermis_golden::data::text::{decoded, Form, Layout, LeftOut, Line, NoReadings, Read, Reader, Stated, TextFrame};
use dermis_golden::result::flags::Flag;
use dermis_golden::spec::sensor::Sensor;
use serde_json::Value;

/// Longest input line in bytes; 65536 taxels of 25 characters take 1.6 MB.
pub const LONGEST_LINE: u64 = 4 << 20;

/// The frame in a line.
#[derive(Clone, Debug, PartialEq)]
pub struct LineFrame {
    /// Null if the line has none.
    pub id: Value,
    /// With the time that the line states.
    pub frame: Frame,
    /// Whether a character may be lost, [`TextFrame::doubt`].
    pub doubtful: bool,
}

impl LineFrame {
    /// The flag of a result with this frame, if there is one.
    pub fn flag(&self) -> Option<Flag> {
        self.doubtful.then_some(Flag::TornFrame)
    }
}

/// Why a line holds no frame, with its id if that could be read.
#[derive(Clone, Debug, PartialEq)]
pub struct NoFrame {
    /// Null if the line has none.
    pub id: Value,
    /// What is wrong with the line.
    pub reason: String,
}

/// How a line was read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Piece {
    /// With its end.
    Line,
    /// It is too long, and skipped to its end.
    TooLong,
    /// The input ends within it.
    Open,
}

impl Piece {
    /// Why it is no line.
    pub fn refusal(self) -> Option<String> {
        match self {
            Piece::Line => None,
            Piece::TooLong => Some(format!("over {LONGEST_LINE} bytes")),
            Piece::Open => Some("the last line has no end, and may be cut within a number".to_owned()),
        }
    }
}

/// Reads a line into `line`; `None` at the end.
pub fn read(input: &mut dyn BufRead, line: &mut Vec<u8>) -> io::Result<Option<Piece>> {
    line.clear();
    // Bounded, so that an endless line cannot exhaust the memory.
    let read = (&mut *input).take(LONGEST_LINE + 1).read_until(b'\n', line)?;
    match line.last() {
        None => return Ok(None),
        Some(b'\n') => return Ok(Some(Piece::Line)),
        Some(_) if read as u64 <= LONGEST_LINE => return Ok(Some(Piece::Open)),
        Some(_) => (),
    }
    line.clear();
    loop {
        let part = input.fill_buf()?;
        let end = part.iter().position(|byte| *byte == b'\n');
        let used = end.map_or(part.len(), |end| end + 1);
        input.consume(used);
        if end.is_some() || used == 0 {
            return Ok(Some(Piece::TooLong));
        }
    }
}

/// The frame in a line of this number, or why there is none.
pub type Brought = (u64, Result<LineFrame, NoFrame>);

/// The frames of a stream's lines, of JSON or of numbers: [`dermis_golden::data::text`]. Each line is a frame, and the first ones with
/// numbers decide their layout.
pub struct Frames {
    reader: Reader,
    sensor: Sensor,
    /// The layout of the lines so far, and in words.
    layout: Option<Layout>,
    shown: Option<String>,
    notes: Vec<String>,
}

impl Frames {
    /// Of lines whose layout is `stated`, but for the form: each is a frame.
    pub fn new(sensor: &Sensor, stated: Stated) -> Frames {
        let reader = Reader::new([sensor.rows, sensor.cols], Stated { form: Some(Form::Line), ..stated });
        Frames { reader, sensor: sensor.clone(), layout: None, shown: None, notes: Vec::new() }
    }

    /// What is to be said of the last lines: headers, or a layout that is not plain.
    pub fn note(&mut self) -> Option<String> {
        let notes = std::mem::take(&mut self.notes);
        (!notes.is_empty()).then(|| notes.join("; "))
    }

    /// Whether lines wait for those that follow to show the layout.
    pub fn is_waiting(&self) -> bool {
        self.reader.is_waiting()
    }

    /// The next line, and what it brought, it or lines before that waited; nothing for a comment, a header, and a line that waits.
    pub fn push(&mut self, line: &[u8], number: u64) -> Vec<Brought> {
        let text = match std::str::from_utf8(line) {
            Ok(text) => text.into(),
            Err(_) => Cow::Owned(decoded(line)),
        };
        let own = usize::try_from(number).unwrap_or(usize::MAX);
        let read = self.reader.push(Line { number: own, text: &text });
        self.brought(read, number)
    }

    /// The same of a frame whose values are known, in place of a line of this number.
    pub fn push_values(&mut self, frame: RecordedFrame, number: u64) -> Vec<Brought> {
        let mut brought = self.settle();
        let RecordedFrame { time_ns, stress_MPa, .. } = frame;
        let own = self.checked(Value::Null, number, stress_MPa).map(|(id, frame)| {
            // Beyond the times that a frame may have it has none.
            LineFrame { id, frame: Frame { time_ns: i64::try_from(time_ns).ok(), ..frame }, doubtful: false }
        });
        brought.push((number, own));
        brought
    }

    /// A piece that is no line, for this reason: what those before it bring that wait, then its refusal.
    pub fn refuse(&mut self, number: u64, reason: String) -> Vec<Brought> {
        let mut brought = self.settle();
        brought.push((number, Err(NoFrame { id: Value::Null, reason })));
        brought
    }

    /// No line follows for now: what those bring that wait.
    pub fn settle(&mut self) -> Vec<Brought> {
        let read = self.reader.settle();
        self.brought(read, 0)
    }

    /// No line follows: what those bring that wait, and lines that were a header if frames had followed.
    pub fn finish(&mut self) -> Vec<Brought> {
        let read = self.reader.finish();
        self.brought(read, 0)
    }

    /// What lines brought, the last of which is `number`.
    fn brought(&mut self, read: Vec<Read>, number: u64) -> Vec<Brought> {
        let mut brought = Vec::new();
        for read in read {
            match read {
                Read::Header(line) => self.notes.push(format!("line {line} is a header")),
                Read::LeftOut(LeftOut { id, reason }) => {
                    let line = reason.line.map_or(number, |line| line as u64);
                    let reason = NoReadings { line: None, ..reason }.to_string();
                    brought.push((line, Err(NoFrame { id, reason })));
                }
                Read::Frame(frame) => brought.push((frame.line as u64, self.frame(frame))),
            }
        }
        if self.reader.layout() != self.layout.as_ref() {
            self.layout = self.reader.layout().cloned();
            let first = brought.first().map_or(number, |(line, _)| *line);
            self.note_layout(first);
        }
        brought
    }

    /// Notes the layout of the lines from `first` on, unless in words it is that of those before.
    fn note_layout(&mut self, first: u64) {
        let Some(layout) = &self.layout else { return };
        // What stands above the line was not the header of a file.
        let mut shown = layout.clone();
        shown.first_line = 1;
        let shown = shown.to_string();
        if self.shown.as_ref() == Some(&shown) {
            return;
        }
        if !layout.is_plain() {
            self.notes.push(format!("lines from {first} on: {shown}"));
        }
        self.shown = Some(shown);
    }

    fn frame(&self, frame: TextFrame) -> Result<LineFrame, NoFrame> {
        let TextFrame { id, readings, time_ns, resultant_N, line, doubt, .. } = frame;
        let (id, frame) = self.checked(id, line as u64, readings)?;
        Ok(LineFrame { id, frame: Frame { resultant_N, time_ns, ..frame }, doubtful: doubt.is_some() })
    }

    /// The frame of these readings, with the name that its id, or without one the number of its line gives it.
    fn checked(&self, id: Value, line: u64, readings: Vec<f64>) -> Result<(Value, Frame), NoFrame> {
        let name = match &id {
            Value::Null => format!("line {line}"),
            Value::String(name) => name.clone(),
            other => other.to_string(),
        };
        match Frame::from_stress(&name, &self.sensor, readings) {
            Ok(frame) => Ok((id, frame)),
            Err(error) => Err(NoFrame { id, reason: error.to_string() }),
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
        let mut frames = Frames::new(&small(), Stated::default());
        let mut read = frames.push(text.as_bytes(), number);
        read.extend(frames.finish());
        let [(line, own)] = <[Brought; 1]>::try_from(read).unwrap();
        assert_eq!(line, number);
        own.map(|LineFrame { id, frame, .. }| (id, frame))
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
        assert_eq!((frames.push(b"a,b,c,d", 1), frames.note().as_deref()), (vec![], Some("line 1 is a header")));
        assert_eq!((frames.push(b"# a remark", 2), frames.note()), (vec![], None));
        assert!(matches!(frames.push(b"5;2;3;4", 3)[..], [(3, Ok(_))]));
        let layout = "lines from 3 on: a frame per line, separated by semicolons, readings in columns 1 to 4";
        assert_eq!(frames.note().as_deref(), Some(layout));
        let [(4, Err(other))] = &frames.push(b"1,2,3,4", 4)[..] else { panic!() };
        assert_eq!(
            other.reason,
            "1 values, wanted 4; this line is separated by commas, those before are separated by semicolons"
        );
        // Latin-1.
        assert!(matches!(frames.push(b"1;2;3;4\xb0C", 5)[..], [(5, Err(_))]));
    }

    #[test]
    fn lines_that_wait_are_brought_in_order_with_their_layout() {
        let mut frames = Frames::new(&small(), Stated::default());
        for (number, line) in [&b"100,1,2,3,4"[..], b"110,2,1,3,4", b"120,1,2,3,4"].into_iter().enumerate() {
            assert_eq!(frames.push(line, number as u64 + 1), vec![]);
        }
        assert!(frames.is_waiting());
        let times: Vec<(u64, Option<i64>)> =
            frames.settle().into_iter().map(|(line, own)| (line, own.unwrap().frame.time_ns)).collect();
        assert_eq!(times, [(1, Some(100_000_000)), (2, Some(110_000_000)), (3, Some(120_000_000))]);
        let layout =
            "lines from 1 on: a frame per line, separated by commas, time in column 1 (ms), readings in columns 2 to 5";
        assert_eq!((frames.is_waiting(), frames.note().as_deref()), (false, Some(layout)));
    }

    #[test]
    fn a_line_that_is_too_long_is_skipped() {
        let long = "1,".repeat(LONGEST_LINE as usize) + "\n";
        let text = format!("first\n{long}second\nlast");
        let (mut input, mut line) = (text.as_bytes(), Vec::new());
        assert_eq!(read(&mut input, &mut line).unwrap(), Some(Piece::Line));
        assert_eq!(read(&mut input, &mut line).unwrap(), Some(Piece::TooLong));
        assert!(line.is_empty());
        assert_eq!(read(&mut input, &mut line).unwrap(), Some(Piece::Line));
        assert_eq!(line, b"second\n");
        assert_eq!(read(&mut input, &mut line).unwrap(), Some(Piece::Open));
        assert_eq!(read(&mut input, &mut line).unwrap(), None);
    }
}
