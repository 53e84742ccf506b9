//! Frames from lines: of a whole text, or line by line as a stream brings them.

use std::borrow::Cow;

use serde_json::Value;

use super::json::{self, without_nan, Request};
use super::layout::has_numbers;
use super::lost::LostCharacters;
use super::read::{LeftOut, Read, TextFrame};
use super::time::{is_date, TimeUnit};
use super::{reading, shown, Form, Layout, Line, NoReadings, Separator, Stated};

/// Lines of another layout in a row after which a stream is taken to have it.
const CHANGES_AFTER: usize = 3;
/// Lines of a stream from which its layout is found, and again with each of them.
const BEGIN: usize = 8;
/// Lines before the first frame that are kept, to be named if none comes.
const MOST_HEADER: usize = 64;

/// Number and text of a line.
type Owned = (usize, String);

/// Half a day in ns: a time of day that falls by more has passed midnight.
const HALF_DAY_NS: i64 = 43_200_000_000_000;

/// Turns lines into frames of one array.
///
/// The readings of a frame may be others than those that were sent, [`TextFrame::doubt`], where numbers are written so that a digit
/// that is lost does not show, as it does in a fixed number of decimals or in numbers that are filled with zeros, and
///
/// - a line at most a hundred lines away has lost characters, or
/// - a reading has changed by far more than all others (of a grid: one for each of its lines), and with one more character its number
///   would be nearly that before. The first frame, unless it is JSON, is compared with the second, for which it waits;
///   [`Reader::settle`] ends that.
///
/// ```
/// use dermis_golden::data::text::{Line, Read, Reader, Stated};
///
/// // The lines whose frames are in doubt.
/// let doubted = |lines: [&str; 3]| -> Vec<usize> {
///     let mut reader = Reader::new([3, 3], Stated::default());
///     let mut read: Vec<Read> =
///         lines.into_iter().enumerate().flat_map(|(k, text)| reader.push(Line { number: k + 1, text })).collect();
///     read.extend(reader.finish());
///     let doubted = read.iter().filter_map(|read| match read {
///         Read::Frame(frame) if frame.doubt.is_some() => Some(frame.line),
///         _ => None,
///     });
///     doubted.collect()
/// };
/// // The second line has lost a separator; the others may have lost a digit.
/// assert_eq!(doubted(["12,3,4,5,1,2,3,4,9", "12,3,4,51,2,3,4,9", "2,3,4,5,1,2,3,4,9"]), [1, 3]);
/// assert_eq!(doubted(["12,3,4,5,1,2,3,4,9", "12,3,4,5,1,2,3,4,9", "12,4,4,5,1,2,3,4,9"]), [0; 0]);
/// // Filled with zeros, no number can have lost one.
/// assert_eq!(doubted(["12,03,04,05,01,02,03,04,09", "12,03,0405,01,02,03,04,09", "02,03,04,05,01,02,03,04,09"]), [0; 0]);
/// // The first reading was 13 before, or is 12 behind.
/// assert_eq!(doubted(["12,3,4,5,1,2,3,4,9", "13,3,4,6,1,2,3,4,9", "2,3,4,6,1,2,3,5,9"]), [3]);
/// assert_eq!(doubted(["2,30,4,5,1,2,3,4,9", "12,30,4,5,1,2,3,4,9", "13,30,4,6,1,2,3,4,9"]), [1]);
/// // All change, or one by what no character explains.
/// assert_eq!(doubted(["12,3,4,5,1,2,3,4,9", "13,3,4,6,1,2,3,4,9", "2,7,9,1,6,8,9,9,1"]), [0; 0]);
/// assert_eq!(doubted(["12,3,4,5,1,2,3,4,9", "13,3,4,6,1,2,3,4,9", "29,3,4,6,1,2,3,5,9"]), [0; 0]);
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
    /// Their lines.
    written: String,
    /// Finds numbers that have lost a character.
    lost: LostCharacters,
}

