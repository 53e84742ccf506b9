//! Cells of a line, and the number in a cell.

use std::borrow::Cow;
use std::fmt;

use csv::ReaderBuilder;

use super::shown;

/// What stands between the time of a terminal and the line.
const ARROW: &str = " -> ";
/// Characters before the first value of a list, and after the last.
const OPENING: [char; 2] = ['[', '('];
const CLOSING: [char; 3] = [']', ')', ','];
/// Words for a reading that is missing, beside `nan` and an empty cell: of JSON, of R, of spreadsheets, of Python, and Tekscan's mark
/// of a sensel that does not exist.
const MISSING: [&str; 7] = ["null", "NULL", "NA", "N/A", "#N/A", "None", "B"];

/// What stands between two cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Separator {
    /// `;`
    Semicolon,
    /// A tab.
    Tab,
    /// `,`
    Comma,
    /// One or more blanks or tabs.
    Blank,
}

impl Separator {
    /// Every separator, in the order in which they are tried: a comma can be a decimal mark, a blank stand beside any other.
    pub const ALL: [Separator; 4] = [Separator::Semicolon, Separator::Tab, Separator::Comma, Separator::Blank];

    /// The cells of a line, without blanks around them and without quotes; of a list as Python and NumPy print it those within the
    /// brackets; the time that a terminal puts before a line, as in `12:34:56.789 -> 1,2,3`, is the first.
    pub(crate) fn cells(self, line: &str) -> Vec<Cow<'_, str>> {
        if let Some((time, rest)) = line.split_once(ARROW) {
            let cells = self.cells(rest).into_iter();
            return std::iter::once(Cow::Borrowed(time.trim())).chain(cells).collect();
        }
        let text = line.trim_start();
        if !text.starts_with(OPENING) {
            return self.split(line);
        }
        let list =
            text.trim_start_matches(OPENING).trim_end_matches(|c: char| c.is_whitespace() || CLOSING.contains(&c));
        match list.contains(['[', ']']) {
            false => self.split(list),
            true => {
                let flat = list.replace(['[', ']'], "");
                self.split(&flat).into_iter().map(|cell| Cow::Owned(cell.into_owned())).collect()
            }
        }
    }

    /// The cells of a line that is no list.
    fn split(self, line: &str) -> Vec<Cow<'_, str>> {
        let byte = match self {
            Separator::Semicolon => b';',
            Separator::Tab => b'\t',
            Separator::Comma => b',',
            Separator::Blank => return with_dates(line.split_whitespace().map(Cow::Borrowed).collect()),
        };
        if line.contains('"') {
            let mut reader = ReaderBuilder::new().delimiter(byte).has_headers(false).from_reader(line.as_bytes());
            if let Some(Ok(record)) = reader.records().next() {
                return record.iter().map(|cell| Cow::Owned(cell.trim().to_owned())).collect();
            }
        }
        line.split(char::from(byte)).map(|cell| Cow::Borrowed(cell.trim())).collect()
    }
}

impl fmt::Display for Separator {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(match self {
            Separator::Semicolon => "semicolons",
            Separator::Tab => "tabs",
            Separator::Comma => "commas",
            Separator::Blank => "blanks",
        })
    }
}

/// Cells between blanks, a date and the time of day behind it as one.
fn with_dates(mut cells: Vec<Cow<str>>) -> Vec<Cow<str>> {
    let is_date = |cell: &str| {
        let parts: Vec<&str> = cell.split(['-', '/', '.']).collect();
        parts.len() == 3 && parts.iter().all(|part| !part.is_empty() && part.bytes().all(|byte| byte.is_ascii_digit()))
    };
    let is_clock = |cell: &str| cell.contains(':') && cell.starts_with(|c: char| c.is_ascii_digit());
    // Nearly all lines have neither.
    while let Some(date) = (1..cells.len()).find(|&k| is_clock(&cells[k]) && is_date(&cells[k - 1])) {
        let clock = cells.remove(date);
        cells[date - 1] = format!("{} {clock}", cells[date - 1]).into();
    }
    cells
}

