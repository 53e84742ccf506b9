//! Times in a column of a text: seconds, milliseconds, a date.

use std::borrow::Cow;
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
    /// Numbers of so many seconds each: 60 for minutes, 3600 for hours.
    Long {
        /// 60 or 3600.
        seconds: u32,
    },
    /// Date and time, or time of day, as ISO 8601 has it; a blank may stand for the `T`, and the date as `31.12.2026` or `2026/12/31`.
    Iso,
}

/// Digits of a second in nanoseconds.
const NANO_DIGITS: usize = 9;
/// Seconds since 1970 from which on a number is one of a date: 1973 to 5138.
const UNIX_S: std::ops::Range<f64> = 1e8..1e11;
/// One in so many times may be missing, wrong, or earlier than the one before.
const STRAY: usize = 10;

/// Whether a time in ns is a Unix time, of 1973 or later, and not one that counts from power-on or the start of a recording.
pub fn is_date(ns: i64) -> bool {
    UNIX_S.contains(&(ns as f64 * 1e-9))
}

/// Whether so few of the cells of a column are no times that it is one of times all the same: one of four, a tenth of many.
pub(super) fn are_stray(strays: usize, cells: usize) -> bool {
    strays * STRAY <= cells || strays == 1 && cells > 3
}

impl TimeUnit {
    /// The unit of times that rise, in the order of the file, but for a few; `None` if they are no times. `name` is that of the
    /// column.
    pub(super) fn of_column(cells: &[&str], name: Option<&str>) -> Option<TimeUnit> {
        let numbers: Vec<f64> = cells.iter().filter_map(|cell| number(cell)).collect();
        if numbers.is_empty() || !are_stray(cells.len() - numbers.len(), cells.len()) {
            let dates = cells.iter().filter(|cell| iso_ns(cell).is_some()).count();
            return (dates > 0 && are_stray(cells.len() - dates, cells.len())).then_some(TimeUnit::Iso);
        }
        let falls = numbers.windows(2).filter(|pair| pair[0] > pair[1]).count();
        // A few readings that rise are no times because of one fall.
        let few = if name.is_some() || cells.len() >= STRAY { are_stray(falls, cells.len()) } else { falls == 0 };
        // Nanoseconds since 1970 are more than a number here has: the texts tell.
        if !few || cells.len() > 1 && cells.iter().all(|cell| *cell == cells[0]) {
            return None;
        }
        let mut sorted = numbers.clone();
        sorted.sort_by(f64::total_cmp);
        let middle = sorted[sorted.len() / 2];
        let absolute = [0, 3, 6, 9].into_iter().find(|digits| UNIX_S.contains(&(middle / 10f64.powi(*digits as i32))));
        if let Some(digits) = absolute {
            return Some(TimeUnit::Number { digits, since_1970: true });
        }
        let of_steps = || TimeUnit::Number { digits: digits_of_steps(&numbers), since_1970: false };
        Some(name.and_then(unit_of_name).unwrap_or_else(of_steps))
    }

    /// The time in a cell in ns, from whatever the numbers or dates count.
    pub(super) fn ns(self, cell: &str) -> Option<i64> {
        match self {
            TimeUnit::Iso => iso_ns(cell),
            TimeUnit::Long { seconds } => number_ns(cell, 0)?.checked_mul(i64::from(seconds)),
            TimeUnit::Number { digits, .. } => number_ns(cell, digits as usize),
        }
    }
}

