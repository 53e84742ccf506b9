//! Frames from lines: of a whole text, or line by line as a stream brings them.

use std::borrow::Cow;

use serde::Deserialize;
use serde_json::value::RawValue;
use serde_json::Value;

use super::layout::has_numbers;
use super::time::{is_date, TimeUnit};
use crate::plain_words::JsonError;

use super::{reading, shown, Form, Layout, Line, NoReadings, Separator, Stated};

/// Lines of another layout in a row after which a stream is taken to have it.
const CHANGES_AFTER: usize = 3;
/// Lines of a stream from which its layout is found, and again with each of them.
const BEGIN: usize = 8;
/// Lines before the first frame that are kept, to be named if none comes.
const MOST_HEADER: usize = 64;
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
    /// Whether a reading may be another one than that which was sent: see [`Reader`].
    pub doubtful: bool,
}

/// What a line brought.
#[derive(Clone, Debug, PartialEq)]
pub enum Read {
    /// The last line of a frame.
    Frame(TextFrame),
    /// The line of this number stands before the first readings, with names.
    Header(usize),
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
    /// The last line has no end and may be cut within a number, in words.
    pub may_be_cut: Option<String>,
}

/// A line of JSON.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Request<'t> {
    #[serde(default)]
    id: Value,
    stress_MPa: Vec<Option<f64>>,
    /// Seconds since any moment, milliseconds since 1970, or ISO 8601.
    /// As it is written: a floating-point number would round the nanoseconds of a date.
    #[serde(default, borrow, alias = "time", alias = "time_s", alias = "t")]
    timestamp: Option<&'t RawValue>,
    #[serde(default)]
    time_ns: Option<i64>,
    #[serde(default)]
    resultant_N: Option<[f64; 3]>,
}

/// Number and text of a line.
type Owned = (usize, String);

/// Half a day in ns: a time of day that falls by more has passed midnight.
const HALF_DAY_NS: i64 = 43_200_000_000_000;