/// The reading in a cell: NaN where it is missing, `None` for anything else than a finite number or a missing reading.
///
/// ```
/// use dermis_golden::data::text::reading;
///
/// assert_eq!(reading(" -3e-1"), Some(-0.3));
/// assert!([" ", "nan", "NaN", "null", "NA", "#N/A", "None", "B"].iter().all(|cell| reading(cell).is_some_and(f64::is_nan)));
/// assert!(["inf", "1e400", "x", "-"].iter().all(|cell| reading(cell).is_none()));
/// ```
pub fn reading(cell: &str) -> Option<f64> {
    of_trimmed(cell.trim())
}

/// [`reading`] of a cell without blanks around it.
fn of_trimmed(cell: &str) -> Option<f64> {
    match cell.parse::<f64>() {
        Ok(value) => Some(value).filter(|value| !value.is_infinite()),
        Err(_) => (cell.is_empty() || MISSING.contains(&cell)).then_some(f64::NAN),
    }
}

/// How the numbers of a text are written.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Digits {
    /// The decimal mark, where the numbers have one; a point where some have a comma.
    pub mark: Option<char>,
    /// Number of decimals, where it is fixed: nearly all have as many, two or more, and more of them end with a zero, which the
    /// shortest form of a number has not, than others have fewer and are as short as they can be.
    decimals: Option<usize>,
    /// Digits of an exponent, where nearly all numbers have one of as many digits, two or more, and not only because they are small.
    exponent: Option<usize>,
    /// A zero may stand without decimals.
    bare_zero: bool,
    /// Numbers are filled with zeros in front.
    padded: bool,
    /// Characters before the decimal mark to which they are, a sign in front or among them.
    width: Option<usize>,
    /// Nearly all numbers have a digit before the decimal mark.
    leading: bool,
}

/// Characters of the longest number of a program that writes more digits than a number in double precision has.
const LONGEST_NUMBER: usize = 64;
/// Share of the numbers from which on all are taken to be written alike.
const LIKE: f64 = 0.9;

/// The parts of a number.
struct Number<'t> {
    signed: bool,
    whole: &'t str,
    decimals: &'t str,
    exponent: &'t str,
}