impl fmt::Display for TimeUnit {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            TimeUnit::Iso => f.write_str("ISO 8601"),
            TimeUnit::Long { seconds } => f.write_str(if *seconds == 60 { "min" } else { "h" }),
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

/// The unit that a column's name states, as `time_ms` or `t (us)` do.
fn unit_of_name(name: &str) -> Option<TimeUnit> {
    let lower = name.to_lowercase();
    let mut words = lower.split(|c: char| !c.is_alphabetic()).rev();
    let below = |digits| Some(TimeUnit::Number { digits, since_1970: false });
    words.find_map(|word| match word {
        "h" | "hour" | "hours" => Some(TimeUnit::Long { seconds: 3600 }),
        "min" | "mins" | "minute" | "minutes" => Some(TimeUnit::Long { seconds: 60 }),
        "s" | "sec" | "secs" | "second" | "seconds" => below(0),
        "ms" | "millis" | "msec" | "milliseconds" => below(3),
        "us" | "µs" | "micros" | "usec" | "microseconds" => below(6),
        "ns" | "nanos" | "nanoseconds" => below(9),
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
pub(crate) fn number_ns(cell: &str, digits: usize) -> Option<i64> {
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
    let text = cell.trim();
    if !text.contains(':') {
        return None;
    }
    let (date, time) = match text.split_once([' ', 'T']) {
        Some((date, time)) => (iso_date(date)?, time.trim_start()),
        None => ("1970-01-01".into(), text),
    };
    let text = format!("{date}T{}", time.replace(',', "."));
    let with_offset = OffsetDateTime::parse(&text, &Iso8601::DEFAULT);
    let moment =
        with_offset.or_else(|_| PrimitiveDateTime::parse(&text, &Iso8601::DEFAULT).map(PrimitiveDateTime::assume_utc));
    i64::try_from(moment.ok()?.unix_timestamp_nanos()).ok()
}

/// A date as ISO 8601 has it: of `2026-12-31`, `2026/12/31`, `31.12.2026`. Which number of `1/2/2026` is the day cannot be told.
fn iso_date(date: &str) -> Option<Cow<'_, str>> {
    let mut parts = date.split(['/', '.']);
    let Some([a, b, c]) = parts.next().zip(parts.next()).zip(parts.next()).map(|((a, b), c)| [a, b, c]) else {
        return Some(date.into());
    };
    let parse = |text: &str| text.parse::<u16>().ok();
    match (parse(a)?, parse(b)?, parse(c)?, date.contains('.')) {
        (day, month, year, true) if c.len() == 4 => Some(format!("{year}-{month:02}-{day:02}").into()),
        (year, month, day, false) if a.len() == 4 => Some(format!("{year}-{month:02}-{day:02}").into()),
        _ => None,
    }
}

/// Whether a text seems to be a date or a time of day in a form that may be read here or not: numbers with `:` or `/` between them.
pub(super) fn seems_a_time(cell: &str) -> bool {
    cell.starts_with(|c: char| c.is_ascii_digit()) && cell.contains([':', '/'])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn unit(cells: &[&str], name: Option<&str>) -> Option<String> {
        TimeUnit::of_column(cells, name).map(|unit| unit.to_string())
    }

    #[test]
    fn units_are_found_from_names_dates_and_steps() {
        let cases: [(&[&str], Option<&str>, Option<&str>); 19] = [
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
            (&["0.5", "1.0"], Some("t_min"), Some("min")),
            (&["0.5", "1.0"], Some("time (h)"), Some("h")),
            (&["31.12.2026 23:59:59,9", "01.01.2027 00:00:00,1"], None, Some("ISO 8601")),
            // Which is the day cannot be told.
            (&["1/2/2026 10:00:00", "1/2/2026 10:00:01"], None, None),
            // One that is missing, wrong, or falls.
            (&["0.1", "", "0.3", "0.4"], None, Some("s")),
            (&["10:00:00", "10:00:01", "1x:00:02", "10:00:03"], None, Some("ISO 8601")),
            (&["1", "2", "3", "0", "5"], Some("t_s"), Some("s")),
            (&["1", "2", "3", "0", "5"], None, None),
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
        assert_eq!(TimeUnit::Long { seconds: 60 }.ns("0.1"), Some(6_000_000_000));
        let day = 10 * 3600 * 1_000_000_000;
        assert_eq!(TimeUnit::Iso.ns("10:00:00.010"), Some(day + 10_000_000));
        let apart = |a: &str, b: &str| Some(TimeUnit::Iso.ns(b)? - TimeUnit::Iso.ns(a)?);
        assert_eq!(apart("2026-01-02T10:00:00.05-05:00", "2026-01-02T15:00:00.1Z"), Some(50_000_000));
        for date in ["02.01.2026 15:00:00.1", "2026/01/02 15:00:00.1", "2.1.2026T15:00:00,1"] {
            assert_eq!(apart("2026-01-02T15:00:00Z", date), Some(100_000_000), "{date}");
        }
        assert_eq!(seconds.ns("1e30"), None);
        assert_eq!(TimeUnit::Iso.ns("10:00"), TimeUnit::Iso.ns("10:00:00"));
    }
}
