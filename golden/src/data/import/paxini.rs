//! PaXini: the CSV that its program PXSR logs, and others in the same form.
//!
//! | column | meaning |
//! |---|---|
//! | `Timestamp` | time of day, `HH:mm:ss.SSS` |
//! | `C-S-1x1-X`, `-Y`, `-Z` | resultant of the sensor in slot S of channel C, steps of 0.1 N; Z is the normal force |
//! | `C-S-NxN-X[k]`, `-Y[k]`, `-Z[k]` | force on its taxel k, the same |
//!
//! The normal forces become stress on the area of a taxel, which `--pitch` states; the resultant is compared with their sum.

use super::error::{ImportError, Source};
use super::format::{is_paxini_header, Format};
use super::recording::{sensel, DeviceFigure, RawFrame, Recording};
use super::triaxial::Wanted;
use super::units::Unit;
use crate::data::text::Separator;

/// Force of one step in N; readings are divided, so that they come out as the decimal fractions they are.
const STEPS_PER_N: f64 = 10.0;
const SECONDS_OF_A_DAY: f64 = 86_400.0;
/// How far the time of day falls at midnight, at least.
const MIDNIGHT: f64 = SECONDS_OF_A_DAY / 2.0;

/// The columns of a sensor.
struct Columns {
    name: String,
    /// Normal force of each taxel.
    taxels: Vec<usize>,
    /// Normal force of the sensor.
    resultant: Option<usize>,
}

impl Columns {
    /// All sensors of a header, in its order.
    fn all(header: &[std::borrow::Cow<str>]) -> Vec<Columns> {
        let mut all: Vec<Columns> = Vec::new();
        for (column, cell) in header.iter().enumerate() {
            let taxel = cell.split_once("-NxN-Z[").map(|(name, _)| (name, true));
            let Some((name, is_taxel)) = taxel.or_else(|| cell.strip_suffix("-1x1-Z").map(|name| (name, false))) else {
                continue;
            };
            let place = all.iter().position(|own| own.name == name).unwrap_or_else(|| {
                all.push(Columns { name: name.to_owned(), taxels: Vec::new(), resultant: None });
                all.len() - 1
            });
            match is_taxel {
                true => all[place].taxels.push(column),
                false => all[place].resultant = Some(column),
            }
        }
        all.retain(|own| !own.taxels.is_empty());
        all
    }
}

/// Reads a recording of the wanted sensor.
pub(super) fn parse(text: &str, wanted: &Wanted, source: &Source) -> Result<Recording, ImportError> {
    let mut lines = text.lines().enumerate().map(|(index, line)| (index + 1, line));
    let header = lines.by_ref().find(|(_, line)| is_paxini_header(line));
    let (number, header) = header.ok_or_else(|| source.missing("the header", "a line Timestamp, C-S-NxN-Z[0], …"))?;
    let separator = match header.contains(';') {
        true => Separator::Semicolon,
        false => Separator::Comma,
    };
    let header = separator.cells(header);
    let all = Columns::all(&header);
    let names: Vec<String> = all.iter().map(|sensor| sensor.name.clone()).collect();
    if names.is_empty() {
        return Err(source.line(number, &header.join(","), "a header with columns C-S-NxN-Z[0], …"));
    }
    let sensor = &all[wanted.choose(&names, source)?];
    let shape = wanted.size(sensor.taxels.len(), "PaXini sensor", source)?;
    let (mut frames, mut left_out) = (Vec::new(), Vec::new());
    let (mut start_s, mut last_s, mut days) = (None, f64::NEG_INFINITY, 0.0);
    for (line, text) in lines.filter(|(_, text)| !text.trim().is_empty()) {
        let cells = separator.cells(text);
        if cells.len() != header.len() {
            left_out.push(format!("line {line}: {} values, wanted {}", cells.len(), header.len()));
            continue;
        }
        let time_s = time_of_day_s(&cells[0])
            .ok_or_else(|| source.value(line, 1, &cells[0], "a time of day as 09:41:07.250"))?;
        days += if time_s < last_s - MIDNIGHT { SECONDS_OF_A_DAY } else { 0.0 };
        last_s = time_s;
        let start_s = *start_s.get_or_insert(time_s);
        let force = |&column: &usize| Ok(sensel(source, line, column + 1, &cells[column])? / STEPS_PER_N);
        let values = sensor.taxels.iter().map(force).collect::<Result<Vec<f64>, ImportError>>()?;
        let resultant = sensor.resultant.as_ref().map(force).transpose()?.filter(|force| force.is_finite());
        frames.push(RawFrame {
            number: frames.len() + 1,
            // Milliseconds, which sums of days would spoil.
            time_s: Some(((days + time_s - start_s) * 1e3).round() / 1e3),
            values,
            stated: None,
            device: resultant.map(DeviceFigure::Force),
        });
    }
    let (device, unit) = (Some(format!("PaXini, sensor {}", sensor.name)), Some(Unit::Newton));
    Ok(Recording { device, unit, left_out, ..Recording::bare(Format::Paxini, shape, frames) })
}