/// Turns lines into frames of one array.
///
/// The readings of a frame may be others than those that were sent, [`TextFrame::doubtful`], where numbers are written so that a
/// digit that is lost does not show, as it does in a fixed number of decimals or in numbers that are filled with zeros, and
///
/// - one of the last hundred lines has lost characters, or
/// - one reading has changed by far more than all others, and with one more character its number would be nearly that before.
///
/// ```
/// use dermis_golden::data::text::{Line, Read, Reader, Stated};
///
/// let doubtful = |lines: [&str; 3]| {
///     let mut reader = Reader::new([2, 2], Stated::default());
///     let read = |(k, text)| reader.push(Line { number: k + 1, text });
///     matches!(lines.into_iter().enumerate().flat_map(read).last(), Some(Read::Frame(frame)) if frame.doubtful)
/// };
/// // The second line has lost a separator; the third may have lost a digit of 12.
/// assert!(doubtful(["12,3,4,5", "12,34,5", "2,3,4,5"]));
/// assert!(!doubtful(["12,3,4,5", "12,3,4,5", "12,4,4,5"]));
/// assert!(!doubtful(["0012,0003,0004,0005", "0012,00030004,0005", "0002,0003,0004,0005"]));
/// // The first reading may have been 0.161295.
/// assert!(doubtful(["0.161,0.2,0.31,0.4", "0.161294,0.201,0.311,0.402", "0.61295,0.202,0.312,0.401"]));
/// // All change, or one by what no character explains.
/// assert!(!doubtful(["0.161,0.2,0.31,0.4", "0.161294,0.201,0.311,0.402", "0.61295,0.402,0.612,0.801"]));
/// assert!(!doubtful(["0.161,0.2,0.31,0.4", "0.161294,0.201,0.311,0.402", "0.83295,0.202,0.312,0.401"]));
/// ```
#[derive(Clone, Debug)]
pub struct Reader {
    shape: [usize; 2],
    stated: Stated,
    layout: Option<Layout>,
    /// The last lines of a stream, those that did not fit.
    other: Vec<Owned>,
    /// The first lines of a stream, at most [`BEGIN`], those of a header above them not counted.
    begin: Vec<Owned>,
    /// How many of them, the last ones, wait for further lines to show the layout.
    waiting: usize,
    /// Lines wait no more: none came for some time, or many have not shown the layout.
    hurried: bool,
    /// Lines without numbers before the first frame, and the last one of them; a frame shows that they are a header.
    header: Vec<NoReadings>,
    names: Option<Owned>,
    /// A frame was read.
    has_frames: bool,
    /// Midnights that the times of day have passed, and the last of these.
    day: (i64, i64),
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
    /// Readings of the last frame of a line.
    before: Vec<f64>,
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
    let last = lines.last().copied().filter(|_| !text.ends_with('\n'));
    let mut read = TextFrames { layout, frames: Vec::new(), left_out: Vec::new(), may_be_cut: None };
    // Before the first readings stands a header; a line of numbers there is one that does not fit.
    let is_header = |line: &Line| {
        line.number < first_line && !is_json(line) && read.layout.as_ref().is_none_or(|layout| layout.is_header(line))
    };
    let own: Vec<Line> = lines.into_iter().filter(|line| !is_header(line)).collect();
    for line in own {
        read.add(reader.push(line));
    }
    read.add(reader.finish());
    read.may_be_cut = last.and_then(|last| read.cut_within(&last));
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
                Read::Header(_) => (),
            }
        }
    }

    /// That a line without end, the last one, may be cut, in words: editors leave out the last end of a line too.
    fn cut_within(&self, line: &Line) -> Option<String> {
        let is_read = self.frames.last().is_some_and(|frame| frame.line == line.number);
        let layout = self.layout.as_ref().filter(|_| is_read && !line.text.trim_start().starts_with('{'))?;
        let cell = layout.cut_cell(line.text)?;
        Some(format!("line {} has no end: its last value, {}, may be cut", line.number, shown(&cell)))
    }

    /// What was left out, in words: how many, and the first three; `None` if nothing was.
    pub fn left_out_text(&self) -> Option<String> {
        let named: Vec<String> = self.left_out.iter().take(3).map(|left_out| left_out.reason.to_string()).collect();
        let more = if self.left_out.len() > named.len() { "; …" } else { "" };
        (!named.is_empty()).then(|| format!("{} left out: {}{more}", self.left_out.len(), named.join("; ")))
    }
}

impl Reader {
    /// Before the first line. The layout is found from the first line with readings; where that leaves it open, as beside a time,
    /// lines wait for those that follow.
    pub fn new(shape: [usize; 2], stated: Stated) -> Reader {
        let (layout, blocks, time_ns, cut) = (None, None, None, None);
        Reader {
            shape,
            stated,
            layout,
            other: Vec::new(),
            begin: Vec::new(),
            waiting: 0,
            hurried: false,
            header: Vec::new(),
            names: None,
            has_frames: false,
            day: (0, 0),
            decided: false,
            blocks,
            rows: Vec::new(),
            first_line: 0,
            time_ns,
            last: 0,
            cut,
            before: Vec::new(),
            hides: false,
        }
    }

    /// The layout, once it is found.
    pub fn layout(&self) -> Option<&Layout> {
        self.layout.as_ref()
    }

    /// Whether a digit may be lost where one of the last lines has lost characters.
    fn is_after_loss(&self) -> bool {
        self.hides && self.cut.is_some_and(|line| self.last - line <= DOUBTED)
    }

    /// Whether lines wait for those that follow; [`Reader::settle`] ends that.
    pub fn is_waiting(&self) -> bool {
        self.waiting > 0
    }

    /// The next line; a blank line, a part of a frame or a line that waits brings nothing, the line that ends the waiting what all
    /// brought.
    pub fn push(&mut self, line: Line) -> Vec<Read> {
        let read = self.take(line);
        self.note(read)
    }

