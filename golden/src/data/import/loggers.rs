//! Programs that write lines of numbers: how their files are recognised, and what they state beside the readings.
//!
//! | program | recognised by | unit | columns of the readings |
//! |---|---|---|---|
//! | novel pliance, pedar (`.asc`) | `pressure values in` and `time[secs]` | named in the line | those behind the time |
//! | BodiTrak (`.csv`) | a header with `Average Pressure (UNIT)` and columns `0`, `1`, … | in brackets | from `0` on |
//!
//! The size and the pitch are in none of them. What the user states replaces what is found here.

use super::units::Unit;
use crate::data::text::Stated;

/// A recognised file.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Logger {
    /// The program, or the devices it is of.
    pub name: &'static str,
    /// Unit of the readings, if the file names one.
    pub unit: Option<Unit>,
    /// Layout of the lines.
    pub layout: Stated,
}

/// Lines within which the header of a file stands.
const HEADER: usize = 64;

/// How a file is recognised, and what it states then.
type Recogniser = fn(&str) -> Option<Logger>;

/// Every program.
const ALL: [Recogniser; 2] = [novel, boditrak];

/// The program that has written a text.
pub(super) fn of(text: &str) -> Option<Logger> {
    ALL.iter().find_map(|recognise| recognise(text))
}

fn novel(text: &str) -> Option<Logger> {
    let line = text.lines().take(HEADER).find(|line| line.trim().starts_with("pressure values in"))?;
    let (skip_rows, _) =
        text.lines().enumerate().take(HEADER).find(|(_, line)| line.trim().starts_with("time[secs]"))?;
    let unit = line.trim().strip_prefix("pressure values in").and_then(Unit::named);
    let layout = Stated { time_column: Some(1), skip_rows: skip_rows + 1, ..Stated::default() };
    Some(Logger { name: "novel pliance or pedar", unit, layout })
}

fn boditrak(text: &str) -> Option<Logger> {
    const FIGURE: &str = "Average Pressure (";
    let (skip_rows, header) = text.lines().enumerate().take(HEADER).find(|(_, line)| line.contains(FIGURE))?;
    let names: Vec<&str> = header.split(',').map(str::trim).collect();
    let unit = names.iter().find_map(|name| Unit::named(name.strip_prefix(FIGURE)?.strip_suffix(')')?));
    let first = names.iter().position(|name| *name == "0")?;
    let count = names[first..].iter().enumerate().take_while(|(k, name)| **name == k.to_string()).count();
    let time = names.iter().position(|name| *name == "Timestamp");
    let layout = Stated {
        columns: Some([first + 1, first + count]),
        time_column: time.map(|column| column + 1),
        skip_rows: skip_rows + 1,
        ..Stated::default()
    };
    Some(Logger { name: "BodiTrak", unit, layout })
}

impl Logger {
    /// The layout with what the user states of it.
    pub(super) fn stated(&self, user: &Stated) -> Stated {
        Stated {
            columns: user.columns.or(self.layout.columns),
            time_column: user.time_column.or(self.layout.time_column),
            skip_rows: user.skip_rows.max(self.layout.skip_rows),
            form: user.form.or(self.layout.form),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{import, Imported, Settings};
    use super::*;

    const PLIANCE: &str = "file name: made-up.sol date/time 01.01.26 10.00\nmat type s0000\ntotal times [secs]: 0.08\n\
        pressure values in kPa\n\n\nelectrical:\ntime[secs]       1       2       3       4\n   \
        0.00000   1.000   2.000   3.000   4.000\n   0.04000   1.000   2.000   3.000   5.000\n";
    const BODITRAK: &str = "Frame,Timestamp,Average Pressure (mmHg),Estimated Force (N),0,1,2,3\n\
        1,2026-01-02T10:00:00.000000-05:00,2.50,0.13,10,0,0,0\n2,2026-01-02T10:00:00.050000-05:00,5.00,0.27,20,0,0,75\n";

    fn imported(file: &str, text: &str) -> Result<Imported, String> {
        let settings = Settings { size: Some([2, 2]), pitch_mm: Some([10.0; 2]), ..Settings::default() };
        import(file, text.as_bytes(), &settings).map_err(|error| error.to_string())
    }

    #[test]
    fn files_of_others_are_read_in_their_unit_and_with_their_times() {
        let pliance = imported("mat.asc", PLIANCE).unwrap();
        assert_eq!(pliance.summary.device.as_deref(), Some("novel pliance or pedar"));
        assert_eq!((pliance.summary.unit, pliance.frames.len()), (Unit::KiloPa, 2));
        assert_eq!(pliance.frames[1].stress_MPa, [0.001, 0.002, 0.003, 0.005]);
        assert!((pliance.summary.frames[1].time_s.unwrap() - 0.04).abs() < 1e-12);
        let boditrak = imported("mat.csv", BODITRAK).unwrap();
        assert_eq!((boditrak.summary.device.as_deref(), boditrak.summary.unit), (Some("BodiTrak"), Unit::MmHg));
        let per_MPa = Unit::MmHg.per_MPa().unwrap();
        assert_eq!(boditrak.frames[1].stress_MPa, [20.0 / per_MPa, 0.0, 0.0, 75.0 / per_MPa]);
        assert!((boditrak.summary.frames[1].time_s.unwrap() - 0.05).abs() < 1e-9);
        // The device's estimate of frame 1 is stress times area.
        assert!((boditrak.summary.frames[0].normal_N - 0.13).abs() < 0.005, "{:?}", boditrak.summary.frames[0]);
    }

    #[test]
    fn what_they_do_not_state_is_asked_with_their_name() {
        for (file, text, name) in [("mat.asc", PLIANCE, "pliance or pedar"), ("mat.csv", BODITRAK, "BodiTrak")] {
            let error = import(file, text.as_bytes(), &Settings::default()).unwrap_err().to_string();
            assert!(error.contains("give it with --size ROWSxCOLS") && error.contains(name), "{error}");
        }
    }

    #[test]
    fn other_texts_are_of_none_of_them() {
        for text in [
            "1,2,3,4\n",
            "time[secs] 1 2\n0 1 2\n",
            "pressure values in kPa\n1 2\n",
            "Frame,Average Pressure (mmHg),A,B\n1,2,3,4\n",
        ] {
            assert_eq!(of(text), None, "{text}");
        }
        // An unknown unit is not taken for another one.
        let unknown = PLIANCE.replace("in kPa", "in stone");
        assert!(imported("mat.asc", &unknown).unwrap_err().contains("the unit is missing"));
    }
}
