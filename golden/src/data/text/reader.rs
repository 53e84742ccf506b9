//! Frames from lines: of a whole text, or line by line as a stream brings them.

use serde::Deserialize;
use serde_json::Value;

use super::layout::has_numbers;
use super::time::TimeUnit;
use crate::plain_words::JsonError;

use super::{Form, Layout, Line, NoReadings, Separator, Stated};

/// Lines of another layout in a row after which a stream is taken to have it.
const CHANGES_AFTER: usize = 3;
/// Lines after one that has lost characters in which one more may be lost where it does not show.
const DOUBTED: usize = 100;

/// A frame of a text.
#[derive(Clone, Debug, PartialEq)]
pub struct TextFrame {
    /// Number of its first line, from 1.
    pub first_line: usize,
    /// Number of its last line.
    pub line: usize,
    /// `id` of a line of JSON.
    pub id: Value,
    /// Time in ns, since 1970 ([`super::is_date`]) or since a moment that the file does not say, if there is one.
    pub time_ns: Option<i64>,
    /// Readings, row-major; NaN where one is missing.
    pub readings: Vec<f64>,
    /// The true force in N, [x, y, normal], of a line of JSON that states it.
    pub resultant_N: Option<[f64; 3]>,
}

/// What a line brought.
#[derive(Clone, Debug, PartialEq)]
pub enum Read {
    /// The last line of a frame.
    Frame(TextFrame),
    /// A line before the first readings, with names.
    Header,
    /// No frame.
    LeftOut(LeftOut),
}

/// A line, or a frame that begins with it, without readings that can be used.
#[derive(Clone, Debug, PartialEq)]
pub struct LeftOut {
    /// `id` of a line of JSON, as far as it could be read.
    pub id: Value,
    /// Line, cell and reason.
    pub reason: NoReadings,
}

/// All frames of a text.
#[derive(Clone, Debug, PartialEq)]
pub struct TextFrames {
    /// The layout; `None` if all lines are JSON.
    pub layout: Option<Layout>,
    /// The frames in their order.
    pub frames: Vec<TextFrame>,
    /// What holds none.
    pub left_out: Vec<LeftOut>,
}

/// A line of JSON.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Request {
    #[serde(default)]
    id: Value,
    stress_MPa: Vec<Option<f64>>,
    /// Seconds since any moment, milliseconds since 1970, or ISO 8601.
    #[serde(default, alias = "time", alias = "time_s", alias = "t")]
    timestamp: Value,
    #[serde(default)]
    time_ns: Option<i64>,
    #[serde(default)]
    resultant_N: Option<[f64; 3]>,
}

/// Turns lines into frames of one array.
#[derive(Clone, Debug)]
pub struct Reader {
    shape: [usize; 2],
    stated: Stated,
    layout: Option<Layout>,
    /// Layout of the last lines that did not fit, and how many they were; only where it is found from one line.
    other: Option<(Layout, usize)>,
    /// Whether the layout was found from many lines.
    decided: bool,
    /// Whether a blank line ends a frame of a grid; `None` before that shows.
    blocks: Option<bool>,
    /// Rows of the frame that is not complete.
    rows: Vec<Result<Vec<f64>, NoReadings>>,
    /// Line and time of its first row.
    first_line: usize,
    time_ns: Option<i64>,
    /// Number of the last line that was not blank.
    last: usize,
    /// Number of the last line that has lost characters.
    cut: Option<usize>,
    /// Whether numbers of the lines so far are written so that a lost digit does not show.
    hides: bool,
}

