//! novel LST: pictures of an emed platform as printed pages.
//!
//! A page has `Sensor area`, `Sensor size`, `Time/picture` and `Pict-No.: N`, then a table: a line of column numbers, a
//! line per row that starts with its number, and a line `Force`. With `Force` as last column it also holds the force in N
//! of each row; the last force is that of the whole picture. Pages without a numbered picture (`MVP`, `MPP`: means and
//! maxima over the pictures) are skipped.
//!
//! Pages print the part of the platform that the recording loads; sensors outside it read zero. The recording has the
//! rows and columns that any page prints. The unit is not printed: it is the one of kPa and N/cm² with which Σ b·area is
//! the printed force, and kPa, novel's default, where every force is zero.

use super::error::{ImportError, Source};
use super::format::Format;
use super::recording::{reading, side, unfinished, DeviceFigure, RawFrame, Recording};
use super::units::Unit;

/// Largest share of readings to fill in, where pages print different parts, over those printed.
const LARGEST_FILL: usize = 16;
/// Largest difference of Σ b·area from the printed force by which a unit is recognised.
const UNIT_TOLERANCE: f64 = 0.05;

/// How lines above the number of a picture begin.
const HEADING: [&str; 6] = ["Page ", "File:", "Sensor area:", "Sensor size:", "MV over", "novel "];

/// The table of a page.
struct Page {
    number: usize,
    /// Column numbers, from 1.
    cols: Vec<usize>,
    /// Row number, from 1, and its readings.
    rows: Vec<(usize, Vec<f64>)>,
    force_N: Option<f64>,
}

/// What all pages share.
#[derive(Default)]
struct Header {
    matrix: Option<String>,
    pitch_mm: Option<[f64; 2]>,
    period_s: Option<f64>,
}

/// Reads a recording.
pub(super) fn parse(text: &str, source: &Source) -> Result<Recording, ImportError> {
    let mut header = Header::default();
    let mut pages: Vec<Page> = Vec::new();
    // Whether the lines that follow belong to a table, and whether to the heading of a page.
    let (mut open, mut heading) = (false, false);
    let unfinished = unfinished(text);
    for (line, text) in
        text.split('\n').enumerate().map(|(index, line)| (index + 1, line.trim_end_matches(['\r', '\x0c'])))
    {
        if text.contains("Pict-No") {
            heading = false;
            let number = text.split("Pict-No.:").nth(1).and_then(|rest| rest.split_whitespace().next());
            open = match number.and_then(|number| number.parse().ok()) {
                Some(number) => {
                    pages.push(Page { number, cols: Vec::new(), rows: Vec::new(), force_N: None });
                    true
                }
                None => false,
            };
        } else if text.trim().is_empty() || !open {
            // Of the table of a page that is skipped no line is like these.
            heading |= HEADING.iter().any(|start| text.trim_start().starts_with(start));
            head_line(text, &mut header, source)?;
        } else if let Some(page) = pages.last_mut() {
            // What is left of a number can be another one.
            open = Some(line) == unfinished || table_line(page, text, line, source)?;
        }
    }
    // A table ends with its line of forces.
    let cut = pages.pop_if(|_| open).map(|page| format!("the table of picture {} is not complete", page.number));
    let without_table = || heading.then(|| "the heading of the last page has no table below it".to_owned());
    let cut = cut.or_else(without_table);
    if cut.is_some() && pages.is_empty() {
        return Ok(Recording { cut, ..Recording::bare(Format::Lst, [0, 0], Vec::new()) });
    }
    if let Some(page) = pages.iter().find(|page| page.rows.is_empty()) {
        let field = format!("the table of picture {}", page.number);
        return Err(source.missing(&field, "a line of column numbers and lines of readings follow Pict-No."));
    }
    Ok(Recording { cut, ..assemble(header, pages, source)? })
}

/// Takes pitch, period and matrix from a line above a table.
fn head_line(text: &str, header: &mut Header, source: &Source) -> Result<(), ImportError> {
    if let Some((_, size)) = text.split_once("Sensor size:") {
        let wrong = || source.field("Sensor size", size, "width×height in cm, such as 0.500x0.500 cm");
        let numbers = size.trim().strip_suffix("cm").map(str::trim).ok_or_else(wrong)?;
        let (x, y) = numbers.split_once('x').ok_or_else(wrong)?;
        let mm = |cm: &str| cm.trim().parse().ok().map(|cm: f64| 10.0 * cm).filter(|mm| *mm > 0.0 && *mm < 1e6);
        header.pitch_mm = Some([mm(x).ok_or_else(wrong)?, mm(y).ok_or_else(wrong)?]);
    }
    if let Some((_, time)) = text.split_once("Time/picture:") {
        let ms = time.trim().strip_suffix("ms").and_then(|ms| ms.trim().parse().ok());
        let ms = ms.filter(|ms: &f64| *ms > 0.0 && ms.is_finite());
        let ms = ms.ok_or_else(|| source.field("Time/picture", time, "a time above 0 in ms"))?;
        header.period_s = Some(1e-3 * ms);
    }
    if let Some((_, matrix)) = text.split_once("Matrix:") {
        header.matrix = Some(matrix.trim().chars().take(16).collect());
    }
    Ok(())
}

