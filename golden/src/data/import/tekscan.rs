//! Tekscan ASF and CSV: lines `KEY value` up to `ASCII_DATA`, then frames of comma-separated rows, `B` where the film has
//! no sensel.
//!
//! | key | use |
//! |---|---|
//! | `ROWS`, `COLS` | size |
//! | `ROW_SPACING`, `COL_SPACING` | pitch with its unit |
//! | `UNITS` | unit; `raw` are counts of 8 bits |
//! | `SECONDS_PER_FRAME` | times, unless a frame's line has its own |
//! | `SATURATION_PRESSURE` | full scale, if in the unit of the readings |
//! | `SENSOR_TYPE` | name of the device |
//! | `START_FRAME`, `END_FRAME` | number of frames: with fewer or more the file is cut |
//!
//! A frame starts with `Frame N`, in the CSV with time and `Raw Sum=` behind it, and has `ROWS` lines; `@@` ends the
//! file: without it the file is cut. A spreadsheet that has saved the file again has filled its lines with empty cells, or separates by
//! semicolons and writes decimal commas.
//!
//! `COMMENTS:` begins lines of text. Keys that stand before it count; of another one that stands behind it, the last one with a
//! value that is allowed, because more keys follow the text. MIRROR_ROW and MIRROR_COL are not applied: the rows stay as the file has them.

use super::error::{ImportError, Source};
use super::format::Format;
use super::recording::{sensel, separator, side, unfinished, unit, DeviceFigure, RawFrame, Recording};
use super::units::{millimetres, Unit, LENGTHS};
use crate::data::text::point;

/// Width of Tekscan's counts.
const BITS: u32 = 8;
/// What fills lines that a spreadsheet has saved.
const FILL: [char; 2] = [',', ';'];

/// Keys of the header that are used.
#[derive(Default)]
struct Header {
    rows: Option<usize>,
    cols: Option<usize>,
    pitch_mm: [Option<f64>; 2],
    unit: Option<Unit>,
    period_s: Option<f64>,
    saturation: Option<String>,
    device: Option<String>,
    /// First and last frame.
    ends: [Option<usize>; 2],
}

/// Reads a recording.
pub(super) fn parse(text: &str, source: &Source) -> Result<Recording, ImportError> {
    let mut lines = text.lines().enumerate().map(|(index, line)| (index + 1, line.trim()));
    let header = header(&mut lines, source)?;
    let size = |count: Option<usize>, key| {
        count.ok_or_else(|| source.missing(key, "the header of a Tekscan file states it before ASCII_DATA"))
    };
    let shape = [size(header.rows, "ROWS")?, size(header.cols, "COLS")?];
    let (frames, cut) = frames(lines, shape, header.period_s, unfinished(text), source)?;
    let cut = cut.or_else(|| header.wrong_count(frames.len()));
    let [x, y] = header.pitch_mm;
    Ok(Recording {
        device: header.device,
        pitch_mm: x.zip(y).map(|(x, y)| [x, y]),
        unit: header.unit,
        bits: Some(BITS),
        full_scale: header.saturation.and_then(|text| saturation(&text, header.unit)),
        cut,
        ..Recording::bare(Format::Tekscan, shape, frames)
    })
}

/// The frames that are whole, and why the file ends too early, if it does; `unfinished` is the number of a last line without end.
fn frames<'a>(
    lines: impl Iterator<Item = (usize, &'a str)>,
    [rows, cols]: [usize; 2],
    period_s: Option<f64>,
    unfinished: Option<usize>,
    source: &Source,
) -> Result<(Vec<RawFrame>, Option<String>), ImportError> {
    let (mut frames, mut left): (Vec<RawFrame>, usize) = (Vec::new(), 0);
    for (line, text) in lines.filter(|(_, text)| !text.is_empty()) {
        let bare = text.trim_end_matches(FILL);
        if bare == "@@" && left == 0 {
            return Ok((frames, None));
        }
        if Some(line) == unfinished {
            // What is left of a number can be another one; a frame whose rows were all before is whole.
            break;
        }
        match frames.last_mut().filter(|_| left > 0) {
            Some(frame) => {
                row(text, line, cols, &mut frame.values, source)?;
                left -= 1;
            }
            None if bare.is_empty() => (),
            None => {
                frames.push(frame_line(text, line, period_s, source)?);
                left = rows;
            }
        }
    }
    let cut = match left {
        0 => "the end mark @@ is missing".to_owned(),
        _ => frames.pop().map_or("no frame".to_owned(), |frame| format!("frame {} is not complete", frame.number)),
    };
    Ok((frames, Some(cut)))
}