    /// No line follows for now: those that wait are read in the layout that they show.
    pub fn settle(&mut self) -> Vec<Read> {
        let read = self.settled();
        // A header alone shows nothing of the lines behind it.
        self.hurried |= read.iter().any(|read| !matches!(read, Read::Header(_)));
        self.note(read)
    }

    /// The end of the text: what waits, what is left of a frame that is not complete, and a header behind which no frame stands.
    pub fn finish(&mut self) -> Vec<Read> {
        let mut read = self.settle();
        let wanted = self.layout.as_ref().map_or(0, |layout| layout.lines);
        read.extend(self.cut(wanted, self.last));
        if !self.has_frames {
            let none = std::mem::take(&mut self.header).into_iter();
            let left_out = none.map(|reason| Read::LeftOut(LeftOut { id: Value::Null, reason }));
            read.splice(..0, left_out);
        }
        read
    }

    /// Remembers what lines brought.
    fn note(&mut self, read: Vec<Read>) -> Vec<Read> {
        if read.iter().any(|read| matches!(read, Read::LeftOut(left_out) if left_out.reason.cut)) {
            self.cut = Some(self.last);
        }
        self.has_frames |= read.iter().any(|read| matches!(read, Read::Frame(_)));
        read
    }

    fn take(&mut self, line: Line) -> Vec<Read> {
        let line = Line { text: line.text.trim_start_matches('\u{feff}'), ..line };
        if line.number <= self.stated.skip_rows || !line.may_hold_readings() {
            return Vec::new();
        }
        if line.text.trim_start().starts_with('{') {
            let mut read = self.settled();
            self.last = line.number;
            self.hides = true;
            read.push(self.json_frame(&line));
            return read;
        }
        match self.decided {
            true => self.read(&line),
            false => self.begin(&line),
        }
    }

    /// A line of a stream, whose layout is found from its first lines.
    fn begin(&mut self, line: &Line) -> Vec<Read> {
        if self.layout.is_some() && self.begin.len() >= BEGIN {
            return self.read(line);
        }
        let is_first = self.layout.is_none() && self.waiting == 0;
        if is_first && !holds_numbers(line) {
            self.last = line.number;
            return vec![self.header(line)];
        }
        if self.begin.len() >= BEGIN {
            self.begin.remove(0);
        }
        self.begin.push((line.number, line.text.to_owned()));
        if self.layout.is_some() {
            return self.again(line);
        }
        self.waiting += 1;
        let alone = Layout::of_lines(&[*line], self.shape, &self.stated);
        match alone.is_ok_and(|layout| layout.is_sure()) || self.hurried || self.waiting >= BEGIN {
            true => self.settled(),
            false => Vec::new(),
        }
    }

    /// A line before the first frame without numbers: of a header, if a frame follows.
    fn header(&mut self, line: &Line) -> Read {
        let [rows, cols] = self.shape;
        let reason = NoReadings::of_line(line, format!("no numbers, wanted {} of {rows}x{cols} taxels", rows * cols));
        if self.has_frames || self.header.len() >= MOST_HEADER {
            return Read::LeftOut(LeftOut { id: Value::Null, reason });
        }
        self.header.push(reason);
        self.names = Some((line.number, line.text.to_owned()));
        Read::Header(line.number)
    }

    /// The layout that the first lines show.
    fn of_begin(&self) -> Result<Layout, NoReadings> {
        let lines = self.names.iter().chain(&self.begin);
        let lines: Vec<Line> = lines.map(|(number, text)| Line { number: *number, text }).collect();
        Layout::of_lines(&lines, self.shape, &self.stated)
    }

    /// A further line of those from which the layout is found: it may show that the lines before left it open.
    fn again(&mut self, line: &Line) -> Vec<Read> {
        let before = self.layout.take();
        let was_sure = before.as_ref().is_some_and(Layout::is_sure);
        match self.of_begin() {
            Ok(now) if !was_sure || before.as_ref().is_some_and(|before| before.reads_as(&now)) => {
                self.layout = Some(now);
                self.read(line)
            }
            Err(reason) if !was_sure => {
                self.last = line.number;
                vec![Read::LeftOut(LeftOut {
                    id: Value::Null,
                    reason: NoReadings { line: Some(line.number), ..reason },
                })]
            }
            _ => {
                self.layout = before;
                self.read(line)
            }
        }
    }