impl<'t> Number<'t> {
    /// The parts of a text that is a number with decimal point.
    fn of(text: &'t str) -> Number<'t> {
        let unsigned = text.trim_start_matches(['-', '+']);
        let (mantissa, exponent) = unsigned.split_once(['e', 'E']).unwrap_or((unsigned, ""));
        let (whole, decimals) = mantissa.split_once('.').unwrap_or((mantissa, ""));
        let signed = unsigned.len() < text.len();
        Number { signed, whole, decimals, exponent: exponent.trim_start_matches(['-', '+']) }
    }

    /// Whether it has as many characters before the decimal mark; a sign counts or stands in front of them.
    fn is_as_wide(&self, width: usize) -> bool {
        self.whole.len() == width || self.signed && self.whole.len() + 1 == width
    }

    fn is_bare_zero(&self) -> bool {
        self.whole == "0" && self.decimals.is_empty() && self.exponent.is_empty()
    }

    fn is_padded(&self) -> bool {
        self.whole.len() > 1 && self.whole.starts_with('0')
    }

    /// Whether it has a zero at its end that its value does not need; `0.0` and `1.0`, as Python writes whole numbers, have none.
    fn is_filled(&self) -> bool {
        self.decimals.len() > 1 && self.decimals.ends_with('0')
    }
}

impl Digits {
    /// What the cells of some lines show.
    pub(super) fn of_cells<'t>(cells: impl Iterator<Item = &'t str> + Clone) -> Digits {
        let mark = ['.', ','].into_iter().find(|mark| cells.clone().any(|cell| cell.contains(*mark)));
        let texts: Vec<(Cow<str>, f64)> = cells
            .map(point)
            .filter_map(|text| reading(&text).filter(|value| value.is_finite()).map(|value| (text, value)))
            .collect();
        // Where exponents are only for the large and the small, these have none.
        let is_plain = |value: f64| value == 0.0 || (1e-3..1e5).contains(&value.abs());
        let needless = texts.iter().any(|(text, value)| is_plain(*value) && text.contains(['e', 'E']));
        let numbers: Vec<Number> = texts.iter().map(|(text, _)| Number::of(text)).collect();
        let share = |is: &dyn Fn(&Number) -> bool| {
            numbers.iter().filter(|number| is(number)).count() as f64 / numbers.len() as f64
        };
        // That of most numbers, so that one that is cut changes nothing.
        let fixed = |length: fn(&Number) -> usize| {
            let mut lengths: Vec<usize> = numbers.iter().map(length).collect();
            lengths.sort_unstable();
            let middle = lengths.get(lengths.len() / 2).copied().filter(|middle| *middle >= 2)?;
            (share(&|number| length(number) == middle) >= LIKE).then_some(middle)
        };
        // Numbers of a fixed length that were not cut are all filled or as long as most.
        let decimals = fixed(|number| number.decimals.len()).filter(|most| {
            let filled = numbers.iter().filter(|number| number.is_filled()).count();
            let shortest = numbers.iter().filter(|number| number.decimals.len() < *most && !number.is_filled()).count();
            filled > shortest
        });
        let exponent = fixed(|number| number.exponent.len()).filter(|_| decimals.is_some() || needless);
        let padded = share(&|number| number.is_padded()) > 1.0 - LIKE;
        Digits {
            mark,
            decimals,
            exponent,
            bare_zero: numbers.iter().filter(|number| number.is_bare_zero()).count() > 1,
            padded,
            width: fixed(|number| number.whole.len() + usize::from(number.signed)).filter(|_| padded),
            leading: share(&|number| !number.whole.is_empty()) >= LIKE,
        }
    }

    /// Numbers of JSON: a decimal point, and as short as they can be.
    pub(super) fn of_json() -> Digits {
        Digits { mark: Some('.'), ..Digits::default() }
    }