/// Reads all frames of a text of an array of `[rows, cols]`.
///
/// ```
/// use dermis_golden::data::text::{frames, Stated};
///
/// let text = "time,a,b,c,d\n0.00,1,2,3,4\n0.01,2,3,4\n0.02,3,4,5,6\n";
/// let read = frames(text, [2, 2], &Stated::default())?;
/// assert_eq!(read.frames[1].readings, [3.0, 4.0, 5.0, 6.0]);
/// assert_eq!(read.frames[1].time_ns, Some(20_000_000));
/// assert_eq!(read.left_out[0].reason.to_string(), "line 3: 4 values, wanted 5");
/// # Ok::<(), dermis_golden::data::text::NoReadings>(())
/// ```
///
/// # Errors
/// No layout, or more than one, that fits; more lines without a frame than frames.
pub fn frames(text: &str, shape: [usize; 2], stated: &Stated) -> Result<TextFrames, NoReadings> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let lines = Line::of_text(text, stated.skip_rows);
    let is_json = |line: &Line| line.text.trim_start().starts_with('{');
    let table: Vec<Line> = lines.iter().copied().filter(|line| !is_json(line)).collect();
    let layout = match table.is_empty() && !lines.is_empty() {
        true => None,
        false => Some(Layout::of_lines(&table, shape, stated)?),
    };
    let mut reader = Reader::new(shape, Stated { skip_rows: 0, ..*stated });
    reader.decided = true;
    reader.blocks = layout.as_ref().map(|layout| layout.blocks);
    let first_line = layout.as_ref().map_or(1, |layout| layout.first_line);
    reader.layout.clone_from(&layout);
    let mut read = TextFrames { layout, frames: Vec::new(), left_out: Vec::new() };
    // Before the first readings stands a header; a line of numbers there is one that does not fit.
    let is_header = |line: &Line| {
        line.number < first_line && !is_json(line) && read.layout.as_ref().is_none_or(|layout| layout.is_header(line))
    };
    let own: Vec<Line> = lines.into_iter().filter(|line| !is_header(line)).collect();
    for line in own {
        read.add(reader.push(line));
    }
    read.add(reader.finish());
    match read.left_out.first() {
        Some(first) if read.left_out.len() > read.frames.len() => Err(first.reason.clone()),
        None if read.frames.is_empty() => Err(NoReadings::of_text("no line with readings")),
        _ => Ok(read),
    }
}

impl TextFrames {
    fn add(&mut self, read: Vec<Read>) {
        for read in read {
            match read {
                Read::Frame(frame) => self.frames.push(frame),
                Read::LeftOut(left_out) => self.left_out.push(left_out),
                Read::Header => (),
            }
        }
    }

    /// What was left out, in words: how many, and the first three; `None` if nothing was.
    pub fn left_out_text(&self) -> Option<String> {
        let named: Vec<String> = self.left_out.iter().take(3).map(|left_out| left_out.reason.to_string()).collect();
        let more = if self.left_out.len() > named.len() { "; …" } else { "" };
        (!named.is_empty()).then(|| format!("{} left out: {}{more}", self.left_out.len(), named.join("; ")))
    }
}

impl Reader {
    /// Before the first line; the layout is found from the first line with readings.
    pub fn new(shape: [usize; 2], stated: Stated) -> Reader {
        let (layout, other, blocks, time_ns, cut) = (None, None, None, None, None);
        Reader {
            shape,
            stated,
            layout,
            other,
            decided: false,
            blocks,
            rows: Vec::new(),
            first_line: 0,
            time_ns,
            last: 0,
            cut,
            hides: false,
        }
    }

    /// The layout, once it is found.
    pub fn layout(&self) -> Option<&Layout> {
        self.layout.as_ref()
    }

    /// Whether the readings of the last line may be others than those that were sent: one of the last hundred lines has lost
    /// characters, and a digit that is lost from these numbers does not show. Written with a fixed number of decimals, or filled
    /// with zeros, they are not in doubt.
    ///
    /// ```
    /// use dermis_golden::data::text::{Line, Reader, Stated};
    ///
    /// let doubtful = |lines: [&str; 3]| {
    ///     let mut reader = Reader::new([2, 2], Stated::default());
    ///     lines.into_iter().enumerate().for_each(|(k, text)| drop(reader.push(Line { number: k + 1, text })));
    ///     reader.is_doubtful()
    /// };
    /// // The second line has lost a separator; the third may have lost a digit of 12.
    /// assert!(doubtful(["12,3,4,5", "12,34,5", "2,3,4,5"]));
    /// assert!(!doubtful(["12,3,4,5", "12,3,4,5", "2,3,4,5"]));
    /// assert!(!doubtful(["0012,0003,0004,0005", "0012,00030004,0005", "0002,0003,0004,0005"]));
    /// ```
    pub fn is_doubtful(&self) -> bool {
        self.hides && self.cut.is_some_and(|line| self.last - line <= DOUBTED)
    }

