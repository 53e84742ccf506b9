//! Frames in CSV: one line per row of taxels, one number in MPa per column, separated by commas; several frames follow
//! one another. A field that is empty, `nan` or `null` is a missing reading.

use super::error::check_count;
use super::{Frame, FrameError};
use crate::spec::scene::Scene;
use crate::spec::sensor::Sensor;

/// Sensor, values, line numbers.
type Values<'a> = (&'a Sensor, Vec<f64>, Vec<usize>);

/// Reads a frame of the scene's sensor; blank lines are ignored.
pub(super) fn parse(text: &str, file: &str, stem: &str, scene: Option<&Scene>) -> Result<Frame, FrameError> {
    let (sensor, stress, lines) = values(text, file, scene)?;
    check_count(file, "rows", lines.len(), sensor.rows)?;
    Frame::from_stress(stem, sensor, stress)
}

/// Reads one or more frames of the scene's sensor.
pub(super) fn parse_all(text: &str, file: &str, stem: &str, scene: Option<&Scene>) -> Result<Vec<Frame>, FrameError> {
    let (sensor, stress, lines) = values(text, file, scene)?;
    let rows = lines.len();
    if rows == 0 || !rows.is_multiple_of(sensor.rows) {
        check_count(file, "rows", rows, (rows / sensor.rows + 1) * sensor.rows)?;
    }
    let one = |(stress, lines): (&[f64], &[usize])| {
        let frame = Frame::from_stress(stem, sensor, stress.to_vec())?;
        frame.check_missing(&format!("{file}, line {}", lines[0]), scene)?;
        Ok(frame)
    };
    stress.chunks(sensor.taxels()).zip(lines.chunks(sensor.rows)).map(one).collect()
}

/// The sensor, the values of all lines, `cols` each, and the number of each line.
fn values<'a>(text: &str, file: &str, scene: Option<&'a Scene>) -> Result<Values<'a>, FrameError> {
    let sensor = match scene {
        Some(scene) => &scene.sensor,
        None => return Err(FrameError::NoSensor { file: file.to_string() }),
    };
    let (mut stress, mut lines) = (Vec::with_capacity(sensor.taxels()), Vec::with_capacity(sensor.rows));
    let filled = text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty());
    for (index, line) in filled {
        let hint = csv_hint(line, sensor.cols, stress.is_empty());
        let (got, wanted) = (line.split(',').count(), sensor.cols);
        if got != wanted {
            return Err(FrameError::CsvRagged { file: file.to_string(), line: index + 1, got, wanted, hint });
        }
        lines.push(index + 1);
        for (column, cell) in line.split(',').enumerate() {
            stress.push(reading(cell).ok_or_else(|| FrameError::CsvValue {
                file: file.to_string(),
                line: index + 1,
                column: column + 1,
                value: cell.trim().chars().take(40).collect(),
                hint,
            })?);
        }
    }
    Ok((sensor, stress, lines))
}

/// The reading in a field of text: NaN where it is missing, `None` for anything else than a finite number or a missing reading.
///
/// ```
/// use dermis_golden::data::frame::reading;
///
/// assert_eq!(reading(" -3e-1"), Some(-0.3));
/// assert!([" ", "nan", "NaN", "null"].iter().all(|field| reading(field).is_some_and(f64::is_nan)));
/// assert!(["inf", "1e400", "x", "-"].iter().all(|field| reading(field).is_none()));
/// ```
pub fn reading(field: &str) -> Option<f64> {
    match field.trim() {
        "" | "null" => Some(f64::NAN),
        field => field.parse().ok().filter(|value: &f64| !value.is_infinite()),
    }
}

/// A likely reason why a line of numbers separated by commas, of which `wanted` are expected, is none, as the end of an error;
/// empty if none is known. `first` is whether no line with values came before.
pub fn csv_hint(line: &str, wanted: usize, first: bool) -> &'static str {
    // Decimal commas come with another separator, or with commas as separators too: twice as many whole numbers.
    let decimal_comma = |cell: &str| matches!(cell.trim().split_once(','), Some((a, b)) if number(a) && number(b));
    let separator = [';', '\t'];
    let mut cells = line.split(',');
    match line {
        _ if line.contains(separator) && line.split(separator).any(decimal_comma) => {
            "; values are separated by commas, and a decimal mark is a point"
        }
        _ if line.contains(separator) => "; values are separated by commas",
        _ if line.split(',').count() == 2 * wanted && cells.all(|cell| number(cell.trim())) => {
            "; a decimal mark is a point, not a comma"
        }
        _ if first && line.split(',').all(|cell| !number(cell) && cell.trim().parse::<f64>().is_err()) => {
            "; a frame has no header line"
        }
        _ => "",
    }
}

/// Whether a text has digits only, but for a sign.
fn number(text: &str) -> bool {
    let digits = text.trim_start_matches(['-', '+']);
    !digits.is_empty() && digits.bytes().all(|byte| byte.is_ascii_digit())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn likely_reasons_are_named() {
        assert_eq!(csv_hint("0,1;0,25", 2, true), "; values are separated by commas, and a decimal mark is a point");
        assert_eq!(csv_hint("1;2", 2, true), "; values are separated by commas");
        assert_eq!(csv_hint("0,1, -0,25", 2, false), "; a decimal mark is a point, not a comma");
        assert_eq!(csv_hint("col 0,col 1", 2, true), "; a frame has no header line");
        // Later lines are no header; a value that is missing or not finite is none either.
        for (line, first) in [("a,b", false), ("1,x", true), ("nan,0.1", true), ("0.1,0.2", true), ("0,1,0.5,2", true)]
        {
            assert_eq!(csv_hint(line, 2, first), "", "{line}");
        }
    }
}