/// Takes a row of `cols` readings; empty cells behind them fill the line.
fn row(text: &str, line: usize, cols: usize, values: &mut Vec<f64>, source: &Source) -> Result<(), ImportError> {
    let separator = separator(text);
    let mut cells = separator.cells(text);
    while cells.len() > cols && cells.last().is_some_and(|cell| cell.is_empty()) {
        cells.pop();
    }
    if cells.len() != cols {
        let wanted = format!("{cols} values separated by {separator} (COLS), not {}", cells.len());
        return Err(source.line(line, text, wanted));
    }
    for (column, cell) in cells.iter().enumerate() {
        values.push(sensel(source, line, column + 1, &point(cell))?);
    }
    Ok(())
}

/// Reads the header up to `ASCII_DATA`.
fn header<'a>(lines: &mut impl Iterator<Item = (usize, &'a str)>, source: &Source) -> Result<Header, ImportError> {
    let mut header = Header::default();
    // Keys before the comments, and whether these have begun.
    let (mut stated, mut comments) = (Vec::new(), false);
    for (_, line) in lines {
        let line = line.trim_end_matches(FILL);
        let (key, value) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        let value = value.trim();
        match key {
            "ASCII_DATA" if !comments || ["", "@@"].contains(&value) => return Ok(header),
            "COMMENTS" | "COMMENTS:" => comments = true,
            _ if !comments => {
                header.key(key, value, source)?;
                stated.push(key);
            }
            // A line of a comment may begin with a word that is a key; its value is hardly one.
            _ if !stated.contains(&key) => header.key(key, value, source).unwrap_or(()),
            _ => (),
        }
    }
    Err(source.missing("ASCII_DATA", "a Tekscan file has it between header and frames"))
}

impl Header {
    /// That a file has fewer or more frames than its header states, in words.
    fn wrong_count(&self, frames: usize) -> Option<String> {
        let (first, last) = self.ends[0].zip(self.ends[1]).filter(|(first, last)| first <= last)?;
        let stated = last - first + 1;
        (frames != stated)
            .then(|| format!("the header states frames {first} to {last}, which are {stated}, not {frames}"))
    }

    /// Takes a key and its value; one that is not used is none.
    fn key(&mut self, key: &str, value: &str, source: &Source) -> Result<(), ImportError> {
        let length = || millimetres(value).ok_or_else(|| source.field(key, value, LENGTHS));
        match key {
            "ROWS" => self.rows = Some(side(source, key, value)?),
            "COLS" => self.cols = Some(side(source, key, value)?),
            // Columns are apart along x.
            "COL_SPACING" => self.pitch_mm[0] = Some(length()?),
            "ROW_SPACING" => self.pitch_mm[1] = Some(length()?),
            "UNITS" => self.unit = Some(unit(source, key, value)?),
            "SECONDS_PER_FRAME" => {
                let seconds = point(value).parse().ok().filter(|seconds: &f64| *seconds > 0.0 && seconds.is_finite());
                self.period_s = Some(seconds.ok_or_else(|| source.field(key, value, "a number above 0"))?);
            }
            "SATURATION_PRESSURE" => self.saturation = Some(value.to_string()),
            "START_FRAME" => self.ends[0] = value.parse().ok(),
            "END_FRAME" => self.ends[1] = value.parse().ok(),
            "SENSOR_TYPE" => self.device = Some(format!("Tekscan {value}")),
            _ => {}
        }
        Ok(())
    }
}

/// `Frame N`, or `Frame N, seconds,, …, Raw Sum=,, sum`.
fn frame_line(text: &str, line: usize, period_s: Option<f64>, source: &Source) -> Result<RawFrame, ImportError> {
    let wrong = || source.line(line, text, "a line that starts with \"Frame\" and a number, or @@");
    let rest = text.strip_prefix("Frame").ok_or_else(wrong)?;
    let cells = separator(rest).cells(rest);
    let mut cells = cells.iter().map(|cell| point(cell));
    let number: usize = cells.next().and_then(|number| number.parse().ok()).ok_or_else(wrong)?;
    let own_time = cells.next().and_then(|seconds| seconds.parse().ok());
    let sum = cells.skip_while(|cell| *cell != "Raw Sum=").skip(1).find(|cell| !cell.is_empty());
    Ok(RawFrame {
        number,
        time_s: own_time
            .filter(|seconds: &f64| seconds.is_finite())
            .or(period_s.map(|s| s * number.saturating_sub(1) as f64)),
        values: Vec::new(),
        stated: None,
        device: sum.and_then(|sum| sum.parse().ok()).filter(|sum: &f64| sum.is_finite()).map(DeviceFigure::Sum),
    })
}

/// The saturation pressure, if it is in the unit of the readings.
fn saturation(text: &str, unit: Option<Unit>) -> Option<f64> {
    let (number, own) = text.split_once(char::is_whitespace)?;
    let same = unit.is_some() && Unit::named(own) == unit && unit != Some(Unit::Raw);
    point(number).parse().ok().filter(|number: &f64| same && *number > 0.0 && number.is_finite())
}