    /// The next line; a blank line or a part of a frame brings nothing.
    pub fn push(&mut self, line: Line) -> Vec<Read> {
        let read = self.take(line);
        if read.iter().any(|read| matches!(read, Read::LeftOut(left_out) if left_out.reason.cut)) {
            self.cut = Some(self.last);
        }
        read
    }

    fn take(&mut self, line: Line) -> Vec<Read> {
        let line = Line { text: line.text.trim_start_matches('\u{feff}'), ..line };
        if line.number <= self.stated.skip_rows || !line.may_hold_readings() {
            return Vec::new();
        }
        let is_apart = self.last > 0 && line.number > self.last + 1;
        let before = std::mem::replace(&mut self.last, line.number);
        if line.text.trim_start().starts_with('{') {
            self.hides = true;
            return vec![json_frame(&line, self.shape[0] * self.shape[1])];
        }
        if self.layout.is_none() {
            match Layout::of_lines(&[line], self.shape, &self.stated) {
                Ok(layout) if layout.has_numbers_of_columns(&line) => return vec![Read::Header],
                Ok(layout) => self.layout = Some(layout),
                Err(_) if !holds_numbers(&line) => return vec![Read::Header],
                Err(reason) => return vec![Read::LeftOut(LeftOut { id: Value::Null, reason })],
            }
        }
        // Found just now, if not before.
        let Some(layout) = self.layout.clone() else { return Vec::new() };
        match layout.form {
            Form::Line => vec![self.line(&layout, &line)],
            Form::Grid => self.row(&layout, &line, before, is_apart),
        }
    }

    /// The end of the text: what is left of a frame that is not complete.
    pub fn finish(&mut self) -> Vec<Read> {
        let wanted = self.layout.as_ref().map_or(0, |layout| layout.lines);
        self.cut(wanted, self.last)
    }

    /// A line that is a frame.
    fn line(&mut self, layout: &Layout, line: &Line) -> Read {
        let cells = layout.split(line.text);
        let time_ns = layout.time.and_then(|(column, unit)| unit.ns(cells.get(column)?));
        match layout.readings_of(line, &cells) {
            Ok(readings) => {
                self.other = None;
                self.hides |= layout.hides_a_lost_digit(&cells);
                Read::Frame(TextFrame {
                    first_line: line.number,
                    line: line.number,
                    id: Value::Null,
                    time_ns,
                    readings,
                    resultant_N: None,
                })
            }
            Err(reason) => self.of_another_layout(layout, line, reason),
        }
    }

    /// A line that does not fit: a frame if the lines before it had the same other layout.
    fn of_another_layout(&mut self, layout: &Layout, line: &Line, mut reason: NoReadings) -> Read {
        let alone = Layout::of_lines(&[*line], self.shape, &self.stated).ok().filter(|own| !own.is_like(layout));
        let Some(own) = alone else {
            self.other = None;
            return Read::LeftOut(LeftOut { id: Value::Null, reason });
        };
        let like = self.other.take().filter(|(other, _)| other.is_like(&own));
        let count = like.map_or(1, |(_, count)| count + 1);
        if count >= CHANGES_AFTER && !self.decided {
            self.layout = Some(own.clone());
            // Those before were whole.
            self.cut = None;
            return self.line(&own, line);
        }
        if own.separator != layout.separator {
            let (now, before) = (own.separator, layout.separator);
            reason.reason += &format!("; this line is separated by {now}, those before are separated by {before}");
        }
        self.other = Some((own, count));
        Read::LeftOut(LeftOut { id: Value::Null, reason })
    }

