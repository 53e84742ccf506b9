//! Which columns of a text hold the readings, and which the time.

use super::cells::point;
use super::time::{are_stray, seems_a_time, TimeUnit};

/// Columns that a header may name beside the readings; units and numbers in names are left out before they are compared.
const BESIDE: [&str; 26] = [
    "average pressure",
    "average",
    "count",
    "date",
    "datetime",
    "estimated force",
    "force",
    "frame",
    "id",
    "index",
    "label",
    "load",
    "max",
    "mean",
    "name",
    "no",
    "nr",
    "number",
    "sample",
    "seq",
    "sequence",
    "sum",
    "temperature",
    "total",
    "unnamed",
    "user",
];
/// Those of them that are times.
const TIMES: [&str; 15] = [
    "t",
    "time",
    "timestamp",
    "datetime",
    "date",
    "seconds",
    "sec",
    "minutes",
    "hours",
    "millis",
    "micros",
    "elapsed",
    "stamp",
    "clock",
    "ms",
];
/// Columns of a table with a line for each reading, which has a place in the array.
const PLACES: [&str; 3] = ["row", "col", "column"];
/// Most columns beside the readings whose header does not name them.
const MOST_BESIDE: usize = 3;

/// The columns of a text, each a list of cells from some of its lines, without those of its header.
pub(super) struct Columns<'t> {
    /// Cells of each column.
    pub cells: Vec<Vec<&'t str>>,
    /// Names of the columns, if there is a header with as many cells.
    pub names: Option<Vec<&'t str>>,
}

/// What the columns hold, counted from 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Found {
    /// First column of the readings.
    pub first: usize,
    /// Column of the time and its unit.
    pub time: Option<(usize, TimeUnit)>,
    /// A column that seems to be a time, and is not read.
    pub unread: Option<usize>,
}

/// What one column beside the readings holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Beside {
    Time(TimeUnit),
    Index,
    Text,
}

impl<'t> Columns<'t> {
    /// The columns of `readings` readings; `time` is the stated column of the time, from 0.
    ///
    /// # Errors
    /// Columns of which more than one reading is possible, or none, in words.
    pub(super) fn find(&self, readings: usize, time: Option<usize>) -> Result<Found, String> {
        let beside = self.cells.len() - readings;
        if beside == 0 {
            let none = Ok(Found { first: 0, time: None, unread: None });
            return time.map_or(none, |column| self.at(0, readings, column));
        }
        if let Some(first) = self.named(readings) {
            return self.with_time(first, readings, time);
        }
        if beside > MOST_BESIDE {
            return Err(format!(
                "{} columns, {readings} of which are readings; --columns A..B says which",
                self.cells.len()
            ));
        }
        if time.is_none() && beside == 1 {
            return self.with_time(self.first_of(readings)?, readings, None);
        }
        let first = if time.is_some_and(|time| time >= readings) { 0 } else { beside };
        self.with_time(first, readings, time)
    }

    /// First column of the readings where there is one more column, in front of them or behind.
    ///
    /// # Errors
    /// Both are possible, or neither, in words.
    fn first_of(&self, readings: usize) -> Result<usize, String> {
        let last = readings;
        let ends = [0, last].map(|column| self.beside(column));
        // A date or a text is no reading; a number is one unless it rises from line to line.
        let sure = ends.map(|end| match end {
            Some(Beside::Text | Beside::Time(TimeUnit::Iso)) => true,
            Some(Beside::Time(TimeUnit::Number { since_1970, .. })) => since_1970,
            _ => false,
        });
        let rise = |strict| [0, last].map(|end| ends[usize::from(end == last)].is_some() && self.rises(end, strict));
        // One that falls once is a time only where none rises all along.
        let all_along = rise(true);
        let possible = if all_along == [false; 2] { rise(false) } else { all_along };
        match (sure, possible) {
            ([true, _], _) => Ok(1),
            ([_, true], _) => Ok(0),
            // Of two lines any column can rise.
            (_, [true, _]) if self.cells[0].len() == 2 => Ok(1),
            (_, [true, false]) => Ok(1),
            (_, [false, true]) => Ok(0),
            (_, [true, true]) if !self.rises(readings / 2, true) => Err(format!(
                "column 1 and column {} both rise as a time does; --time-column 1 or --time-column {0} says which it is",
                last + 1
            )),
            (_, [true, true]) => Ok(1),
            (_, [false, false]) => Err(format!(
                "{} values, wanted {readings}: one is too many, and neither the first nor the last rises from line to line as a time or an \
                 index does; --columns 2..{0} or --columns 1..{readings} says which are readings",
                last + 1
            )),
        }
    }