/// Seconds since midnight of `HH:mm:ss.SSS`.
fn time_of_day_s(text: &str) -> Option<f64> {
    let mut parts = text.splitn(3, ':');
    let mut whole = |most: u32| parts.next()?.parse::<u32>().ok().filter(|part| *part < most);
    let (hours, minutes) = (whole(24)?, whole(60)?);
    let seconds: f64 = parts.next()?.parse().ok().filter(|seconds| (0.0..61.0).contains(seconds))?;
    Some(f64::from(3600 * hours + 60 * minutes) + seconds)
}

#[cfg(test)]
mod tests {
    use super::super::{import, Imported, Settings};
    use super::*;

    /// Two sensors, of four taxels and of one, over midnight.
    fn file() -> String {
        let columns = |name: &str, taxels: usize| {
            let axes = |of: String| ["X", "Y", "Z"].map(|axis| of.replace("AXIS", axis)).join(",");
            let all = (0..taxels).map(|k| axes(format!("{name}-NxN-AXIS[{k}]")));
            std::iter::once(axes(format!("{name}-1x1-AXIS"))).chain(all).collect::<Vec<_>>().join(",")
        };
        format!(
            "Timestamp,{},{}\n{}\n{}\n",
            columns("0-0", 4),
            columns("0-1", 1),
            "23:59:59.990,1,-2,30,9,9,4,9,9,8,9,9,0,9,9,18,7,7,7,7,7,7",
            "00:00:00.010,1,-2,10,9,9,1,9,9,2,9,9,3,9,9,4,7,7,5,7,7,5"
        )
    }

    fn read(text: &str, settings: Settings) -> Result<Imported, String> {
        let pitch_mm = Some([2.0, 5.0]);
        import("log.csv", text.as_bytes(), &Settings { pitch_mm, ..settings }).map_err(|error| error.to_string())
    }

    fn of(sensor: Option<&str>, size: Option<[usize; 2]>) -> Settings {
        Settings { sensor: sensor.map(str::to_owned), size, ..Settings::default() }
    }

    #[test]
    fn normal_forces_become_stress_and_sum_to_the_resultant() {
        let imported = read(&file(), of(Some("0-0"), Some([2, 2]))).unwrap();
        let summary = &imported.summary;
        assert_eq!((summary.format, summary.unit), (Format::Paxini, Unit::Newton));
        // 0.4 N on 10 mm².
        assert_eq!(imported.frames[0].stress_MPa, [0.04, 0.08, 0.0, 0.18]);
        assert!((summary.frames[0].normal_N - 3.0).abs() < 1e-12 && summary.closure().unwrap()[0] < 1e-12);
        assert_eq!(summary.frames[1].time_s, Some(0.02));
        // As a spreadsheet saves it.
        let saved = read(&file().replace(',', ";"), of(Some("0-0"), Some([2, 2]))).unwrap();
        assert_eq!(saved.frames, imported.frames);
    }

    #[test]
    fn what_the_file_leaves_open_is_asked() {
        let error = |settings: Settings| read(&file(), settings).unwrap_err();
        let open = error(of(None, None));
        assert_eq!(open, "log.csv: the sensor is missing; name it with --sensor, one of 0-0, 0-1");
        assert!(error(of(Some("1-0"), None)).contains("--sensor = 1-0 is not allowed; it must be one of 0-0, 0-1"));
        assert!(error(of(Some("0-0"), None)).ends_with("--size ROWSxCOLS; this PaXini sensor has 4 taxels"));
        assert!(error(of(Some("0-0"), Some([2, 3]))).contains("--size = 2x3 is not allowed"));
        let time = read(&file().replace("23:59", "24:59"), of(Some("0-0"), Some([2, 2]))).unwrap_err();
        assert!(time.starts_with("log.csv, line 2, value 1: \"24:59:59.990\" is not allowed"), "{time}");
        let short = file() + "00:00:00.030,1,2\n";
        let imported = read(&short, of(Some("0-0"), Some([2, 2]))).unwrap();
        assert_eq!(imported.summary.lines_left_out, ["line 4: 3 values, wanted 22"]);
    }
}