    /// A row of a grid; `before` is the number of the line before, and `is_apart` whether a blank line is between.
    fn row(&mut self, layout: &Layout, line: &Line, before: usize, is_apart: bool) -> Vec<Read> {
        let cells = layout.split(line.text);
        let is_heading = layout.is_heading(&cells);
        if is_apart && self.blocks.is_none() {
            self.blocks = Some(self.rows.is_empty());
        }
        let mut read = match is_heading || (is_apart && self.blocks == Some(true)) {
            true => self.cut(layout.lines, before),
            false => Vec::new(),
        };
        if is_heading {
            return read;
        }
        if self.rows.is_empty() {
            self.first_line = line.number;
            self.time_ns = layout.time.and_then(|(column, unit)| unit.ns(cells.get(column)?));
        }
        let row = layout.readings_of(line, &cells);
        self.hides |= row.is_ok() && layout.hides_a_lost_digit(&cells);
        self.rows.push(row);
        if self.rows.len() == layout.lines {
            let rows = std::mem::take(&mut self.rows);
            read.push(match rows.into_iter().collect::<Result<Vec<_>, _>>() {
                Ok(rows) => Read::Frame(TextFrame {
                    first_line: self.first_line,
                    line: line.number,
                    id: Value::Null,
                    time_ns: self.time_ns.take(),
                    readings: rows.concat(),
                    resultant_N: None,
                }),
                Err(reason) => Read::LeftOut(LeftOut { id: Value::Null, reason }),
            });
        }
        read
    }

    /// Ends a frame of a grid that is not complete, after the line `before`.
    fn cut(&mut self, wanted: usize, before: usize) -> Vec<Read> {
        let rows = std::mem::take(&mut self.rows);
        if rows.is_empty() {
            return Vec::new();
        }
        let got = rows.len();
        let reason = format!("the frame ends after {got} of {wanted} rows");
        let short = NoReadings { line: Some(before), cell: None, reason, cut: true };
        vec![Read::LeftOut(LeftOut {
            id: Value::Null,
            reason: rows.into_iter().find_map(Result::err).unwrap_or(short),
        })]
    }
}

/// Whether any separator finds numbers in a line.
fn holds_numbers(line: &Line) -> bool {
    Separator::ALL.into_iter().any(|separator| has_numbers(&separator.cells(line.text)))
}

/// The frame in a line of JSON.
fn json_frame(line: &Line, taxels: usize) -> Read {
    let left_out = |id: Value, reason: String, cut: bool| {
        Read::LeftOut(LeftOut { id, reason: NoReadings { cut, ..NoReadings::of_line(line, reason) } })
    };
    let request: Request = match serde_json::from_str(&without_nan(line.text)) {
        Ok(request) => request,
        Err(error) => {
            let JsonError { column, message, .. } = JsonError::new(&error);
            return left_out(Value::Null, format!("column {column}: {message}"), !error.is_data());
        }
    };
    let got = request.stress_MPa.len();
    if got != taxels {
        return left_out(request.id, format!("stress_MPa has {got} values, wanted {taxels}"), true);
    }
    let cell = match &request.timestamp {
        Value::String(text) => text.clone(),
        other => other.to_string(),
    };
    let of_cell = || TimeUnit::of_column(&[&cell], None)?.ns(&cell);
    let readings = request.stress_MPa.into_iter().map(|reading| reading.unwrap_or(f64::NAN)).collect();
    Read::Frame(TextFrame {
        first_line: line.number,
        line: line.number,
        id: request.id,
        time_ns: request.time_ns.or_else(of_cell),
        readings,
        resultant_N: request.resultant_N,
    })
}

/// JSON with `null` for `NaN`, which Python writes and JSON does not have; texts in quotes stay.
pub(crate) fn without_nan(text: &str) -> std::borrow::Cow<'_, str> {
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