    /// First column of the readings by the names of the header: those that [`BESIDE`] and [`TIMES`] do not have, without a gap.
    fn named(&self, readings: usize) -> Option<usize> {
        let names = self.names.as_ref()?;
        let is_beside = |name: &str| {
            let plain = plain(name);
            plain.is_empty() && name.trim().parse::<f64>().is_err()
                || BESIDE.contains(&plain.as_str())
                || TIMES.contains(&plain.split(' ').next().unwrap_or(""))
        };
        let own: Vec<usize> = (0..names.len()).filter(|&column| !is_beside(names[column])).collect();
        let first = *own.first()?;
        (own.len() == readings && own[readings - 1] + 1 - first == readings).then_some(first)
    }

    /// Checks the names of the readings' columns: that the header calls none of some a time, an index, a place.
    ///
    /// # Errors
    /// Such a column, in words.
    pub(super) fn check_names(&self, first: usize, readings: usize) -> Result<(), String> {
        // A letter is the name of a spreadsheet's column, a number behind it that of a taxel.
        let is_other = |column: &usize| {
            self.name(*column).is_some_and(|name| {
                let (name, plain) = (name.trim(), plain(name));
                let known = [&BESIDE[..], &TIMES, &PLACES].iter().any(|list| list.contains(&plain.as_str()));
                known && name.len() > 1 && !name.contains(|c: char| c.is_ascii_digit())
            })
        };
        let others: Vec<usize> = (first..first + readings).filter(is_other).collect();
        let [column, ..] = others[..] else { return Ok(()) };
        if others.len() == readings {
            return Ok(());
        }
        let name = self.name(column).unwrap_or_default().trim();
        Err(format!(
            "the header calls column {} {name:?}, which is no reading; --columns A..B says which are, and a table with a line for each \
             reading is turned into one with a frame per line (pandas: DataFrame.pivot)",
            column + 1
        ))
    }

    /// The readings from column `first` on and the time in one of the others.
    fn with_time(&self, first: usize, readings: usize, stated: Option<usize>) -> Result<Found, String> {
        let others = (0..self.cells.len()).filter(|column| !(first..first + readings).contains(column));
        if let Some(column) = stated {
            return self.at(first, readings, column);
        }
        let (mut times, mut unread) = (Vec::new(), None);
        for column in others {
            match self.beside(column) {
                // A sum can rise as a time does.
                _ if self.name(column).is_some_and(|name| !is_time(name) && BESIDE.contains(&plain(name).as_str())) => (),
                Some(Beside::Time(unit)) => times.push((column, unit)),
                Some(Beside::Text) if self.seems_a_time(column) => {
                    unread.get_or_insert(column);
                }
                Some(_) => (),
                // It is no reading by its name, and stands still.
                None if self.name(column).is_some_and(is_time) => {
                    unread.get_or_insert(column);
                }
                None => {
                    return Err(format!(
                        "column {} is neither a time nor an index, and {} columns are one too many; --columns A..B says which are readings",
                        column + 1,
                        self.cells.len()
                    ))
                }
            }
        }
        let named = times.iter().copied().find(|(column, _)| self.name(*column).is_some_and(is_time));
        match times[..] {
            [] => Ok(Found { first, time: None, unread }),
            [only] => Ok(Found { first, time: Some(only), unread: None }),
            [a, b, ..] if named.is_none() => {
                let [a, b] = [a.0 + 1, b.0 + 1];
                Err(format!("columns {a} and {b} both rise as a time does; --time-column says which it is"))
            }
            _ => Ok(Found { first, time: named, unread: None }),
        }
    }

    /// The stated readings from column `first` on, with the stated time, or that of the first other column that is named one or
    /// stands first; whatever else there is.
    pub(super) fn stated(&self, first: usize, readings: usize, time: Option<usize>) -> Result<Found, String> {
        if let Some(column) = time {
            return self.at(first, readings, column);
        }
        let mut others = (0..self.cells.len()).filter(move |column| !(first..first + readings).contains(column));
        let is_clock = |column: &usize| match (self.name(*column), self.beside(*column)) {
            (name, Some(Beside::Time(unit))) if *column == 0 || name.is_some_and(is_time) => Some((*column, unit)),
            _ => None,
        };
        let time = others.clone().find_map(|column| is_clock(&column));
        let seems = |column: &usize| self.beside(*column) == Some(Beside::Text) && self.seems_a_time(*column);
        Ok(Found { first, time, unread: others.find(|column| time.is_none() && seems(column)) })
    }

