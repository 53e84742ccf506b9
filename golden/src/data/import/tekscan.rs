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
//!
//! A frame starts with `Frame N`, in the CSV with time and `Raw Sum=` behind it, and has `ROWS` lines; `@@` ends the
//! file. MIRROR_ROW and MIRROR_COL are not applied: the rows stay as the file has them.

use super::error::{ImportError, Source};
use super::format::Format;
use super::recording::{sensel, side, DeviceFigure, RawFrame, Recording};
use super::units::{millimetres, Unit, LENGTHS};

/// Width of Tekscan's counts.
const BITS: u32 = 8;

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
}

/// Reads a recording.
pub(super) fn parse(text: &str, source: &Source) -> Result<Recording, ImportError> {
    let mut lines = text.lines().enumerate().map(|(index, line)| (index + 1, line.trim()));
    let header = header(&mut lines, source)?;
    let size = |count: Option<usize>, key| {
        count.ok_or_else(|| source.missing(key, "the header of a Tekscan file states it before ASCII_DATA"))
    };
    let (rows, cols) = (size(header.rows, "ROWS")?, size(header.cols, "COLS")?);
    let mut frames: Vec<RawFrame> = Vec::new();
    let mut left = 0;
    let mut last = 0;
    for (line, text) in lines.filter(|(_, text)| !text.is_empty()) {
        last = line;
        if text == "@@" {
            break;
        }
        if left == 0 {
            frames.push(frame_line(text, line, header.period_s, source)?);
            left = rows;
            continue;
        }
        let cells = text.split(',');
        let got = cells.clone().count();
        if got != cols {
            return Err(source.line(line, text, format!("{cols} values separated by commas (COLS), not {got}")));
        }
        let values = &mut frames.last_mut().ok_or_else(|| source.line(line, text, "Frame 1"))?.values;
        for (column, cell) in cells.enumerate() {
            values.push(sensel(source, line, column + 1, cell)?);
        }
        left -= 1;
    }
    if left > 0 {
        let number = frames.last().map_or(0, |frame| frame.number);
        return Err(source.line(last, "end of file", format!("{left} more rows of frame {number}, which has {rows}")));
    }
    let [x, y] = header.pitch_mm;
    Ok(Recording {
        format: Format::Tekscan,
        device: header.device,
        rows,
        cols,
        pitch_mm: x.zip(y).map(|(x, y)| [x, y]),
        unit: header.unit,
        bits: Some(BITS),
        full_scale: header.saturation.and_then(|text| saturation(&text, header.unit)),
        missing: Vec::new(),
        layout: None,
        left_out: Vec::new(),
        frames,
    })
}

/// Reads the header up to `ASCII_DATA`.
fn header<'a>(lines: &mut impl Iterator<Item = (usize, &'a str)>, source: &Source) -> Result<Header, ImportError> {
    let mut header = Header::default();
    let length = |key: &str, text: &str| millimetres(text).ok_or_else(|| source.field(key, text, LENGTHS));
    for (_, line) in lines {
        let (key, value) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        let value = value.trim();
        match key {
            "ASCII_DATA" => return Ok(header),
            "ROWS" => header.rows = Some(side(source, key, value)?),
            "COLS" => header.cols = Some(side(source, key, value)?),
            // Columns are apart along x.
            "COL_SPACING" => header.pitch_mm[0] = Some(length(key, value)?),
            "ROW_SPACING" => header.pitch_mm[1] = Some(length(key, value)?),
            "UNITS" => {
                let unit = Unit::named(value);
                header.unit = Some(unit.ok_or_else(|| source.field(key, value, format!("one of {}", Unit::names())))?);
            }
            "SECONDS_PER_FRAME" => {
                let seconds = value.parse().ok().filter(|seconds: &f64| *seconds > 0.0 && seconds.is_finite());
                header.period_s = Some(seconds.ok_or_else(|| source.field(key, value, "a number above 0"))?);
            }
            "SATURATION_PRESSURE" => header.saturation = Some(value.to_string()),
            "SENSOR_TYPE" => header.device = Some(format!("Tekscan {value}")),
            _ => {}
        }
    }
    Err(source.missing("ASCII_DATA", "a Tekscan file has it between header and frames"))
}

/// `Frame N`, or `Frame N, seconds,, …, Raw Sum=,, sum`.
fn frame_line(text: &str, line: usize, period_s: Option<f64>, source: &Source) -> Result<RawFrame, ImportError> {
    let wrong = || source.line(line, text, "a line that starts with \"Frame\" and a number, or @@");
    let rest = text.strip_prefix("Frame").ok_or_else(wrong)?;
    let mut cells = rest.split(',').map(str::trim);
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
    number.parse().ok().filter(|number: &f64| same && *number > 0.0 && number.is_finite())
}