/// Takes a line of a table; false after its last one.
fn table_line(page: &mut Page, text: &str, line: usize, source: &Source) -> Result<bool, ImportError> {
    let mut cells: Vec<&str> = text.split('\t').map(str::trim).collect();
    let head = cells.remove(0);
    if page.cols.is_empty() {
        if cells.last() == Some(&"Force") {
            cells.pop();
        }
        let cols = cells.iter().map(|cell| side(source, "column number", cell)).collect::<Result<Vec<_>, _>>()?;
        let rising = cols.windows(2).all(|pair| pair[1] == pair[0] + 1);
        if cols.is_empty() || !head.is_empty() || !rising {
            return Err(source.line(line, text, "successive column numbers, each behind a tab"));
        }
        page.cols = cols;
        return Ok(true);
    }
    let force = || match cells.get(page.cols.len()) {
        Some(cell) => reading(source, line, page.cols.len() + 2, cell).map(Some),
        None => Ok(None),
    };
    let force_N = force()?;
    if head == "Force" {
        page.force_N = force_N;
        return Ok(false);
    }
    if cells.len() != page.cols.len() && cells.len() != page.cols.len() + 1 {
        let wanted = format!("a row's number and {} readings behind tabs, not {}", page.cols.len(), cells.len());
        return Err(source.line(line, text, wanted));
    }
    let number = side(source, "row number", head)?;
    if page.rows.last().is_some_and(|(last, _)| number != last + 1) {
        return Err(source.line(line, text, "the row that follows the one above"));
    }
    let values = cells[..page.cols.len()].iter().enumerate();
    let values =
        values.map(|(column, cell)| if cell.is_empty() { Ok(0.0) } else { reading(source, line, column + 2, cell) });
    page.rows.push((number, values.collect::<Result<_, _>>()?));
    Ok(true)
}

/// Puts the pages' tables into the rows and columns that any of them prints.
fn assemble(header: Header, pages: Vec<Page>, source: &Source) -> Result<Recording, ImportError> {
    let range = |numbers: &mut dyn Iterator<Item = usize>| {
        numbers.fold((usize::MAX, 0), |(low, high), number| (low.min(number), high.max(number)))
    };
    let (row0, row1) = range(&mut pages.iter().flat_map(|page| page.rows.iter().map(|(number, _)| *number)));
    let (col0, col1) = range(&mut pages.iter().flat_map(|page| page.cols.iter().copied()));
    if pages.is_empty() {
        return Err(source.missing("Pict-No.", "an LST file has a page for each picture"));
    }
    let (rows, cols) = (row1 - row0 + 1, col1 - col0 + 1);
    let printed: usize = pages.iter().map(|page| page.rows.len() * page.cols.len()).sum();
    if rows * cols * pages.len() > LARGEST_FILL * printed {
        let size = format!("rows {row0} to {row1}, columns {col0} to {col1}");
        return Err(source.field("the printed part", size, "nearly the same on all pages"));
    }
    let frames = pages.iter().map(|page| {
        let mut values = vec![0.0; rows * cols];
        for (number, readings) in &page.rows {
            let start = (number - row0) * cols + page.cols[0] - col0;
            values[start..start + readings.len()].copy_from_slice(readings);
        }
        let time_s = header.period_s.map(|period| period * page.number.saturating_sub(1) as f64);
        RawFrame { number: page.number, time_s, values, stated: None, device: page.force_N.map(DeviceFigure::Force) }
    });
    let frames: Vec<RawFrame> = frames.collect();
    let unit = header.pitch_mm.and_then(|pitch| unit(&frames, pitch[0] * pitch[1]));
    let device = header.matrix.map(|matrix| format!("novel, matrix {matrix}"));
    Ok(Recording {
        device: device.or(Some("novel".to_string())),
        pitch_mm: header.pitch_mm,
        unit,
        ..Recording::bare(Format::Lst, [rows, cols], frames)
    })
}

/// The unit with which Σ b·area of all frames is the sum of their forces; kPa where both are zero.
fn unit(frames: &[RawFrame], area_mm2: f64) -> Option<Unit> {
    let force = |frame: &RawFrame| match frame.device {
        Some(DeviceFigure::Force(force)) => Some((frame.values.iter().sum::<f64>(), force)),
        _ => None,
    };
    let (sum, force) = frames.iter().filter_map(force).fold((0.0, 0.0), |(s, f), (sum, force)| (s + sum, f + force));
    if sum == 0.0 && force == 0.0 {
        return Some(Unit::KiloPa);
    }
    [Unit::KiloPa, Unit::NewtonPerCm2].into_iter().find(|unit| {
        let own = unit.per_MPa().map_or(0.0, |per_MPa| sum / per_MPa * area_mm2);
        (own - force).abs() <= UNIT_TOLERANCE * force.abs()
    })
}
