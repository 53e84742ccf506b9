//! Times in a column of a text: seconds, milliseconds, a date.

use std::fmt;

use super::cells::point;
use time::format_description::well_known::Iso8601;
use time::{OffsetDateTime, PrimitiveDateTime};

/// How the times of a text are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TimeUnit {
    /// Numbers of so many decimal digits below the second: 0 for seconds, 3 for milliseconds, 6, 9.
    Number {
        /// 0, 3, 6 or 9.
        digits: u32,
        /// They count from 1970.
        since_1970: bool,
    },
    /// Date and time, or time of day, as ISO 8601 has it; a blank may stand for the `T`.
    Iso,
}

/// Digits of a second in nanoseconds.
const NANO_DIGITS: usize = 9;
/// Seconds since 1970 from which on a number is one of a date: 1973 to 5138.
const UNIX_S: std::ops::Range<f64> = 1e8..1e11;

/// Whether a time in ns is a Unix time, of 1973 or later, and not one that counts from power-on or the start of a recording.
pub fn is_date(ns: i64) -> bool {
    UNIX_S.contains(&(ns as f64 * 1e-9))
}

impl TimeUnit {
    /// The unit of times that rise, in the order of the file; `None` if they are no times. `name` is that of the column.
    pub(super) fn of_column(cells: &[&str], name: Option<&str>) -> Option<TimeUnit> {
        let (first, last) = (cells.first()?, cells.last()?);
        let numbers: Option<Vec<f64>> = cells.iter().map(|cell| number(cell)).collect();
        let Some(numbers) = numbers else {
            return cells.iter().all(|cell| iso_ns(cell).is_some()).then_some(TimeUnit::Iso);
        };
        let rises = numbers.windows(2).all(|pair| pair[0] <= pair[1]) && (cells.len() == 1 || first != last);
        if !rises {
            return None;
        }
        let absolute =
            [0, 3, 6, 9].into_iter().find(|digits| UNIX_S.contains(&(numbers[0] / 10f64.powi(*digits as i32))));
        if let Some(digits) = absolute {
            return Some(TimeUnit::Number { digits, since_1970: true });
        }
        Some(TimeUnit::Number {
            digits: name.and_then(digits_of_name).unwrap_or_else(|| digits_of_steps(&numbers)),
            since_1970: false,
        })
    }

    /// The time in a cell in ns, from whatever the numbers or dates count.
    pub(super) fn ns(self, cell: &str) -> Option<i64> {
        match self {
            TimeUnit::Iso => iso_ns(cell),
            TimeUnit::Number { digits, .. } => number_ns(cell, digits as usize),
        }
    }
}

impl fmt::Display for TimeUnit {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            TimeUnit::Iso => f.write_str("ISO 8601"),
            TimeUnit::Number { digits, since_1970 } => {
                let unit = ["s", "ms", "µs", "ns"][*digits as usize / 3 % 4];
                write!(f, "{unit}{}", if *since_1970 { " since 1970" } else { "" })
            }
        }
    }
}

fn number(cell: &str) -> Option<f64> {
    point(cell).parse().ok().filter(|value: &f64| value.is_finite())
}

/// Digits below the second that a column's name states, as `time_ms` or `t (us)` do.
fn digits_of_name(name: &str) -> Option<u32> {
    let lower = name.to_lowercase();
    let mut words = lower.split(|c: char| !c.is_alphabetic()).rev();
    words.find_map(|word| match word {
        "s" | "sec" | "secs" | "second" | "seconds" => Some(0),
        "ms" | "millis" | "msec" | "milliseconds" => Some(3),
        "us" | "µs" | "micros" | "usec" | "microseconds" => Some(6),
        "ns" | "nanos" | "nanoseconds" => Some(9),
        _ => None,
    })
}

/// Digits below the second of times without a stated unit: whole numbers that are 2 to 1999 apart are those of a
/// microcontroller's `millis()`, larger steps those of `micros()`; anything else is in seconds. No array is read
/// every two seconds only.
fn digits_of_steps(numbers: &[f64]) -> u32 {
    let mut steps: Vec<f64> = numbers.windows(2).map(|pair| pair[1] - pair[0]).collect();
    steps.sort_by(f64::total_cmp);
    let whole = numbers.iter().all(|value| value.fract() == 0.0);
    match steps.get(steps.len() / 2) {
        Some(step) if whole && *step >= 2000.0 => 6,
        Some(step) if whole && *step >= 2.0 => 3,
        _ => 0,
    }
}