    /// The readings from column `first` on and the time in `column`.
    fn at(&self, first: usize, readings: usize, column: usize) -> Result<Found, String> {
        if (first..first + readings).contains(&column) {
            return Err(format!("--time-column {} is one of the readings", column + 1));
        }
        // Who states it has named it.
        let name = self.name(column).or(Some(TIMES[0]));
        let unit = self.cells.get(column).and_then(|cells| TimeUnit::of_column(cells, name));
        let unit = unit.ok_or_else(|| format!("--time-column {} holds no times that rise", column + 1))?;
        Ok(Found { first, time: Some((column, unit)), unread: None })
    }

    /// Whether a column of texts seems to be a time, by its name or by what it begins with.
    fn seems_a_time(&self, column: usize) -> bool {
        self.name(column).is_some_and(is_time) || seems_a_time(self.cells[column][0])
    }

    /// Leaves out the last column.
    pub(super) fn drop_last(&mut self) {
        self.cells.pop();
        self.names.iter_mut().for_each(|names| {
            names.pop();
        });
    }

    /// What a column beside the readings holds; `None` if it looks like a reading.
    fn beside(&self, column: usize) -> Option<Beside> {
        let (cells, name) = (&self.cells[column], self.name(column));
        let readings = || cells.iter().map(|cell| super::reading(&point(cell)));
        let is_text = readings().any(|reading| reading.is_none())
            && !readings().flatten().any(f64::is_finite)
            && TimeUnit::of_column(cells, name).is_none();
        if is_text {
            return Some(Beside::Text);
        }
        let whole: Option<Vec<i64>> = cells.iter().map(|cell| cell.parse().ok()).collect();
        // Lines may be lost between two, or the count begin anew.
        let counts = whole.is_some_and(|whole| {
            let others = whole.windows(2).filter(|pair| pair[1] != pair[0] + 1).count();
            are_stray(others, whole.len()) && whole.len() > 1 && (0..1 << 24).contains(&whole[0])
        });
        let time = TimeUnit::of_column(cells, name.filter(|name| is_time(name)));
        match name.is_some_and(is_time) || !counts {
            true => time.map(Beside::Time),
            false => Some(Beside::Index),
        }
    }

    /// Whether the numbers of a column rise from line to line: all, or most of them and with hardly one that falls or is missing.
    fn rises(&self, column: usize, strict: bool) -> bool {
        let cells = &self.cells[column];
        let numbers: Vec<f64> = cells.iter().filter_map(|cell| point(cell).parse().ok()).collect();
        let of_steps = |is: fn(&[f64]) -> bool| numbers.windows(2).filter(|pair| is(pair)).count();
        let (up, down) = (of_steps(|pair| pair[0] < pair[1]), of_steps(|pair| pair[0] > pair[1]));
        let strays = cells.len() - numbers.len() + down;
        match strict {
            true => numbers.len() > 1 && up + 1 == cells.len(),
            false => numbers.len() > 1 && are_stray(strays, cells.len()) && 2 * up + 1 >= numbers.len(),
        }
    }

    fn name(&self, column: usize) -> Option<&'t str> {
        self.names.as_ref()?.get(column).copied()
    }

    /// Whether the first column rises as a time does, and hardly another one.
    pub(super) fn begins_with_time(&self) -> bool {
        let others = 1..self.cells.len();
        self.cells[0].len() > 2
            && self.rises(0, true)
            && others.clone().filter(|&column| self.rises(column, true)).count() * 2 < others.len()
    }
}

/// A name in small letters, with blanks for all that is no letter, without what is in brackets.
fn plain(name: &str) -> String {
    let name = name.split(['(', '[']).next().unwrap_or("").to_lowercase();
    let words: String = name.chars().map(|c| if c.is_alphabetic() { c } else { ' ' }).collect();
    words.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Whether a header names a column that is known to stand beside the readings.
pub(super) fn is_known(name: &str) -> bool {
    is_time(name) || BESIDE.contains(&plain(name).as_str())
}

fn is_time(name: &str) -> bool {
    TIMES.contains(&plain(name).split(' ').next().unwrap_or(""))
}