    /// The least by which numbers that are written as these can differ; 0 where they have exponents.
    pub(super) fn step<'t>(&self, cells: impl Iterator<Item = &'t str>) -> f64 {
        let decimals = |cell: &str| {
            let text = point(cell);
            let number = Number::of(&text);
            number.exponent.is_empty().then_some(number.decimals.len())
        };
        let most = cells.map(decimals).try_fold(0, |most, own| Some(most.max(own?)));
        most.map_or(0.0, |most| 10f64.powi(-(most as i32)))
    }

    /// The first cell with an ambiguous comma, a thousands separator or a decimal comma, where all cells with a comma are so: three
    /// digits behind it, no zero in front, beside other numbers without comma or point.
    pub(super) fn thousands<'t>(cells: impl Iterator<Item = &'t str> + Clone) -> Option<&'t str> {
        let is_grouped = |cell: &str| {
            let unsigned = cell.trim().trim_start_matches(['-', '+']);
            let (whole, thousand) = unsigned.split_once(',')?;
            let digits = |text: &str| text.bytes().all(|byte| byte.is_ascii_digit());
            let own = thousand.len() == 3 && (1..4).contains(&whole.len()) && !whole.starts_with('0');
            Some(own && digits(whole) && digits(thousand))
        };
        let with_comma = || cells.clone().filter_map(is_grouped);
        let others =
            cells.clone().filter(|cell| !cell.contains(',') && reading(cell).is_some_and(|value| value.abs() > 0.0));
        // Beside a decimal point it is no decimal mark.
        let has_point = cells.clone().any(|cell| cell.contains('.'));
        match !has_point && with_comma().all(|grouped| grouped) && others.count() > 0 {
            true => cells.clone().find(|cell| is_grouped(cell) == Some(true)),
            false => None,
        }
    }

    /// The reading in a cell: NaN where it is missing.
    ///
    /// # Errors
    /// A cell that is no number, or not one as the others are written, in words.
    pub(super) fn reading(&self, cell: &str) -> Result<f64, String> {
        if cell.contains(',') && self.mark == Some('.') {
            return Err(format!("{} has a comma, where others have a decimal point", shown(cell)));
        }
        let text = point(cell);
        let value = of_trimmed(&text).ok_or_else(|| format!("{} is not a finite number", shown(cell)))?;
        let number = Number::of(&text);
        let differs = |own: usize, wanted: Option<usize>| wanted.is_some_and(|wanted| own != wanted);
        match value.is_finite() && !(self.bare_zero && number.is_bare_zero()) {
            true if differs(number.decimals.len(), self.decimals) => Err(format!(
                "{} has {} decimals, the others {}",
                shown(cell),
                number.decimals.len(),
                self.decimals.unwrap_or(0)
            )),
            true if differs(number.exponent.len(), self.exponent) => {
                Err(format!("{} has an exponent that is cut", shown(cell)))
            }
            true if self.leading && number.whole.is_empty() => {
                Err(format!("{} has no digit before its decimal mark", shown(cell)))
            }
            true => match self.width {
                Some(width) if !number.is_as_wide(width) => {
                    Err(format!("{} has {} digits, the others {width}", shown(cell), number.whole.len()))
                }
                None if number.is_padded() && !self.padded => Err(format!("{} begins with a zero", shown(cell))),
                _ => Ok(value),
            },
            false => Ok(value),
        }
    }

    /// Whether the number in a cell would with one more character be written as the others and differ from `wanted` by `most`. One
    /// that is longer than programs write numbers is taken to be so: trying takes the square of its length.
    pub(super) fn would_be(&self, cell: &str, wanted: f64, most: f64) -> bool {
        let text = point(cell);
        if text.len() > LONGEST_NUMBER {
            return true;
        }
        let with = |(at, character): (usize, char)| {
            let longer = format!("{}{character}{}", &text[..at], &text[at..]);
            self.reading(&longer).is_ok_and(|value| (value - wanted).abs() <= most)
        };
        // A number has one byte for each character.
        let places = (0..=text.len()).filter(|at| text.is_char_boundary(*at));
        let characters = if self.mark.is_some() { "0123456789-." } else { "0123456789-" };
        places.flat_map(|at| characters.chars().map(move |character| (at, character))).any(with)
    }

    /// Whether the number in a cell, which is read, may be the begin of a longer one.
    pub(super) fn may_be_cut(&self, cell: &str) -> bool {
        let text = point(cell);
        let number = Number::of(&text);
        match (self.exponent, self.decimals) {
            (Some(_), _) => number.exponent.is_empty(),
            (None, Some(_)) => number.is_bare_zero(),
            (None, None) => self.width.is_none() || !number.decimals.is_empty(),
        }
    }

    /// Whether the number in a cell would be another one without one of its digits, and be read: where numbers are as long as
    /// they need to be, nothing shows that one is cut.
    pub(super) fn hide_a_lost_digit(&self, cell: &str) -> bool {
        let text = point(cell);
        let number = Number::of(&text);
        number.whole.len() > 1 && self.width.is_none()
            || !number.decimals.is_empty() && self.decimals.is_none()
            || !number.exponent.is_empty() && self.exponent.is_none()
    }
}

/// A cell with a decimal point.
pub(crate) fn point(cell: &str) -> Cow<'_, str> {
    match cell.contains(',') && !cell.contains('.') {
        true => Cow::Owned(cell.trim().replacen(',', ".", 1)),
        false => Cow::Borrowed(cell.trim()),
    }
}