/// A decimal number with `digits` digits below the second as ns, exact; ns below one are cut off.
fn number_ns(cell: &str, digits: usize) -> Option<i64> {
    let text = point(cell);
    if text.contains(['e', 'E']) {
        let ns = number(&text)? * 10f64.powi((NANO_DIGITS - digits) as i32);
        // Far within i64: the check of the range is exact.
        return (ns.abs() < 9e18).then_some(ns as i64);
    }
    let (sign, text) = text.strip_prefix('-').map_or((1, text.trim_start_matches('+')), |rest| (-1, rest));
    let (whole, decimals) = text.split_once('.').unwrap_or((text, ""));
    let fraction = NANO_DIGITS - digits;
    let below: String = decimals.chars().chain(std::iter::repeat('0')).take(fraction).collect();
    let ns: i64 = format!("{whole}{below}").parse().ok()?;
    Some(sign * ns)
}

/// A date and time, or a time of day, as ns since 1970 or since midnight.
fn iso_ns(cell: &str) -> Option<i64> {
    let text = cell.trim().replacen(' ', "T", 1).replace(',', ".");
    let text = match text.contains('-') || text.contains('T') {
        _ if !text.contains(':') => return None,
        true => text,
        false => format!("1970-01-01T{text}"),
    };
    let with_offset = OffsetDateTime::parse(&text, &Iso8601::DEFAULT);
    let moment =
        with_offset.or_else(|_| PrimitiveDateTime::parse(&text, &Iso8601::DEFAULT).map(PrimitiveDateTime::assume_utc));
    i64::try_from(moment.ok()?.unix_timestamp_nanos()).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn unit(cells: &[&str], name: Option<&str>) -> Option<String> {
        TimeUnit::of_column(cells, name).map(|unit| unit.to_string())
    }

    #[test]
    fn units_are_found_from_names_dates_and_steps() {
        let cases: [(&[&str], Option<&str>, Option<&str>); 11] = [
            (&["0.5", "0.51", "0.52"], None, Some("s")),
            (&["0,5", "0,51"], None, Some("s")),
            (&["1732770000.00", "1732770000.01"], None, Some("s since 1970")),
            (&["1732770000000", "1732770000010"], None, Some("ms since 1970")),
            (&["1732770000000000001", "1732770000000000002"], None, Some("ns since 1970")),
            (&["100", "110", "121"], None, Some("ms")),
            (&["100000", "110000"], None, Some("µs")),
            (&["0", "1", "2"], Some("time (ms)"), Some("ms")),
            (&["2026-01-02T10:00:00.000", "2026-01-02 10:00:00.010"], None, Some("ISO 8601")),
            (&["0.2", "0.1"], None, None),
            (&["a", "b"], None, None),
        ];
        for (cells, name, wanted) in cases {
            assert_eq!(unit(cells, name).as_deref(), wanted, "{cells:?}");
        }
    }

    #[test]
    fn times_are_exact_to_the_nanosecond() {
        let seconds = TimeUnit::Number { digits: 0, since_1970: true };
        assert_eq!(seconds.ns("1732770000.010000001"), Some(1_732_770_000_010_000_001));
        assert_eq!(seconds.ns("-0.5"), Some(-500_000_000));
        assert_eq!(seconds.ns("1e-3"), Some(1_000_000));
        assert_eq!(TimeUnit::Number { digits: 3, since_1970: false }.ns("10.25"), Some(10_250_000));
        assert_eq!(TimeUnit::Number { digits: 9, since_1970: false }.ns("7"), Some(7));
        let day = 10 * 3600 * 1_000_000_000;
        assert_eq!(TimeUnit::Iso.ns("10:00:00.010"), Some(day + 10_000_000));
        let apart = |a: &str, b: &str| Some(TimeUnit::Iso.ns(b)? - TimeUnit::Iso.ns(a)?);
        assert_eq!(apart("2026-01-02T10:00:00.05-05:00", "2026-01-02T15:00:00.1Z"), Some(50_000_000));
        assert_eq!(seconds.ns("1e30"), None);
        assert_eq!(TimeUnit::Iso.ns("10:00"), TimeUnit::Iso.ns("10:00:00"));
    }
}
