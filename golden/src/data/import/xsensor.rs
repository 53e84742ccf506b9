//! XSENSOR CSV: cells `key, value`, then `SENSELS` and a line per row, once for each frame.
//!
//! | key | use |
//! |---|---|
//! | `FRAME` | number; begins a frame |
//! | `Rows`, `Columns` | size, the same in all frames |
//! | `Sensel Width (cm)`, `Sensel Height (cm)` | pitch along columns and rows; the unit is that of the key |
//! | `Units` | unit |
//! | `Est. Load (N)` | normal force |
//!
//! Keys may have a colon behind them; others are not used. Empty cells behind a row are padding. A spreadsheet that has saved the file
//! again separates by semicolons and writes decimal commas.

use super::error::{ImportError, Source};
use super::format::Format;
use super::recording::{sensel, separator, side, unfinished, unit, DeviceFigure, RawFrame, Recording};
use super::units::{millimetres, Unit, LENGTHS};
use crate::data::text::point;

/// A key without quotes and colon.
fn cell(text: &str) -> &str {
    text.trim().trim_matches('"').trim_end_matches(':').trim()
}

/// What the lines before the sensels of a frame state.
#[derive(Default)]
struct Header {
    rows: Option<usize>,
    cols: Option<usize>,
    pitch_mm: [Option<f64>; 2],
    unit: Option<Unit>,
    number: Option<usize>,
    force_N: Option<f64>,
}

impl Header {
    /// Takes a line `key, value`.
    fn read(&mut self, line: &str, source: &Source) -> Result<(), ImportError> {
        let cells = separator(line).cells(line);
        let mut cells = cells.iter().map(|text| cell(text));
        let (key, value) = (cells.next().unwrap_or(""), cells.next().unwrap_or(""));
        let (name, of) =
            key.split_once('(').map_or((key, ""), |(name, unit)| (name.trim(), unit.trim_end_matches(')')));
        let pitch = || {
            let length = format!("{value} {of}");
            millimetres(&length).ok_or_else(|| source.field(key, &length, LENGTHS))
        };
        match name {
            "FRAME" | "Frame" => self.number = value.parse().ok(),
            "Rows" => self.rows = Some(side(source, key, value)?),
            "Columns" => self.cols = Some(side(source, key, value)?),
            "Sensel Width" => self.pitch_mm[0] = Some(pitch()?),
            "Sensel Height" => self.pitch_mm[1] = Some(pitch()?),
            "Units" => self.unit = Some(unit(source, key, value)?),
            "Est. Load" if of == "N" => {
                self.force_N = point(value).parse().ok().filter(|force: &f64| force.is_finite())
            }
            _ => {}
        }
        Ok(())
    }

    fn size(&self, source: &Source) -> Result<[usize; 2], ImportError> {
        let of = |count: Option<usize>, key| {
            count.ok_or_else(|| source.missing(key, "an XSENSOR file states it before SENSELS"))
        };
        Ok([of(self.rows, "Rows")?, of(self.cols, "Columns")?])
    }
}

/// Reads a recording.
pub(super) fn parse(text: &str, source: &Source) -> Result<Recording, ImportError> {
    let mut lines = text.lines().enumerate().map(|(index, line)| (index + 1, line));
    let (mut header, mut frames, mut shape) = (Header::default(), Vec::new(), None);
    let (mut last, mut cut, unfinished) = (0, None, unfinished(text));
    'frames: while let Some((line, text)) = lines.next() {
        last = line;
        if cell(text.split([',', ';']).next().unwrap_or("")) != "SENSELS" {
            header.read(text, source)?;
            continue;
        }
        let [rows, cols] = header.size(source)?;
        if shape.replace([rows, cols]).is_some_and(|before| before != [rows, cols]) {
            return Err(source.field("Rows and Columns", format!("{rows}×{cols}"), "those of the frames before"));
        }
        // Grown with the file: a header may state more than there is.
        let mut values = Vec::new();
        for row in 0..rows {
            let Some((line, text)) = lines.next().filter(|(line, _)| Some(*line) != unfinished) else {
                cut = Some(format!("the last frame has {row} of {rows} rows"));
                break 'frames;
            };
            if text.trim().is_empty() {
                let allowed = format!("{rows} rows below SENSELS, not {row}");
                return Err(source.line(line, "end of the frame", allowed));
            }
            let separator = separator(text);
            let cells = separator.cells(text);
            if cells.len() < cols || cells[cols..].iter().any(|cell| !cell.trim().is_empty()) {
                return Err(source.line(line, text, format!("{cols} values separated by {separator} (Columns)")));
            }
            for (column, text) in cells[..cols].iter().enumerate() {
                values.push(sensel(source, line, column + 1, &point(text))?);
            }
        }
        let number = header.number.take().unwrap_or(frames.len() + 1);
        let device = header.force_N.take().map(DeviceFigure::Force);
        frames.push(RawFrame { number, time_s: None, values, stated: None, device });
    }
    let shape = shape.ok_or_else(|| source.line(last, "end of file", "SENSELS before the first frame"))?;
    let [x, y] = header.pitch_mm;
    Ok(Recording {
        device: Some("XSENSOR".into()),
        pitch_mm: x.zip(y).map(|(x, y)| [x, y]),
        unit: header.unit,
        cut,
        ..Recording::bare(Format::Xsensor, shape, frames)
    })
}