    /// What the lines bring that wait, in the layout that they show.
    fn settled(&mut self) -> Vec<Read> {
        let waiting = std::mem::take(&mut self.waiting);
        if waiting == 0 {
            return Vec::new();
        }
        let own = self.begin[self.begin.len() - waiting..].to_vec();
        let lines = own.iter().map(|(number, text)| Line { number: *number, text });
        let last = lines.clone().next_back().filter(|_| waiting > 1);
        // Lines of another layout before the first that shows its own do not spoil that.
        let found = self.of_begin().or_else(|error| {
            let alone = last.and_then(|line| Layout::of_lines(&[line], self.shape, &self.stated).ok());
            alone.filter(Layout::is_sure).ok_or(error)
        });
        let layout = match found {
            Ok(layout) if layout.may_be_numbers && waiting == 1 => {
                self.begin.clear();
                return lines.map(|line| self.header(&line)).collect();
            }
            Ok(layout) => layout,
            Err(error) => {
                self.hurried |= self.begin.len() >= BEGIN;
                self.last = own.last().map_or(self.last, |(number, _)| *number);
                let reason = |line: Line| {
                    // What all lines leave open is more than what one does.
                    let alone = Layout::of_lines(&[line], self.shape, &self.stated).err().filter(|own| !own.open);
                    NoReadings { line: Some(line.number), ..alone.unwrap_or_else(|| error.clone()) }
                };
                return lines.map(|line| Read::LeftOut(LeftOut { id: Value::Null, reason: reason(line) })).collect();
            }
        };
        let first_line = layout.first_line;
        self.layout = Some(layout);
        lines.flat_map(|line| if line.number < first_line { self.above(&line) } else { self.read(&line) }).collect()
    }

    /// A line above the first one with readings.
    fn above(&mut self, line: &Line) -> Vec<Read> {
        match self.layout.as_ref().is_some_and(|layout| layout.is_header(line)) {
            true => vec![self.header(line)],
            false => self.read(line),
        }
    }

    /// A line in the layout that is found.
    fn read(&mut self, line: &Line) -> Vec<Read> {
        let is_apart = self.last > 0 && line.number > self.last + 1;
        let before = std::mem::replace(&mut self.last, line.number);
        let Some(layout) = self.layout.clone() else { return Vec::new() };
        match layout.form {
            Form::Line => vec![self.line(&layout, line)],
            Form::Grid => self.row(&layout, line, before, is_apart),
        }
    }

    /// The time of a line, if it has one.
    ///
    /// # Errors
    /// A cell that is no time.
    fn time(&mut self, layout: &Layout, line: &Line, cells: &[Cow<str>]) -> Result<Option<i64>, NoReadings> {
        let Some((column, unit)) = layout.time else { return Ok(None) };
        let Some(cell) = cells.get(column).filter(|cell| !reading(cell).is_some_and(f64::is_nan)) else {
            return Ok(None);
        };
        let own = unit.ns(cell).ok_or_else(|| {
            let none =
                NoReadings::of_cell(line, column + 1, format!("{} is no time as the others ({unit})", shown(cell)));
            none.cut()
        })?;
        Ok(Some(self.over_midnight(unit, own)))
    }

    /// A time in ns; one of day goes on behind midnight.
    fn over_midnight(&mut self, unit: TimeUnit, own: i64) -> i64 {
        if unit != TimeUnit::Iso || is_date(own) {
            return own;
        }
        let (days, last) = self.day;
        let days = days + i64::from(last - own > HALF_DAY_NS);
        self.day = (days, own);
        own + days * 2 * HALF_DAY_NS
    }