impl Reader {
    /// Before the first line. The layout is found from the first line with readings; where that leaves it open, as beside a time,
    /// lines wait for those that follow.
    pub fn new(shape: [usize; 2], stated: Stated) -> Reader {
        let (layout, blocks, time_ns) = (None, None, None);
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
            written: String::new(),
            lost: LostCharacters::default(),
        }
    }

    /// Of a text whose layout was found from many lines; `None` where all are JSON.
    pub(super) fn of_layout(shape: [usize; 2], stated: Stated, layout: Option<Layout>) -> Reader {
        let blocks = layout.as_ref().map(|layout| layout.blocks);
        Reader { decided: true, blocks, layout, ..Reader::new(shape, Stated { skip_rows: 0, ..stated }) }
    }

    /// The layout, once it is found.
    pub fn layout(&self) -> Option<&Layout> {
        self.layout.as_ref()
    }

    /// Whether lines wait for those that follow; [`Reader::settle`] ends that.
    pub fn is_waiting(&self) -> bool {
        self.waiting > 0 || self.lost.is_waiting()
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
        let mut read = self.note(read);
        read.extend(self.lost.waiting());
        read
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

    /// Remembers what lines brought, and judges it.
    fn note(&mut self, read: Vec<Read>) -> Vec<Read> {
        self.has_frames |= read.iter().any(|read| matches!(read, Read::Frame(_)));
        self.lost.judge(read, self.last, self.layout.as_ref())
    }

    fn take(&mut self, line: Line) -> Vec<Read> {
        let line = Line { text: line.text.trim_start_matches('\u{feff}'), ..line };
        if line.number <= self.stated.skip_rows || !line.may_hold_readings() {
            return Vec::new();
        }
        if json::is_json(line.text) {
            let mut read = self.settled();
            self.last = line.number;
            self.lost.note_json();
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
                self.lost.note(layout, &cells);
                Read::Frame(TextFrame { time_ns, readings, ..TextFrame::of_line(line) })
            }
            Err(reason) => self.of_another_layout(layout, line, reason),
        }
    }

    /// A line that does not fit: a frame if the lines before it had the same other layout.
    fn of_another_layout(&mut self, layout: &Layout, line: &Line, mut reason: NoReadings) -> Read {
        if let Some(own) = self.changed(layout, line) {
            // Those before were whole.
            self.lost.forget_cut();
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
        let new = Layout::of_lines(&lines, self.shape, &self.stated).ok().filter(|new| {
            let fits = |line: &Line| new.readings_of(line, &new.split(line.text)).is_ok();
            !new.is_like(layout) && lines.iter().all(fits)
        });
        match new {
            Some(new) => {
                (self.begin, self.names) = (std::mem::take(&mut self.other), None);
                Some(new)
            }
            None => {
                self.other.remove(0);
                None
            }
        }
    }

    /// The frame in a line of JSON.
    fn json_frame(&mut self, line: &Line) -> Read {
        let text = without_nan(line.text);
        let request = match Request::of(&text, line.number, self.shape[0] * self.shape[1]) {
            Ok(request) => request,
            Err(left_out) => return Read::LeftOut(left_out),
        };
        let of_cell = request.time().map(|(unit, own)| self.over_midnight(unit, own));
        Read::Frame(TextFrame {
            id: request.id,
            time_ns: request.time_ns.or(of_cell),
            readings: request.stress_MPa.into_iter().map(|reading| reading.unwrap_or(f64::NAN)).collect(),
            resultant_N: request.resultant_N,
            ..TextFrame::of_line(line)
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
        if row.is_ok() {
            self.lost.note(layout, &cells);
        }
        self.rows.push(row);
        self.written += line.text;
        self.written.push('\n');
        if self.rows.len() == layout.lines {
            let (rows, written) = (std::mem::take(&mut self.rows), std::mem::take(&mut self.written));
            read.push(match rows.into_iter().collect::<Result<Vec<_>, _>>() {
                Ok(rows) => Read::Frame(TextFrame {
                    first_line: self.first_line,
                    time_ns: self.time_ns.take(),
                    readings: rows.concat(),
                    written,
                    ..TextFrame::of_line(line)
                }),
                Err(reason) => Read::LeftOut(LeftOut { id: Value::Null, reason }),
            });
        }
        read
    }

    /// Ends a frame of a grid that is not complete, after the line `before`.
    fn cut(&mut self, wanted: usize, before: usize) -> Vec<Read> {
        let rows = std::mem::take(&mut self.rows);
        self.written.clear();
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