#[cfg(test)]
mod tests {
    use super::super::{import, Settings};
    use super::*;

    /// Frames of 2×2 sensels with these readings.
    fn file(frames: &[[f64; 4]]) -> String {
        let frame = |(k, [a, b, c, d]): (usize, &[f64; 4])| {
            let size = "Rows,2,,\nColumns,2,,\nSensel Width (cm),1.0,,\nSensel Height (cm),1.5,,\n";
            format!("FRAME,{},,\n{size}Est. Load (N),0.2,,\nSENSELS,,,\n{a},{b},,\n{c},{d},,\n,,,\n", k + 1)
        };
        let frames: String = frames.iter().enumerate().map(frame).collect();
        format!("\u{feff}File:,made-up.XSN,,\n,,,\nUnits:,mmHg,,\nThreshold:,5,,\n{frames}")
    }

    #[test]
    fn frames_with_their_header_each_are_read() {
        let text = file(&[[10.0, 0.0, 0.0, 0.0], [0.0, 20.0, 30.0, 0.0]]);
        let imported = import("mat.csv", text.as_bytes(), &Settings::default()).unwrap();
        let (summary, sensor) = (&imported.summary, &imported.scene.sensor);
        assert_eq!((summary.format, summary.unit), (Format::Xsensor, Unit::MmHg));
        assert_eq!((sensor.pitch_x_mm, sensor.pitch_y_mm), (10.0, 15.0));
        assert_eq!(imported.frames.len(), 2);
        let per_MPa = Unit::MmHg.per_MPa().unwrap();
        assert_eq!(imported.frames[1].stress_MPa, [0.0, 20.0 / per_MPa, 30.0 / per_MPa, 0.0]);
        // 10 mmHg on 1.5 cm², as the device says.
        assert_eq!(summary.frames[0].device_N, Some(0.2));
        assert!(summary.frames[0].closure().unwrap().abs() < 1e-3, "{:?}", summary.frames[0]);
    }

    #[test]
    fn a_file_that_a_spreadsheet_has_saved_is_the_same() {
        let text = file(&[[10.5, 0.0, 0.0, 0.0], [0.0, 20.0, 30.25, 0.0]]);
        let saved =
            text.replace(',', ";").replace('.', ",").replace("made-up,XSN", "made-up.XSN").replace("Est,", "Est.");
        let [whole, saved] =
            [text, saved].map(|text| import("mat.csv", text.as_bytes(), &Settings::default()).unwrap());
        assert_eq!(saved.frames, whole.frames);
        assert_eq!(saved.summary.frames[0].device_N, Some(0.2));
    }

    #[test]
    fn a_cut_file_and_other_sizes_are_refused() {
        let whole = file(&[[10.0, 0.0, 0.0, 0.0], [0.0, 20.0, 30.0, 0.0]]);
        let error = |text: &str| import("mat.csv", text.as_bytes(), &Settings::default()).unwrap_err().to_string();
        let cut = whole.split("0,20").next().unwrap();
        assert!(error(cut).contains("the last frame has 0 of 2 rows"), "{}", error(cut));
        let cut = whole.split("\n30,0").next().unwrap();
        assert!(error(cut).contains("the last frame has"), "{}", error(cut));
        let (first, second) = whole.split_at(whole.find("FRAME,2").unwrap());
        let other = format!("{first}{}", second.replace("Rows,2", "Rows,1"));
        assert!(error(&other).contains("those of the frames before"), "{}", error(&other));
        assert!(error(&whole.replace("10,0,,", "10,0,7,")).contains("2 values separated by commas"));
        assert!(error(&whole.replace("mmHg", "stone")).contains("Units = stone"));
        assert!(error(&whole.replace("10,0,,", "10,x,,")).contains("value 2: \"x\""));
    }
}