    /// A line that is a frame.
    fn line(&mut self, layout: &Layout, line: &Line) -> Read {
        let cells = layout.split(line.text);
        let read = layout.readings_of(line, &cells);
        match read.and_then(|readings| Ok((readings, self.time(layout, line, &cells)?))) {
            Ok((readings, time_ns)) => {
                self.other.clear();
                self.hides |= layout.hides_a_lost_digit(&cells);
                let doubtful = self.is_after_loss() || layout.may_lack_a_character(&cells, &self.before, &readings);
                self.before.clone_from(&readings);
                Read::Frame(TextFrame {
                    first_line: line.number,
                    line: line.number,
                    id: Value::Null,
                    time_ns,
                    readings,
                    resultant_N: None,
                    doubtful,
                })
            }
            Err(reason) => self.of_another_layout(layout, line, reason),
        }
    }

    /// A line that does not fit: a frame if the lines before it had the same other layout.
    fn of_another_layout(&mut self, layout: &Layout, line: &Line, mut reason: NoReadings) -> Read {
        if let Some(own) = self.changed(layout, line) {
            // Those before were whole.
            self.cut = None;
            self.layout = Some(own.clone());
            return self.line(&own, line);
        }
        let alone = Layout::of_lines(&[*line], self.shape, &self.stated).ok();
        if let Some(own) = alone.filter(|own| own.separator != layout.separator) {
            let (now, before) = (own.separator, layout.separator);
            reason.reason += &format!("; this line is separated by {now}, those before are separated by {before}");
        }
        Read::LeftOut(LeftOut { id: Value::Null, reason })
    }

    /// The layout of a line and those before it that did not fit either, where they are so many that it has changed.
    fn changed(&mut self, layout: &Layout, line: &Line) -> Option<Layout> {
        if self.decided {
            return None;
        }
        self.other.push((line.number, line.text.to_owned()));
        if self.other.len() < CHANGES_AFTER {
            return None;
        }
        let lines: Vec<Line> = self.other.iter().map(|(number, text)| Line { number: *number, text }).collect();
        let own = Layout::of_lines(&lines, self.shape, &self.stated).ok().filter(|own| {
            let fits = |line: &Line| own.readings_of(line, &own.split(line.text)).is_ok();
            !own.is_like(layout) && lines.iter().all(fits)
        });
        match own {
            Some(own) => {
                (self.begin, self.names) = (std::mem::take(&mut self.other), None);
                Some(own)
            }
            None => {
                self.other.remove(0);
                None
            }
        }
    }

    /// The frame in a line of JSON.
    fn json_frame(&mut self, line: &Line) -> Read {
        let taxels = self.shape[0] * self.shape[1];
        let left_out = |id: Value, reason: String, cut: bool| {
            Read::LeftOut(LeftOut { id, reason: NoReadings { cut, ..NoReadings::of_line(line, reason) } })
        };
        let text = without_nan(line.text);
        let request: Request = match serde_json::from_str(&text) {
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
        let cell = request.timestamp.map_or("", RawValue::get).trim_matches('"');
        let unit = TimeUnit::of_column(&[cell], None);
        let of_cell = unit.and_then(|unit| Some(self.over_midnight(unit, unit.ns(cell)?)));
        let readings = request.stress_MPa.into_iter().map(|reading| reading.unwrap_or(f64::NAN)).collect();
        Read::Frame(TextFrame {
            first_line: line.number,
            line: line.number,
            id: request.id,
            time_ns: request.time_ns.or(of_cell),
            readings,
            resultant_N: request.resultant_N,
            doubtful: self.is_after_loss(),
        })
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
        let mut row = layout.readings_of(line, &cells);
        if self.rows.is_empty() {
            self.first_line = line.number;
            self.time_ns = None;
            row = row.and_then(|row| {
                self.time_ns = self.time(layout, line, &cells)?;
                Ok(row)
            });
        }
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
                    doubtful: self.is_after_loss(),
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
        let short = NoReadings { line: Some(before), cell: None, reason, cut: true, open: false };
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
